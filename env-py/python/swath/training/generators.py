"""The process's generators of random numbers, which stable-baselines3 draws from."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

__all__ = ["Generators", "unchanged"]


class Generators(NamedTuple):
    """The states of the generators of Python, NumPy and PyTorch (its CPU's)."""

    python: tuple[Any, ...]
    numpy: Any
    torch: Any

    @classmethod
    def now(cls) -> Generators:
        """Returns the present states."""
        import torch

        return cls(random.getstate(), np.random.get_state(), torch.get_rng_state())  # noqa: NPY002

    def put_back(self) -> None:
        """Makes these the present states."""
        import torch

        random.setstate(self.python)
        np.random.set_state(self.numpy)  # noqa: NPY002
        torch.set_rng_state(self.torch)


@contextmanager
def unchanged() -> Iterator[None]:
    """Puts the generators back afterwards, so that an evaluation does not change the training."""
    before = Generators.now()
    try:
        yield
    finally:
        before.put_back()
