"""Each agent's best and worst episode, driven again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from swath.episode import Episode, run_episode
from swath.errors import ConfigError

if TYPE_CHECKING:
    from swath.report.evaluated import Evaluated
    from swath.report.groups import Group

__all__ = ["SUCCESSES", "Extreme", "drawn", "extremes_of", "ratio_percent"]

SUCCESSES = ("done", "goal")
"""How an episode ends that has not failed: by the agent's own stop, or at the goal."""

_DIGITS = 9
"""Behind the point, of per cent: what rounding decides makes no episode better than another."""


@dataclass(frozen=True)
class Extreme:
    """An episode that stands out.

    Attributes:
        kind: `best`, `worst`, or `all alike` where every path is as long as the agent's mean.
        place: Number of its scenario.
        agent: Number of its agent.
        instance: Number of its instance.
    """

    kind: str
    place: int
    agent: int
    instance: int


def extremes_of(groups: Sequence[Group]) -> Iterator[Extreme]:
    """Yields the best and the worst episode of each agent in each group of scenarios.

    The best is the shortest path in per cent of the agent's own mean in that scenario, the worst the longest: so within
    a sweep no scenario wins by being easy. An episode that failed is worse than all that did not, and the more so the
    fewer weeds it mowed. Of equal ones the first counts.
    """
    for group in groups:
        numbers = list(group.numbers)
        for agent in range(len(group.evaluated.agents)):
            percent = ratio_percent(group.evaluated, agent)[numbers]
            is_done = np.isin(group.evaluated.outcomes[numbers, agent], SUCCESSES)
            # Failures come after all others, by what they left, and only then by their path.
            left_percent = 100.0 - group.evaluated.mowed_percent[numbers, agent]
            failed = percent.max() * (1.0 + left_percent) + percent
            cost = np.where(is_done, percent, failed + 1.0).round(_DIGITS)
            best, worst = int(cost.argmin()), int(cost.argmax())
            found = [("best", best), ("worst", worst)] if best != worst else [("all alike", best)]
            for kind, at in found:
                place, instance = np.unravel_index(at, cost.shape)
                yield Extreme(kind, numbers[int(place)], agent, int(instance))


def ratio_percent(evaluated: Evaluated, agent: int) -> npt.NDArray[np.float64]:
    """Returns an agent's paths in per cent of its own mean in the scenario, (places, instances)."""
    path_m = evaluated.path_m[:, agent]
    mean_m = path_m.mean(axis=1, keepdims=True)
    return np.where(mean_m > 0, 100.0 * path_m / np.where(mean_m > 0, mean_m, 1.0), 100.0)


def drawn(evaluated: Evaluated, extreme: Extreme) -> list[Episode]:
    """Drives an episode again, and beside it, on the same weeds, the agent that the others are compared with.

    Returns:
        One or two episodes; none where the scenario or the agent cannot be had from the folder alone.
    """
    scenario = evaluated.places[extreme.place].scenario
    if scenario is None:
        return []
    labels = dict.fromkeys([evaluated.agents[extreme.agent], evaluated.versus])
    seed = evaluated.seed + extreme.instance
    try:
        return [run_episode(label, scenario=scenario, seed=seed) for label in labels]
    except ConfigError:
        return []  # such as a trained policy, whose label names no scripted agent
