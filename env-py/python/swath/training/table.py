"""The printed table of a training's evaluations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.table import Table

from swath.evaluation.statistics import interval
from swath.evaluation.table import print_whole
from swath.training.curve import POLICY

if TYPE_CHECKING:
    from swath.training.curve import Curve

__all__ = ["table_of"]


def table_of(curve: Curve) -> str:
    """Returns one line for each agent, the untrained and the trained policy among them."""
    if not curve.steps:
        return ""
    first, last = curve.steps[0], curve.steps[-1]
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("agent")
    for name in ["n", "path m", "weeds mowed", "trained - it, m"]:
        table.add_column(name, justify="right")
    named = [(agent, agent, 0) for agent in curve.agents] + [(f"policy at step {first}", POLICY, first)]
    if last != first:
        named.append((f"policy at step {last}", POLICY, last))
    for name, agent, steps in named:
        path = curve.path_m(agent, steps)
        is_trained = (agent, steps) == (POLICY, last)
        longer = "" if is_trained else interval(curve.longer_m(last, agent, steps), sign="+")
        table.add_row(name, str(path["n"]), interval(path), interval(curve.weeds_mowed(agent, steps)), longer)
    return print_whole(table) + "held-out instances, the same for all; mean ± half the 95 % interval (Student's t)\n"
