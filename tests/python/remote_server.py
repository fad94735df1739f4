"""A server of swath in a process of its own, and what its environments are held against."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

TARGET = Path(os.environ.get("CARGO_TARGET_DIR", Path(__file__).parents[2] / "target"))
SERVER = TARGET / "debug/swath-server"

SHORT = {"episode": {"budget": 0.01}, "pasture": {"headland_m": 2.0}}

needs_server = pytest.mark.skipif(not SERVER.exists(), reason="needs the server: `make server` builds it")


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
        return port


class Server:
    """A server process on a free port."""

    def __init__(self, *flags: str, name: str = "default", log: Path | None = None) -> None:
        self.name = name
        self.log = log
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.flags = flags
        self.start()

    def start(self) -> None:
        command = [str(SERVER), "--listen", self.endpoint, "--name", self.name, *self.flags]
        with (self.log or Path(os.devnull)).open("a") as log:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line == f"swath-server ready: {self.endpoint} {self.name}\n", line

    def end(self, how: signal.Signals = signal.SIGTERM) -> int:
        if self.process.poll() is None:
            self.process.send_signal(how)
        status = self.process.wait(10)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return status


def actions_for(vec, rng):
    space = vec.single_action_space
    if isinstance(space, gym.spaces.Discrete):
        return rng.integers(0, 3, vec.num_envs)
    return rng.uniform(-1, 1, (vec.num_envs, *space.shape)).astype(np.float32)


def same(one, other):
    """Tells whether two results hold the same bits, types and shapes."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray) and one.dtype == object:
        return one.shape == other.shape and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    return type(one) is type(other) and one == other
