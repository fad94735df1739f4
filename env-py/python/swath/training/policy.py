"""Trained policies, loaded and asked."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from swath.training.algorithms import algorithm_class
from swath.training.card import Card

if TYPE_CHECKING:
    from typing import TypeAlias

    import torch
    from gymnasium import spaces
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.vec_env import VecNormalize

    Observations: TypeAlias = "npt.NDArray[np.float32] | Mapping[str, npt.NDArray[np.float32]]"
    Actions: TypeAlias = "npt.NDArray[np.float32] | npt.NDArray[np.int64]"
    Masks: TypeAlias = "npt.NDArray[np.bool_] | None"

__all__ = ["OneByOne", "Player", "Policy", "RandomPlayer", "load_policy"]


class Player(Protocol):
    """Whatever can act in many environments at once."""

    def begin(self, seeds: Sequence[int]) -> None:
        """Makes ready for new episodes.

        Args:
            seeds: The seed of every environment's episode, which determines whatever is drawn in it; none: the episodes
                are over.
        """
        ...

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
    _draws: list[torch.Tensor] = field(default_factory=list, init=False, repr=False, compare=False)

    def begin(self, seeds: Sequence[int]) -> None:
        """Makes ready for new episodes; see `Player`."""
        if self.deterministic:
            return
        import torch

        self._draws[:] = [torch.Generator().manual_seed(drawn).get_state() for drawn in map(_seed_of_draws, seeds)]

    def predict(self, observations: Observations, action_masks: Masks = None) -> Actions:
        """Chooses an action for every environment; see `Player`.

        A policy that draws its actions draws from PyTorch's generator, or after `begin` from one for each episode.
        """
        if self.deterministic or not self._draws:
            return self._predict(observations, action_masks)
        import torch

        chosen: list[npt.NDArray[Any]] = []
        with torch.random.fork_rng(devices=[]):
            for row, state in enumerate(self._draws):
                torch.set_rng_state(state)
                chosen.append(self._predict(*_only(row, observations, action_masks)))
                self._draws[row] = torch.get_rng_state()
        actions: Actions = np.concatenate(chosen)
        return actions

    def _predict(self, observations: Observations, action_masks: Masks) -> Actions:
        if self.normalization is not None:
            observations = self.normalization.normalize_obs(observations)
        # Algorithms that know no masks choose among all actions.
        knows_masks = "action_masks" in inspect.signature(self.model.predict).parameters
        masks = {"action_masks": action_masks} if knows_masks and action_masks is not None else {}
        actions: Actions = self.model.predict(observations, deterministic=self.deterministic, **masks)[0]
        return actions


class OneByOne:
    """A policy that is asked about one environment at a time.

    Sums over a batch are rounded in an order that depends on its size, so that many rows at once may bring other bits
    than each alone.
    """

    def __init__(self, policy: Policy) -> None:
        """Wraps a policy that takes its likeliest action."""
        self._policy = policy

    def begin(self, seeds: Sequence[int]) -> None:
        """Makes ready for new episodes; see `Player`."""
        self._policy.begin(seeds)

    def predict(self, observations: Observations, action_masks: Masks = None) -> Actions:
        """Chooses an action for every environment; see `Player`."""
        some = next(iter(observations.values())) if isinstance(observations, Mapping) else observations
        rows: list[npt.NDArray[Any]] = [
            self._policy.predict(*_only(row, observations, action_masks)) for row in range(len(some))
        ]
        actions: Actions = np.concatenate(rows)
        return actions


class RandomPlayer:
    """Draws its actions uniformly, among the allowed ones where there is a mask."""

    def __init__(self, action_space: spaces.Space[object], seed: int = 0) -> None:
        """Makes a player.

        Args:
            action_space: Of one environment.
            seed: Players of different seeds draw differently in the same episodes.
        """
        self._space = action_space
        self._seed = seed
        self._rngs: list[np.random.Generator] = []

    def begin(self, seeds: Sequence[int]) -> None:
        """Makes ready for new episodes; see `Player`."""
        self._rngs = [np.random.default_rng([_seed_of_draws(seed), self._seed]) for seed in seeds]

    def predict(self, observations: Observations, action_masks: Masks = None) -> Actions:
        """Chooses an action for every environment; see `Player`. `begin` comes first."""
        from gymnasium.spaces import Box, Discrete

        if isinstance(self._space, Box):
            low, high = self._space.low, self._space.high
            return np.stack([rng.uniform(low, high) for rng in self._rngs]).astype(np.float32)
        assert isinstance(self._space, Discrete), "actions are numbers or a choice"
        weights = np.stack([rng.random(int(self._space.n)) for rng in self._rngs])
        if action_masks is not None:
            weights[~action_masks] = -1.0
        chosen: Actions = weights.argmax(axis=1)
        return chosen


def _only(row: int, observations: Observations, masks: Masks) -> tuple[Observations, Masks]:
    """Returns what there is of one environment."""
    only = slice(row, row + 1)
    part = (
        {key: values[only] for key, values in observations.items()}
        if isinstance(observations, Mapping)
        else observations[only]
    )
    return part, None if masks is None else masks[only]


def _seed_of_draws(seed: int) -> int:
    """Returns a seed for the draws in an episode, hashed apart from the episode's own."""
    return int.from_bytes(sha256(f"draws {seed}".encode()).digest()[:8], "little")


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
        ModuleNotFoundError: If stable-baselines3, sb3-contrib or PyTorch is not installed; the message names the extra.
    """
    path = Path(path)
    path = path / "model.zip" if path.is_dir() else path
    card = Card.read(path)
    model = algorithm_class(card.algorithm).load(path, device="cpu")
    return Policy(model, card.load_normalization(), deterministic, card)
