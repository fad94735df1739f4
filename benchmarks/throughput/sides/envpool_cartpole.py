"""CartPole of EnvPool: every environment in one batch, one thread."""

from __future__ import annotations

from typing import Any

import envpool
import numpy as np
from benchmarks.throughput.sides.worker import Run, live_steps, serve


def measure(case: dict[str, Any]) -> Run:
    """Drives with random actions, drawn before the clock starts.

    EnvPool steps on a thread of its own while the caller waits. With two threads allowed it still has one, but the two
    need not share a core.
    """
    num_envs = case["num_envs"]
    vec = envpool.make("CartPole-v1", env_type="gymnasium", num_envs=num_envs, num_threads=1, seed=0)
    actions = list(np.random.default_rng(0).integers(0, 2, (200, num_envs)).astype(np.int32))
    vec.reset()
    live_steps(vec.step, actions[:50], num_envs, 0.0)
    run = live_steps(vec.step, actions, num_envs, case["enough_s"])
    vec.close()
    return run


if __name__ == "__main__":
    serve(["envpool", "gymnasium", "numpy"], measure)
