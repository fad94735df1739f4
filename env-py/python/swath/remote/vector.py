"""Many environments on servers as one of Gymnasium's vector environments."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swath.remote.batch import RemoteBatch
from swath.vector import MowerRoutingVectorEnv

if TYPE_CHECKING:
    from typing import Any

    from gymnasium.vector import AutoresetMode

__all__ = ["RemoteVectorEnv"]


class RemoteVectorEnv(MowerRoutingVectorEnv):
    """A `MowerRoutingVectorEnv` whose environments lie on servers; `swath.remote.make_vec` makes it.

    Environment i of a vector seeded s is the environment seeded s + i, on any number of servers and in this process.
    It cannot be pickled: its sessions belong to this process. One thread at a time may use it.
    """

    def __init__(self, batch: RemoteBatch, num_envs: int, autoreset_mode: AutoresetMode) -> None:
        """Takes over the sessions of a batch of so many environments."""
        self._adopt(batch, num_envs, autoreset_mode)

    @property
    def has_low_latency(self) -> bool:
        """Whether the next step goes by connections of its own, as it does where all its servers offer low latency."""
        return self._remote.has_low_latency

    def retry(self) -> object:
        """Asks once more for what was not answered in time, and returns what that call would have returned.

        Raises:
            RemoteTimeout: If it is not answered this time either.
            ResumeError: If the session was lost and is not resumed.
        """
        return self._remote.retry()

    @property
    def _remote(self) -> RemoteBatch:
        batch = self._core
        assert isinstance(batch, RemoteBatch), "its rows lie on servers"
        return batch

    def close_extras(self, **kwargs: object) -> None:
        """Ends the sessions."""
        batch = self.__dict__.get("_batch")
        if batch is not None:
            batch.close()
        super().close_extras(**kwargs)

    def __reduce__(self) -> str | tuple[Any, ...]:
        """Refuses to be pickled."""
        return self._core.__reduce__()
