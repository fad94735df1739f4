"""`python -m benchmarks.faults LOG ...`: collects what tests print as `measured: ...` in benchmarks/FAULTS.md."""

from __future__ import annotations

import re
import sys
from importlib.metadata import version
from pathlib import Path

from benchmarks.throughput import machine

PAGE = machine.ROOT / "benchmarks/FAULTS.md"
INTRODUCTION = """\
Servers and clients are killed and stopped, and messages are lost, doubled, delayed, damaged and made up.
Each line is what a test has measured; a test that does not keep its promise fails, and then there is no page.
The server and the tests are debug builds on one machine: nothing here is about speed.
"""
MEASURED = re.compile(r"\bmeasured: (.*)")
SEEDS = re.compile(r"seed \d+: ")


def main(logs: list[str]) -> None:
    """Writes the page."""
    lines = [found for log in logs for found in MEASURED.findall(Path(log).read_text())]
    if not lines:
        sys.exit(f"benchmarks.faults: nothing was measured in {', '.join(logs)}")
    rows = machine.describe("make test-faults", {"swath": version("swath")})
    table = "\n".join(["|  |  |", "| --- | --- |", *(f"| {name} | {value} |" for name, value in rows)])
    found = "\n".join(f"- {line}" for line in lines if not SEEDS.match(line))
    PAGE.write_text(f"# Faults\n\n{table}\n\n{INTRODUCTION}\n{found}\n")
    sys.stdout.write(f"{found}\n\nwritten to {PAGE.relative_to(machine.ROOT)}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
