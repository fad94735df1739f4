"""The environments that a policy learns from, and their state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gymnasium import spaces

from swath import _native
from swath.errors import ConfigError
from swath.registration import ENV_ID
from swath.training.algorithms import normalize_arguments

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv

    from swath.scenario import Scenario
    from swath.training.config import TrainingConfig

__all__ = ["make_bare_venv", "make_training_venv", "make_venv", "restore", "snapshots"]


def make_venv(scenario: Scenario, num_envs: int, num_threads: int = 1) -> VecEnv:
    """Makes environments that step together."""
    from swath.sb3 import make_vec_env

    return make_vec_env(ENV_ID, num_envs, scenario=scenario, num_threads=num_threads)


def make_bare_venv(config: TrainingConfig) -> VecEnv:
    """Makes the environments of a training: with several counts of weeds, as many environments for each of them."""
    if not config.weed_counts:
        return make_venv(config.scenario, config.num_envs, config.num_threads)
    from swath.training.abreast import AbreastVecEnv

    each = config.num_envs // len(config.weed_counts)
    scenarios = [_native.Scenario(config.scenario, weeds={"count": count}) for count in config.weed_counts]
    return AbreastVecEnv([make_venv(scenario, each, config.num_threads) for scenario in scenarios])


def make_training_venv(config: TrainingConfig) -> VecEnv:
    """Makes the environments of a training, normalised as it says."""
    venv = make_bare_venv(config)
    arguments = normalize_arguments(config)
    if arguments is None:
        return venv
    from stable_baselines3.common.vec_env import VecNormalize

    try:
        return VecNormalize(venv, **arguments)
    except (AssertionError, ValueError, TypeError, KeyError) as error:
        hint = ""
        if isinstance(venv.observation_space, spaces.Dict):
            numbers = [name for name, part in venv.observation_space.items() if isinstance(part, spaces.Box)]
            hint = f": `norm_obs` = false, or `norm_obs_keys` among {', '.join(numbers)}"
        text = f"`normalize` must suit the observation kind `{config.observation_kind}`{hint}, got {arguments}"
        raise ConfigError(text) from error


def snapshots(venv: VecEnv) -> list[bytes]:
    """Returns the state of every environment."""
    return list(venv.env_method("snapshot"))


def restore(venv: VecEnv, states: list[bytes]) -> None:
    """Puts back the state of every environment."""
    for index, state in enumerate(states):
        venv.env_method("restore", state, indices=[index])
