"""Runs the counted programs under callgrind and reads what it wrote."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

# Callgrind counts inside of this function of `benchmarks/src/bin/counted.rs`.
COLLECTS = "*swath_collects*"

_SUBPOSITION = re.compile(r"(fl|fi|fe|fn|cfi|cfl|cfn|ob|cob)=\((\d+)\)(?: (.*))?")
_COST = re.compile(r"(?:\+\d+|-\d+|\d+|\*) (\d+)$")


@dataclass
class Profile:
    """Where the instructions of a program went.

    Attributes:
        total: All of them.
        by_file: Instructions of the lines of each source file, wherever the compiler put them.
        by_function: Instructions of each function that was not inlined, with all that it called.
    """

    total: int
    by_file: Counter[str] = field(default_factory=Counter)
    by_function: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class Counted:
    """A program that has run.

    Attributes:
        name: Its name.
        units: How many times it did its work.
        unit: What it did, such as `step`.
        profile: Where its instructions went.
    """

    name: str
    units: int
    unit: str
    profile: Profile

    @property
    def instructions(self) -> int:
        """Instructions of one unit."""
        return round(self.profile.total / self.units)


def names(binary: Path) -> list[str]:
    """The programs that `binary` can run."""
    return _run([str(binary)]).split()


def count(binary: Path, name: str) -> Counted:
    """Runs one program under callgrind."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / "callgrind.out"
        options = ["--tool=callgrind", f"--toggle-collect={COLLECTS}", f"--callgrind-out-file={out}"]
        units, unit = _run(["valgrind", *options, str(binary), name]).rstrip("\n").split("\t")
        return Counted(name, int(units), unit, read(out.read_text()))


def read(text: str) -> Profile:
    """Reads a file in callgrind's format, with positions of lines and one event.

    A line of costs counts for the file named last (`fl`, or `fi` and `fe` around inlined code) and the function named
    last.
    The line after `calls=` is what the call cost in all: it counts for the callee, and once more for the caller.
    """
    profile = Profile(0)
    names: dict[tuple[str, str], str] = {}
    at = {"file": "", "function": "", "callee": ""}
    is_call = False
    for line in text.splitlines():
        if line.startswith("calls="):
            is_call = True
        elif named := _SUBPOSITION.match(line):
            kind, number, name = named.groups()
            role = {"fn": "function", "cfn": "callee", "fl": "file", "fi": "file", "fe": "file"}.get(kind)
            space = "function" if kind in ("fn", "cfn") else "object" if kind in ("ob", "cob") else "file"
            if name is not None:
                names[space, number] = name
            if role is not None:
                at[role] = names[space, number]
        elif cost := _COST.fullmatch(line):
            instructions = int(cost[1])
            if is_call:
                # What a function that calls itself costs is in the cost of its first call already.
                profile.by_function[at["function"]] += instructions if at["callee"] != at["function"] else 0
            else:
                profile.by_file[at["file"]] += instructions
                profile.by_function[at["function"]] += instructions
            is_call = False
        elif line.startswith("totals: "):
            profile.total = int(line.removeprefix("totals: "))
    return profile


def _run(command: list[str]) -> str:
    # No environment: its strings lie on the stack and move what comes after them.
    executable = shutil.which(command[0])
    done = subprocess.run(command, executable=executable, capture_output=True, text=True, env={}, check=False)
    if done.returncode != 0:
        text = f"{' '.join(command)} failed:\n{done.stderr}"
        raise RuntimeError(text)
    return done.stdout
