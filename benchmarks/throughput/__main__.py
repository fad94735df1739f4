"""Measures all cases in turn, round by round, and writes `benchmarks/RESULTS.md`, with every run in a CSV beside it.

`make bench` calls it.
"""

from __future__ import annotations

import argparse
import csv
import io
import os
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

from benchmarks.throughput import machine, page
from benchmarks.throughput.case import PASTURES, Case, cases
from benchmarks.throughput.figures import Figures
from benchmarks.throughput.side import MODULES, Limits, Side
from benchmarks.throughput.sides.swath_faces import tape_of

from swath.files import write_whole
from swath.progress import Progress

ROOT = Path(__file__).resolve().parent.parent
OUT = Path("out/bench")
WARM_UP = Limits(0.02, 0.2)


def main() -> None:
    """Measures and writes."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.throughput", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few, short runs, written to out/bench only")
    parser.add_argument("--profile", type=Path, help="text that says where the instructions go, for the page")
    arguments = parser.parse_args()

    # One thread in whatever computes with arrays; the children inherit it.
    os.environ["OMP_NUM_THREADS"] = "1"
    rounds, limits = (2, WARM_UP) if arguments.quick else (5, Limits(0.3, 3.0))
    figures = measure(cases(), rounds, limits)
    folder = OUT if arguments.quick else ROOT
    profile = arguments.profile.read_text() if arguments.profile else None
    command = "make bench QUICK=1" if arguments.quick else "make bench"
    # The page says whether anything is not committed, which is not to be the figures beside it.
    text = page.text(figures, command, profile)
    write_whole(folder / "RESULTS.csv", csv_of(figures))
    write_whole(folder / "RESULTS.md", text)
    print(page.targets(figures))
    print(f"wrote {os.path.relpath(folder / 'RESULTS.md')} and RESULTS.csv beside it")


def measure(wanted: list[Case], rounds: int, limits: Limits) -> Figures:
    """Runs every case once to warm up, and then once a round."""
    OUT.mkdir(parents=True, exist_ok=True)
    figures = Figures(loads=[machine.load()])
    for weeds, length_m, width_m in PASTURES:
        tape = tape_of(weeds, length_m, width_m)
        figures.shares_inside[f"{weeds:,} weeds, {length_m} x {width_m} m"] = tape.share_inside
    with ExitStack() as stack:
        sides = {name: stack.enter_context(Side(name, OUT / f"{name}.log")) for name in MODULES}
        figures.versions = {name: side.versions for name, side in sides.items()}
        progress = stack.enter_context(Progress("runs", len(wanted) * (rounds + 1), is_wanted=True))
        for number in range(rounds + 1):
            for case in wanted:
                if case not in figures.missing:
                    run = sides[case.side].measure(case, limits if number > 0 else WARM_UP)
                    if isinstance(run, str):
                        figures.missing[case] = run
                    elif number > 0:
                        figures.runs.setdefault(case, []).append(run)
                progress.advance(1)
            figures.loads.append(machine.load())
    return figures


def csv_of(figures: Figures) -> str:
    """Every run after the warm-up."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*Case.__dataclass_fields__, "round", "steps", "cpu_s", "wall_s"])
    for case, runs in figures.runs.items():
        for number, run in enumerate(runs, start=1):
            seconds = [f"{run.cpu_s:.6f}", f"{run.wall_s:.6f}"]
            writer.writerow([*asdict(case).values(), number, run.steps, *seconds])
    return text.getvalue()


if __name__ == "__main__":
    main()
