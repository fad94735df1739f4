"""Plays the trained policies on held-out instances, and writes data and tables.

`make train-learned` trains them and calls it; `python -m benchmarks.learned --tables` writes the tables anew from the
data that is there.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.learned import page
from benchmarks.learned.results import TRAININGS, collect


def main() -> None:
    """Runs everything."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.learned", description=__doc__)
    parser.add_argument("--runs", type=Path, default=Path("out/learned"), help="the trainings (default: %(default)s)")
    parser.add_argument("--to", type=Path, default=Path("agents/learned"), help="data and page (default: %(default)s)")
    parser.add_argument("--instances", type=int, default=50, help="held-out instances (default: %(default)s)")
    parser.add_argument("--tables", action="store_true", help="only write the tables anew")
    arguments = parser.parse_args()
    if not arguments.tables:
        for name in TRAININGS:
            collect(arguments.runs / name, arguments.to / name, arguments.instances)
    page.write(arguments.to / "README.md", arguments.to)
    print(f"wrote {arguments.to / 'README.md'}")


if __name__ == "__main__":
    main()
