"""The same problem in NumPy, on the same pastures and with the same actions."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from benchmarks.throughput.numpy_env import NumpyMowerRoutingVectorEnv
from benchmarks.throughput.sides.worker import Run, serve

import swath
from swath.throughput import Tape, drive, record


def measure(case: dict[str, Any]) -> Run:
    """Drives a recorded lap of `snake`."""
    num_envs = case["num_envs"]
    tape, weeds_m = lap_of(case["weeds"])
    rows = tape.rows(num_envs)
    vec = NumpyMowerRoutingVectorEnv(num_envs, weeds=case["weeds"])
    replay = (lambda: vec.reset(options={"weeds": weeds_m[rows]})), vec.step, list(tape.actions[:, rows])
    return Run(*drive(replay, num_envs, enough_s=case["enough_s"], most_s=case["most_s"]))


@lru_cache
def lap_of(weeds: int) -> tuple[Tape, npt.NDArray[np.float64]]:
    """The laps on pastures with so many weeds, and where these stand: (pastures, weeds, 2), metres."""
    blocks = {"weeds": {"count": weeds}}
    tape = record(blocks)
    scenario = swath.Scenario(None, weeds={"count": weeds})
    return tape, np.array([swath.run_episode("bcp", scenario=scenario, seed=seed).weeds_m for seed in tape.seeds])


if __name__ == "__main__":
    serve(["numpy", "gymnasium"], measure)
