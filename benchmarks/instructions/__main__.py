"""Counts the instructions of fixed programs and compares them with `benchmarks/counts.txt`.

`make bench-count` and `make profile` call it.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.instructions import table
from benchmarks.instructions.callgrind import Counted, count, names

COUNTS = Path(__file__).resolve().parent.parent / "counts.txt"
_ROWS = 16


def main() -> int:
    """Counts, compares and returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.instructions", description=__doc__)
    parser.add_argument("binary", type=Path, help="the built `counted`")
    parser.add_argument("--renew", action="store_true", help="write the counts to the table")
    parser.add_argument("--profile", metavar="NAME", help="print where the instructions of one program go")
    arguments = parser.parse_args()

    if arguments.profile:
        print(profile_text(count(arguments.binary, arguments.profile)))
        return 0
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        counted = list(threads.map(lambda name: count(arguments.binary, name), names(arguments.binary)))
    text, problems = table.compare(counted, table.read(COUNTS))
    if arguments.renew:
        problems = []
        compiler = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True).stdout.strip()
        table.write(COUNTS, counted, compiler)
    flatness, uneven = table.flatness(counted)
    print(f"{text}\n{flatness}")
    for problem in [*problems, *uneven]:
        print(f"FAILED: {problem}")
    if problems:
        print("A change of cost that is meant goes into the table, in the same change: make bench-count RENEW=1")
    return 1 if problems or uneven else 0


def profile_text(counted: Counted) -> str:
    """Where the instructions of a program go, as two tables."""
    profile = counted.profile
    by_file: Counter[str] = Counter()
    for file, instructions in profile.by_file.items():
        by_file[source_name(file)] += instructions
    # What reaches the total is the way from the start of the program to the work.
    by_function = Counter({name: cost for name, cost in profile.by_function.items() if cost < profile.total})
    lines = [f"{counted.name}: {counted.instructions:,} instructions a {counted.unit}"]
    for title, costs in [
        ("lines of this file, inlined or not", by_file),
        ("function and all that it calls", by_function),
    ]:
        lines += ["", f"{'instructions':>12}  {'share':>7}  {title}"]
        for name, cost in costs.most_common(_ROWS):
            lines.append(f"{cost / counted.units:>12,.0f}  {100 * cost / profile.total:>5.1f} %  {name}")
    return "\n".join(lines)


def source_name(file: str) -> str:
    """A source file by its place in the workspace, in a crate or in the standard library."""
    root = f"{COUNTS.parent.parent}/"
    if file.startswith(root):
        return file.removeprefix(root)
    if "/library/" in file:
        return "standard library"
    parts = Path(file).parts
    return f"crate {parts[2]}" if parts[:2] == ("/", "crates") else "system library"


if __name__ == "__main__":
    sys.exit(main())
