"""What an evaluation has found."""

from __future__ import annotations

import csv
import io
import json
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from pathlib import Path
from typing import TYPE_CHECKING

from swath import _native
from swath.errors import ConfigError
from swath.evaluation.chance import are_copies
from swath.evaluation.row import NUMBERS, Row
from swath.evaluation.statistics import Spread, spread
from swath.evaluation.study import Study
from swath.files import write_whole
from swath.plain import plain

if TYPE_CHECKING:
    from swath.evaluation.row import Task

__all__ = ["Results", "versus_of"]

_BEFORE = ("scenario", "agent", "instance", "seed")
_AFTER = (*NUMBERS, "wall_s")


@dataclass(frozen=True)
class Results:
    """The rows of a study and what can be said about them.

    Attributes:
        study: What was asked.
        rows: One row an episode, sorted by cell, agent and instance.
        versus: Label of the agent that the printed table compares the others with.
    """

    study: Study
    rows: tuple[Row, ...]
    versus: str

    @classmethod
    def of(cls, study: Study, rows: Mapping[Task, Row], versus: str) -> Results:
        """Sorts the rows of a study, all of which there must be."""
        order = product(range(len(study.cells)), study.labels, range(study.instances))
        return cls(study, tuple(rows[task] for task in order), versus)

    def of_cell(self, cell: int, agent: str) -> Sequence[Row]:
        """Returns the rows of one agent in one cell, instance by instance."""
        start = (cell * len(self.study.agents) + self.study.labels.index(agent)) * self.study.instances
        return self.rows[start : start + self.study.instances]

    def summary(self) -> dict[str, object]:
        """Returns the statistics as plain data.

        Per cell and agent: path in per cent of the boustrophedon path and weeds mowed in per cent, each with n, mean,
        standard deviation and the 95 % interval of the mean by Student's t; how often each outcome came about.
        Per cell and ordered pair of agents: the same of the differences on the same instances, in points.
        Per cell: why all instances have the same weeds, or None. If they have, n is 1 and there is no interval, but
        for agents that choose at random: theirs is over their own choices.

        Returns:
            What `summary.json` holds: nothing in it depends on the time or the number of threads.
        """
        study = self.study
        return {
            "swath": _native.VERSION,
            "arguments": {
                "agents": study.labels,
                "only": study.only,
                "instances": study.instances,
                "seed": study.seed,
                "versus": self.versus,
            },
            "interval": "95 % of the mean, by Student's t with n - 1 degrees of freedom",
            "cells": [
                {
                    "scenario": cell.name,
                    "hash": cell.scenario.hash,
                    "values": plain(cell.values),
                    "same_weeds": cell.same_weeds,
                    "agents": [self._about(number, agent) for agent in study.labels],
                    "comparisons": [self._pair(number, *pair) for pair in permutations(study.labels, 2)],
                }
                for number, cell in enumerate(study.cells)
            ],
        }

    def path(self, cell: int, agent: str) -> Spread:
        """Sums up an agent's paths in a cell, in per cent of the boustrophedon path."""
        return self._spread([row.path_percent for row in self.of_cell(cell, agent)], cell, agent)

    def mowed(self, cell: int, agent: str) -> Spread:
        """Sums up how many of the weeds an agent mowed in a cell, per cent."""
        return self._spread([row.mowed_percent for row in self.of_cell(cell, agent)], cell, agent)

    def compare(self, cell: int, agent: str, other: str) -> Spread:
        """Sums up how much longer one agent's path is than another's on the same instances.

        Args:
            cell: Number of the cell.
            agent: Name of the agent.
            other: Name of the agent whose path is subtracted.

        Returns:
            The spread of the difference, in points of per cent of the boustrophedon path.
        """
        pairs = zip(self.of_cell(cell, agent), self.of_cell(cell, other), strict=True)
        return self._spread([row.path_percent - twin.path_percent for row, twin in pairs], cell, agent, other)

    def outcomes(self, cell: int, agent: str) -> dict[str, int]:
        """Returns how often each outcome came about, by name."""
        return dict(sorted(Counter(row.outcome for row in self.of_cell(cell, agent)).items()))

    def _spread(self, values: Sequence[float], cell: int, *agents: str) -> Spread:
        """Sums up values of these agents in a cell, instance by instance."""
        return spread(values, are_copies=are_copies([self.study.cells[cell].same_weeds], agents))

    def _about(self, cell: int, agent: str) -> dict[str, object]:
        return {
            "agent": agent,
            "path_percent": self.path(cell, agent),
            "mowed_percent": self.mowed(cell, agent),
            "outcomes": self.outcomes(cell, agent),
        }

    def _pair(self, cell: int, agent: str, other: str) -> dict[str, object]:
        pairs = zip(self.of_cell(cell, agent), self.of_cell(cell, other), strict=True)
        mowed = [row.mowed_percent - twin.mowed_percent for row, twin in pairs]
        return {
            "agent": agent,
            "versus": other,
            "path_points": self.compare(cell, agent, other),
            "mowed_points": self._spread(mowed, cell, agent, other),
        }

    def csv(self) -> str:
        """Returns the rows as the text of `episodes.csv`, with numbers as `repr` writes them."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([*_BEFORE, *self.study.keys, *_AFTER])
        for row in self.rows:
            swept = [_cell_text(value) for value in self.study.cells[row.cell].values.values()]
            fields = [[getattr(row, name) for name in names] for names in (_BEFORE, _AFTER)]
            writer.writerow([*fields[0], *swept, *fields[1]])
        return text.getvalue()

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes the rows to a file, as a whole or not at all."""
        write_whole(Path(path), self.csv())

    def table(self) -> str:
        """Returns the statistics as a table for people."""
        from swath.evaluation.table import text_of

        return text_of(self)

    def write(self, folder: Path) -> None:
        """Writes `episodes.csv`, the scenario files and `summary.json`, each as a whole or not at all."""
        for name, text in self.study.files.items():
            write_whole(folder / name, text)
        self.to_csv(folder / "episodes.csv")
        write_whole(folder / "summary.json", self.json())

    def json(self) -> str:
        """Returns `summary` as the text of `summary.json`."""
        return json.dumps(self.summary(), indent=2, allow_nan=False) + "\n"


def versus_of(study: Study, versus: str | None) -> str:
    """Returns the label of the agent to compare with, the first one by default.

    Raises:
        ConfigError: If it is not among the study's agents.
    """
    label = study.labels[0] if versus is None else _native.AgentSpec(versus).label
    if label not in study.labels:
        text = f"`versus` must be one of the agents {', '.join(study.labels)}, got `{label}`"
        raise ConfigError(text)
    return label


def _cell_text(value: object) -> object:
    return json.dumps(plain(value)) if isinstance(value, list | dict) else plain(value)
