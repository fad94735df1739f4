"""What an evaluation is asked: which agents, on which scenarios, over which instances."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from swath import _native
from swath.errors import ConfigError
from swath.evaluation.chance import same_weeds
from swath.evaluation.row import Row
from swath.plain import plain
from swath.seeds import LARGEST_SEED

if TYPE_CHECKING:
    from typing import TypeAlias

    from swath.evaluation.row import Task
    from swath.scenario import ScenarioSource

    Sources: TypeAlias = "ScenarioSource | Sequence[ScenarioSource]"

__all__ = ["Cell", "Sources", "Study", "build", "cores", "whole"]

_MOST_INSTANCES = 1 << 32


@dataclass(frozen=True)
class Cell:
    """One scenario of a study.

    Attributes:
        name: Name of its source, with the sweep's behind a slash.
        values: Every swept key of the study, in its order, with the value it has here.
        scenario: The scenario itself.
    """

    name: str
    values: Mapping[str, object]
    scenario: _native.Scenario

    @cached_property
    def weeds(self) -> int:
        """Number of weeds of every instance."""
        return int(self.scenario.to_dict()["weeds"]["count"])  # type: ignore[index] # a block of keys

    @cached_property
    def same_weeds(self) -> str | None:
        """Why all instances have the same weeds; None where each draws its own."""
        return same_weeds(self.scenario)


@dataclass(frozen=True)
class Study:
    """A checked question; two equal ones have the same answers.

    Attributes:
        agents: The agents, in the order of tables.
        cells: The scenarios, in the order of tables.
        instances: Number of instances of each cell.
        seed: Seed of instance 0; instance i has seed + i, whatever the agent.
        only: Name of the one sweep that was asked for.
        files: Name and text of the files from which the cells can be made again.
    """

    agents: tuple[_native.AgentSpec, ...]
    cells: tuple[Cell, ...]
    instances: int
    seed: int
    only: str | None
    files: Mapping[str, str]

    @classmethod
    def plan(
        cls, agents: str | Sequence[str], *, scenario: Sources, instances: int, seed: int, only: str | None
    ) -> Study:
        """Checks every part of the question.

        Raises:
            ConfigError: For the first part that cannot be used.
        """
        if not isinstance(agents, Iterable):
            text = f"`agents` must be names of agents, such as `snake`, got {agents!r}"
            raise ConfigError(text)
        texts = [
            text.strip() if isinstance(text, str) else text
            for text in (agents.split(",") if isinstance(agents, str) else agents)
        ]
        sources = _sources(scenario)
        instances = whole("instances", instances, least=1, most=_MOST_INSTANCES)
        study = cls(
            agents=tuple(map(_native.AgentSpec, texts)),
            cells=_cells(sources, only),
            instances=instances,
            seed=whole("seed", seed, least=0, most=LARGEST_SEED - (instances - 1)),
            only=only,
            files=dict(_files(sources, only)),
        )
        _refuse_twins("agents", study.labels, written=texts)
        titles = [_title(cell) for cell in study.cells]
        _refuse_twins("scenario", titles, written=titles)
        return study

    @property
    def labels(self) -> list[str]:
        """Name and options of every agent."""
        return [spec.label for spec in self.agents]

    @property
    def keys(self) -> list[str]:
        """Every swept key."""
        return list(self.cells[0].values)

    def tasks(self) -> Iterator[Task]:
        """Yields every episode, each instance for all agents before the next one."""
        for cell, instance, agent in product(range(len(self.cells)), range(self.instances), self.labels):
            yield (cell, agent, instance)

    def run(self, tasks: Sequence[Task], *, threads: int) -> Iterator[Row]:
        """Yields the rows of these tasks as they get finished."""
        labels = self.labels
        numbers = [(cell, labels.index(agent), instance) for cell, agent, instance in tasks]
        scenarios = [cell.scenario for cell in self.cells]
        stream = _native.EpisodeStream(scenarios, self.agents, numbers, self.seed, threads)
        for cell, agent, instance, summary, wall_s in stream:
            yield Row(
                cell=cell,
                scenario=self.cells[cell].name,
                agent=labels[agent],
                instance=instance,
                seed=self.seed + instance,
                wall_s=wall_s,
                **summary,
            )

    def __len__(self) -> int:
        """Returns the number of episodes."""
        return len(self.cells) * len(self.agents) * self.instances

    def identity(self) -> dict[str, object]:
        """Returns what tells this study from others, as plain data: the first line of its journal."""
        return {
            "swath": _native.VERSION,
            "build": build(),
            "agents": self.labels,
            "instances": self.instances,
            "seed": self.seed,
            "cells": [
                {"scenario": cell.name, "hash": cell.scenario.hash, "values": plain(cell.values)} for cell in self.cells
            ],
        }


@cache
def build() -> str:
    """Returns what tells this build of the compiled module from others of the same version: its results may differ."""
    return sha256(Path(_native.__file__).read_bytes()).hexdigest()[:16]


def cores() -> int:
    """Returns how many cores this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def whole(field: str, value: object, *, least: int, most: int) -> int:
    """Returns a whole number within bounds, NumPy's whole numbers included.

    Raises:
        ConfigError: If it is none, naming `field`.
    """
    try:
        number = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        number = least - 1
    if not least <= number <= most:
        text = f"`{field}` must be a whole number from {least} to {most}, got {value!r}"
        raise ConfigError(text)
    return number


def _sources(scenario: Sources) -> list[ScenarioSource]:
    if scenario is None or isinstance(scenario, str | os.PathLike | Mapping | _native.Scenario):
        return [scenario]
    return list(scenario)


def _cells(sources: Sequence[ScenarioSource], only: str | None) -> tuple[Cell, ...]:
    found = [cell for source in sources for cell in _native.cells(source, only=only)]
    keys = dict.fromkeys(key for _, values, _ in found for key in values)
    return tuple(
        Cell(name, {key: values[key] if key in values else _value_of(scenario, key) for key in keys}, scenario)
        for name, values, scenario in found
    )


def _value_of(scenario: _native.Scenario, key: str) -> object:
    """Returns the value of a key that another source sweeps; empty where the scenario has none."""
    value: object = scenario.to_dict()
    for name in key.split("."):
        value = value.get(name, "") if isinstance(value, dict) else ""
    return value


def _files(sources: Sequence[ScenarioSource], only: str | None) -> Iterator[tuple[str, str]]:
    for number, source in enumerate(sources, start=1):
        name = "scenario.toml" if len(sources) == 1 else f"scenario-{number}.toml"
        yield name, _native.resolved(source, only=only)


def _title(cell: Cell) -> str:
    return ", ".join([cell.name, *(f"{key} = {value}" for key, value in cell.values.items())])


def _refuse_twins(field: str, names: Sequence[str], *, written: Sequence[str]) -> None:
    if not names:
        text = f"`{field}` must name at least one, got none"
        raise ConfigError(text)
    for number, name in enumerate(names):
        if name in names[:number]:
            one, other = written[names.index(name)], written[number]
            got = f"`{one}` twice" if one == other else f"`{one}` and `{other}`, which are the same"
            text = f"`{field}` must differ in their names, got {got}"
            raise ConfigError(text)
