"""The committed counts, and the rules that counts must keep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.instructions.callgrind import Counted

BAND = 0.05
"""A count may be this share away from the committed one, either way."""

FLATNESS = 1.15
"""A step over known ground is to cost at most so many times as much on one of two pastures as on the other."""

ALIKE = [
    ("known/40-weeds", "known/10000-weeds", FLATNESS),
    ("wide/40-weeds", "wide/10000-weeds", 1.4),
    ("drive/40-weeds", "drive/10000-weeds", 1.3),
    ("drive-wide/40-weeds", "drive-wide/10000-weeds", 1.3),
    ("known/160-weeds", "known/1000x400-m", FLATNESS),
]
"""Programs whose steps find and mow nothing, and what the dearer one may cost until `FLATNESS` is reached: among
few and among many weeds, round the tightest circle and round one twice as wide, with the observation and without;
and on a small and a large pasture."""

_HEADER = """\
# Instructions of one unit of each program of benchmarks/src/bin/counted.rs, as callgrind counts them.
# `make bench-count` fails where a count is more than 5 % away from this table; with RENEW=1 it writes the table anew.
# Counted with {compiler}.
"""


def read(file: Path) -> dict[str, int]:
    """The committed count of every program."""
    lines = file.read_text().splitlines() if file.exists() else []
    rows = [line.split() for line in lines if not line.startswith("#")]
    return {name: int(instructions) for name, instructions, *_ in rows}


def write(file: Path, counted: Sequence[Counted], compiler: str) -> None:
    """Commits counts."""
    width = max(len(one.name) for one in counted)
    rows = [f"{one.name:{width}}  {one.instructions:>12}  {one.unit}\n" for one in counted]
    temporary = file.with_suffix(".tmp")
    temporary.write_text(_HEADER.format(compiler=compiler) + "".join(rows))
    temporary.replace(file)


def compare(counted: Sequence[Counted], committed: dict[str, int]) -> tuple[str, list[str]]:
    """Measured beside committed counts, and what is wrong with them."""
    width = max(len(one.name) for one in counted)
    lines = [f"{'program':{width}}  {'instructions':>12}  {'committed':>12}  {'change':>8}  unit"]
    problems = []
    for one in counted:
        was = committed.get(one.name)
        change = "new" if was is None else f"{100 * (one.instructions / was - 1):+.2f} %"
        lines.append(f"{one.name:{width}}  {one.instructions:>12,}  {was or 0:>12,}  {change:>8}  {one.unit}")
        if was is None:
            problems.append(f"{one.name} is not in the table")
        elif abs(one.instructions - was) > BAND * was:
            problems.append(f"{one.name}: {change} is outside of the band of {100 * BAND:.0f} % either way")
    gone = sorted(set(committed) - {one.name for one in counted})
    problems += [f"{name} is in the table, but there is no such program" for name in gone]
    return "\n".join(lines), problems


def flatness(counted: Sequence[Counted]) -> tuple[str, list[str]]:
    """How much the cost of a step over known ground depends on the pasture, and whether that is too much."""
    instructions = {one.name: one.instructions for one in counted}
    lines, problems = [], []
    for one, other, gate in ALIKE:
        if missing := {one, other} - instructions.keys():
            problems.append(f"{' and '.join(sorted(missing))} did not run, so {one} and {other} cannot be compared")
            continue
        cheap, dear = sorted([one, other], key=lambda name: instructions[name])
        ratio = instructions[dear] / instructions[cheap]
        verdict = "met" if ratio <= FLATNESS else "MISSED"
        text = f"a step over known ground: {dear} takes {ratio:.3f} times {cheap}"
        lines.append(f"{text}; target {FLATNESS}: {verdict}, gate {gate}")
        if ratio > gate:
            problems.append(lines[-1])
    return "\n".join(lines), problems
