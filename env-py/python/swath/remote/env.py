"""One environment on a server, as Gymnasium's `Env`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from swath.errors import ClosedError
from swath.options import weeds_of
from swath.seeds import drawn_seed
from swath.spaces import action_space, observation_space

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any, TypeAlias

    from swath.remote.batch import RemoteBatch
    from swath.scenario import Scenario

__all__ = ["RemoteEnv"]

# How many things a step returns, and no other call.
_OF_A_STEP = 5

Observation: TypeAlias = "npt.NDArray[np.generic] | dict[str, npt.NDArray[np.generic]]"


class RemoteEnv(gym.Env["Observation", "npt.ArrayLike"]):
    """A `MowerRoutingEnv`, which describes it, on a server; `swath.remote.make` makes it.

    It cannot be pickled: its session belongs to this process. One thread at a time may use it.
    """

    metadata: dict[str, object] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(self, batch: RemoteBatch) -> None:
        """Takes over the session of a batch of one environment."""
        self._batch: RemoteBatch | None = batch
        self.observation_space = observation_space(self._core.observation_spec)
        self.action_space = action_space(self._core.action_spec)

    @property
    def scenario(self) -> Scenario:
        """The scenario with every key resolved."""
        return self._core.scenario

    @property
    def observation_names(self) -> list[str]:
        """Name of every number of an observation, in order."""
        return [name for _, _, _, bounds in self._core.observation_spec for name, _, _ in bounds]

    @property
    def has_low_latency(self) -> bool:
        """Whether the next step goes by a connection of its own, as it does where the server offers low latency."""
        return self._core.has_low_latency

    @property
    def _core(self) -> RemoteBatch:
        if self._batch is None:
            text = "`reset` and `step` must come before `close`"
            raise ClosedError(text)
        return self._batch

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, object] | None = None
    ) -> tuple[Observation, dict[str, object]]:
        """Begins an episode, as `MowerRoutingEnv.reset` does."""
        batch = self._core
        weeds = weeds_of(options, 1)
        first_seed = None if batch.has_begun or seed is not None else drawn_seed(self.np_random)
        observations, infos = batch.reset([seed], None, weeds, first_seed)
        super().reset(seed=seed)
        return _first(observations), _info(infos)

    def step(self, action: npt.ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, object]]:
        """Steps, as `MowerRoutingEnv.step` does."""
        return stepped(self._core.step_alone(action))

    def retry(self) -> object:
        """Asks once more for what was not answered in time, and returns what that call would have returned.

        Raises:
            RemoteTimeout: If it is not answered this time either.
            ResumeError: If the session was lost and is not resumed.
            RemoteError: If every call was answered.
        """
        result = self._core.retry()
        if isinstance(result, tuple) and len(result) == _OF_A_STEP:
            return stepped(result)
        if isinstance(result, tuple):
            return _first(result[0]), _info(result[1])
        return result

    def action_masks(self) -> npt.NDArray[np.bool_]:
        """Returns which choices are open, as sb3-contrib asks for them."""
        masks: npt.NDArray[np.bool_] = self._core.action_masks
        first: npt.NDArray[np.bool_] = masks[0]
        return first

    def snapshot(self) -> bytes:
        """Returns the state as bytes, if the server allows it; a `MowerRoutingEnv` can restore it too."""
        return self._core.snapshot(0)

    def restore(self, snapshot: bytes) -> None:
        """Puts back what `snapshot` returned, here or anywhere else."""
        self._core.restore(snapshot, 0)

    def close(self) -> None:
        """Ends the session; closing twice is fine."""
        if self._batch is not None:
            self._batch.close()
            self._batch = None

    def __reduce__(self) -> str | tuple[Any, ...]:
        """Refuses to be pickled."""
        return self._core.__reduce__()


def stepped(result: Any) -> tuple[Observation, float, bool, bool, dict[str, object]]:  # noqa: ANN401 - of a batch
    """Returns the step of the only environment of a batch."""
    observations, rewards, terminated, truncated, infos = result
    return _first(observations), float(rewards[0]), bool(terminated[0]), bool(truncated[0]), _info(infos)


def _first(observations: Any) -> Observation:  # noqa: ANN401 - an array or a dictionary of them
    if isinstance(observations, dict):
        return {name: part[0] for name, part in observations.items()}
    first: npt.NDArray[np.generic] = observations[0]
    return first


def _info(infos: dict[str, Any]) -> dict[str, object]:
    """Returns the info of the only environment."""
    info: dict[str, object] = {}
    for name, column in infos.items():
        if name.startswith("_") or not infos[f"_{name}"][0]:
            continue
        if isinstance(column, dict):
            info[name] = _info(column)
        elif column.ndim > 1:
            info[name] = column[0]
        else:
            info[name] = column[0].item() if isinstance(column[0], np.generic) else column[0]
    return info
