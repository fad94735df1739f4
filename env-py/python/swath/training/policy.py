"""Trained policies, loaded and asked."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

from swath.training.algorithms import algorithm_class
from swath.training.card import Card

if TYPE_CHECKING:
    from typing import TypeAlias

    from gymnasium import spaces
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.vec_env import VecNormalize

    Observations: TypeAlias = "npt.NDArray[np.float32] | Mapping[str, npt.NDArray[np.float32]]"
    Actions: TypeAlias = "npt.NDArray[np.float32] | npt.NDArray[np.int64]"
    Masks: TypeAlias = "npt.NDArray[np.bool_] | None"

__all__ = ["Player", "Policy", "RandomPlayer", "load_policy"]


class Player(Protocol):
    """Whatever can act in many environments at once."""

    def predict(self, observations: Observations, action_masks: Masks = None) -> Actions:
        """Chooses an action for every environment.

        Args:
            observations: As the environments give them, (num_envs, ...).
            action_masks: (num_envs, K) bool, where the actions are a choice among K.

        Returns:
            (num_envs, ...) actions.
        """
        ...


@dataclass(frozen=True)
class Policy:
    """A policy that was trained on a scenario.

    Attributes:
        model: The model of stable-baselines3.
        normalization: How its observations are normalised; None: not at all.
        deterministic: Whether it takes its likeliest action; otherwise it draws one.
        card: What is known about it; None while it is being trained.
    """

    model: BaseAlgorithm
    normalization: VecNormalize | None = None
    deterministic: bool = True
    card: Card | None = None

    def predict(self, observations: Observations, action_masks: Masks = None) -> Actions:
        """Chooses an action for every environment; see `Player`."""
        if self.normalization is not None:
            observations = self.normalization.normalize_obs(observations)
        # Algorithms that know no masks choose among all actions.
        knows_masks = "action_masks" in inspect.signature(self.model.predict).parameters
        masks = {"action_masks": action_masks} if knows_masks and action_masks is not None else {}
        actions: Actions = self.model.predict(observations, deterministic=self.deterministic, **masks)[0]
        return actions


class RandomPlayer:
    """Draws its actions uniformly, among the allowed ones where there is a mask."""

    def __init__(self, action_space: spaces.Space[object], seed: int) -> None:
        """Makes a player.

        Args:
            action_space: Of one environment.
            seed: Of its draws.
        """
        self._space = action_space
        self._rng = np.random.default_rng(seed)

    def predict(self, observations: Observations, action_masks: Masks = None) -> Actions:
        """Chooses an action for every environment; see `Player`."""
        from gymnasium.spaces import Box, Discrete

        count = len(next(iter(observations.values())) if isinstance(observations, Mapping) else observations)
        if isinstance(self._space, Box):
            drawn = self._rng.uniform(self._space.low, self._space.high, (count, *self._space.shape))
            return drawn.astype(np.float32)
        assert isinstance(self._space, Discrete), "actions are numbers or a choice"
        weights = self._rng.random((count, int(self._space.n)))
        if action_masks is not None:
            weights[~action_masks] = -1.0
        chosen: Actions = weights.argmax(axis=1)
        return chosen


def load_policy(path: str | os.PathLike[str], *, deterministic: bool = True) -> Policy:
    """Loads a trained policy.

    A model is code as much as data: load only what you trust. The file beside it says what it is, and nothing is
    unpacked before its hash is found to be right.

    Args:
        path: The model, such as `out/ppo/model.zip`, with `model.toml` beside it; or the folder of both.
        deterministic: Whether the policy takes its likeliest action; otherwise it draws one.

    Returns:
        The policy; `policy.card.scenario` is what it was trained on.

    Raises:
        ConfigError: If a file is missing or has another hash.
        ModuleNotFoundError: If stable-baselines3 or sb3-contrib is not installed; the message names the extra.
    """
    path = Path(path)
    path = path / "model.zip" if path.is_dir() else path
    card = Card.read(path)
    model = algorithm_class(card.algorithm).load(path, device="cpu")
    return Policy(model, card.load_normalization(), deterministic, card)
