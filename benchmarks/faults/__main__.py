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
_MACHINES, _ZENOH, _PYTHON = "cargo test -p swath-tests", "cargo test -p swath-server", "pytest tests/python"
COVERED = (
    (
        "whatever becomes of messages, each request is carried out once, and each client sees its replies",
        (f"{_MACHINES} --test exactly_once", f"{_ZENOH} --test over_zenoh exactly_once"),
    ),
    (
        "bytes that are no request are refused by name; nothing changes, and nothing of them is kept",
        (f"{_MACHINES} --test wire_garbage", f"{_ZENOH} --test over_zenoh hostile"),
    ),
    (
        "servers and clients may be killed and stopped: the others are told so or go on, and places become free",
        (f"{_ZENOH} --test over_zenoh kills",),
    ),
    (
        "who is not listed, or has no certificate of the authority, gets nowhere, through a router too",
        (f"{_ZENOH} --test over_zenoh access", f"{_PYTHON}/test_two_machines.py"),
    ),
    ("a million environment steps on two servers are those here, to the bit", (f"{_PYTHON}/test_remote_bits.py",)),
    ("PPO learns on two servers what it learns here", (f"{_PYTHON}/test_remote.py",)),
    (
        "environments of Python are resumed at a server that was started anew, in the middle of a training too",
        (f"{_PYTHON}/test_remote_faults.py",),
    ),
    (
        "a rollout worker that is killed, or whose server is, goes on and keeps each episode once",
        (f"{_PYTHON}/test_worker.py",),
    ),
    (
        "sweeps on Ray with killed workers have the rows of the local one; RLlib learns through servers as here",
        ("make test-ray",),
    ),
)
MEASURED = re.compile(r"\bmeasured: (.*)")
SEEDS = re.compile(r"seed \d+: ")


def covered() -> str:
    """What is promised, and which command looks after it."""
    lines = ["## What covers what", "", "`make test-faults` runs all of it, and writes this page if all passes.", ""]
    lines += ["| promise | command |", "| --- | --- |"]
    for promise, commands in COVERED:
        lines.append(f"| {promise} | {', '.join(f'`{command}`' for command in commands)} |")
    return "\n".join(lines) + "\n"


def main(logs: list[str]) -> None:
    """Writes the page."""
    lines = [found for log in logs for found in MEASURED.findall(Path(log).read_text())]
    if not lines:
        sys.exit(f"benchmarks.faults: nothing was measured in {', '.join(logs)}")
    rows = machine.describe("make test-faults", {"swath": version("swath")})
    table = "\n".join(["|  |  |", "| --- | --- |", *(f"| {name} | {value} |" for name, value in rows)])
    found = "\n".join(f"- {line}" for line in lines if not SEEDS.match(line))
    PAGE.write_text(f"# Faults\n\n{table}\n\n{INTRODUCTION}\n{found}\n\n{covered()}")
    sys.stdout.write(f"{found}\n\nwritten to {PAGE.relative_to(machine.ROOT)}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
