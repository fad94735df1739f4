"""Every way into swath/MowerRouting-v0: one environment, wrapped or not, and the batch."""

from __future__ import annotations

import itertools
import time
from functools import lru_cache
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from benchmarks.throughput.sides.worker import Run, serve

from swath.throughput import ENV_ID, Blocks, Replay, Tape, drive, record, replay_env, replay_vec

_DECISIONS = 300


def measure(case: dict[str, Any]) -> Run:
    """Drives a recorded lap of `snake`, or, with the action kind `target`, to the first choice that is allowed."""
    blocks: Blocks = {
        "weeds": {"count": case["weeds"]},
        "pasture": {"length_m": float(case["length_m"]), "width_m": float(case["width_m"])},
    }
    num_envs, action = case["num_envs"], case["action"]
    tape = tape_of(case["weeds"], case["length_m"], case["width_m"])
    kinds: Blocks = {"observation": {"kind": case["observation"]}, "action": {"kind": action}}
    if case["face"] == "make_vec":
        extra = {} if case["threads"] == 1 and case["copy"] else {"num_threads": case["threads"], "copy": case["copy"]}
        env: Any = gym.make_vec(ENV_ID, num_envs=num_envs, **blocks, **kinds, **extra)
        replay = replay_vec(env, tape, actions_of(action, tape))
    else:
        env = gym.make(ENV_ID, **dict(blocks), **dict(kinds))
        if case["face"] != "gym.make":
            env = env.unwrapped
        actions = actions_of(action, tape)
        replay = replay_env(env, tape, None if actions is None else actions[:, 0])
    if case["face"] == "reset":
        return resets(env, case["enough_s"])
    if action == "target":
        replay = first_allowed(env, replay)
    run = drive(replay, num_envs, enough_s=case["enough_s"], most_s=case["most_s"])
    env.close()
    return Run(*run)


@lru_cache
def tape_of(weeds: int, length_m: int, width_m: int) -> Tape:
    """The laps on such pastures, always the same."""
    return record({"weeds": {"count": weeds}, "pasture": {"length_m": float(length_m), "width_m": float(width_m)}})


def actions_of(kind: str, tape: Tape) -> npt.NDArray[Any] | None:
    """The lap in another kind of action; None where it is as recorded."""
    if kind == "drive":
        return np.concatenate([tape.actions, np.ones_like(tape.actions)], axis=-1)
    if kind == "discrete":
        return nearest_choices(tape.actions[..., 0])
    return None


def nearest_choices(steer: npt.NDArray[np.float32]) -> npt.NDArray[np.int64]:
    """The same turns in five curvatures: each step makes up for what the steps before have turned too little."""
    choices = np.zeros(steer.shape, np.int64)
    owed = np.zeros(steer.shape[1])
    for step, wanted in enumerate(steer):
        owed = owed + wanted
        choices[step] = np.clip(np.rint(2.0 * owed) + 2.0, 0, 4)
        owed -= 0.5 * choices[step] - 1.0
    return choices


def first_allowed(env: Any, replay: Replay) -> Replay:
    """Takes the first choice that the mask allows: the cheapest known weed, else the cheapest view, else the sweep."""
    begin, step, _ = replay
    is_batch = isinstance(env, gym.vector.VectorEnv)
    choice: Any = 0

    def reset() -> None:
        nonlocal choice
        _, info = begin() if is_batch else env.reset()  # type: ignore[misc]
        choice = info["action_mask"].argmax(axis=-1)

    def decide(_: object) -> None:
        nonlocal choice
        _, _, terminated, truncated, info = step(choice)  # type: ignore[misc]
        choice = info["action_mask"].argmax(axis=-1)
        if not is_batch and (terminated or truncated):
            reset()

    return reset, decide, range(_DECISIONS)


def resets(env: Any, enough_s: float) -> Run:
    """Resets to one seed after another."""
    seeds = itertools.count()
    done = 0
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    while time.process_time() - cpu_s < enough_s:
        for seed in itertools.islice(seeds, 100):
            env.reset(seed=seed)
        done += 100
    return Run(done, time.process_time() - cpu_s, time.perf_counter() - wall_s)


if __name__ == "__main__":
    serve(["swath", "gymnasium", "numpy"], measure)
