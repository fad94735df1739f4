"""Steps environments here and on a server in turn, beside other ways, and writes `benchmarks/REMOTE.md`.

`make bench-remote` calls it.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from benchmarks.remote import page
from benchmarks.remote.blocks import Pair, drive, timed
from benchmarks.remote.figures import (
    ACTION_BYTES,
    BATCHES,
    FULL,
    PEERS,
    REPLY_BYTES,
    REQUEST_BYTES,
    ROW_BYTES,
    SHORT,
    USUAL,
    Figures,
    Kind,
)
from benchmarks.remote.local import LocalEnv, LocalVecEnv
from benchmarks.remote.server import free_port, serving
from benchmarks.remote.side import Side
from benchmarks.throughput import machine

import swath
import swath.remote
from swath.files import write_whole
from swath.progress import Progress
from swath.registration import ENV_ID
from swath.throughput import Tape, record

# A way to make these steps, which takes so long a step, microseconds, if it can be gone.
Way: TypeAlias = "Callable[[list[Any]], float | None]"
ROOT = Path(__file__).resolve().parent.parent
OUT = Path("out/bench")
# Steps of a block and of a round, by the number of environments. Large batches leave the caches to each other at the
# beginning of a block: it is long enough for that to count for little.
ONE = 100
BLOCK = {1: 100, 64: 40, 1024: 10, 4096: 10}
ROUND = {1: 500, 64: 400, 1024: 200, 4096: 150}
ROUNDS = 40


def main() -> None:
    """Measures and writes."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.remote", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one short round, written to out/bench only")
    arguments = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    figures = measure(rounds=1 if arguments.quick else ROUNDS)
    folder = OUT if arguments.quick else ROOT
    text = page.text(figures, "make bench-remote QUICK=1" if arguments.quick else "make bench-remote")
    write_whole(folder / "REMOTE.md", text)
    print(text)
    print(f"wrote {os.path.relpath(folder / 'REMOTE.md')}")


def measure(rounds: int) -> Figures:
    """Everything once a round, and before that once for nothing."""
    OUT.mkdir(parents=True, exist_ok=True)
    figures = Figures(loads=[machine.load()], rounds=rounds)
    tapes = {kind: record(kind.blocks) for kind in (SHORT, FULL)}
    cases = [(kind, num_envs) for num_envs in BATCHES for kind in (SHORT, FULL)]
    with ExitStack() as stack:
        sides = {name: stack.enter_context(_peer(name)) for name in PEERS}
        echoes = {num_envs: stack.enter_context(_echo(num_envs)) for num_envs in BATCHES}
        sides["echo"] = echoes[1]
        for name, side in sides.items():
            figures.versions |= side.versions
            if side.missing is not None:
                figures.missing[name] = side.missing
        versions = {name: version for name, version in figures.versions.items() if name != "Python"}
        figures.versions = {"Python": figures.versions["Python"], "swath": swath.__version__, **versions}
        progress = stack.enter_context(Progress("cases", (rounds + 1) * (1 + len(cases)), is_wanted=True))
        for number in range(rounds + 1):
            into = figures if number > 0 else Figures()
            # Of each round its own, since processes differ by where the system puts their memory.
            with serving(OUT / "server.log") as endpoint, serving(OUT / "usual.log", USUAL) as usual:
                one_environment(into, sides, (endpoint, usual), tapes[SHORT], ROUND[1] if number > 0 else ONE)
                progress.advance(1)
                for kind, num_envs in cases:
                    steps = ROUND[num_envs] if number > 0 else BLOCK[num_envs]
                    pair = batch(endpoint, kind, tapes[kind], num_envs, steps)
                    known = into.batches.setdefault((kind, num_envs), Pair())
                    known.local_us += pair.local_us
                    known.remote_us += pair.remote_us
                    progress.advance(1)
            for num_envs, side in echoes.items():
                times = into.echoes.setdefault(num_envs, [])
                blocks = (ROUND[num_envs] if number > 0 else BLOCK[num_envs]) // BLOCK[num_envs]
                times += [time_us for _ in range(blocks) if (time_us := side.step_us(BLOCK[num_envs])) is not None]
            figures.missing |= {name: side.missing for name, side in sides.items() if side.missing is not None}
            figures.loads.append(machine.load())
    return figures


def one_environment(
    figures: Figures, sides: dict[str, Side], endpoints: tuple[str, str], tape: Tape, steps: int
) -> None:
    """A block of each way in turn: here, on the server, on the one without low latency, and on those of others."""
    local = LocalEnv(SHORT)
    remotes = [swath.remote.make(ENV_ID, connect=endpoint, infos=SHORT.infos, **SHORT.blocks) for endpoint in endpoints]
    for env in (local, *remotes):
        env.reset(seed=tape.seeds[0])
    own_us = (figures.one.local_us, figures.one.remote_us, figures.usual_us)
    ways: list[tuple[Way, list[float]]] = [
        (partial(timed, env.step), times_us) for env, times_us in zip((local, *remotes), own_us, strict=True)
    ]
    ways += [(partial(_side_us, side), figures.others.setdefault(name, [])) for name, side in sides.items()]
    for start in range(0, steps, ONE):
        actions = list(tape.actions[start : start + ONE, 0])
        for step_us, times_us in ways:
            time_us = step_us(actions)
            if time_us is not None:
                times_us.append(time_us)
        ways.reverse()
    for remote in remotes:
        remote.close()


def batch(endpoint: str, kind: Kind, tape: Tape, num_envs: int, steps: int) -> Pair:
    """The laps of the tape on as many environments here and on the server."""
    rows = tape.rows(num_envs)
    seeds = [tape.seeds[row] for row in rows]
    actions: list[Any] = [np.ascontiguousarray(of_step[rows]) for of_step in tape.actions[:steps]]
    local: Any = LocalVecEnv(num_envs, kind)
    remote: Any = swath.remote.make_vec(ENV_ID, num_envs, connect=endpoint, infos=kind.infos, **kind.blocks)
    local.reset(seed=seeds)
    remote.reset(seed=seeds)
    pair = drive(local.step, remote.step, actions, BLOCK[num_envs])
    local.close()
    remote.close()
    return pair


def _side_us(side: Side, actions: list[Any]) -> float | None:
    return side.step_us(len(actions))


def _peer(name: str) -> Side:
    return Side(name, [str(free_port())], OUT / f"{name}.log", is_peer=True)


def _echo(num_envs: int) -> Side:
    sizes = [REQUEST_BYTES + ACTION_BYTES * num_envs, REPLY_BYTES + ROW_BYTES * num_envs]
    arguments = [f"tcp/127.0.0.1:{free_port()}", *map(str, sizes)]
    return Side("zenoh_echo", arguments, OUT / f"echo-{num_envs}.log", is_peer=False)


if __name__ == "__main__":
    main()
