"""Batches of different scenarios as one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

if TYPE_CHECKING:
    import numpy.typing as npt

    from swath.vector import Flags, Observations

__all__ = ["AbreastVecEnv"]

Indices = int | Iterable[int] | None
"""Which environments are meant; None: all."""


class AbreastVecEnv(VecEnv):
    """Several `VecEnv` with the same spaces, stepped one after another: the rows of the first come first."""

    def __init__(self, parts: Sequence[VecEnv]) -> None:
        """Takes them over."""
        self._parts = list(parts)
        self._firsts = np.cumsum([0, *(part.num_envs for part in self._parts)]).tolist()
        first = self._parts[0]
        super().__init__(self._firsts[-1], first.observation_space, first.action_space)

    def reset(self) -> Observations:
        """Begins an episode in every environment, with the seeds set since the last reset."""
        for part, first in zip(self._parts, self._firsts, strict=False):
            part.seed(self._seeds[first])
        observations = _joined([part.reset() for part in self._parts])
        self.reset_infos = [info for part in self._parts for info in part.reset_infos]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: npt.NDArray[np.int64]) -> None:
        """Keeps the actions, one row an environment, for `step_wait`."""
        for part, first in zip(self._parts, self._firsts, strict=False):
            part.step_async(actions[first : first + part.num_envs])

    def step_wait(self) -> tuple[Observations, npt.NDArray[np.float32], Flags, list[dict[str, object]]]:
        """Steps every environment; see `MowerRoutingVecEnv`."""
        steps = [part.step_wait() for part in self._parts]
        rewards, dones = (np.concatenate([step[what] for step in steps]) for what in (1, 2))
        return _joined([step[0] for step in steps]), rewards, dones, [info for step in steps for info in step[3]]

    def close(self) -> None:
        """Ends the use of the environments."""
        for part in self._parts:
            part.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Returns an attribute of every environment."""
        return [part.get_attr(attr_name, row)[0] for part, row in self._places(indices)]

    def set_attr(self, attr_name: str, value: object, indices: Indices = None) -> None:
        """Sets an attribute of every environment."""
        for part, row in self._places(indices):
            part.set_attr(attr_name, value, row)

    def env_method(self, method_name: str, *args: object, indices: Indices = None, **kwargs: object) -> list[Any]:
        """Calls a method of every environment."""
        if indices is None:
            return [value for part in self._parts for value in part.env_method(method_name, *args, **kwargs)]
        return [part.env_method(method_name, *args, indices=row, **kwargs)[0] for part, row in self._places(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """Tells of every environment whether it does a wrapper's work."""
        return [part.env_is_wrapped(wrapper_class, row)[0] for part, row in self._places(indices)]

    def _places(self, indices: Indices) -> list[tuple[VecEnv, int]]:
        """Returns the batch of every environment, and its row there."""
        chosen = list(self._get_indices(indices))
        parts = np.searchsorted(self._firsts, chosen, side="right") - 1
        return [(self._parts[part], int(index) - self._firsts[part]) for part, index in zip(parts, chosen, strict=True)]


def _joined(parts: Sequence[Observations]) -> Observations:
    """Returns observations one below the other, part by part where they have parts."""
    if isinstance(parts[0], dict):
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}  # type: ignore[call-overload]
    joined: Observations = np.concatenate(parts)  # type: ignore[arg-type]
    return joined
