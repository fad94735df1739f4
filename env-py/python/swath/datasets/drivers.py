"""Who drives the mowers of a batch while their episodes are recorded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from swath import _native
from swath.errors import ConfigError
from swath.spaces import action_space
from swath.training.card import Card
from swath.training.config import refuse_endless

if TYPE_CHECKING:
    from typing import TypeAlias

    import numpy.typing as npt

    from swath.remote.batch import RemoteBatch
    from swath.scenario import ScenarioSource
    from swath.training.policy import Player
    from swath.vector import Observations

    AnyBatch: TypeAlias = _native.Batch | RemoteBatch
    Flags: TypeAlias = npt.NDArray[np.bool_]
    Actions: TypeAlias = npt.NDArray[np.float32] | npt.NDArray[np.int64]
    Decisions: TypeAlias = tuple[Actions, Sequence[str | None]]

__all__ = ["RANDOM", "Driver", "PlayerDriver", "ScriptedDriver", "driver_of", "scenario_of"]

_MODEL = ".zip"

RANDOM = "random"
"""Name of the driver that draws its actions uniformly, among the allowed ones where there is a mask."""


class Driver(Protocol):
    """Drives every row of a batch through one episode."""

    def begin(self, batch: AnyBatch, seeds: Sequence[int]) -> None:
        """Makes ready for new episodes in all rows, of these seeds."""
        ...

    def act(self, batch: AnyBatch, observations: Observations, masks: Flags | None, live: Flags) -> Decisions:
        """Decides for every row.

        Args:
            batch: The environments.
            observations: Their present observations.
            masks: (num_envs, K) bool, where actions are a choice among K.
            live: (num_envs,) bool, whose episodes still run; what is decided for the others does not matter.

        Returns:
            Actions, one row an environment, and for each row why its driver has stopped (`done`, `capped`) or None.
        """
        ...


class ScriptedDriver:
    """A scripted agent in every row, each with the row's seed for its own choices."""

    def __init__(self, spec: _native.AgentSpec) -> None:
        """Waits for the first episodes.

        Args:
            spec: The agent.
        """
        self._spec = spec
        self._crew = _native.Crew(spec, [])

    def begin(self, batch: AnyBatch, seeds: Sequence[int]) -> None:
        """Gives every row an agent of its own."""
        self._crew = _native.Crew(self._spec, seeds)

    def act(self, batch: AnyBatch, observations: Observations, masks: Flags | None, live: Flags) -> Decisions:
        """Decides for every row; see `Driver`."""
        return self._crew.act(batch, live)


class PlayerDriver:
    """A trained policy, or chance; it never stops by itself."""

    def __init__(self, player: Player) -> None:
        """Wraps whatever can act in many environments at once."""
        self._player = player

    def begin(self, batch: AnyBatch, seeds: Sequence[int]) -> None:
        """Has every row drawn for by its own seed."""
        self._player.begin(seeds)

    def act(self, batch: AnyBatch, observations: Observations, masks: Flags | None, live: Flags) -> Decisions:
        """Decides for every row; see `Driver`."""
        return self._player.predict(observations, masks), [None] * len(live)  # type: ignore[arg-type] # as the space says


def scenario_of(agent: str) -> ScenarioSource:
    """Returns what an agent drives on unless somebody says otherwise: a trained model on what it was trained on.

    Args:
        agent: As for `driver_of`.

    Raises:
        ConfigError: If there is no such model.
    """
    return Card.read(Path(agent)).scenario if agent.endswith(_MODEL) else "pasture"


def driver_of(agent: str, scenario: _native.Scenario, *, one_by_one: bool = False) -> tuple[Driver, str]:
    """Returns a driver and its label.

    Args:
        agent: A scripted agent with or without options, `random`, or the file of a trained model.
        scenario: What it drives on.
        one_by_one: Whether a trained model is asked about one environment at a time: what it does in an episode then
            does not depend, to the bit, on how many are played together.

    Raises:
        ConfigError: If there is no such agent or model, or it cannot act in the action kind, or need never stop.
    """
    batch = _native.Batch(scenario, 1, "SameStep", 1, copy=True)
    if agent == RANDOM:
        from swath.training.policy import RandomPlayer

        refuse_endless("episode.budget", scenario)
        return PlayerDriver(RandomPlayer(action_space(batch.action_spec))), RANDOM
    if agent.endswith(_MODEL):
        from swath.training.policy import OneByOne, load_policy

        policy = load_policy(agent)
        assert policy.card is not None, "it was loaded with its card"
        for name in ("observation", "action"):
            trained, given = policy.card.scenario.to_dict()[name], scenario.to_dict()[name]
            if trained != given:
                text = f"`scenario.{name}` must be what {agent} was trained on, {trained}, got {given}"
                raise ConfigError(text)
        refuse_endless("episode.budget", scenario)
        return PlayerDriver(OneByOne(policy) if one_by_one else policy), f"{policy.card.algorithm}:{Path(agent).stem}"
    spec = _native.AgentSpec(agent)
    # It refuses actions that it cannot take, even where there is nothing to decide.
    _native.Crew(spec, [0]).act(batch, np.zeros(1, dtype=bool))
    return ScriptedDriver(spec), spec.label
