"""Each agent's best and worst episode, driven again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from swath.episode import Episode, run_episode
from swath.errors import ConfigError

if TYPE_CHECKING:
    from swath.report.evaluated import Evaluated

__all__ = ["Extreme", "drawn", "extremes_of"]

_DIGITS = 9
"""Behind the point, of per cent: what rounding decides makes no episode better than another."""


@dataclass(frozen=True)
class Extreme:
    """An episode that stands out.

    Attributes:
        kind: `best`, `worst`, or `all alike` where every episode is as long as the others.
        place: Number of its scenario.
        agent: Number of its agent.
        instance: Number of its instance.
    """

    kind: str
    place: int
    agent: int
    instance: int


def extremes_of(evaluated: Evaluated) -> Iterator[Extreme]:
    """Yields the best and the worst episode of each agent.

    The best is the shortest path in per cent of the boustrophedon path, the worst the longest; an episode that did not
    end by the agent's own stop or at the goal is worse than all that did. Of equal ones the first counts.
    """
    for agent in range(len(evaluated.agents)):
        percent, is_done = evaluated.path_percent[:, agent], np.isin(evaluated.outcomes[:, agent], ("done", "goal"))
        # Failures come after all others.
        cost = np.where(is_done, percent, percent + percent.max() + 1.0).round(_DIGITS)
        best, worst = int(cost.argmin()), int(cost.argmax())
        found = [("best", best), ("worst", worst)] if best != worst else [("all alike", best)]
        for kind, at in found:
            place, instance = np.unravel_index(at, cost.shape)
            yield Extreme(kind, int(place), agent, int(instance))


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
