"""Remote environments are the local ones, bit for bit, for as long as anybody steps them."""

from __future__ import annotations

from hashlib import sha256

import gymnasium as gym
import numpy as np
import pytest
from remote_server import Server, needs_server

import swath
from swath.registration import ENV_ID

pytestmark = needs_server

NUM_ENVS = 250


def digest(result):
    """A hash of everything that a step returned: names, types, shapes and bits."""
    found = sha256()

    def take_in(part):
        if isinstance(part, dict):
            for name in part:
                found.update(name.encode())
                take_in(part[name])
        elif isinstance(part, tuple | list):
            for item in part:
                take_in(item)
        elif isinstance(part, np.ndarray) and part.dtype != object:
            found.update(f"{part.dtype}{part.shape}".encode())
            found.update(part.tobytes())
        elif isinstance(part, np.ndarray):
            for item in part.ravel():
                take_in(item)
        else:
            found.update(repr(part).encode())

    take_in(result)
    return found.digest()


@pytest.mark.parametrize(
    "steps",
    [
        pytest.param(100_000, id="100000"),
        pytest.param(1_000_000, id="1000000", marks=[pytest.mark.slow, pytest.mark.timeout(600)]),
    ],
)
def test_local_and_remote_are_equal_over_as_many_environment_steps(steps):
    blocks = {"episode": {"budget": 0.05}, "weeds": {"count": 40}}
    servers = [Server("--allow-snapshot"), Server("--allow-snapshot")]
    here = gym.make_vec(ENV_ID, num_envs=NUM_ENVS, **blocks).unwrapped
    far = swath.remote.make_vec(ENV_ID, NUM_ENVS, connect=[server.endpoint for server in servers], **blocks)
    assert digest(here.reset(seed=1)) == digest(far.reset(seed=1))
    rng = np.random.default_rng(1)
    ended = 0
    for _ in range(steps // NUM_ENVS):
        actions = rng.uniform(-1, 1, (NUM_ENVS, 1)).astype(np.float32)
        one, other = here.step(actions), far.step(actions)
        assert digest(one) == digest(other)
        ended += int((one[2] | one[3]).sum())
    assert ended > steps // 1000, "episodes ended and began anew on the way"
    assert here.snapshot() == far.snapshot()
    far.close()
    for server in servers:
        server.end()
