"""Gymnasium spaces made from the bounds that the Rust core states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
import numpy.typing as npt
from gymnasium import Space
from gymnasium.spaces import Box

__all__ = ["box"]


def box(spec: Sequence[tuple[str, float, float]]) -> Space[npt.NDArray[np.float32]]:
    """Makes the space of a flat vector.

    Args:
        spec: Name, lowest and highest value of every number.

    Returns:
        A `Box` of shape (len(spec),) and dtype float32.
    """
    low = np.array([low for _, low, _ in spec], dtype=np.float32)
    high = np.array([high for _, _, high in spec], dtype=np.float32)
    # What a Box is generic over differs between the versions of Gymnasium.
    return cast("Space[npt.NDArray[np.float32]]", Box(low, high, dtype=np.float32))
