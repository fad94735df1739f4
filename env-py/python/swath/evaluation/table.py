"""The printed table of an evaluation."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from swath.evaluation.chance import without_interval
from swath.evaluation.statistics import interval

if TYPE_CHECKING:
    from swath.evaluation.results import Results
    from swath.evaluation.study import Study

__all__ = ["print_whole", "text_of"]


def text_of(results: Results) -> str:
    """Returns one line for each cell and agent, and below it how to read them."""
    study, versus = results.study, results.versus
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for name in ["scenario", *study.keys, "agent"]:
        table.add_column(name)
    for name in ["n", "path %", "weeds mowed %", f"path - {versus}", "outcomes"]:
        table.add_column(name, justify="right")
    for number, cell in enumerate(study.cells):
        for agent in study.labels:
            path, mowed = results.path(number, agent), results.mowed(number, agent)
            points = "" if agent == versus else interval(results.compare(number, agent, versus), sign="+")
            outcomes = ", ".join(f"{count} {name}" for name, count in results.outcomes(number, agent).items())
            named = [cell.name, *map(str, cell.values.values()), agent, str(path["n"])]
            table.add_row(
                *named,
                interval(path),
                interval(mowed, whole=100.0),
                points,
                outcomes,
                end_section=agent == study.labels[-1],
            )
    return print_whole(table) + (
        "path: in % of the boustrophedon path over the whole pasture; its difference in points, on the same instances\n"
        "mean ± half the 95 % interval of the mean, by Student's t\n" + _copies(results.study)
    )


def _copies(study: Study) -> str:
    """Returns a line for each scenario or sweep in which there is no interval, and why."""
    if study.instances == 1:
        return ""
    cells = dict.fromkeys((cell.name, cell.same_weeds) for cell in study.cells if cell.same_weeds)
    return "".join(f"{name}: {without_interval(why, study.labels, study.instances)}\n" for name, why in cells)


def print_whole(table: Table) -> str:
    """Returns a table as plain text, as wide as it needs to be."""
    text = io.StringIO()
    console = Console(file=text, width=10_000, color_system=None, highlight=False)
    console.print(table)
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()).strip("\n") + "\n"
