"""Plays every agent of the registry on fixed instances, and writes page and data.

`make league` calls it. A stopped run goes on where it stopped, as long as the build is the same.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from benchmarks.league import page
from benchmarks.league.parts import PARTS, QUICK, agents, play, write
from benchmarks.throughput.machine import describe

import swath
from swath.files import write_whole


def main() -> None:
    """Plays everything."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.league", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/league"), help="finished episodes (default: %(default)s)")
    parser.add_argument("--to", type=Path, default=Path("benchmarks"), help="page and data (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=None, help="threads (default: all cores)")
    parser.add_argument("--fewer", type=int, default=1, help="divides the number of instances (default: %(default)s)")
    parser.add_argument("--only", nargs="*", choices=[part.name for part in PARTS], help="some parts (default: all)")
    parser.add_argument("--quick", action="store_true", help="two cells and the field, page and data in --out")
    arguments = parser.parse_args()

    command = "make league" + (" QUICK=1" if arguments.quick else "")
    command += f" FEWER={arguments.fewer}" if arguments.fewer > 1 else ""
    command += f" ONLY='{' '.join(arguments.only)}'" if arguments.only else ""
    chosen = [part for part in (QUICK if arguments.quick else PARTS) if part.name in (arguments.only or [part.name])]
    parts = [replace(part, instances=max(2, part.instances // arguments.fewer)) for part in chosen]
    facts = describe(command, {"swath": swath.__version__})
    played, wall_s = play(parts, arguments.out, arguments.jobs)
    facts.append(("time", f"{wall_s / 60:.0f} min for all episodes, one after another"))
    folder = arguments.out if arguments.quick else arguments.to
    write(folder / "LEAGUE.csv", played)
    write_whole(folder / "LEAGUE.md", page.text(played, agents(), facts))
    print(f"wrote {folder / 'LEAGUE.md'}")


if __name__ == "__main__":
    main()
