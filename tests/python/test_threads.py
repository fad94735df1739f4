"""Threads of a batch: how many there may be, and what becomes of them in another process."""

import os
import subprocess
import sys

import pytest


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_batch_with_threads_goes_on_in_a_process_that_was_forked():
    """A forked process has none of the threads."""
    code = """
import hashlib, os, signal, gymnasium as gym, numpy as np, swath
envs = gym.make_vec("swath/MowerRouting-v0", num_envs=256, num_threads=2)
envs.reset(seed=1)
actions = np.zeros((256, 1), np.float32)
envs.step(actions)
child = os.fork()
if child == 0:
    signal.alarm(20)
rewards = envs.step(actions)[1]
os.write(1, hashlib.sha256(rewards).hexdigest().encode() + b"\\n")
if child == 0:
    os._exit(0)
assert os.waitpid(child, 0)[1] == 0
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    one, other = run.stdout.split()
    assert one == other


@pytest.mark.skipif(sys.platform != "linux", reason="it reads how much a process uses from /proc")
def test_more_threads_than_the_system_can_start_are_refused_by_name():
    """Address space is left for some threads, whose stacks take 2 MiB each, and not for 1,000."""
    code = """
import resource, swath
small = {"pasture": {"length_m": 10.0, "width_m": 10.0}, "weeds": {"count": 1}, "observation": {"kind": "maps"}}
swath.MowerRoutingVectorEnv(4096, num_threads=2, **small)
used_b = 4096 * int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (used_b + (1 << 29), resource.RLIM_INFINITY))
for refused in [
    lambda: swath.MowerRoutingVectorEnv(4096, num_threads=1000, **small),
    lambda: swath.evaluate("bcp", instances=2000, jobs=2000),
]:
    try:
        refused()
    except swath.ConfigError as error:
        print(error)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.stdout.splitlines() == [
        "`num_threads` must be as many as the system can start, got 1000",
        "`jobs` must be as many as the system can start, got 2000",
    ], run.stderr
