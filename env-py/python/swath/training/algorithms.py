"""The algorithms of stable-baselines3 and sb3-contrib, and what may be said to them."""

from __future__ import annotations

import importlib
import inspect
import typing
from collections.abc import Mapping
from typing import TYPE_CHECKING

from swath.errors import ConfigError
from swath.extras import need
from swath.training import keys

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.vec_env import VecEnv

    from swath.training.config import TrainingConfig

__all__ = ["algorithm_class", "check_parameters", "new_model", "normalize_arguments"]

_CLASSES = {
    "ppo": ("stable_baselines3", "PPO"),
    "sac": ("stable_baselines3", "SAC"),
    "maskable-ppo": ("sb3_contrib", "MaskablePPO"),
}

# Arguments that swath gives itself, or that TOML cannot hold.
_OURS = {
    "policy", "env", "seed", "verbose", "policy_kwargs", "tensorboard_log", "action_noise",
    "rollout_buffer_class", "rollout_buffer_kwargs", "replay_buffer_class", "replay_buffer_kwargs",
    "stats_window_size", "_init_setup_model",
}  # fmt: skip
_POLICY_OURS = {"observation_space", "action_space", "lr_schedule", "optimizer_class", "use_sde"}
_NORMALIZE_OURS = {"venv", "training", "gamma"}

# Policies that cannot read an observation kind, which stable-baselines3 finds out late; the other kinds have no parts
# and no table.
_UNFIT = {"dict": ("MlpPolicy", "CnnPolicy"), "candidates": ("MultiInputPolicy",)}

# Bounds that stable-baselines3 checks late or not at all.
_POSITIVE = {"learning_rate", "n_steps", "batch_size", "n_epochs", "buffer_size", "clip_range"}
_SHARES = {"gamma", "gae_lambda", "tau"}


def algorithm_class(name: str) -> type[BaseAlgorithm]:
    """Returns the class of an algorithm.

    Args:
        name: `ppo`, `sac` or `maskable-ppo`.

    Raises:
        ModuleNotFoundError: If its package is not installed; the message names the extra.
    """
    need("training", "train", "stable_baselines3", "torch", "tensorboard")
    if name == "maskable-ppo":
        need("`maskable-ppo`", "train", "sb3_contrib")
    module, chosen = _CLASSES[name]
    found: type[BaseAlgorithm] = getattr(importlib.import_module(module), chosen)
    return found


def check_parameters(config: TrainingConfig) -> None:
    """Checks hyperparameters, the policy's arguments and those of the normalisation against their signatures.

    Raises:
        ConfigError: For the first one that cannot be used.
    """
    _hyperparameters(config)
    _policy(config)
    normalize_arguments(config)


def new_model(config: TrainingConfig, venv: VecEnv) -> BaseAlgorithm:
    """Makes an untrained model.

    Args:
        config: The checked configuration.
        venv: The environments to learn from; the model seeds them.

    Raises:
        ConfigError: If stable-baselines3 refuses the parameters together.
    """
    policy, policy_kwargs = _policy(config)
    try:
        return algorithm_class(config.algorithm)(
            policy,
            venv,
            seed=config.seed,
            policy_kwargs=policy_kwargs,
            **{"device": "cpu", **_hyperparameters(config)},
        )
    except (AssertionError, ValueError, TypeError) as error:
        reason = str(error).strip().splitlines() or ["no reason given"]
        text = f"`policy` and `hyperparameters` must suit {config.algorithm}: {reason[0]}"
        raise ConfigError(text) from error


def normalize_arguments(config: TrainingConfig) -> dict[str, object] | None:
    """Returns the keyword arguments of VecNormalize, or None without normalisation.

    Raises:
        ConfigError: For the first one that cannot be used.
    """
    if config.normalize is None:
        return None
    from stable_baselines3.common.vec_env import VecNormalize

    gamma = _hyperparameters(config).get("gamma", _default(algorithm_class(config.algorithm), "gamma"))
    return {**_fit("normalize", config.normalize, VecNormalize, _NORMALIZE_OURS), "gamma": gamma}


def _hyperparameters(config: TrainingConfig) -> dict[str, typing.Any]:
    fitted = _fit("hyperparameters", config.hyperparameters, algorithm_class(config.algorithm), _OURS)
    for name, value in config.hyperparameters.items():
        if name in _POSITIVE and isinstance(value, int | float) and not value > 0:
            text = f"`hyperparameters.{name}` must be > 0, got {value}"
            raise ConfigError(text)
        if name == "batch_size" and "ppo" in config.algorithm and isinstance(value, int | float) and not value > 1:
            text = (
                f"`hyperparameters.batch_size` must be > 1, since advantages are normalised over a batch, got {value}"
            )
            raise ConfigError(text)
        if name in _SHARES and isinstance(value, int | float) and not 0 <= value <= 1:
            text = f"`hyperparameters.{name}` must be from 0 to 1, got {value}"
            raise ConfigError(text)
    return fitted


def _policy(config: TrainingConfig) -> tuple[type, dict[str, object]]:
    """Returns the policy's class and keyword arguments, with names of classes turned into classes."""
    from torch import nn

    from swath.training import networks

    aliases: dict[str, type] = dict(algorithm_class(config.algorithm).policy_aliases)
    if config.algorithm == "maskable-ppo":
        aliases["CandidatePolicy"] = networks.candidate_policy()
    given = dict(config.policy)
    name = keys.choice("policy.class", given.pop("class"), aliases)
    unfit = _UNFIT.get(config.observation_kind, ("MultiInputPolicy", "CandidatePolicy"))
    if name in unfit:
        fit = " or ".join(f"`{alias}`" for alias in aliases if alias not in unfit)
        text = f"`policy.class` must be {fit} for the observation kind `{config.observation_kind}`, got `{name}`"
        raise ConfigError(text)
    policy = aliases[name]
    classes: dict[str, dict[str, type]] = {
        "activation_fn": {name: getattr(nn, name) for name in ("Tanh", "ReLU", "ELU", "GELU", "SiLU", "LeakyReLU")},
        "features_extractor_class": networks.EXTRACTORS,
    }
    chosen = {
        name: table[keys.choice(f"policy.{name}", given.pop(name), table)]
        for name, table in classes.items()
        if name in given
    }
    return policy, {**_fit("policy", given, policy, _POLICY_OURS - set(chosen)), **chosen}


def _fit(path: str, given: Mapping[str, object], taker: type, ours: set[str]) -> dict[str, object]:
    """Returns arguments as the constructor of `taker` wants them."""
    parameters = inspect.signature(taker).parameters
    keys.refuse_unknown(path, given, [name for name in parameters if name not in ours])
    hints = {name: parameters[name].annotation for name in given}
    # An annotation that is a text would have to be evaluated first; none of those that matter is.
    return {
        name: keys.fitting(f"{path}.{name}", value, typing.Any if isinstance(hints[name], str) else hints[name])
        for name, value in given.items()
    }


def _default(taker: type, name: str) -> object:
    return inspect.signature(taker).parameters[name].default
