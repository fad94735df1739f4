"""One finished episode of an evaluation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from swath.errors import SwathError

if TYPE_CHECKING:
    from typing import TypeAlias

__all__ = ["NUMBERS", "Row", "Task", "add"]

Task: TypeAlias = "tuple[int, str, int]"
"""Number of a cell, name of an agent, number of an instance."""

NUMBERS = (
    "weeds_total",
    "weeds_detected",
    "weeds_mowed",
    "path_length_m",
    "bcp_length_m",
    "path_fraction",
    "seen_fraction",
    "outcome",
)
"""What result files say of an episode, in the order of their columns."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """The numbers of one agent on one instance of one cell.

    Attributes:
        cell: Number of the cell, in the order of tables.
        scenario: Name of the cell.
        agent: Name of the agent with its options.
        instance: Number of the instance, from 0.
        seed: Seed of the instance.
        path_length_m: Way driven, metres.
        bcp_length_m: Length of the boustrophedon path over the whole pasture, metres.
        path_fraction: Way driven, in lengths of the boustrophedon path.
        weeds_total: Number of weeds on the pasture.
        weeds_detected: Number of weeds that the sensor has seen.
        weeds_mowed: Number of weeds mowed, seen or not.
        seen_fraction: Share of the pasture's cells seen, 0 to 1.
        outcome: Why the episode ended.
        wall_s: How long it took to run, seconds; the only field that differs from run to run.
    """

    cell: int
    scenario: str
    agent: str
    instance: int
    seed: int
    path_length_m: float
    bcp_length_m: float
    path_fraction: float
    weeds_total: int
    weeds_detected: int
    weeds_mowed: int
    seen_fraction: float
    outcome: str
    wall_s: float

    @property
    def task(self) -> Task:
        """What the row answers."""
        return (self.cell, self.agent, self.instance)

    @property
    def path_percent(self) -> float:
        """Way driven, in per cent of the boustrophedon path."""
        return 100.0 * self.path_fraction

    @property
    def mowed_percent(self) -> float:
        """Weeds mowed, in per cent of all; 100 where there are none."""
        return 100.0 * self.weeds_mowed / self.weeds_total if self.weeds_total else 100.0

    @property
    def is_possible(self) -> bool:
        """Whether an episode can have these numbers, whatever was asked."""
        weeds = (self.weeds_total, self.weeds_detected, self.weeds_mowed)
        if any(type(number) is not int for number in (self.cell, self.instance, self.seed, *weeds)):
            return False
        lengths = (self.path_length_m, self.bcp_length_m, self.path_fraction, self.wall_s)
        return (
            all(0 <= number <= self.weeds_total for number in weeds)
            and all(0.0 <= length < math.inf for length in lengths)
            and math.isclose(self.path_fraction * self.bcp_length_m, self.path_length_m, rel_tol=1e-9)
            and 0.0 <= self.seen_fraction <= 1.0
            and isinstance(self.outcome, str)
        )


def add(rows: dict[Task, Row], row: Row) -> bool:
    """Adds a row under its key, once.

    Returns:
        Whether it is new. One that is there already is compared and left out.

    Raises:
        SwathError: If the one that is there says something else: the same episode has gone two ways.
    """
    known = rows.setdefault(row.task, row)
    if replace(known, wall_s=row.wall_s) != row:
        text = f"instance {row.instance} of {row.agent} on {row.scenario} must end one way, got {known} and {row}"
        raise SwathError(text)
    return known is row
