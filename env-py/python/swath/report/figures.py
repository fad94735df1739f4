"""The figures of a report."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from swath.evaluation.statistics import Spread, interval
from swath.report.chart import Frame, Scale, colour, dashes, marker, ticks
from swath.share import share
from swath.styles import title_of

if TYPE_CHECKING:
    from swath.report.groups import Group, Panel

__all__ = ["MEASURES", "differences", "distributions", "over_value"]

MEASURES = {"path": "path length, % of boustrophedon", "mowed": "weeds mowed, % of all"}
_WHOLE = {"path": None, "mowed": 100.0}
_POSSIBLE = {"path": (0.0, math.inf), "mowed": (0.0, 100.0)}
_UNITS = {"m": "m", "mps": "m/s", "s": "s", "rad": "rad", "j": "J", "radps": "rad/s"}
_BINS = 60
_LOG_FROM = 8.0
_ASIDE_PX = 3.0
_HILL_PX = 30.0
_ROW_PX = 260


def over_value(group: Group, panel: Panel, measure: str, values: npt.NDArray[np.float64]) -> str:
    """Returns an SVG: each agent's mean with its 95 % interval over the swept value."""
    assert group.key is not None, "a figure goes along a swept key"
    agents, styles = group.evaluated.agents, group.evaluated.styles
    spreads = [[group.mean(values, agent, numbers) for _, numbers in panel.points] for agent in range(len(agents))]
    points = [value for value, _ in panel.points]
    low, high = _limits([end for row in spreads for one in row for end in _ends(one, measure)], measure)
    title = f"{MEASURES[measure]} over {axis_label(group.key)}{', ' * bool(panel.title)}{panel.title}"
    frame = Frame(560, 330, title, "lines")
    is_log = points[0] > 0 and points[-1] / points[0] >= _LOG_FROM
    x = Scale(points[0], points[-1], 72, 536, is_log=is_log)
    y = Scale(low, high, 278, 30)
    frame.y_axis(y, 56, ticks(low, high, 6), MEASURES[measure], right_px=548)
    frame.x_axis(x, 278, points, axis_label(group.key), top_px=278)
    frame.line(56, 278, 548, 278, "axis")
    if panel.title:
        frame.text(302, 18, panel.title)
    for agent, row in enumerate(spreads):
        # A little beside each other, so that no whisker hides another.
        aside_px = _ASIDE_PX * (agent - 0.5 * (len(agents) - 1))
        places = [round(x(value) + aside_px, 1) for value in points]
        look = styles[agent]
        line = " ".join(f"{at},{y(one['mean'])}" for at, one in zip(places, row, strict=True))
        frame.add(f'<polyline points="{line}" class="run {colour(look)}" stroke-dasharray="{dashes(look)}"/>')
        for at, value, one in zip(places, points, row, strict=True):
            ends = _ends(one, measure)
            frame.line(at, y(ends[0]), at, y(ends[-1]), f"whisker {colour(look)}")
            frame.add(
                marker(
                    look, at, y(one["mean"]), f"{agents[agent]} at {value:g}: {interval(one, whole=_WHOLE[measure])} %"
                )
            )
    return frame.svg()


def distributions(group: Group, measure: str, values: npt.NDArray[np.float64]) -> str:
    """Returns an SVG: a histogram of the episodes of each agent, with mean, median and the middle 90 %."""
    agents, styles = group.evaluated.agents, group.evaluated.styles
    pooled = [group.pooled(values, agent) for agent in range(len(agents))]
    low, high = _limits([float(end) for one in pooled for end in (one.min(), one.max())], measure)

    def shown(value: float, digits: int) -> str:
        return share(float(value), digits, whole=_WHOLE[measure] or math.inf)

    def row(frame: Frame, agent: int, x: Scale, base: float) -> str:
        counts, edges = np.histogram(pooled[agent], bins=_BINS, range=(low, high))
        most = int(counts.max())
        tall = _HILL_PX / most
        steps = "".join(
            f"V{round(base - tall * count, 1)}H{x(float(edge))}" for count, edge in zip(counts, edges[1:], strict=True)
        )
        frame.add(f'<path d="M{x(low)} {base}{steps}V{base}Z" class="hill {colour(styles[agent])}"/>')
        frame.line(x(low), base, x(low), base - _HILL_PX, "axis")
        for count in (0, most):
            at = round(base - tall * count, 1)
            frame.line(x(low) - 4, at, x(low), at, "axis")
            frame.text(x(low) - 6, at + 4, f"{count}", "end small")
        fifth, median, last = (float(number) for number in np.percentile(pooled[agent], [5, 50, 95]))
        frame.line(x(fifth), base + 3, x(last), base + 3, f"whisker {colour(styles[agent])}")
        frame.line(x(median), base - 2, x(median), base + 8, "median")
        frame.add(
            marker(
                styles[agent], x(float(pooled[agent].mean())), base + 3, f"mean {shown(pooled[agent].mean(), 2)} %", 3.5
            )
        )
        return f"{shown(median, 1)} ({shown(fifth, 1)} to {shown(last, 1)})"

    heights = f"\u2191 episodes per {(high - low) / _BINS:.2g} %"
    label = f"{MEASURES[measure]}, one episode each"
    return _rows(group, (low, high), label, "median (5 to 95 %)", row, heights=heights)


