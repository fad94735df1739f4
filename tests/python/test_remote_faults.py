"""What environments on servers promise when something goes wrong: servers that are killed, deadlines, settings."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
import warnings

import gymnasium as gym
import numpy as np
import pytest
from remote_server import SHORT, Server, actions_for, needs_server, same

import swath
from swath.registration import ENV_ID

pytestmark = needs_server


@pytest.fixture
def server():
    server = Server("--allow-snapshot", "--grace-ms", "2000")
    yield server
    server.end(signal.SIGKILL)


def kill_and_start(server, pause_s=0.1):
    server.end(signal.SIGKILL)
    time.sleep(pause_s)
    server.start()


@pytest.mark.parametrize("action", ["steer", "target"])
def test_environments_that_are_resumed_go_on_to_the_bit(server, action):
    blocks = {**SHORT, "action": {"kind": action}}
    here = gym.make_vec(ENV_ID, num_envs=4, **blocks)
    far = swath.remote.make_vec(
        ENV_ID, 4, connect=[server.endpoint] * 2, resume=True, hash_every=2, attempt_s=0.3, **blocks
    )
    rng = np.random.default_rng(0)
    assert same(here.reset(seed=3), far.reset(seed=3))
    for step in range(60):
        if step in {0, 20, 21, 45}:
            kill_and_start(server)
        actions = actions_for(here, rng)
        assert all(map(same, here.step(actions), far.step(actions)))
        if action == "target":
            assert same(here.unwrapped._core.action_masks, far._core.action_masks)
    assert here.unwrapped.snapshot() == far.snapshot()
    assert far._core.resumed == 4 * 2
    far.close()


def test_a_server_that_was_started_anew_does_not_wait_for_one_that_stands_still(server):
    still = Server("--allow-snapshot", "--grace-ms", "60000")
    here = gym.make_vec(ENV_ID, num_envs=2)
    connect = [server.endpoint, still.endpoint]
    far = swath.remote.make_vec(ENV_ID, 2, connect=connect, resume=True, attempt_s=2.0)
    assert same(here.reset(seed=3), far.reset(seed=3))
    action = np.zeros((2, 1), np.float32)
    for _ in range(400):
        assert all(map(same, here.step(action), far.step(action)))
    kill_and_start(server)
    still.process.send_signal(signal.SIGSTOP)
    took_s = []

    def wait_for_the_other():
        start_s = time.monotonic()
        while far._core.resumed < 1 and time.monotonic() < start_s + 20:
            time.sleep(0.01)
        took_s.append(time.monotonic() - start_s)
        still.process.send_signal(signal.SIGCONT)

    watcher = threading.Thread(target=wait_for_the_other)
    watcher.start()
    told = far.step(action)
    watcher.join()
    assert all(map(same, here.step(action), told))
    # As long as one attempt at the other, which answers none of the requests that are sent again here.
    assert took_s[0] < 3.8
    far.close()
    still.end(signal.SIGKILL)


def test_a_server_that_is_killed_while_it_works_is_resumed_from(server):
    here = gym.make(ENV_ID).unwrapped
    far = swath.remote.make(ENV_ID, connect=server.endpoint, resume=True, hash_every=1, attempt_s=0.3)
    here.reset(seed=1)
    far.reset(seed=1)
    is_over = threading.Event()

    def kill_again_and_again():
        for _ in range(3):
            time.sleep(0.5)
            kill_and_start(server)
        is_over.set()

    killer = threading.Thread(target=kill_again_and_again)
    killer.start()
    steps = 0
    while not is_over.is_set() or steps < 100:
        action = np.float32([np.sin(steps)])
        one = here.step(action)
        assert all(map(same, one, far.step(action)))
        steps += 1
        if one[2] or one[3]:
            assert same(here.reset(), far.reset())
    killer.join()
    far.step(np.float32([0.0]))
    assert 1 <= far._core.resumed <= 3
    far.close()


def test_ppo_learns_the_same_though_its_server_is_killed(server):
    from stable_baselines3 import PPO

    def learned(**where):
        env = swath.sb3.make_vec_env(ENV_ID, num_envs=4, seed=1, **where, **SHORT)
        model = PPO("MlpPolicy", env, seed=1, n_steps=32, batch_size=64, n_epochs=1, device="cpu")
        model.learn(128)
        if where:
            kill_and_start(server)
        model.learn(128, reset_num_timesteps=False)
        env.close()
        return model.policy.state_dict()

    here, far = learned(), learned(connect=server.endpoint, resume=True, attempt_s=0.3)
    assert all(same(here[name].numpy(), far[name].numpy()) for name in here)


def test_a_server_that_sends_no_snapshots_is_refused_for_a_resumption():
    server = Server("--max-sessions", "1")
    try:
        with pytest.raises(swath.ResumeError, match="it runs without `--allow-snapshot`"):
            swath.remote.make(ENV_ID, connect=server.endpoint, resume=True)
        swath.remote.make(ENV_ID, connect=server.endpoint).close()
    finally:
        server.end(signal.SIGKILL)


def test_whoever_can_no_longer_be_resumed_is_told_once_and_goes_on():
    server = Server("--allow-snapshot", "--max-msg", "50000")
    here = gym.make(ENV_ID).unwrapped
    far = swath.remote.make(ENV_ID, connect=server.endpoint, resume=True, hash_every=1)
    # A weed takes more bytes in a snapshot than in the request that places it.
    weeds = {"weeds": np.random.default_rng(0).uniform(1.0, 19.0, (3000, 2))}
    action = np.zeros(1, np.float32)
    told = []
    for request in range(1200):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            if request % 100 == 0:
                assert same(here.reset(seed=1, options=weeds), far.reset(seed=1, options=weeds))
            else:
                assert same(here.step(action), far.step(action))
        told += [(request, warning) for warning in caught]
    ((request, warning),) = told
    assert request == 511, "the first snapshot after that of the beginning"
    assert (warning.category, warning.filename) == (RuntimeWarning, __file__)
    text = "`resume` holds no longer: a server refused a further snapshot: "
    assert str(warning.message).startswith(text)
    server.end(signal.SIGKILL)
    server.start()
    with pytest.raises(swath.ResumeError):
        far.step(action)
    server.end(signal.SIGKILL)


def test_a_retry_goes_on_with_a_resumption_that_took_too_long(server):
    here = gym.make(ENV_ID).unwrapped
    far = swath.remote.make(ENV_ID, connect=server.endpoint, resume=True, attempt_s=0.2, deadline_s=0.6)
    assert same(here.reset(seed=1), far.reset(seed=1))
    server.end(signal.SIGKILL)
    with pytest.raises(swath.RemoteTimeout):
        far.step(np.float32([0.5]))
    server.start()
    end_s = time.monotonic() + 20
    while True:
        try:
            result = far.retry()
            break
        except swath.RemoteTimeout:
            assert time.monotonic() < end_s
    assert all(map(same, here.step(np.float32([0.5])), result))
    with pytest.raises(swath.RemoteError, match="every call that was sent was answered"):
        far.retry()
    far.close()


def test_a_deadline_shorter_than_an_attempt_is_kept_and_so_is_the_second_of_a_close(server):
    far = swath.remote.make(ENV_ID, connect=server.endpoint, attempt_s=30.0, deadline_s=0.5)
    far.reset(seed=0)
    server.process.send_signal(signal.SIGSTOP)
    try:
        start_s = time.monotonic()
        with pytest.raises(swath.RemoteTimeout):
            far.step(np.float32([0.0]))
        assert 0.4 < time.monotonic() - start_s < 2.0
        start_s = time.monotonic()
        far.close()
        assert time.monotonic() - start_s < 3.0
    finally:
        server.process.send_signal(signal.SIGCONT)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"server": "Big Field"}, "`server` must be 1 to 64 lower-case letters, digits and dashes, got 'Big Field'"),
        ({"server": "a/**"}, "`server` must be 1 to 64"),
        ({"server": 3}, "`server` must be 1 to 64"),
        ({"zenoh": {"no/such": 1}}, "`zenoh` must hold settings of Zenoh by their path, got 'no/such': 1"),
        ({"zenoh": {"connect/timeout_ms": "soon"}}, "`zenoh` must hold settings of Zenoh by their path, got"),
        ({"zenoh": {"id": object}}, "`zenoh` must hold settings of Zenoh by their path, got 'id'"),
        ({"zenoh": {"transport/unicast": {"lowlatency": True}}}, "must leave 'transport/unicast' to swath, got {'low"),
        ({"zenoh": {"mode": "router"}}, "`zenoh` must leave 'mode' to swath, got 'router'"),
        (
            {"zenoh": {"transport/unicast/lowlatency": True}},
            "must leave 'transport/unicast/lowlatency' to swath, got True",
        ),
        ({"zenoh": 7}, "`zenoh` must be settings of Zenoh by their path, got 7"),
        ({"resume": True, "hash_every": 0}, "`hash_every` must be a whole number from 1 to 4294967295, got 0"),
        ({"attempt_s": 0}, "`attempt_s` must be from 0.001 to 86400 seconds, got 0"),
        ({"attempt_s": True}, "`attempt_s` must be from 0.001 to 86400 seconds, got True"),
        ({"resume": "yes"}, "`resume` must be True or False, got 'yes'"),
        ({"infos": 1}, "`infos` must be True or False, got 1"),
    ],
)
def test_an_argument_that_cannot_be_used_is_named_with_its_value(server, arguments, text):
    with pytest.raises(swath.ConfigError) as raised:
        swath.remote.make(ENV_ID, **{"connect": server.endpoint, **arguments})
    assert text in str(raised.value)
    assert len(str(raised.value).splitlines()) == 1


def test_what_is_said_of_servers_without_naming_any_is_refused():
    with pytest.raises(swath.ConfigError, match="`server` must be left out without `connect`, got 'south'"):
        swath.sb3.make_vec_env(ENV_ID, 4, server="south")


def test_threads_of_this_process_are_refused_where_servers_do_the_work(server):
    with pytest.raises(swath.ConfigError, match=r"`num_threads` must be left out with `connect`.* got 2"):
        swath.sb3.make_vec_env(ENV_ID, 4, connect=server.endpoint, num_threads=2)


def test_why_a_session_was_not_resumed_crosses_processes_whole():
    error = pickle.loads(pickle.dumps(swath.ResumeError("why")))
    assert isinstance(error, swath.RemoteError)
    assert str(error) == "why"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.parametrize("end", ["", "env.close(); del env"])
def test_a_child_that_was_forked_after_an_open_is_told_and_ends(server, end):
    code = f"""
        import os, sys, swath
        env = swath.remote.make("{ENV_ID}", connect="{server.endpoint}")
        {end}
        child = os.fork()
        if child == 0:
            try:
                swath.remote.make("{ENV_ID}", connect="{server.endpoint}")
            except swath.RemoteError as error:
                assert "forked" in str(error), error
                sys.exit(7)
            sys.exit(1)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    """
    assert subprocess.run([sys.executable, "-c", textwrap.dedent(code)], timeout=20, check=False).returncode == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_child_that_was_forked_before_any_open_opens_its_own(server):
    code = f"""
        import os, sys, swath
        child = os.fork()
        swath.remote.make("{ENV_ID}", connect="{server.endpoint}").close()
        if child:
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    """
    assert subprocess.run([sys.executable, "-c", textwrap.dedent(code)], timeout=20, check=False).returncode == 0


@pytest.mark.parametrize("context", ["spawn", "forkserver"])
def test_worker_processes_hold_environments_of_their_own(server, tmp_path, context):
    script = tmp_path / "workers.py"
    script.write_text(
        textwrap.dedent(f"""
            import gymnasium, numpy, swath

            def made():
                return swath.remote.make("{ENV_ID}", connect="{server.endpoint}")

            if __name__ == "__main__":
                both = gymnasium.vector.AsyncVectorEnv([made, made], context="{context}")
                both.reset(seed=1)
                both.step(numpy.zeros((2, 1), numpy.float32))
                both.close()
        """)
    )
    assert subprocess.run([sys.executable, str(script)], timeout=28, check=False).returncode == 0
