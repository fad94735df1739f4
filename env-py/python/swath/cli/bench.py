"""`swath bench`."""

from __future__ import annotations

import json
import statistics
from typing import Annotated

import gymnasium as gym
import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from swath._native import VERSION
from swath.cli.options import AsJson
from swath.cli.stop import Stopped
from swath.errors import ConfigError
from swath.evaluation.table import print_whole
from swath.progress import Progress
from swath.registration import ENV_ID
from swath.throughput import Run, Tape, drive, record, replay_env, replay_vec

__all__ = ["bench"]

RUNS = 5
ENOUGH_S, MOST_S = 0.2, 2.0
WEEDS = {"count": 160}


def bench(
    *,
    num_envs: Annotated[str, typer.Option(help="Sizes of batches with commas between.")] = "1,8,64,256,1024",
    observation: Annotated[str, typer.Option(help="Kind of the observation.")] = "features",
    as_json: AsJson = False,
) -> None:
    """Measure how many steps this machine makes a second, in one environment and in batches.

    The pasture is 100 x 40 m with 160 weeds; the mowers drive laps of snake that were recorded before the clock starts.
    """
    sizes = _sizes(num_envs)
    tape = record({"weeds": WEEDS})
    ways = ["unwrapped", "gym.make", *["make_vec"] * len(sizes)]
    cases = list(zip(ways, [1, 1, *sizes], strict=True))
    runs: dict[tuple[str, int], list[Run]] = {case: [] for case in cases}
    try:
        with Progress("runs", len(cases) * (RUNS + 1), is_wanted=True) as progress:
            # In turn, so that what else happens on the machine happens to all of them.
            for number in range(RUNS + 1):
                for case in cases:
                    run = _measure(*case, observation, tape)
                    if number > 0:
                        runs[case].append(run)
                    progress.advance(1)
    except KeyboardInterrupt:
        raise Stopped("stopped: nothing was kept") from None  # noqa: TRY003
    typer.echo(_json(runs, observation, tape) if as_json else _table(runs, observation, tape), nl=False)


def _sizes(text: str) -> list[int]:
    sizes = [int(part) if part.strip().isdecimal() else 0 for part in text.split(",")]
    if min(sizes) < 1 or len(set(sizes)) < len(sizes):
        message = f"`num_envs` must be different whole numbers from 1 with commas between, got {text}"
        raise ConfigError(message)
    return sizes


def _measure(way: str, num_envs: int, observation: str, tape: Tape) -> Run:
    kind = {"kind": observation}
    if way == "make_vec":
        vec = gym.make_vec(ENV_ID, num_envs=num_envs, weeds=WEEDS, observation=kind)
        run = drive(replay_vec(vec, tape), num_envs, enough_s=ENOUGH_S, most_s=MOST_S)
        vec.close()
        return run
    env = gym.make(ENV_ID, weeds=WEEDS, observation=kind)
    return drive(replay_env(env if way == "gym.make" else env.unwrapped, tape), enough_s=ENOUGH_S, most_s=MOST_S)


def _table(runs: dict[tuple[str, int], list[Run]], observation: str, tape: Tape) -> str:
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("through")
    for name in ["environments", "steps per CPU-second", "lowest", "highest", "steps per second"]:
        table.add_column(name, justify="right")
    for (way, num_envs), measured in runs.items():
        rates = sorted(run.per_cpu_s for run in measured)
        by_wall = statistics.median(run.steps / run.wall_s for run in measured)
        numbers = [statistics.median(rates), rates[0], rates[-1], by_wall]
        table.add_row(way, str(num_envs), *(f"{number:,.0f}" for number in numbers))
    return print_whole(table) + (
        f"medians of {RUNS} runs; observation {observation}, action steer, 160 weeds on 100 x 40 m, "
        f"{100 * tape.share_inside:.1f} % of the steps end on the pasture\n"
    )


def _json(runs: dict[tuple[str, int], list[Run]], observation: str, tape: Tape) -> str:
    results = [
        {
            "through": way,
            "num_envs": num_envs,
            "steps_per_cpu_s": statistics.median(run.per_cpu_s for run in measured),
            "runs": [run._asdict() for run in measured],
        }
        for (way, num_envs), measured in runs.items()
    ]
    told = {"version": VERSION, "observation": observation, "share_inside": tape.share_inside, "results": results}
    return json.dumps(told, indent=2) + "\n"
