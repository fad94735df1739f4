"""The tables of a report."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from swath.evaluation.statistics import Spread
from swath.report.chart import swatch
from swath.share import share
from swath.styles import YARDSTICK, is_yardstick, title_of

if TYPE_CHECKING:
    from swath.report.groups import Group

__all__ = ["matrix", "name_of", "of_group", "of_places", "table"]


def name_of(label: str) -> str:
    """Returns an agent's label as HTML: a yardstick stands apart."""
    if not is_yardstick(label):
        return escape(label)
    return f'<i class="yardstick" title="{escape(YARDSTICK)}">{escape(title_of(label))}</i>'


def of_group(group: Group) -> str:
    """Returns a line for each agent: means over the scenarios of the group."""
    evaluated = group.evaluated
    versus = evaluated.agents.index(evaluated.versus)
    rows = []
    for agent, label in enumerate(evaluated.agents):
        outcomes = evaluated.outcomes[list(group.numbers), agent].ravel().tolist()
        rows.append(
            [
                f"{swatch(evaluated.styles[agent])} {name_of(label)}",
                f"{group.mean(evaluated.path_m, agent)['mean']:.0f}",
                _interval(group.mean(evaluated.path_percent, agent)),
                _interval(group.mean(evaluated.mowed_percent, agent), most=100.0),
                "" if agent == versus else _difference(group.difference(evaluated.path_percent, agent, versus)),
                _counts(outcomes),
            ]
        )
    return table(_heads("agent", evaluated.versus), rows)


def of_places(group: Group) -> str:
    """Returns a line for each scenario and agent of the group."""
    evaluated = group.evaluated
    versus = evaluated.agents.index(evaluated.versus)
    keys = list(evaluated.places[group.numbers[0]].values)
    rows = []
    for number in group.numbers:
        values = escape(", ".join(str(evaluated.places[number].values[key]) for key in keys))
        for agent, label in enumerate(evaluated.agents):
            points = group.difference(evaluated.path_percent, agent, versus, [number])
            rows.append(
                [
                    f"{values}{': ' * bool(values)}{name_of(label)}",
                    f"{evaluated.path_m[number, agent].mean():.0f}",
                    _interval(group.mean(evaluated.path_percent, agent, [number])),
                    _interval(group.mean(evaluated.mowed_percent, agent, [number]), most=100.0),
                    "" if agent == versus else _difference(points),
                    _counts(evaluated.outcomes[number, agent].tolist()),
                ]
            )
    return table(_heads(f"{escape(', '.join(keys))}{': ' * bool(keys)}agent", evaluated.versus), rows)


def matrix(group: Group) -> str:
    """Returns how much longer the path of each row's agent is than that of each column's, on the same instances."""
    evaluated = group.evaluated
    rows = []
    for agent, label in enumerate(evaluated.agents):
        cells = [
            "" if agent == other else _difference(group.difference(evaluated.path_percent, agent, other))
            for other in range(len(evaluated.agents))
        ]
        rows.append([name_of(label), *cells])
    return table(["path of &#8600; minus path of &#8594;", *map(name_of, evaluated.agents)], rows)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Returns a table whose cells are HTML; it can be moved sideways where the window is narrow."""
    head = "".join(f'<th scope="col">{cell}</th>' for cell in heads)
    body = "".join(
        f'<tr><th scope="row">{first}</th>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>\n'
        for first, *rest in rows
    )
    return (
        '<div class="wide" tabindex="0" role="region" aria-label="Table">'
        f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table></div>\n"
    )


def _heads(first: str, versus: str) -> list[str]:
    return [
        first,
        "path, m",
        "path, % of boustrophedon",
        "weeds mowed, %",
        f"path &minus; {escape(versus)}, points",
        "outcomes",
    ]


def _interval(one: Spread, *, most: float = math.inf) -> str:
    """Returns a mean with its interval, cut to what can be: from 0 to `most`."""
    mean = share(one["mean"], 2, whole=most)
    if one["low"] is None or one["high"] is None:
        return mean
    low, high = max(one["low"], 0.0), min(one["high"], most)
    return f"{mean} <small>[{share(low, 2, whole=most)}, {share(high, 2, whole=most)}]</small>"


def _difference(one: Spread) -> str:
    """Returns a difference with its interval, and by sign and shape whether it is decided."""
    # What rounding leaves is no difference.
    low, mean, high = (None if end is None else round(end, 9) + 0.0 for end in (one["low"], one["mean"], one["high"]))
    text = f"{mean:+.2f}"
    if low is None or high is None:
        return text
    verdict = ("shorter", "&#9660;") if high < 0 else ("longer", "&#9650;") if low > 0 else ("open", "&#9671;")
    return f'<span class="{verdict[0]}">{verdict[1]} {text} <small>[{low:+.2f}, {high:+.2f}]</small></span>'


def _counts(outcomes: Sequence[str]) -> str:
    return ", ".join(f"{count} {escape(name)}" for name, count in sorted(Counter(outcomes).items()))
