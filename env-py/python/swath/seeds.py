"""Which seeds there are, which of them are drawn, and which are kept for evaluation."""

from __future__ import annotations

import numpy as np

__all__ = ["HELD_OUT_FROM", "LARGEST_SEED", "drawn_seed"]

LARGEST_SEED = (1 << 64) - 1
"""Seeds are whole numbers from 0 to this one."""

HELD_OUT_FROM = 1_000_000
"""Evaluation begins here; training stays below."""

_DRAWN_BELOW = 1 << 63
"""So that a seed for each of many environments still fits behind a drawn one."""


def drawn_seed(rng: np.random.Generator) -> int:
    """Returns a seed for who was given none."""
    return int(rng.integers(_DRAWN_BELOW))
