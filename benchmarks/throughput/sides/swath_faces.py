"""Every way into swath/MowerRouting-v0: one environment, wrapped or not, and the batch."""

from __future__ import annotations

import itertools
import time
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from benchmarks.throughput.sides.worker import Run, serve

from swath.registration import ENV_ID
from swath.throughput import Replay, Tape, drive, record, replay_env, replay_vec

if TYPE_CHECKING:
    from typing import TypeAlias

Env: TypeAlias = "gym.Env[Any, Any]"
Vec: TypeAlias = "gym.vector.VectorEnv[Any, Any, Any]"

_DECISIONS = 300


def measure(case: dict[str, Any]) -> Run:
    """Drives a recorded lap of `snake`, or, with the action kind `target`, to the first choice that is allowed."""
    tape = tape_of(case["weeds"], case["length_m"], case["width_m"])
    blocks = {
        **pasture(case["weeds"], case["length_m"], case["width_m"]),
        "observation": {"kind": case["observation"]},
        "action": {"kind": case["action"]},
    }
    if case["face"] == "make_vec":
        # Named only where they are not as they are by default.
        extra = {} if case["threads"] == 1 and case["copy"] else {"num_threads": case["threads"], "copy": case["copy"]}
        return batch(gym.make_vec(ENV_ID, num_envs=case["num_envs"], **blocks, **extra), tape, case)
    made = gym.make(ENV_ID, **blocks)
    return single(made if case["face"] == "gym.make" else made.unwrapped, tape, case)


def batch(vec: Vec, tape: Tape, case: dict[str, Any]) -> Run:
    """Measures a batch."""
    is_target = case["action"] == "target"
    replay = first_allowed_vec(vec) if is_target else replay_vec(vec, tape, actions_of(case["action"], tape))
    run = drive(replay, vec.num_envs, enough_s=case["enough_s"], most_s=case["most_s"])
    vec.close()
    return Run(*run)


def single(env: Env, tape: Tape, case: dict[str, Any]) -> Run:
    """Measures one environment."""
    if case["face"] == "reset":
        return resets(env, case["enough_s"])
    is_target = case["action"] == "target"
    replay = first_allowed_env(env) if is_target else replay_env(env, tape, actions_of(case["action"], tape)[:, 0])
    return Run(*drive(replay, enough_s=case["enough_s"], most_s=case["most_s"]))


def pasture(weeds: int, length_m: int, width_m: int) -> dict[str, Any]:
    """The blocks of a scenario with such pastures."""
    return {"weeds": {"count": weeds}, "pasture": {"length_m": float(length_m), "width_m": float(width_m)}}


@lru_cache
def tape_of(weeds: int, length_m: int, width_m: int) -> Tape:
    """The laps on such pastures, always the same."""
    return record(pasture(weeds, length_m, width_m))


def actions_of(kind: str, tape: Tape) -> npt.NDArray[Any]:
    """(steps, pastures, ...) The lap in another kind of action."""
    if kind == "drive":
        return np.concatenate([tape.actions, np.ones_like(tape.actions)], axis=-1)
    return nearest_choices(tape.actions[..., 0]) if kind == "discrete" else tape.actions


def nearest_choices(steer: npt.NDArray[np.float32]) -> npt.NDArray[np.int64]:
    """The same turns in five curvatures: each step makes up for what the steps before have turned too little."""
    choices = np.zeros(steer.shape, np.int64)
    owed = np.zeros(steer.shape[1])
    for step, wanted in enumerate(steer):
        owed = owed + wanted
        choices[step] = np.clip(np.rint(2.0 * owed) + 2.0, 0, 4)
        owed -= 0.5 * choices[step] - 1.0
    return choices


def first_allowed_env(env: Env) -> Replay:
    """Takes the first choice that the mask allows: the cheapest known weed, else the cheapest view, else the sweep."""
    mask = np.zeros(1)

    def reset() -> None:
        nonlocal mask
        mask = env.reset()[1]["action_mask"]

    def decide(_: object) -> None:
        nonlocal mask
        _, _, terminated, truncated, info = env.step(int(mask.argmax()))
        mask = info["action_mask"]
        if terminated or truncated:
            reset()

    return reset, decide, range(_DECISIONS)


def first_allowed_vec(vec: Vec) -> Replay:
    """The same in every row of a batch; rows whose episodes end reset themselves."""
    masks = np.zeros((1, 1))

    def reset() -> None:
        nonlocal masks
        masks = vec.reset(seed=0)[1]["action_mask"]

    def decide(_: object) -> None:
        nonlocal masks
        masks = vec.step(masks.argmax(axis=1))[4]["action_mask"]

    return reset, decide, range(_DECISIONS)


def resets(env: Env, enough_s: float) -> Run:
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
