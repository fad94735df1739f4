"""Shares of a whole, as people read them."""

from __future__ import annotations

__all__ = ["share"]


def share(value: float, digits: int, *, whole: float = 1.0) -> str:
    """Returns a share with so many digits behind the point; what is not whole is not called whole.

    Args:
        value: The share.
        digits: Number of digits behind the point.
        whole: What the whole is: 1, or 100 for per cent.
    """
    # Nothing has no sign.
    rounded = round(value, digits) + 0.0
    if value < whole <= rounded:
        rounded = whole - 10.0**-digits
    return f"{rounded:.{digits}f}"
