"""The environments of this process, behind the same Python as those on a server: a pair differs by the wire only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import AutoresetMode

from swath import _native
from swath.remote.env import RemoteEnv, stepped
from swath.spaces import action_space, observation_space
from swath.vector import MowerRoutingVectorEnv

if TYPE_CHECKING:
    import numpy.typing as npt
    from benchmarks.remote.figures import Kind

    from swath.remote.env import Observation

__all__ = ["LocalEnv", "LocalVecEnv"]


class LocalVecEnv(MowerRoutingVectorEnv):
    """Environments that form no infos where the remote ones send none."""

    def __init__(self, num_envs: int, kind: Kind) -> None:
        """Makes them, to be stepped on one thread."""
        mode = AutoresetMode.NEXT_STEP
        self._adopt(_batch(num_envs, mode.value, kind), num_envs, mode)


class LocalEnv(RemoteEnv):
    """One such environment, as `swath.remote.make` makes it on a server."""

    def __init__(self, kind: Kind) -> None:
        """Makes it."""
        batch: Any = _batch(1, AutoresetMode.DISABLED.value, kind)
        self._batch = batch
        self.observation_space = observation_space(batch.observation_spec)
        self.action_space = action_space(batch.action_spec)

    def step(self, action: npt.ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, object]]:
        """Steps it here."""
        return stepped(self._core.step(np.asarray(action)[np.newaxis]))

    def close(self) -> None:
        """Leaves it; there is no session to end."""
        self._batch = None


def _batch(num_envs: int, mode: str, kind: Kind) -> _native.Batch:
    return _native.Batch(_native.Scenario(None, **kind.blocks), num_envs, mode, 1, copy=True, infos=kind.infos)
