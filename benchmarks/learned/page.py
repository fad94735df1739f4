"""The tables of `agents/learned/README.md`, written between their markers."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from benchmarks.learned.results import AGAIN, AGENTS, COUNTS, LEARNED

from swath.evaluation.statistics import Spread, spread

MARK = re.compile(r"(<!-- (?P<kind>contest|curve|again): (?P<name>[\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def write(file: Path, data: Path) -> None:
    """Writes every table of the page anew from the data."""
    text = MARK.sub(lambda found: found[1] + table(found["kind"], found["name"], data) + found[4], file.read_text())
    temporary = file.with_suffix(".tmp")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(file)


def table(kind: str, name: str, data: Path) -> str:
    """Returns a table in Markdown: the contest on so many weeds, the curve of a training, or two trainings compared."""
    match kind:
        case "contest":
            return contest(data / "contest", name)
        case "curve":
            return curve(data / name)
        case _:
            return again(data)


def contest(folder: Path, weeds: str) -> str:
    """Every contestant on the same instances, and how much the learned agent's path differs from its path."""
    played = {
        agent: [row for row in read(folder / f"{agent}.csv") if row["weeds_total"] == weeds]
        for agent in AGENTS
        if (folder / f"{agent}.csv").exists()
    }
    lines = [
        "| agent | path, m | % of bcp | weeds mowed, % | ground seen, % | learned - it: path, m | path, % "
        "| learned is shorter in | an episode takes, ms |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    own_m = column(played[LEARNED], "path_length_m")
    for agent, rows in played.items():
        path_m, mowed = column(rows, "path_length_m"), column(rows, "weeds_mowed")
        share = [100 * path / bcp for path, bcp in zip(path_m, column(rows, "bcp_length_m"), strict=True)]
        versus = ["", "", ""]
        if agent != LEARNED:
            longer_m = [own - other for own, other in zip(own_m, path_m, strict=True)]
            percent = 100 * sum(longer_m) / sum(path_m)
            versus = [shown(spread(longer_m), "+", 1), f"{percent:+.1f}", str(sum(longer < 0 for longer in longer_m))]
        cells = [
            f"`{agent}`",
            shown(spread(path_m), digits=1),
            shown(spread(share), digits=2),
            f"{100 * sum(mowed) / (int(weeds) * len(rows)):.2f}",
            f"{100 * sum(column(rows, 'seen_fraction')) / len(rows):.1f}",
            *versus,
            f"{1000 * sum(column(rows, 'wall_s')) / len(rows):.0f}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    foot = f"{len(own_m)} held-out instances, the same for all: mean ± half its 95 % interval (t); paired differences."
    return "\n".join([*lines, "", foot, ""])


def again(data: Path) -> str:
    """The policy of a second training beside the one that is shipped, on the same instances."""
    lines = [
        "| weeds | shipped, m | again, m | again - shipped, m | % | weeds mowed again, % |",
        "|---|---|---|---|---|---|",
    ]
    shipped, trained = read(data / "contest" / f"{LEARNED}.csv"), read(data / AGAIN)
    for weeds in COUNTS:
        one, two = ([row for row in rows if row["weeds_total"] == str(weeds)] for rows in (shipped, trained))
        one_m, two_m, mowed = column(one, "path_length_m"), column(two, "path_length_m"), column(two, "weeds_mowed")
        longer_m = spread([second - first for first, second in zip(one_m, two_m, strict=True)])
        cells = [
            str(weeds),
            shown(spread(one_m), digits=1),
            shown(spread(two_m), digits=1),
            shown(longer_m, "+", 1),
            f"{100 * sum(two_m) / sum(one_m) - 100:+.1f}",
            f"{100 * sum(mowed) / (weeds * len(two)):.2f}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def column(rows: list[dict[str, str]], name: str) -> list[float]:
    """Returns a column as numbers."""
    return [float(row[name]) for row in rows]


def curve(folder: Path) -> str:
    """The policy while it learned."""
    lines = ["| steps | minutes | path, m | weeds mowed |", "|---|---|---|---|"]
    for row in read(folder / "curve.csv"):
        path = f"{float(row['path_m']):.0f} ± {float(row['path_half_width_m']):.0f}"
        mowed = f"{float(row['weeds_mowed']):.2f} ± {float(row['weeds_half_width']):.2f}"
        lines.append(f"| {int(row['steps']):,} | {float(row['wall_s']) / 60:.1f} | {path} | {mowed} |")
    where = (folder / "machine.txt").read_text(encoding="utf-8").strip()
    return "\n".join([*lines, "", f"Trained on {where}.", ""])


def shown(values: Spread, sign: str = "", digits: int = 0) -> str:
    """Returns a mean and half its interval."""
    mean = f"{values['mean'] + 0.0:{sign}.{digits}f}"
    return mean if values["high"] is None else f"{mean} ± {values['high'] - values['mean']:.{digits}f}"


def read(file: Path) -> list[dict[str, str]]:
    """Returns the rows of a CSV file."""
    with file.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))
