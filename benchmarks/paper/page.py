"""The page `docs/reproduce/cowbot-2022.md` and the data beside it."""

from __future__ import annotations

import csv
from pathlib import Path

from benchmarks.paper import claims
from benchmarks.paper.claims import COUNTS, DISTRIBUTIONS, Claim
from benchmarks.paper.runs import EXPERIMENTS, Experiment, Runs

VERDICTS = {True: "reproduced", False: "**not reproduced**", None: "in part"}


def write(file: Path, data: Path, all_runs: dict[str, Runs], command: str) -> None:
    """Writes the page to `file` and one CSV an experiment to `data`."""
    data.mkdir(parents=True, exist_ok=True)
    for experiment in EXPERIMENTS:
        write_data(data / f"{experiment.name}.csv", experiment, all_runs[experiment.name])
    text = [_prose("introduction"), _experiments(all_runs, command)]
    text.append("## Claims\n")
    text.append(_claims("Number and distribution of weeds", claims.density_claims(all_runs["density"])))
    text.append(f"![Figure 6]({data.name}/figure-6.png)\n")
    text.append(_tables(all_runs["density"]))
    text.append(_claims("Turning radius", claims.radius_claims(all_runs["turning-radius"])))
    text.append(f"![Figure 7]({data.name}/figure-7.png)\n")
    text.append(_claims("Sensor", claims.sensor_claims(all_runs["sensor-width"], all_runs["sensor-range"])))
    text.append(f"![Figure 8]({data.name}/figure-8.png)\n")
    text.append(_claims("The field experiment", claims.field_claims(all_runs["field"])))
    text.append(_prose("deviations"))
    _replace(file, "\n".join(text))


def write_data(file: Path, experiment: Experiment, runs: Runs) -> None:
    """One row a cell and agent: n, and the means of path, mowed and detected with their half widths."""
    lines: list[list[str]] = []
    header: list[str] = []
    for agent in experiment.agents:
        for rows in runs.cells(agent):
            swept = {key: value for key, value in rows[0].items() if "." in key}
            where = {key.replace(".", "__"): _typed(value) for key, value in swept.items()}
            means = {measure: runs.mean(agent, measure, **where) for measure in ("path", "mowed", "detected")}
            columns = [name for measure in means for name in (f"{measure}_percent", f"{measure}_half_width")]
            header = ["agent", *swept, "instances", *columns]
            numbers = [f"{number:.3f}" for mean in means.values() for number in mean]
            lines.append([agent, *swept.values(), str(len(rows)), *numbers])
    temporary = file.with_suffix(".tmp")
    with temporary.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(lines)
    temporary.replace(file)


def _experiments(all_runs: dict[str, Runs], command: str) -> str:
    lines = [
        "| experiment | agents | instances a cell | episodes by outcome | data |",
        "|---|---|---|---|---|",
    ]
    for experiment in EXPERIMENTS:
        outcomes = ", ".join(f"{count} {name}" for name, count in sorted(all_runs[experiment.name].outcomes().items()))
        agents = ", ".join(f"`{agent}`" for agent in experiment.agents)
        data = f"[csv](cowbot-2022/{experiment.name}.csv)"
        lines.append(f"| {experiment.name} | {agents} | {experiment.instances} | {outcomes} | {data} |")
    return "\n".join(
        [*lines, "", f"Command: `{command}`. An outcome of `done` means that the planner stopped by itself.", ""]
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
    return "\n".join(lines)


def _prose(name: str) -> str:
    return Path(__file__).with_name(f"{name}.md").read_text()


def _typed(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


def _replace(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    temporary = file.with_suffix(".tmp")
    temporary.write_text(text)
    temporary.replace(file)
