"""The episodes of an experiment as the data file beside the page: one row an instance, planners side by side."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from swath.evaluation import Results

OF_AGENT = ("path_m", "weeds_detected", "weeds_mowed", "outcome")
"""The columns that every planner has, each under the planner's name and its own."""


class Episode(NamedTuple):
    """One planner on one instance of one cell.

    Attributes:
        agent: Name of the planner with its options.
        swept: The swept keys of the cell and their values, as the file has them.
        instance: Number of the instance, from 0.
        weeds_total: Number of weeds on the pasture.
        bcp_m: Length of the boustrophedon path over the whole pasture, metres.
        path_m: Way driven, metres.
        weeds_detected: Number of weeds that the sensor has seen.
        weeds_mowed: Number of weeds mowed.
        outcome: Why the episode ended.
    """

    agent: str
    swept: Mapping[str, str]
    instance: int
    weeds_total: int
    bcp_m: float
    path_m: float
    weeds_detected: int
    weeds_mowed: int
    outcome: str


def text(results: Results) -> str:
    """Returns the data file of an evaluation, with lengths in millimetres."""
    study = results.study
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    own = [f"{agent} {column}" for agent in study.labels for column in OF_AGENT]
    writer.writerow([*study.keys, "instance", "weeds_total", "bcp_m", *own])
    for number, cell in enumerate(study.cells):
        for rows in zip(*(results.of_cell(number, agent) for agent in study.labels), strict=True):
            line = [*cell.values.values(), rows[0].instance, rows[0].weeds_total, f"{rows[0].bcp_length_m:.3f}"]
            for row in rows:
                line += [f"{row.path_length_m:.3f}", row.weeds_detected, row.weeds_mowed, row.outcome]
            writer.writerow(line)
    return stream.getvalue()


def read(file: Path) -> Iterator[Episode]:
    """Yields the episodes of a data file, by cell, instance and planner."""
    with file.open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            agents = dict.fromkeys(name.rsplit(" ", 1)[0] for name in row if " " in name)
            swept = {key: value for key, value in row.items() if "." in key and " " not in key}
            for agent in agents:
                yield Episode(
                    agent=agent,
                    swept=swept,
                    instance=int(row["instance"]),
                    weeds_total=int(row["weeds_total"]),
                    bcp_m=float(row["bcp_m"]),
                    path_m=float(row[f"{agent} path_m"]),
                    weeds_detected=int(row[f"{agent} weeds_detected"]),
                    weeds_mowed=int(row[f"{agent} weeds_mowed"]),
                    outcome=row[f"{agent} outcome"],
                )
