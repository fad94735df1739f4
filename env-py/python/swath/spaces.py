"""Gymnasium spaces made from the bounds that the Rust core states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import Space
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary

__all__ = ["Bound", "Part", "action_space", "observation_space"]

Bound = tuple[str, float, float]
"""Name, lowest and highest value of a number."""

Part = tuple[str, str, list[int], list[Bound]]
"""Name, dtype, shape and bounds of a part of an observation: along its last axis, or one for all its numbers."""


def observation_space(parts: Sequence[Part]) -> Space[Any]:
    """Makes the space of an observation.

    Args:
        parts: Its parts.

    Returns:
        The space of the only part; a `Dict` of the parts where there are several.
    """
    spaces = {part[0]: _part_space(part) for part in parts}
    return Dict(spaces) if len(spaces) > 1 else next(iter(spaces.values()))


def action_space(form: Sequence[Bound] | int) -> Space[Any]:
    """Makes the space of an action.

    Args:
        form: Name, lowest and highest value of every number, or the number of choices.

    Returns:
        A float32 `Box` of shape (len(form),), or a `Discrete`.
    """
    return Discrete(form) if isinstance(form, int) else _box("float32", [len(form)], form)


def _part_space(part: Part) -> Space[Any]:
    _, dtype, shape, bounds = part
    return MultiBinary(shape[0]) if dtype == "int8" else _box(dtype, shape, bounds)


def _box(dtype: str, shape: Sequence[int], bounds: Sequence[Bound]) -> Space[Any]:
    low, high = (np.array([bound[at] for bound in bounds], dtype=dtype) for at in (1, 2))
    return Box(np.broadcast_to(low, shape).copy(), np.broadcast_to(high, shape).copy(), dtype=np.dtype(dtype).type)
