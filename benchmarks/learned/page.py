"""The tables of `agents/learned/README.md`, written between their markers."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from benchmarks.learned.results import RANDOM, SCRIPTED, TRAINED

from swath.evaluation.statistics import Spread, spread

MARK = re.compile(r"(<!-- (?P<kind>contest|curve): (?P<name>[\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def write(file: Path, data: Path) -> None:
    """Writes every table of the page anew from the data."""
    text = MARK.sub(lambda found: found[1] + table(found["kind"], data / found["name"]) + found[4], file.read_text())
    temporary = file.with_suffix(".tmp")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(file)


def table(kind: str, folder: Path) -> str:
    """Returns a table in Markdown; one line where a training has not been run."""
    if not (folder / "episodes.csv").exists():
        return "Not run yet: `make train-learned`.\n"
    return contest(folder) if kind == "contest" else curve(folder)


def contest(folder: Path) -> str:
    """Every contestant on the same instances, and how much the trained policy's path differs from its path."""
    paths: dict[str, list[float]] = {}
    mowed: dict[str, list[float]] = {}
    seen: dict[str, list[float]] = {}
    outcomes: dict[str, list[str]] = {}
    for row in read(folder / "episodes.csv"):
        paths.setdefault(row["agent"], []).append(float(row["path_length_m"]))
        mowed.setdefault(row["agent"], []).append(float(row["weeds_mowed"]))
        seen.setdefault(row["agent"], []).append(100 * float(row["seen_fraction"]))
        outcomes.setdefault(row["agent"], []).append(row["outcome"])
    lines = [
        "| agent | path, m | weeds mowed | ground seen, % | trained - it: path, m | path, % | weeds mowed | ended by |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for agent, path in paths.items():
        ends = ", ".join(f"{outcomes[agent].count(name)} {name}" for name in sorted(set(outcomes[agent])))
        versus = ["", "", ""]
        if agent != TRAINED:
            longer = spread([own - other for own, other in zip(paths[TRAINED], path, strict=True)])
            more = spread([own - other for own, other in zip(mowed[TRAINED], mowed[agent], strict=True)])
            share = 100 * longer["mean"] / spread(path)["mean"]
            versus = [f"{shown(longer, '+')}", f"{share:+.1f}", f"{shown(more, '+', 2)}"]
        name = f"`{agent}`" if agent in (*SCRIPTED, RANDOM) else agent
        own = [shown(spread(path)), shown(spread(mowed[agent]), "", 2), shown(spread(seen[agent]), "", 1)]
        lines.append(f"| {' | '.join([name, *own, *versus, ends])} |")
    count = len(paths[TRAINED])
    foot = f"{count} held-out instances, the same for all: mean ± half its 95 % interval (t); paired differences."
    return "\n".join([*lines, "", foot, ""])


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
