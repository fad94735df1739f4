"""Values as JSON and CSV can hold them."""

from __future__ import annotations

import math
from collections.abc import Mapping

__all__ = ["plain"]


def plain(value: object) -> object:
    """Returns the same value, with numbers that JSON lacks (`inf`) as text."""
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    return value
