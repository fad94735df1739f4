"""What a change of the conditions does to a planner, on the same instances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from benchmarks.paper.runs import Floats, Mean, Runs, mean_of

NOTICEABLE = 5.0
"""How large an effect may be before the page calls it noticeable, in points of per cent."""


class Effect(NamedTuple):
    """A difference between two conditions, instance by instance.

    Attributes:
        points: Its mean over the instances, in points of per cent, with half its 95 % interval.
        between: The two conditions, as the page names them.
    """

    points: Mean
    between: str

    def __str__(self) -> str:
        """The difference with its sign, and what was compared."""
        return f"{self.points:+} ({self.between})"

    @property
    def is_noticeable(self) -> bool:
        """Whether the whole interval is beyond what is noticeable, on one side of zero."""
        return self.points.low > NOTICEABLE or self.points.high < -NOTICEABLE

    @property
    def is_small(self) -> bool:
        """Whether the whole interval is within what is noticeable."""
        return self.points.low > -NOTICEABLE and self.points.high < NOTICEABLE


def of_depth(runs: Runs, agent: str, depths_m: Sequence[float]) -> Effect:
    """The longest less the shortest mean path over the sensor's depth; points of the boustrophedon path."""
    paths = {depth_m: runs.by_instance(agent, "path", sensor__range_m=depth_m) for depth_m in depths_m}
    longest = max(paths, key=lambda depth_m: float(np.mean(paths[depth_m])))
    shortest = min(paths, key=lambda depth_m: float(np.mean(paths[depth_m])))
    return Effect(mean_of(paths[longest] - paths[shortest]), f"S_d = {longest} m less {shortest} m")


def of_distribution(runs: Runs, agent: str, measure: str, counts: Sequence[int]) -> Effect:
    """Gaussian less uniform weeds, at the number of weeds where the mean differs most."""

    def values(count: int, distribution: str) -> Floats:
        return runs.by_instance(agent, measure, weeds__count=count, weeds__distribution=distribution)

    pairs = {count: (values(count, "uniform"), values(count, "gaussian")) for count in counts}
    widest = max(pairs, key=lambda count: abs(float(np.mean(pairs[count][1] - pairs[count][0]))))
    uniform, gaussian = pairs[widest]
    between = f"{np.mean(uniform):.1f} -> {np.mean(gaussian):.1f} % at {widest} weeds"
    return Effect(mean_of(gaussian - uniform), between)


def described(effects: Mapping[str, Effect]) -> str:
    """Every planner's effect, and whose are noticeable."""
    each = ", ".join(f"{agent} {effect}" for agent, effect in effects.items())
    beyond = [agent for agent, effect in effects.items() if effect.is_noticeable]
    return f"{each}; beyond {NOTICEABLE:.0f} points: {', '.join(beyond) or 'none'}"


def are_absent(effects: Mapping[str, Effect]) -> bool | None:
    """True if every planner's effect is small, False if one is noticeable, None if an interval leaves it open."""
    if any(effect.is_noticeable for effect in effects.values()):
        return False
    return True if all(effect.is_small for effect in effects.values()) else None
