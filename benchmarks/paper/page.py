"""The page `docs/reproduce/cowbot-2022.md`, and the means beside it."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path

from benchmarks.paper import claims
from benchmarks.paper.claims import COUNTS, DISTRIBUTIONS, Claim
from benchmarks.paper.runs import EXPERIMENTS, Experiment, Runs

DATA = "cowbot-2022"
"""The folder beside the page that holds its data and figures."""

VERDICTS = {True: "reproduced", False: "**not reproduced**", None: "in part"}


def text(all_runs: Mapping[str, Runs], command: str) -> str:
    """Returns the page, which follows from the episodes alone."""
    parts = [_prose("introduction"), _experiments(all_runs, command)]
    parts.append("## Claims\n")
    parts.append(_claims("Number and distribution of weeds", claims.density_claims(all_runs["density"])))
    parts.append(f"![Figure 6]({DATA}/figure-6.png)\n")
    parts.append(_tables(all_runs["density"]))
    parts.append(_claims("Turning radius", claims.radius_claims(all_runs["turning-radius"])))
    parts.append(f"![Figure 7]({DATA}/figure-7.png)\n")
    parts.append(_claims("Sensor", claims.sensor_claims(all_runs["sensor-width"], all_runs["sensor-range"])))
    parts.append(f"![Figure 8]({DATA}/figure-8.png)\n")
    parts.append(_claims("The field experiment", claims.field_claims(all_runs["field"])))
    parts.append(_prose("deviations"))
    return "\n".join(parts)


def means(experiment: Experiment, runs: Runs) -> str:
    """Returns one row a cell and agent: n, and the means of path, mowed and detected with their half widths."""
    lines: list[list[str]] = []
    header: list[str] = []
    for agent in experiment.agents:
        for episodes in runs.cells(agent):
            swept = episodes[0].swept
            where = {key.replace(".", "__"): _typed(value) for key, value in swept.items()}
            found = {measure: runs.mean(agent, measure, **where) for measure in ("path", "mowed", "detected")}
            columns = [name for measure in found for name in (f"{measure}_percent", f"{measure}_half_width")]
            header = ["agent", *swept, "instances", *columns]
            numbers = [f"{number:.3f}" for mean in found.values() for number in mean]
            lines.append([agent, *swept.values(), str(len(episodes)), *numbers])
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([header, *lines])
    return stream.getvalue()


def _experiments(all_runs: Mapping[str, Runs], command: str) -> str:
    lines = [
        "| experiment | agents | instances a cell | episodes by outcome | data |",
        "|---|---|---|---|---|",
    ]
    for experiment in EXPERIMENTS:
        outcomes = ", ".join(f"{count} {name}" for name, count in sorted(all_runs[experiment.name].outcomes().items()))
        agents = ", ".join(f"`{agent}`" for agent in experiment.agents)
        data = f"[means]({DATA}/{experiment.name}.csv), [instances]({DATA}/{experiment.name}-instances.csv)"
        lines.append(f"| {experiment.name} | {agents} | {experiment.instances} | {outcomes} | {data} |")
    return "\n".join(
        [
            *lines,
            "",
            f"Command: `{command}`. An outcome of `done` means that the planner stopped by itself.",
            "The files of instances hold every episode, those of all planners on one instance in one row; "
            "instance i has the seed i.",
            "",
        ]
    )


def _claims(title: str, rows: list[Claim]) -> str:
    lines = [f"### {title}", "", "| the paper | where | measured | verdict |", "|---|---|---|---|"]
    lines += [f"| {claim.text} | {claim.where} | {claim.measured} | {VERDICTS[claim.holds]} |" for claim in rows]
    return "\n".join([*lines, ""])


def _tables(runs: Runs) -> str:
    lines: list[str] = []
    agents = ("bcp-tsp", "react", "jump", "snake", "r-snake")
    for distribution in DISTRIBUTIONS:
        lines += [
            f"Path in % of `bcp` / weeds mowed in %, {distribution}, mean ± half width of the 95 % interval:",
            "",
            "| agent | " + " | ".join(str(count) for count in COUNTS) + " |",
            "|---|" + "---|" * len(COUNTS),
        ]
        for agent in agents:
            where: list[dict[str, str | float]] = [
                {"weeds__count": count, "weeds__distribution": distribution} for count in COUNTS
            ]
            cells = [f"{runs.mean(agent, 'path', **w)} / {runs.mean(agent, 'mowed', **w)}" for w in where]
            lines.append(f"| `{agent}` | " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join([*lines, _detected(runs), ""])


def _detected(runs: Runs) -> str:
    """How the detected share of `bcp-tsp` in the data differs from the one that the paper speaks of."""
    where: dict[str, str | float] = {"weeds__count": 80, "weeds__distribution": "uniform"}
    tour, mowed = runs.mean("bcp-tsp", "detected", **where), runs.mean("bcp-tsp", "mowed", **where)
    sweep = runs.mean("bcp:spacing=sensor", "detected", **where)
    return (
        f"The detected share of `bcp-tsp` in the data, {tour} % at 80 uniform weeds, counts weeds first seen during "
        f"the tour too, most of which stay unmowed ({mowed} % mowed); what the paper's first phase detects and its "
        f"tour visits is the detected share of the search sweep, {sweep} %."
    )


def _prose(name: str) -> str:
    return Path(__file__).with_name(f"{name}.md").read_text()


def _typed(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text