def differences(group: Group, measure: str, values: npt.NDArray[np.float64]) -> str:
    """Returns an SVG: how each agent differs from the one compared with, on the same instances."""
    evaluated = group.evaluated
    versus = evaluated.agents.index(evaluated.versus)
    spreads = [group.difference(values, agent, versus) for agent in range(len(evaluated.agents))]
    low, high = _limits([0.0, *(end for one in spreads for end in _ends(one))])

    def row(frame: Frame, agent: int, x: Scale, base: float) -> str:
        one, look = spreads[agent], evaluated.styles[agent]
        if agent == versus:
            frame.add(marker(look, x(0.0), base - 10, "the others are compared with it", 5))
            return "0: the reference"
        ends = _ends(one)
        frame.line(x(ends[0]), base - 10, x(ends[-1]), base - 10, f"whisker {colour(look)}")
        text = interval(one, sign="+")
        frame.add(marker(look, x(one["mean"]), base - 10, f"{text} points", 5))
        return text

    label = f"{MEASURES[measure].split(',')[0]} minus that of the reference, points of per cent"
    return _rows(group, (low, high), label, "mean ± 95 % interval", row, zero=True)


def _rows(
    group: Group,
    limits: tuple[float, float],
    label: str,
    numbers: str,
    draw: Callable[[Frame, int, Scale, float], str],
    *,
    zero: bool = False,
    heights: str = "",
) -> str:
    """Draws a row for each agent: its name, what `draw` draws, and the text that it returns.

    `heights` says what the rows' own axes count.
    """
    agents = [title_of(agent) for agent in group.evaluated.agents]
    left, pitch = 28 + 30 * bool(heights) + round(6.6 * max(len(agent) for agent in agents)), 44
    right = max(450, left + _ROW_PX)
    bottom = 24 + pitch * len(agents)
    frame = Frame(right + 170, bottom + 42, f"{label}, a row for each agent", "rows")
    x = Scale(*limits, left, right)
    frame.x_axis(x, bottom, ticks(*limits, 6), label, top_px=20)
    frame.text(right + 14, 14, numbers, "start")
    frame.text(2, 14, heights, "start")
    if zero:
        frame.line(x(0.0), bottom, x(0.0), 20, "zero")
    for agent, name in enumerate(agents):
        base = 14 + pitch * (agent + 1)
        frame.add(marker(group.evaluated.styles[agent], 8, base - 9))
        frame.text(18, base - 5, name, "start")
        frame.text(right + 14, base - 5, draw(frame, agent, x, base), "start")
    return frame.svg()


def axis_label(key: str) -> str:
    """Returns a swept key as people read it, with its unit."""
    if key == "weeds.count":
        return "number of weeds"
    *words, last = key.split(".")[-1].split("_")
    if last in _UNITS and words:
        return f"{' '.join(words)} in {_UNITS[last]} ({key})"
    return f"{' '.join([*words, last])} ({key})"


def _ends(one: Spread, measure: str = "") -> tuple[float, ...]:
    """Returns the ends of an interval, or the mean where there is none; those of a measure within what it can be."""
    if one["low"] is None or one["high"] is None:
        return (one["mean"],)
    least, most = _POSSIBLE.get(measure, (-math.inf, math.inf))
    return (max(one["low"], least), min(one["high"], most))


def _limits(values: Sequence[float], measure: str = "") -> tuple[float, float]:
    """Returns limits of an axis with some air at both ends, as far as the measure can be there."""
    low, high = min(values), max(values)
    air = 0.05 * (high - low) or 0.5
    least, most = _POSSIBLE.get(measure, (-math.inf, math.inf))
    return max(low - air, least), min(high + air, most)
