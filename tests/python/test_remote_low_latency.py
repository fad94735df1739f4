"""Servers that offer Zenoh's low-latency transport: steps of few environments go by it, and nothing else changes."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
import time

import gymnasium as gym
import numpy as np
import pytest
from remote_server import SHORT, Server, actions_for, needs_server, same

import swath
from swath.registration import ENV_ID
from swath.remote.watch import Watch

pytestmark = needs_server


@pytest.fixture
def server():
    server = Server("--allow-snapshot", "--low-latency", "--grace-ms", "500")
    yield server
    server.end(signal.SIGKILL)


def is_by_low_latency(far):
    return [link._steps is not None for link in far._batch._links]


def pair(server, num_envs, **arguments):
    """Environments here and on the server that have begun."""
    here = gym.make_vec(ENV_ID, num_envs=num_envs, **SHORT)
    far = swath.remote.make_vec(ENV_ID, num_envs, connect=server.endpoint, **arguments, **SHORT)
    assert same(here.reset(seed=3), far.reset(seed=3))
    return here, far


def step_both(here, far, steps):
    rng = np.random.default_rng(0)
    for _ in range(steps):
        actions = actions_for(here, rng)
        assert all(map(same, here.step(actions), far.step(actions)))


@pytest.mark.parametrize(("num_envs", "is_so"), [(1, True), (64, True), (512, False)])
def test_few_environments_are_stepped_by_low_latency_and_many_are_not_with_the_same_bits(server, num_envs, is_so):
    here, far = pair(server, num_envs)
    assert is_by_low_latency(far) == [is_so]
    step_both(here, far, 100)
    assert is_by_low_latency(far) == [is_so]
    far.close()


def test_a_server_that_does_not_offer_it_is_asked_as_ever(server):
    usual = Server()
    far = swath.remote.make_vec(ENV_ID, 2, connect=[usual.endpoint, server.endpoint])
    assert is_by_low_latency(far) == [False, True]
    far.reset(seed=0)
    far.step(np.zeros((2, 1), np.float32))
    far.close()
    usual.end()


def test_a_snapshot_that_is_too_long_for_low_latency_goes_here_and_there(server):
    blocks = {"pasture": {"width_m": 400.0, "length_m": 1000.0}, "weeds": {"count": 4000}}
    here = gym.make(ENV_ID, **blocks).unwrapped
    far = swath.remote.make(ENV_ID, connect=server.endpoint, **blocks)
    here.reset(seed=0)
    far.reset(seed=0)
    for _ in range(20):
        assert all(map(same, here.step([0.1]), far.step([0.1])))
    snapshot = far.snapshot()
    assert len(snapshot) > 64 << 10
    assert snapshot == here.snapshot()
    far.reset(seed=1)
    far.restore(snapshot)
    assert all(map(same, here.step([0.2]), far.step([0.2])))
    assert is_by_low_latency(far) == [True]
    far.close()


def test_a_step_that_is_not_answered_is_asked_again_as_ever_and_done_once(server):
    here, far = pair(server, 3, attempt_s=0.3, deadline_s=30.0)
    step_both(here, far, 20)
    actions = np.zeros((3, 1), np.float32)
    server.process.send_signal(signal.SIGSTOP)
    waker = subprocess.Popen(
        [sys.executable, "-c", f"import os, time; time.sleep(1); os.kill({server.process.pid}, 18)"]
    )
    assert all(map(same, here.step(actions), far.step(actions)))
    waker.wait()
    assert is_by_low_latency(far) == [False]
    step_both(here, far, 20)
    far.close()


def test_environments_go_on_to_the_bit_when_their_server_is_started_anew(server):
    here, far = pair(server, 4, resume=True, hash_every=2, attempt_s=0.3)
    for _ in range(3):
        step_both(here, far, 15)
        server.end(signal.SIGKILL)
        server.start()
    step_both(here, far, 15)
    assert here.unwrapped.snapshot() == far.snapshot()
    assert far._core.resumed == 3
    far.close()


@pytest.mark.parametrize("how", [signal.SIGSTOP, signal.SIGKILL])
def test_a_client_that_stands_still_or_is_killed_while_it_steps_holds_up_nobody_and_makes_room(server, how):
    code = f"""
        import swath
        far = swath.remote.make_vec(
            "{ENV_ID}", 64, connect="{server.endpoint}", zenoh={{"transport/link/tx/lease": 1000}}
        )
        far.reset(seed=0)
        assert far._batch._links[0]._steps is not None
        print("begun", flush=True)
        while True:
            far.step([[0.1]] * 64)
    """
    clients = [
        subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    for client in clients:
        assert client.stdout.readline() == "begun\n"
    here, far = pair(server, 2, attempt_s=5.0)
    for client in clients:
        client.send_signal(how)
    longest_s = 0.0
    for _ in range(300):
        begin_s = time.monotonic()
        step_both(here, far, 1)
        longest_s = max(longest_s, time.monotonic() - begin_s)
    watch = Watch([server.endpoint], ["default"])
    end_s = time.monotonic() + 10
    while watch.read_all()[0].stats["sessions"] > 1:
        assert time.monotonic() < end_s
        time.sleep(0.05)
    watch.close()
    assert longest_s < 2.0
    far.close()
    for client in clients:
        client.kill()
        client.wait()
        client.stdout.close()
