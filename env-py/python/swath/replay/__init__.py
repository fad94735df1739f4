"""Episodes as a page that plays them, side by side, offline."""

from swath.replay.data import data_of
from swath.replay.page import page_of

__all__ = ["data_of", "page_of"]
