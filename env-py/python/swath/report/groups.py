"""The scenarios of an evaluation that are shown together, and the statistics of each group."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from swath.evaluation.chance import are_copies
from swath.evaluation.statistics import Spread, spread

if TYPE_CHECKING:
    from swath.report.evaluated import Evaluated

__all__ = ["Group", "Panel", "groups_of"]

_MOST_PANELS = 4


@dataclass(frozen=True)
class Panel:
    """Some scenarios of a group over the swept value.

    Attributes:
        title: What its scenarios have in common; empty where there is one panel.
        points: For each swept value, ascending: the value, and the numbers of its scenarios.
    """

    title: str
    points: Sequence[tuple[float, Sequence[int]]]


@dataclass(frozen=True, eq=False)
class Group:
    """The scenarios of one name: a sweep, or a scenario alone.

    A mean over several scenarios is first taken instance by instance, since the same seed stands behind all of them: n
    of an interval is the number of instances.

    Attributes:
        evaluated: The evaluation.
        name: The name.
        numbers: Numbers of the scenarios.
        key: The swept key that figures go along; None for a scenario alone.
        averaged: Other swept keys, over which figures average.
        panels: Empty for a scenario alone.
    """

    evaluated: Evaluated
    name: str
    numbers: Sequence[int]
    key: str | None
    averaged: Sequence[str]
    panels: Sequence[Panel]

    def per_instance(
        self, values: npt.NDArray[np.float64], agent: int, numbers: Sequence[int] | None = None
    ) -> npt.NDArray[np.float64]:
        """Returns the means over scenarios, (instances,)."""
        chosen = self.numbers if numbers is None else numbers
        means: npt.NDArray[np.float64] = values[list(chosen), agent].mean(axis=0)
        return means

    def mean(self, values: npt.NDArray[np.float64], agent: int, numbers: Sequence[int] | None = None) -> Spread:
        """Returns what is known about an agent's mean over scenarios."""
        return self._spread(self.per_instance(values, agent, numbers), [agent], numbers)

    def difference(
        self, values: npt.NDArray[np.float64], agent: int, other: int, numbers: Sequence[int] | None = None
    ) -> Spread:
        """Returns what is known about the difference of two agents on the same instances."""
        points = self.per_instance(values, agent, numbers) - self.per_instance(values, other, numbers)
        return self._spread(points, [agent, other], numbers)

    def _spread(self, means: npt.NDArray[np.float64], agents: Sequence[int], numbers: Sequence[int] | None) -> Spread:
        places = [self.evaluated.places[number] for number in (self.numbers if numbers is None else numbers)]
        labels = [self.evaluated.agents[agent] for agent in agents]
        return spread(means.tolist(), are_copies=are_copies([place.same_weeds for place in places], labels))

    def pooled(self, values: npt.NDArray[np.float64], agent: int) -> npt.NDArray[np.float64]:
        """Returns an agent's episodes of all scenarios of the group."""
        return values[list(self.numbers), agent].ravel()


def groups_of(evaluated: Evaluated) -> list[Group]:
    """Returns the groups, in the order of the evaluation."""
    names = dict.fromkeys(place.name for place in evaluated.places)
    return [_group(evaluated, name) for name in names]


def _group(evaluated: Evaluated, name: str) -> Group:
    numbers = [number for number, place in enumerate(evaluated.places) if place.name == name]
    values = [evaluated.places[number].values for number in numbers]
    swept = [key for key in values[0] if len({repr(value[key]) for value in values}) > 1]
    numeric = [key for key in swept if all(_is_number(value[key]) for value in values)]
    # A sweep over the mower goes along that; its weeds are averaged over, as the paper does.
    key = next((key for key in numeric if not key.startswith("weeds.")), numeric[0] if numeric else None)
    if key is None:
        return Group(evaluated, name, numbers, None, swept, ())
    others = [other for other in swept if other != key]
    split = others if key.startswith("weeds.") else [other for other in others if not other.startswith("weeds.")]
    if len({_title(value, split) for value in values}) > _MOST_PANELS:
        split = []
    titles = dict.fromkeys(_title(value, split) for value in values)
    panels = []
    for title in titles:
        members = [number for number, value in zip(numbers, values, strict=True) if _title(value, split) == title]
        at: dict[float, list[int]] = {}
        for number in members:
            at.setdefault(float(evaluated.places[number].values[key]), []).append(number)  # type: ignore[arg-type] # numeric
        panels.append(Panel(title, sorted(at.items())))
    return Group(evaluated, name, numbers, key, [other for other in others if other not in split], panels)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _title(values: object, keys: Sequence[str]) -> str:
    assert isinstance(values, dict), "swept values have names"
    return ", ".join(f"{key} = {values[key]}" for key in keys)
