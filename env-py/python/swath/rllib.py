"""Environments for RLlib, which the extra `swath[rllib]` installs.

```python
swath.rllib.register()
config = (
    PPOConfig()
    .environment(swath.rllib.NAME, env_config={"weeds": {"count": 20}})
    .env_runners(num_envs_per_env_runner=32, gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT)
)
```

With `VECTOR_ENTRY_POINT` a runner steps swath's native batch; with `SYNC` it steps single environments in a loop.
With `connect` in `env_config` the environments are on servers, and the runner's machine needs none of their cores.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium as gym
from gymnasium.vector import AutoresetMode

from swath import remote
from swath.errors import ConfigError
from swath.extras import need
from swath.registration import ENV_ID
from swath.vector import autoreset_from

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["NAME", "env_creator", "register"]

NAME = "swath-mower-routing"
"""The name under which `register` makes the environments known."""


def env_creator(context: Mapping[str, Any]) -> gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]:
    """Makes what a runner of RLlib asks for: a batch where `context` has `num_envs`, else one environment.

    A batch begins ended episodes in the step after, since RLlib takes the observation of that step for the first of the
    next episode; with any other mode it would learn from the wrong ones.

    Args:
        context: RLlib's `env_config`. Its keys are those of `gym.make_vec("swath/MowerRouting-v0", ...)`: `scenario`
            and the blocks of one, `num_envs`, `num_threads`, `copy`; with `connect` those of `swath.remote.make_vec`.

    Raises:
        ConfigError: If a key or the scenario cannot be used.
        RemoteError: If a server cannot be reached or takes no further session.
        ModuleNotFoundError: If `connect` is there and `eclipse-zenoh` is not installed; the message names the extra.
    """
    keys = dict(context)
    num_envs = keys.pop("num_envs", None)
    mode = keys.pop("autoreset_mode", AutoresetMode.NEXT_STEP)
    if autoreset_from(mode) is not AutoresetMode.NEXT_STEP:
        text = f"`autoreset_mode` must be NextStep, the one that RLlib reads rightly, got {mode!r}"
        raise ConfigError(text)
    # Whatever the scenario, "connect" says whether it is played here.
    is_here = keys.get("connect") is None
    if is_here:
        keys.pop("connect", None)
    if num_envs is None:
        return gym.make(ENV_ID, **keys) if is_here else remote.make(ENV_ID, **keys)
    if is_here:
        return gym.make_vec(ENV_ID, num_envs=num_envs, autoreset_mode=mode, **keys)
    return remote.make_vec(ENV_ID, num_envs, autoreset_mode=mode, **keys)


def register(name: str = NAME) -> None:
    """Makes `env_creator` known to RLlib and Tune under a name, in this process and in every worker.

    Args:
        name: What `AlgorithmConfig.environment` is given.

    Raises:
        ModuleNotFoundError: If Ray is not installed; the message names the extra.
    """
    need("`swath.rllib`", "rllib", "ray")
    from ray.tune.registry import register_env

    register_env(name, env_creator)
