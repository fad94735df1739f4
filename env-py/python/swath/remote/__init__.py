"""Environments on servers, reached over Zenoh; the extra `swath[remote]` brings what it needs.

```python
far = swath.remote.make_vec("swath/MowerRouting-v0", num_envs=1024, connect="tcp/127.0.0.1:7447")
```

They are the environments that this process would make itself, bit for bit.
A message that is lost or late is sent again, and what it asks for is done once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gymnasium.vector import AutoresetMode

from swath import _native
from swath.errors import ConfigError, RenderModeError
from swath.registration import ENTRY_POINTS
from swath.remote.tls import tls

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typing_extensions import Unpack

    from swath.remote.env import RemoteEnv
    from swath.remote.vector import RemoteVectorEnv
    from swath.scenario import Blocks, ScenarioSource

__all__ = ["make", "make_vec", "tls"]


def make(
    env_id: str,
    *,
    connect: str,
    server: str = "default",
    scenario: ScenarioSource = None,
    infos: bool = True,
    attempt_s: float = 2.0,
    deadline_s: float = 60.0,
    client: str = "",
    resume: bool = False,
    hash_every: int = 64,
    zenoh: dict[str, object] | None = None,
    render_mode: str | None = None,
    **blocks: Unpack[Blocks],
) -> RemoteEnv:
    """Makes one environment on a server: a `MowerRoutingEnv` elsewhere.

    Args:
        env_id: `swath/MowerRouting-v0`.
        connect: The server's endpoint, such as `tcp/127.0.0.1:7447`.
        server: The name that the server was started with.
        scenario: A shipped name, a file, a dictionary, a `Scenario`, or None for the defaults.
        infos: Whether every step tells its infos. Without, they are empty but for what is said of an episode that ends,
            and, with the action kind `target`, which choices are open; a reply is then shorter.
        attempt_s: How long to wait for an answer before the same is asked again, seconds.
        deadline_s: How long to go on asking, seconds, before a `RemoteTimeout`; a second more may pass until it can say
            why. Connecting is not part of it: where nobody listens, that is given up after 5 s.
        client: Who asks, for the server's logs.
        resume: Whether to go on when the server was started anew: from a snapshot that this process holds, with the
            requests since sent again and every reply compared with the one that there was. The server has to run with
            `--allow-snapshot`. What is kept: the snapshot, and up to 64 MiB of requests. If it refuses a later
            snapshot, such as one that has grown too large, a `RuntimeWarning` says once that resuming is over.
        hash_every: With `resume`, the servers send a hash of the state with every so many replies, so that it is
            compared too; more often costs more.
        zenoh: Further settings of Zenoh by their path; `tls` returns those for a client with a certificate.
        render_mode: None: there are no pictures of environments elsewhere. A local one of the same seed looks the same.
        **blocks: Blocks of the scenario, laid over it key by key.

    Raises:
        ConfigError: If an argument or the scenario cannot be used.
        RemoteError: If the server cannot be reached, has another version of swath, or takes no further session; with
            `resume`, a `ResumeError` if it sends no snapshots.
        ModuleNotFoundError: If `eclipse-zenoh` is not installed; the message names the extra.
    """
    _check(env_id, render_mode)
    from swath.remote.batch import RemoteBatch
    from swath.remote.env import RemoteEnv

    if not isinstance(connect, str):
        text = f"`connect` must be the endpoint of one server, since one environment lies on one, got {connect!r}"
        raise ConfigError(text)
    batch = RemoteBatch(
        _native.Scenario(scenario, **blocks),
        1,
        "Disabled",
        connect,
        server=server,
        infos=infos,
        attempt_s=attempt_s,
        deadline_s=deadline_s,
        client=client,
        resume=resume,
        hash_every=hash_every,
        zenoh=zenoh,
    )
    return RemoteEnv(batch)


def make_vec(
    env_id: str,
    num_envs: int = 1,
    *,
    connect: str | Sequence[str],
    server: str = "default",
    scenario: ScenarioSource = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    copy: bool = True,
    infos: bool = True,
    attempt_s: float = 2.0,
    deadline_s: float = 60.0,
    client: str = "",
    resume: bool = False,
    hash_every: int = 64,
    zenoh: dict[str, object] | None = None,
    render_mode: str | None = None,
    **blocks: Unpack[Blocks],
) -> RemoteVectorEnv:
    """Makes many environments on one server or several: a `MowerRoutingVectorEnv` elsewhere.

    Args:
        env_id: `swath/MowerRouting-v0`.
        num_envs: How many, shared evenly among the servers.
        connect: The endpoint of a server, or a list of them; all are asked at the same time.
        server: The name that the servers were started with.
        scenario: As for `make`.
        autoreset_mode: As for `gym.make_vec`.
        copy: As for `gym.make_vec`.
        infos: As for `make`.
        attempt_s: As for `make`.
        deadline_s: As for `make`.
        client: As for `make`.
        resume: As for `make`; each server's environments by themselves.
        hash_every: As for `make`.
        zenoh: As for `make`.
        render_mode: As for `make`.
        **blocks: Blocks of the scenario, laid over it key by key.

    Raises:
        ConfigError: If an argument or the scenario cannot be used.
        RemoteError: As for `make`.
        ModuleNotFoundError: If `eclipse-zenoh` is not installed; the message names the extra.
    """
    _check(env_id, render_mode)
    from swath.remote.batch import RemoteBatch
    from swath.remote.vector import RemoteVectorEnv
    from swath.vector import MOST_ENVS, autoreset_from, checked_count

    mode = autoreset_from(autoreset_mode)
    num_envs = checked_count("num_envs", num_envs, MOST_ENVS)
    batch = RemoteBatch(
        _native.Scenario(scenario, **blocks),
        num_envs,
        mode.value,
        connect,
        server=server,
        copy=bool(copy),
        infos=infos,
        attempt_s=attempt_s,
        deadline_s=deadline_s,
        client=client,
        resume=resume,
        hash_every=hash_every,
        zenoh=zenoh,
    )
    return RemoteVectorEnv(batch, num_envs, mode)


def _check(env_id: str, render_mode: str | None) -> None:
    if env_id not in ENTRY_POINTS:
        text = f"`env_id` must be one of {', '.join(ENTRY_POINTS)}, got {env_id!r}"
        raise ConfigError(text)
    if render_mode is not None:
        text = f"`render_mode` must be None, since there are no pictures of environments elsewhere, got {render_mode!r}"
        raise RenderModeError(text)
