"""An evaluation as one page: tables, figures, comparisons and replays, offline."""

from swath.report.evaluated import Evaluated
from swath.report.page import page_of

__all__ = ["Evaluated", "page_of"]
