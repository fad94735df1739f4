"""Many environments on servers as one of Gymnasium's vector environments."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gymnasium.vector import AutoresetMode

from swath import _native
from swath.remote.batch import RemoteBatch
from swath.vector import MOST_ENVS, MowerRoutingVectorEnv, autoreset_from, checked_count

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typing_extensions import Unpack

    from swath.scenario import Blocks, ScenarioSource

__all__ = ["RemoteVectorEnv"]


class RemoteVectorEnv(MowerRoutingVectorEnv):
    """A `MowerRoutingVectorEnv` whose environments lie on servers; `swath.remote.make_vec` makes it.

    Environment i of a vector seeded s is the environment seeded s + i, on any number of servers and in this process.
    It cannot be pickled: its sessions belong to this process.
    """

    def __init__(
        self,
        num_envs: int = 1,
        scenario: ScenarioSource = None,
        *,
        connect: str | Sequence[str],
        server: str = "default",
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        infos: bool = True,
        attempt_s: float = 2.0,
        deadline_s: float = 60.0,
        client: str = "",
        resume: bool = False,
        hash_every: int = 64,
        zenoh: dict[str, object] | None = None,
        **blocks: Unpack[Blocks],
    ) -> None:
        """Opens a session on every server; see `swath.remote.make_vec`."""
        mode = autoreset_from(autoreset_mode)
        num_envs = checked_count("num_envs", num_envs, MOST_ENVS)
        batch = RemoteBatch(
            _native.Scenario(scenario, **blocks),
            num_envs,
            mode.value,
            connect,
            server=server,
            copy=bool(copy),
            infos=bool(infos),
            attempt_s=attempt_s,
            deadline_s=deadline_s,
            client=client,
            resume=resume,
            hash_every=hash_every,
            zenoh=zenoh,
        )
        self._adopt(batch, num_envs, mode)

    def retry(self) -> object:
        """Asks once more for what was not answered in time, and returns what that call would have returned.

        Raises:
            RemoteTimeout: If it is not answered this time either.
        """
        batch = self._core
        assert isinstance(batch, RemoteBatch), "its rows lie on servers"
        return batch.retry()

    def close_extras(self, **kwargs: object) -> None:
        """Ends the sessions."""
        batch = self.__dict__.get("_batch")
        if batch is not None:
            batch.close()
        super().close_extras(**kwargs)

    def __reduce__(self) -> str:
        """Refuses to be pickled."""
        text = "an environment on a server cannot be pickled: make it where it is used, or take a `snapshot`"
        raise TypeError(text)
