"""Means with their intervals, alone and in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

import numpy as np

from swath import _native
from swath.share import share

__all__ = ["Spread", "interval", "spread"]

CONFIDENCE = 0.95
"""Share of intervals, over repeated studies, that hold the true mean."""


class Spread(TypedDict):
    """What is known about a mean from n independent values.

    Attributes:
        n: Number of values; 1 where all of them are copies of one.
        mean: Their mean.
        sd: Their standard deviation, with n - 1; None for n = 1.
        low: Lower end of the 95 % interval of the mean, by Student's t with n - 1 degrees of freedom; None for n = 1.
        high: Upper end.
    """

    n: int
    mean: float
    sd: float | None
    low: float | None
    high: float | None


def spread(values: Sequence[float], *, are_copies: bool = False) -> Spread:
    """Sums up values that are independent of one another, or copies of one.

    Args:
        values: At least one.
        are_copies: Whether they are copies: then there is no interval, however many they are.

    Returns:
        Mean, standard deviation and 95 % interval of the mean.
    """
    n, mean = 1 if are_copies else len(values), float(np.mean(values))
    if n == 1:
        return Spread(n=1, mean=mean, sd=None, low=None, high=None)
    sd = float(np.std(values, ddof=1))
    half = _native.student_t(0.5 + 0.5 * CONFIDENCE, n - 1) * sd / n**0.5
    return Spread(n=n, mean=mean, sd=sd, low=mean - half, high=mean + half)


def interval(values: Spread, *, sign: str = "", whole: float | None = None) -> str:
    """Returns a mean with half its interval, two digits behind the point; below `whole` it is not shown as that."""
    # A difference that rounds to nothing has no sign.
    mean = 0.0 if abs(values["mean"]) < 0.005 else values["mean"]
    text = f"{mean:{sign}.2f}" if whole is None else share(mean, 2, whole=whole)
    if values["high"] is None:
        return text
    return f"{text} ± {values['high'] - values['mean']:.2f}"
