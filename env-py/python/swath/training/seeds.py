"""Which seeds training may use, and which are kept for evaluation."""

__all__ = ["HELD_OUT_FROM", "LARGEST_SEED"]

HELD_OUT_FROM = 1_000_000
"""Evaluation begins here; training stays below."""

LARGEST_SEED = (1 << 64) - 1
