"""The page `benchmarks/LEAGUE.md`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from benchmarks.league.parts import PARTS, Part, Played

from swath.evaluation.statistics import Spread, spread

REFERENCE = "horizon"
"""Whose way the others are compared with."""

RIVALS = ("jump", "snake", "r-snake")
"""The planners of the paper that must be beaten."""

_METHOD = """\
Every agent that `swath agents` lists drives the same instances, seeds 0, 1, 2 ... of each cell, until it stops.
A figure is the mean way in % of the boustrophedon path with the same R and B (`bcp` is 100), ± half its 95 % interval.
Behind a slash stand the weeds mowed in %, where it is not all of them in every episode: 99.98 is not all.
The second table of each part says how much longer the way is than that of `horizon` on the same instances, in points of
that per cent: mean ± half the 95 % interval of the paired difference.
An agent in italics is a yardstick: it is told where the weeds stand, which no mower can know.
Episodes are few where they are slow, which the intervals show: with two of them it is very wide.
Every episode is in [`LEAGUE.csv`](LEAGUE.csv).
`make league QUICK=1` tries it in two cells and the field; `ONLY="field sensor"` plays some parts, `FEWER=2` half of the
instances.
"""


def text(played: Sequence[Played], agents: dict[str, bool], facts: Sequence[tuple[str, str]]) -> str:
    """Returns the whole page.

    Args:
        played: Every episode.
        agents: Name of every agent, and whether it is an online agent, in the order of tables.
        facts: What it was measured on.
    """
    parts = [part for part in PARTS if any(one.part == part.name for one in played)]
    where = ["|  |  |", "| --- | --- |", *(f"| {name} | {value} |" for name, value in facts)]
    sections = ["# League\n", "\n".join([*where, ""]), headline(played, agents)]
    sections += ["## How to read it\n", _METHOD, *(section(part, played, agents) for part in parts)]
    return "\n".join(sections)


def headline(played: Sequence[Played], agents: dict[str, bool]) -> str:
    """Returns one line an agent over all parts: means over its episodes, and what it has not done.

    Without intervals: cells share their instances' random numbers, and are not independent.
    """
    lines = [
        "| agent | episodes | way, % of `bcp` | weeds mowed, % | all mowed, % of episodes | all ground seen, % | "
        "longer than `horizon`, points | stopped by itself, % |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for agent, is_online in agents.items():
        own = [one for one in played if one.agent == agent]
        if not own:
            continue
        whole = [one.weeds_mowed == one.weeds_total for one in own]
        figures = [
            f"{len(own)}",
            f"{mean([one.path_percent for one in own]):.1f}",
            f"{mean([one.mowed_percent for one in own]):.2f}",
            f"{100 * mean(whole):.1f}",
            f"{100 * mean([one.seen >= 1 for one in own]):.1f}",
            "" if agent == REFERENCE else f"{longer(played, agent)['mean']:+.1f}",
            f"{100 * mean([one.outcome == 'done' for one in own]):.1f}",
        ]
        lines.append(f"| {named(agent, is_online=is_online)} | {' | '.join(figures)} |")
    return "\n".join([*lines, "", contest(played), ""])


def contest(played: Sequence[Played]) -> str:
    """Says how often `horizon` is shorter than the best of the paper's planners among those that mowed everything."""
    rivals: dict[tuple[str, str, int], float] = {}
    for one in played:
        if one.agent in RIVALS and one.weeds_mowed == one.weeds_total:
            rivals[key(one)] = min(one.path_m, rivals.get(key(one), one.path_m))
    own = [one for one in played if one.agent == REFERENCE and key(one) in rivals]
    wins = sum(one.path_m < rivals[key(one)] for one in own)
    over = sum(one.path_percent > 100 for one in played if one.agent == REFERENCE)
    share = f" ({100 * wins / len(own):.1f} %)" if own else ""
    return (
        f"`{REFERENCE}` is shorter than the best of {', '.join(f'`{name}`' for name in RIVALS)} that mowed every weed "
        f"in {wins} of {len(own)} instances{share}, and longer than `bcp` in {over}."
    )


def section(part: Part, played: Sequence[Played], agents: dict[str, bool]) -> str:
    """Returns both tables of a part."""
    own = [one for one in played if one.part == part.name]
    cells = list(dict.fromkeys(one.cell for one in own))
    instances = len({one.instance for one in own})

    def table(cell_of: Callable[[str, str], str], left_out: str | None) -> list[str]:
        lines = ["| | " + " | ".join(f"`{agent}`" for agent in shown_agents if agent != left_out) + " |"]
        lines.append("| --- |" + " --- |" * sum(agent != left_out for agent in shown_agents))
        for cell in cells:
            figures = [cell_of(cell, agent) for agent in shown_agents if agent != left_out]
            lines.append(f"| {cell} | {' | '.join(figures)} |")
        return lines

    shown_agents = [agent for agent in agents if any(one.agent == agent for one in own)]

    def way(cell: str, agent: str) -> str:
        rows = [one for one in own if one.cell == cell and one.agent == agent]
        figure = shown(spread([one.path_percent for one in rows]))
        if any(one.weeds_mowed < one.weeds_total for one in rows):
            figure = f"{figure} / {not_all(mean([one.mowed_percent for one in rows]))}"
        return figure if agents[agent] else f"*{figure}*"

    def difference(cell: str, agent: str) -> str:
        figure = shown(longer([one for one in own if one.cell == cell], agent), "+")
        return figure if agents[agent] else f"*{figure}*"

    lines = [f"## {part.title}", "", f"{instances} instances a cell.", "", *table(way, None), ""]
    lines += [f"Longer than `{REFERENCE}`, points:", "", *table(difference, REFERENCE), ""]
    if part.name == "field":
        metres = [
            f"{named(agent, is_online=agents[agent])} {mean([one.path_m for one in own if one.agent == agent]):.1f} m"
            for agent in shown_agents
        ]
        lines += [f"Mean way: {', '.join(metres)}.", ""]
    return "\n".join(lines)


def longer(played: Sequence[Played], agent: str) -> Spread:
    """Sums up how much longer an agent's way is than the reference's, instance by instance, in points."""
    reference = {key(one): one.path_percent for one in played if one.agent == REFERENCE}
    return spread([one.path_percent - reference[key(one)] for one in played if one.agent == agent])


def key(one: Played) -> tuple[str, str, int]:
    """What two episodes have in common that are compared."""
    return (one.part, one.cell, one.instance)


def named(agent: str, *, is_online: bool) -> str:
    """Returns a name as code, in italics if it is no online agent."""
    return f"`{agent}`" if is_online else f"*`{agent}`*"


def mean(values: Sequence[float]) -> float:
    """Returns the mean."""
    return sum(values) / len(values)


def not_all(percent: float) -> str:
    """Returns a share below 100 %, with one digit behind the point, or as many as it takes not to read 100."""
    return next(text for text in (f"{percent:.{digits}f}" for digits in range(1, 16)) if float(text) < 100)


def shown(values: Spread, sign: str = "") -> str:
    """Returns a mean and half its interval, one digit behind the point."""
    figure = f"{values['mean'] + 0.0:{sign}.1f}"
    return figure if values["high"] is None else f"{figure} ± {values['high'] - values['mean']:.1f}"
