"""CartPole of Gymnasium: one environment, SyncVectorEnv, and the batch written in NumPy."""

from __future__ import annotations

import time
from typing import Any

import gymnasium as gym
import numpy as np
from benchmarks.throughput.sides.worker import Run, live_steps, serve

ENV_ID = "CartPole-v1"


def measure(case: dict[str, Any]) -> Run:
    """Drives with random actions, drawn before the clock starts."""
    num_envs, enough_s = case["num_envs"], case["enough_s"]
    generator = np.random.default_rng(0)
    if case["face"] == "gym.make":
        return _single(generator.integers(0, 2, 2000).tolist(), enough_s)
    mode = {"SyncVectorEnv": "sync", "vector_entry_point": "vector_entry_point"}[case["face"]]
    vec = gym.make_vec(ENV_ID, num_envs=num_envs, vectorization_mode=mode)
    actions = list(generator.integers(0, 2, (200, num_envs)))
    vec.reset(seed=0)
    live_steps(vec.step, actions[:50], num_envs, 0.0)
    run = live_steps(vec.step, actions, num_envs, enough_s)
    vec.close()
    return run


def _single(actions: list[int], enough_s: float) -> Run:
    env = gym.make(ENV_ID)
    steps = 0
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    env.reset(seed=0)
    while time.process_time() - cpu_s < enough_s:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        steps += len(actions)
    return Run(steps, time.process_time() - cpu_s, time.perf_counter() - wall_s)


if __name__ == "__main__":
    serve(["gymnasium", "numpy"], measure)
