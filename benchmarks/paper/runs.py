"""The experiments of the paper, run or resumed, and their episodes as arrays."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from benchmarks.paper.instances import Episode

import swath
from swath.evaluation import Results
from swath.evaluation.statistics import spread
from swath.evaluation.study import build

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Experiment:
    """One part of the paper's evaluation.

    Attributes:
        name: Name of its folder and data file.
        scenario: A shipped scenario.
        only: The sweep of that scenario, or None.
        agents: Who runs.
        instances: Instances a cell.
        axis: The swept key on the x axis of its figure, or None.
    """

    name: str
    scenario: str
    only: str | None
    agents: tuple[str, ...]
    instances: int
    axis: str | None


ONLINE = ("jump", "snake", "r-snake")
EXPERIMENTS = (
    Experiment(
        "density",
        "table1",
        "density",
        ("bcp", "bcp:spacing=sensor", "bcp-tsp", "react", *ONLINE),
        100,
        "weeds.count",
    ),
    Experiment("turning-radius", "table1", "turning-radius", ONLINE, 40, "mower.turning_radius_m"),
    Experiment("sensor-width", "table1", "sensor-width", ONLINE, 40, "sensor.width_m"),
    Experiment("sensor-range", "table1", "sensor-range", ONLINE, 40, "sensor.range_m"),
    Experiment("field", "cowbot-field", None, ("bcp", *ONLINE), 200, None),
)


class Mean(NamedTuple):
    """A mean with the half width of its 95 % interval."""

    value: float
    half_width: float

    def __str__(self) -> str:
        """The mean and its half width, one decimal."""
        return f"{self}"

    def __format__(self, spec: str) -> str:
        """The mean and its half width, one decimal unless `spec` has a precision; `+` as for numbers."""
        number = spec if "." in spec else f"{spec}.1f"
        return f"{self.value:{number}} ± {self.half_width:{number.lstrip('+')}}"

    @property
    def low(self) -> float:
        """Lower end of the interval."""
        return self.value - self.half_width

    @property
    def high(self) -> float:
        """Upper end of the interval."""
        return self.value + self.half_width


class Runs:
    """The episodes of one experiment."""

    def __init__(self, episodes: Iterable[Episode]) -> None:
        """Takes every episode, those of a cell sorted by instance."""
        self._episodes = list(episodes)
        self._cells: dict[tuple[str, ...], list[Episode]] = {}
        for episode in self._episodes:
            self._cells.setdefault((episode.agent, *episode.swept.values()), []).append(episode)

    def cells(self, agent: str, **where: str | float) -> list[list[Episode]]:
        """The episodes of `agent`, one list a cell, each by instance; `where` picks cells, with `__` for a dot."""
        wanted = {key.replace("__", "."): value for key, value in where.items()}
        return [
            episodes
            for (name, *_), episodes in self._cells.items()
            if name == agent and all(_equal(episodes[0].swept[key], value) for key, value in wanted.items())
        ]

    def values(self, key: str) -> list[float]:
        """Every value of a swept key, ascending."""
        return sorted({float(episode.swept[key]) for episode in self._episodes})

    def outcomes(self) -> dict[str, int]:
        """How many episodes ended in which way."""
        return dict(Counter(episode.outcome for episode in self._episodes))

    def by_instance(self, agent: str, measure: str, **where: str | float) -> Floats:
        """A measure of each instance, its mean over the cells that `where` picks.

        Instances are independent of one another; the cells of one instance are not, since they share random numbers.
        """
        cells = [measured(rows, measure) for rows in self.cells(agent, **where)]
        mean: Floats = np.mean(cells, axis=0)
        return mean

    def mean(self, agent: str, measure: str, **where: str | float) -> Mean:
        """Mean of a measure over instances, each averaged over the cells that `where` picks."""
        return mean_of(self.by_instance(agent, measure, **where))

    def difference(self, agent: str, other: str, measure: str, **where: str | float) -> Mean:
        """Mean of `agent` minus `other` on the same instances."""
        return mean_of(self.by_instance(agent, measure, **where) - self.by_instance(other, measure, **where))

    def each(self, agent: str, measure: str, **where: str | float) -> Floats:
        """A measure of every episode that `where` picks, by cell and instance."""
        return np.concatenate([measured(rows, measure) for rows in self.cells(agent, **where)])


def measured(episodes: list[Episode], measure: str) -> Floats:
    """One measure of some episodes: `path`, `mowed` or `detected` in per cent, `length` in metres."""

    def column(name: str) -> Floats:
        return np.array([float(getattr(episode, name)) for episode in episodes])

    if measure == "length":
        return column("path_m")
    if measure == "path":
        return 100 * column("path_m") / column("bcp_m")
    return 100 * column(f"weeds_{measure}") / column("weeds_total")


def mean_of(values: Floats) -> Mean:
    """Mean of independent values with half its 95 % interval, by Student's t."""
    known = spread(list(values))
    return Mean(known["mean"], 0.0 if known["high"] is None else known["high"] - known["mean"])


def run(experiment: Experiment, folder: Path, jobs: int | None) -> Results:
    """Runs an experiment, or what is left of it, in a folder of this build: another build's episodes may differ."""
    return swath.evaluate(
        list(experiment.agents),
        scenario=experiment.scenario,
        only=experiment.only,
        instances=experiment.instances,
        jobs=jobs,
        out=folder / build() / experiment.name,
        progress=True,
    )


def _equal(text: str, value: str | float) -> bool:
    return text == value if isinstance(value, str) else float(text) == value
