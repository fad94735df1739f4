"""The native batch for stable-baselines3, which the extra `swath[train]` installs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import gymnasium as gym

from swath import _native
from swath.errors import ConfigError
from swath.extras import need
from swath.registration import ENTRY_POINTS
from swath.rendering import RENDER_SIZE, check_render_mode
from swath.vector import MOST_ENVS, MOST_THREADS, checked_count

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typing_extensions import Unpack

    from swath.remote.batch import RemoteBatch
    from swath.scenario import Blocks, ScenarioSource
    from swath.vec_env import MowerRoutingVecEnv

__all__ = ["make_vec_env"]

# What the `make_vec_env` of stable-baselines3 itself would be given, and what is meant here.
_MEANT = {"n_envs": "`num_envs`", "env_kwargs": "its entries as keywords, such as `weeds={...}`"}


def make_vec_env(
    env_id: str,
    num_envs: int = 1,
    *,
    seed: int | None = None,
    scenario: ScenarioSource = None,
    num_threads: int = 1,
    render_mode: str | None = None,
    render_size: tuple[int, int] = RENDER_SIZE,
    connect: str | Sequence[str] | None = None,
    server: str = "default",
    attempt_s: float = 2.0,
    deadline_s: float = 60.0,
    client: str = "",
    resume: bool = False,
    hash_every: int = 64,
    zenoh: dict[str, object] | None = None,
    **blocks: Unpack[Blocks],
) -> MowerRoutingVecEnv:
    """Makes a `VecEnv` of stable-baselines3 over the native batch.

    ```python
    model = PPO("MlpPolicy", swath.sb3.make_vec_env("swath/MowerRouting-v0", num_envs=64, weeds={"count": 160}))
    ```

    Args:
        env_id: `swath/MowerRouting-v0`.
        num_envs: How many environments.
        seed: Environment i begins with the seed `seed` + i, unless `seed()` is called before the first reset. None:
            seeds are drawn.
        scenario: A shipped name, a file, a dictionary, a `Scenario`, or None for the defaults.
        num_threads: Most threads that a step may use; see `MowerRoutingVectorEnv`. Refused with `connect`: servers have
            workers of their own.
        render_mode: None or `rgb_array`, for `render` and `VecVideoRecorder`; None with `connect`.
        render_size: Width and height of a picture of one environment, pixels.
        connect: The endpoint of a server, or a list of them, that hold the environments; see `swath.remote.make_vec`.
            None: this process holds them.
        server: The name that the servers were started with; as this, the next ones are refused without `connect`.
        attempt_s: See `swath.remote.make`.
        deadline_s: See `swath.remote.make`.
        client: See `swath.remote.make`.
        resume: See `swath.remote.make`.
        hash_every: See `swath.remote.make`.
        zenoh: See `swath.remote.make`.
        **blocks: Blocks of the scenario, laid over it key by key.

    Raises:
        ConfigError: If an argument cannot be used; the message names it.
        RemoteError: If a server cannot be reached or takes no further session.
        ModuleNotFoundError: If stable-baselines3 or PyTorch is not installed; the message names the extra.
    """
    if env_id not in ENTRY_POINTS:
        text = f"`env_id` must be one of {', '.join(ENTRY_POINTS)}, got {env_id!r}"
        raise ConfigError(text)
    for name, meant in _MEANT.items():
        if name in blocks:
            text = f"`{name}` is not a known key; did you mean {meant}?"
            raise ConfigError(text)
    num_envs = checked_count("num_envs", num_envs, MOST_ENVS)
    num_threads = checked_count("num_threads", num_threads, MOST_THREADS)
    if connect is not None and num_threads != 1:
        text = (
            f"`num_threads` must be left out with `connect`, since servers have workers of their own, got {num_threads}"
        )
        raise ConfigError(text)
    if connect is None:
        given = {"server": server, "attempt_s": attempt_s, "deadline_s": deadline_s, "client": client}
        given |= {"resume": resume, "hash_every": hash_every, "zenoh": zenoh}
        usual = make_vec_env.__kwdefaults__ or {}
        for name, value in given.items():
            if value != usual[name]:
                text = f"`{name}` must be left out without `connect`, got {value!r}"
                raise ConfigError(text)
    check_render_mode(render_mode, ("rgb_array",) if connect is None else ())
    need("`swath.sb3`", "train", "stable_baselines3", "torch")
    from swath.vec_env import MowerRoutingVecEnv

    core = _native.Scenario(scenario, **blocks)
    batch: _native.Batch | RemoteBatch
    if connect is None:
        size = None if render_mode is None else render_size
        batch = _native.Batch(core, num_envs, "SameStep", num_threads, copy=True, picture_size=size)
    else:
        from swath.remote.batch import RemoteBatch

        batch = RemoteBatch(
            core,
            num_envs,
            "SameStep",
            connect,
            server=server,
            # Of running episodes stable-baselines3 is told nothing here either.
            infos=False,
            attempt_s=attempt_s,
            deadline_s=deadline_s,
            client=client,
            resume=resume,
            hash_every=hash_every,
            zenoh=zenoh,
        )
    keywords = {**({} if scenario is None else {"scenario": scenario}), **blocks}
    env = MowerRoutingVecEnv(batch, num_envs, replace(gym.spec(env_id), kwargs=keywords), render_mode)
    if seed is not None:
        env.seed(seed)
    return env
