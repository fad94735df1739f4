"""The figures as a page."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence

from benchmarks.remote.blocks import interval, spread
from benchmarks.remote.figures import BATCHES, FULL, PEERS, SHORT, USUAL, Figures
from benchmarks.throughput import machine

_METHOD = """\
All processes are on one machine and speak over the loopback; the server is the release build with its defaults, and for
one environment a second one beside it runs with `--low-latency=off`.
Local and remote environments drive the same tape, laps of `snake` on 16 pastures with 160 weeds, block by block
in turn, and who begins takes turns too; row i of a batch is on pasture i modulo 16.
A step is a call of `step` in Python, with all that it returns; a figure is the median over blocks, with the quartiles.
Each round has servers of its own. The interval of a target's figure is that of the median, by bootstrap over whole
rounds; it tells of the machine as it was in these minutes, and at another hour it may be another.
What the wire adds is the median of the differences between a remote block and the local block beside it, divided by the
number of environments. Local batches step on one thread, and so do those on the server.
Local environments have the same Python around them as remote ones, and form no infos where those send none.

For the peers an environment that simulates nothing returns the same 32 floats, a reward and its flags, so theirs is the
time of the way alone, while swath's holds its simulation. Each has client and server of its own, in Python, in an
environment of its own: dm_env_rpc with `DmEnvAdaptor`, OpenEnv with its asynchronous WebSocket client.
Zenoh alone is a `get` from Python with as many bytes as a step and its reply, answered by Python, on Zenoh's own
threads. swath's client waits awake where answers are quick, as it always does, and so does its server after a brief
step; the others sleep until they are woken. A block of one environment comes after the blocks of other ways, during
which both its ends slept, and begins slowly; a block of a batch of 1 comes after a short local one.
"""


def text(figures: Figures, command: str) -> str:
    """The whole page."""
    sections = [
        ("# Remote environments", _machine(figures, command)),
        ("## Targets", targets(figures)),
        ("## One environment", _one(figures)),
        ("## What the wire adds", _batches(figures)),
        ("## How it is measured", _METHOD),
        ("## Not compared", "\n".join(f"- {name}: {reason}" for name, reason in figures.missing.items())),
    ]
    return "\n".join(f"{title}\n\n{body.strip()}\n" for title, body in sections if body)


def targets(figures: Figures) -> str:
    """What was promised, what was measured, and whether that is enough."""
    rows = []
    for usual, how in ((False, ""), (True, f", `{USUAL}`")):
        for peer, name in PEERS.items():
            shares = figures.shares_of(peer, usual=usual)
            rows.append(_row(f"one remote environment's step, of {name}'s{how}", 0.5, shares, figures.rounds, ""))
    for num_envs, most_us in ((1024, 0.5), (4096, 0.3)):
        what = f"what the wire adds to an environment's step, batch of {num_envs}, {SHORT.name}"
        rows.append(_row(what, most_us, figures.added_us(SHORT, num_envs), figures.rounds, " us"))
    return _table(["", "at most", "measured", "95 % interval", ""], rows)


def _row(what: str, most: float, blocks: Sequence[float], rounds: int, unit: str) -> list[str]:
    if not blocks:
        return [what, f"{most}{unit}", "-", "-", "not compared"]
    measured, likely = statistics.median(blocks), interval(blocks, rounds)
    verdict, between = "met" if measured <= most else "**missed**", "-"
    if likely is not None:
        between = f"{likely[0]:.3f} to {likely[1]:.3f}"
        if likely[0] <= most < likely[1]:
            verdict += ", not beyond doubt"
    return [what, f"{most}{unit}", f"{measured:.3f}{unit}", between, verdict]


def _machine(figures: Figures, command: str) -> str:
    loads = ", ".join(f"{load:.2f}" for load in figures.loads)
    rows = machine.describe(command, figures.versions)
    return _table(["", ""], [*rows, ("load average", f"{loads} (before, and after each round)")])


def _one(figures: Figures) -> str:
    rows = [
        ["swath, local", _cell(figures.one.local_us), "", ""],
        ["swath, remote", _cell(figures.one.remote_us), "", ""],
        [f"swath, remote, `{USUAL}`", _cell(figures.usual_us), "", ""],
    ]
    pairs = zip(figures.one.remote_us, figures.usual_us, strict=True)
    rows[1][-1] = f"{statistics.median(own / usual for own, usual in pairs):.2f}"
    for other, name in {"echo": "Zenoh alone", **PEERS}.items():
        shares = [figures.shares_of(other, usual=usual) for usual in (False, True)]
        ratios = [f"{statistics.median(of_blocks):.2f}" if of_blocks else "not compared" for of_blocks in shares]
        rows.append([name, _cell(figures.others.get(other, [])), *ratios])
    head = ["32 floats, no infos", "a step, us", "swath, remote, by this", f"`{USUAL}`, by this"]
    return _table(head, rows)


def _batches(figures: Figures) -> str:
    rows = []
    for num_envs in BATCHES:
        for kind in (SHORT, FULL):
            pair = figures.batches[kind, num_envs]
            first, middle, third = spread(figures.added_us(kind, num_envs))
            added = f"{middle:.3f} ({first:.3f} to {third:.3f})"
            echo = _cell(figures.echoes.get(num_envs, [])) if kind is SHORT else ""
            rows.append([str(num_envs), kind.name, _cell(pair.local_us), _cell(pair.remote_us), added, echo])
    head = ["environments", "a step tells", "local, us", "remote, us", "added, us per environment", "Zenoh alone, us"]
    return _table(head, rows)


def _cell(times_us: Sequence[float]) -> str:
    if len(times_us) < 2:
        return "not measured"
    first, middle, third = spread(times_us)
    return f"{middle:.1f} ({first:.1f} to {third:.1f})"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
