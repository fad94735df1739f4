"""What was measured, and how it is written."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import dataclass, field

from benchmarks.throughput.case import Case

from swath.throughput import Run


@dataclass
class Figures:
    """The runs of every case.

    Attributes:
        runs: The runs of each case that could be measured.
        missing: Why another case could not.
        versions: What each side ran with.
        loads: Load average before the first round and after each.
        shares_inside: Share of the steps of a tape that end on the pasture, by pasture.
    """

    runs: dict[Case, list[Run]] = field(default_factory=dict)
    missing: dict[Case, str] = field(default_factory=dict)
    versions: dict[str, dict[str, str]] = field(default_factory=dict)
    loads: list[float] = field(default_factory=list)
    shares_inside: dict[str, float] = field(default_factory=dict)

    def rates(self, case: Case, *, by_wall: bool = False) -> list[float]:
        """Steps a CPU-second, or a second that passed, of each run, ascending; empty if there is none."""
        runs = self.runs.get(case, [])
        return sorted(run.steps / (run.wall_s if by_wall else run.cpu_s) for run in runs)

    def median(self, case: Case, *, by_wall: bool = False) -> float | None:
        """Median of `rates`."""
        rates = self.rates(case, by_wall=by_wall)
        return statistics.median(rates) if rates else None

    def better(self, *among: Case) -> Case:
        """The case with the higher median; the first of them if none was measured."""
        return max(among, key=lambda case: self.median(case) or 0.0)

    def cell(self, case: Case, *, by_wall: bool = False, write: Callable[[float], str] | None = None) -> str:
        """The median with the lowest and the highest run, or that it was not measured."""
        rates = self.rates(case, by_wall=by_wall)
        if not rates:
            return "not measured"
        write = write or short
        return f"{write(statistics.median(rates))} ({write(rates[0])} to {write(rates[-1])})"

    def ratio(self, ours: Case, theirs: Case) -> str:
        """How many times as fast ours is, by the medians; nothing where the runs overlap."""
        mine, others = self.rates(ours), self.rates(theirs)
        if not mine or not others:
            return "not compared"
        if mine[0] <= others[-1] and others[0] <= mine[-1]:
            return "within the spread"
        return f"{statistics.median(mine) / statistics.median(others):.2f}"


def short(rate: float) -> str:
    """A rate with three digits: 12.3 k, 4.56 M."""
    for size, letter in ((1e6, " M"), (1e3, " k")):
        if rate >= size:
            number = rate / size
            return f"{number:.{max(0, 2 - (number >= 10) - (number >= 100))}f}{letter}"
    return f"{rate:.3g}"
