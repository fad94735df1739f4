"""Environments on real servers, over real Zenoh sessions on this machine's loopback."""

from __future__ import annotations

import pickle
import re
import signal
import subprocess
import sys
import textwrap
import time

import gymnasium as gym
import numpy as np
import pytest
from remote_server import SERVER, SHORT, Server, actions_for, needs_server, same

import swath
from swath.registration import ENV_ID

pytestmark = needs_server


@pytest.fixture(scope="module")
def server():
    server = Server("--allow-snapshot")
    yield server
    server.end()


@pytest.fixture
def own_server():
    server = Server("--allow-snapshot", "--grace-ms", "300", "--max-sessions", "2")
    yield server
    server.end(signal.SIGKILL)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("kind", ["steer", "target"])
def test_without_infos_only_ends_and_choices_are_told_and_all_else_is_the_same(server, mode, kind):
    blocks = {**SHORT, "action": {"kind": kind}, "autoreset_mode": mode}
    here = gym.make_vec(ENV_ID, num_envs=3, **blocks)
    far = swath.remote.make_vec(ENV_ID, 3, connect=server.endpoint, infos=False, **blocks)
    always = {"action_mask", "_action_mask"} if kind == "target" else set()
    untold = {"reward_terms", "_reward_terms", "action_clipped", "_action_clipped", "elapsed_m", "_elapsed_m"}
    rng, ended = np.random.default_rng(0), 0
    observation, infos = far.reset(seed=3)
    assert same(observation, here.reset(seed=3)[0])
    assert infos.keys() == always
    for _ in range(200):
        actions = far._core.action_masks.argmax(axis=1) if kind == "target" else actions_for(here, rng)
        *one, all_infos = here.step(actions)
        *other, infos = far.step(actions)
        assert all(map(same, one, other))
        assert same(infos, {key: value for key, value in all_infos.items() if key not in untold})
        ended += (other[2] | other[3]).sum()
    assert ended > 3
    far.close()


def test_one_environment_without_infos_tells_its_end(server):
    here, far = (
        gym.make(ENV_ID, **SHORT).unwrapped,
        swath.remote.make(ENV_ID, connect=server.endpoint, infos=False, **SHORT),
    )
    here.reset(seed=1)
    assert far.reset(seed=1)[1] == {}
    end = False
    while not end:
        *_, terminated, truncated, whole = here.step([0.0])
        *_, info = far.step([0.0])
        end = terminated or truncated
        assert info.keys() == (whole.keys() - {"reward_terms", "action_clipped"} if end else set())
    assert info["outcome"] == whole["outcome"]
    far.close()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
@pytest.mark.parametrize(
    ("observation", "action"),
    [("features", "steer"), ("maps", "discrete"), ("candidates", "target"), ("dict", "drive")],
)
def test_environments_elsewhere_go_the_same_way_to_the_bit(server, mode, observation, action):
    blocks = {**SHORT, "observation": {"kind": observation}, "action": {"kind": action}, "autoreset_mode": mode}
    here = gym.make_vec(ENV_ID, num_envs=5, **blocks)
    far = swath.remote.make_vec(ENV_ID, 5, connect=[server.endpoint, server.endpoint], **blocks)
    rng = np.random.default_rng(0)
    assert same(here.reset(seed=[3, 1, 4, 1, 5]), far.reset(seed=[3, 1, 4, 1, 5]))
    ended = 0
    for _ in range(120):
        actions = actions_for(here, rng)
        one, other = here.step(actions), far.step(actions)
        assert all(map(same, one, other))
        done = one[2] | one[3]
        ended += done.sum()
        if action == "target":
            assert same(here.unwrapped._core.action_masks, far._core.action_masks)
        if mode == "Disabled" and done.any():
            options = {"reset_mask": done}
            assert same(here.reset(options=options), far.reset(options=options))
    assert ended > 0
    assert here.unwrapped.snapshot() == far.snapshot()
    far.close()


def test_a_snapshot_goes_on_here_and_there(server):
    here = gym.make_vec(ENV_ID, num_envs=3).unwrapped
    far = swath.remote.make_vec(ENV_ID, 3, connect=[server.endpoint] * 2)
    here.reset(seed=1)
    far.reset(seed=9)
    actions = np.zeros((3, 1), np.float32)
    here.step(actions)
    far.restore(here.snapshot())
    assert all(map(same, here.step(actions), far.step(actions)))
    far.restore(here.snapshot(2), 0)
    assert far.snapshot(0) == here.snapshot(2)
    with pytest.raises(swath.SnapshotError, match="`snapshot` must be the bytes"):
        far.restore(b"nothing")
    far.close()


def test_one_environment_elsewhere_is_the_one_here(server):
    here = gym.make(ENV_ID, **SHORT).unwrapped
    with swath.remote.make(ENV_ID, connect=server.endpoint, **SHORT) as far:
        weeds = {"weeds": np.array([[3.0, 1.0]])}
        assert same(here.reset(seed=2, options=weeds), far.reset(seed=2, options=weeds))
        for _ in range(40):
            one, other = here.step(np.float32([0.1])), far.step(np.float32([0.1]))
            assert all(map(same, one, other))
            if one[2] or one[3]:
                break
        assert same(here.reset(), far.reset())
        assert here.snapshot() == far.snapshot()
    with pytest.raises(swath.ClosedError):
        far.reset()


def test_stable_baselines3_meets_the_same_environments(server):
    here = swath.sb3.make_vec_env(ENV_ID, num_envs=4, **SHORT)
    far = swath.sb3.make_vec_env(ENV_ID, num_envs=4, connect=[server.endpoint] * 2, **SHORT)
    for env in (here, far):
        env.seed(5)
    assert same(here.reset(), far.reset())
    rng = np.random.default_rng(1)
    for _ in range(80):
        actions = rng.uniform(-1, 1, (4, 1)).astype(np.float32)
        *one, infos = here.step(actions)
        *other, far_infos = far.step(actions)
        assert all(map(same, one, other))
        for info in infos + far_infos:
            if "episode" in info:
                del info["episode"]["t"]
        assert all(map(same, infos, far_infos))
    far.close()


def test_ppo_learns_through_servers_what_it_learns_here(server):
    from stable_baselines3 import PPO

    def learned(**where):
        env = swath.sb3.make_vec_env(ENV_ID, num_envs=4, seed=1, **where, **SHORT)
        model = PPO("MlpPolicy", env, seed=1, n_steps=32, batch_size=64, n_epochs=2, device="cpu")
        model.learn(256)
        env.close()
        return model.policy.state_dict()

    other = Server()
    here, far = learned(), learned(connect=[server.endpoint, other.endpoint])
    other.end()
    assert all(same(here[name].numpy(), far[name].numpy()) for name in here)


REFUSED = {
    "seed": lambda env: env.reset(seed=-1),
    "options": lambda env: env.reset(options=5),
    "option": lambda env: env.reset(options={"weed": []}),
    "weeds_off": lambda env: env.reset(options={"weeds": [[1.0, 2.0], [1000.0, 3.0]]}),
    "weeds_of_three": lambda env: env.reset(options={"weeds": [[1.0, 2.0, 3.0]]}),
    "action_nan": lambda env: env.step([np.nan]),
    "action_long": lambda env: env.step([0.1, 0.2]),
    "action_flat": lambda env: env.step(0.1),
    "action_text": lambda env: env.step("left"),
    "action_none": lambda env: env.step(None),
    "snapshot_empty": lambda env: env.restore(b""),
    "snapshot_junk": lambda env: env.restore(b"no snapshot of swath's, of some length"),
}


@pytest.mark.parametrize("call", REFUSED.values(), ids=REFUSED.keys())
def test_what_one_environment_refuses_it_refuses_in_the_same_words_on_a_server(server, call):
    far = swath.remote.make(ENV_ID, connect=server.endpoint)
    here = gym.make(ENV_ID).unwrapped
    for is_begun in (False, True):
        said = []
        for env in (here, far):
            with pytest.raises((ValueError, swath.SwathError)) as caught:
                call(env)
            said.append((type(caught.value), str(caught.value)))
        assert said[0] == said[1], f"begun: {is_begun}"
        for env in (here, far):
            env.reset(seed=0)
    assert all(map(same, here.step([0.1]), far.step([0.1])))
    far.close()


def test_which_of_several_servers_was_started_anew_is_said(server):
    other = Server()
    far = swath.remote.make_vec(ENV_ID, 2, connect=[server.endpoint, other.endpoint])
    far.reset(seed=0)
    other.end(signal.SIGKILL)
    other.start()
    with pytest.raises(swath.RemoteError, match=f"^{other.endpoint}: the server was started anew"):
        far.step(np.zeros((2, 1), np.float32))
    far.close()
    other.end()


def test_what_a_server_refuses_is_refused_as_it_is_here(server):
    far = swath.remote.make_vec(ENV_ID, 2, connect=server.endpoint)
    with pytest.raises(swath.ActionError, match="reset"):
        far.step(np.zeros((2, 1), np.float32))
    far.reset(seed=0)
    before = far.snapshot()
    with pytest.raises(swath.ActionError, match=r"row 1: `action\[0\]` must be finite, got NaN"):
        far.step(np.float32([[0], [np.nan]]))
    with pytest.raises(swath.ActionError, match="shape"):
        far.step(np.zeros((3, 1), np.float32))
    assert far.snapshot() == before
    far.close()
    with pytest.raises(swath.ConfigError, match=r"`mower\.deck_width_m` must be finite and > 0, got 0"):
        swath.remote.make(ENV_ID, connect=server.endpoint, mower={"deck_width_m": 0.0})
    with pytest.raises(swath.ConfigError, match="`env_id` must be one of"):
        swath.remote.make("swath/Ploughing-v0", connect=server.endpoint)
    with pytest.raises(swath.ConfigError, match="`connect` must be an endpoint"):
        swath.remote.make(ENV_ID, connect="localhost")
    with pytest.raises(swath.ConfigError, match="`connect` must name 1 server for 1 environment, got"):
        swath.remote.make_vec(ENV_ID, 1, connect=[server.endpoint] * 2)
    with pytest.raises(swath.ConfigError, match="`connect` must name from 1 to 2 servers, no more than environments"):
        swath.remote.make_vec(ENV_ID, 2, connect=[server.endpoint] * 3)
    with pytest.raises(swath.ConfigError, match="`connect` must be the endpoint of one server"):
        swath.remote.make(ENV_ID, connect=[server.endpoint] * 2)


@pytest.mark.parametrize(
    "endpoint",
    [
        "http://127.0.0.1:7447",
        "tcp/127.0.0.1:7447/x",
        "tcp/127.0.0.1",
        "tcp/127.0.0.1:0",
        "tcp/::1:7447",
        "tcp/a:70000",
    ],
)
def test_what_is_no_endpoint_is_refused_before_anybody_is_asked(server, endpoint):
    start_s = time.monotonic()
    with pytest.raises(swath.ConfigError) as raised:
        swath.remote.make_vec(ENV_ID, 2, connect=["tcp/127.0.0.1:1", endpoint])
    assert str(raised.value) == f"`connect` must be an endpoint such as 'tcp/127.0.0.1:7447', got '{endpoint}'"
    assert time.monotonic() - start_s < 1


def test_environments_on_servers_are_neither_pickled_nor_driven_by_an_agent_here(server):
    far = swath.remote.make(ENV_ID, connect=server.endpoint)
    vector = swath.remote.make_vec(ENV_ID, 2, connect=server.endpoint)
    for env in (far, vector):
        with pytest.raises(TypeError, match="an environment on a server cannot be pickled: make it where it is used"):
            pickle.dumps(env)
    with pytest.raises(swath.ConfigError, match="got RemoteEnv; `swath worker` plays scripted agents on servers"):
        swath.make_agent("snake").act(far)
    far.close()
    vector.close()


def test_an_endpoint_where_nobody_listens_is_named_in_one_line():
    with pytest.raises(swath.RemoteError) as raised:
        swath.remote.make(ENV_ID, connect="tcp/127.0.0.1:1")
    text = str(raised.value)
    assert text.startswith("no server at tcp/127.0.0.1:1: ")
    assert "\n" not in text
    assert "/src/" not in text


def test_a_full_server_says_so_and_a_client_that_leaves_makes_room(own_server):
    def open_one():
        return swath.remote.make(ENV_ID, connect=own_server.endpoint)

    first, second = open_one(), open_one()
    with pytest.raises(swath.RemoteError, match=r"the server is full: 2 of 2 sessions are taken \(`max_sessions`\)$"):
        open_one()
    first.close()
    open_one().close()
    second.close()


def test_a_client_that_was_killed_makes_room_after_its_grace(own_server):
    code = f"""
        import swath, time
        envs = [swath.remote.make("{ENV_ID}", connect="{own_server.endpoint}") for _ in range(2)]
        print("open", flush=True)
        time.sleep(60)
    """
    with subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        assert client.stdout.readline() == "open\n"
        client.kill()
    end_s = time.monotonic() + 10
    while True:
        try:
            swath.remote.make(ENV_ID, connect=own_server.endpoint).close()
            break
        except swath.RemoteError:
            assert time.monotonic() < end_s
            time.sleep(0.1)


def test_a_server_that_was_killed_is_named_and_its_successor_is_not_taken_for_it(own_server):
    far = swath.remote.make_vec(ENV_ID, 2, connect=own_server.endpoint, attempt_s=0.3, deadline_s=1.5)
    far.reset(seed=0)
    own_server.end(signal.SIGKILL)
    gone = (
        f"; no sign of `default` at {own_server.endpoint}: not running any more, or stopped, or we are not authorised"
    )
    with pytest.raises(swath.RemoteTimeout, match=f"^no answer within .*{re.escape(gone)}$"):
        far.step(np.zeros((2, 1), np.float32))
    # Whether the step was made is not known, so no other one may follow.
    with pytest.raises(swath.RemoteError, match="retry"):
        far.step(np.zeros((2, 1), np.float32))
    own_server.start()
    end_s = time.monotonic() + 20
    text = ""
    while "started anew" not in text:
        assert time.monotonic() < end_s, text
        with pytest.raises(swath.RemoteError) as raised:
            far.retry()
        text = str(raised.value)
    assert "make the environments anew, or with `resume`" in text
    far.close()


def test_a_name_that_no_server_has_is_refused_at_once_where_others_are(own_server):
    begin_s = time.monotonic()
    text = f"^there is no server `meadow` at {own_server.endpoint}, but `default`$"
    with pytest.raises(swath.RemoteError, match=text):
        swath.remote.make(ENV_ID, connect=own_server.endpoint, server="meadow")
    assert time.monotonic() - begin_s < 5


def test_a_remote_environment_names_what_it_observes_as_a_local_one_does(server):
    far = swath.remote.make(ENV_ID, connect=server.endpoint)
    assert far.observation_names == gym.make(ENV_ID).unwrapped.observation_names
    far.close()


def test_choices_after_a_restore_are_those_of_the_state_put_back(server):
    blocks = {"action": {"kind": "target"}, "num_envs": 3}
    here = gym.make_vec(ENV_ID, **blocks).unwrapped
    far = swath.remote.make_vec(ENV_ID, connect=[server.endpoint] * 2, **blocks)
    here.reset(seed=1)
    far.reset(seed=2)
    for _ in range(4):
        here.step(here._core.action_masks.argmax(axis=1))
    far.restore(here.snapshot())
    assert same(here._core.action_masks, far._core.action_masks)
    far.reset(seed=2)
    far.restore(here.snapshot(0), 2)
    assert same(here._core.action_masks[0], far._core.action_masks[2])
    far.close()
    both = [gym.make_vec(ENV_ID, **blocks).unwrapped]
    both.append(swath.remote.make_vec(ENV_ID, connect=[server.endpoint] * 2, **blocks))
    for env in both:
        env.restore(here.snapshot(0), 2)
    assert same(*(env._core.action_masks for env in both))
    both[1].close()


@pytest.mark.parametrize(
    ("flags", "text"),
    [
        (["--listen", "tcp/0.0.0.0:7447"], "is not an address of this machine's loopback and needs mutual TLS"),
        (["--listen", "tcp/localhost:7447"], "is not an address of this machine's loopback and needs mutual TLS"),
        (["--name", "Big Field"], '`name` must be 1 to 64 lower-case letters, digits and dashes, got "Big Field"'),
        (["--config", "no/such.toml"], "`no/such.toml`: No such file or directory"),
    ],
)
def test_a_setting_that_cannot_be_is_one_line_and_status_2(flags, text):
    run = subprocess.run([str(SERVER), *flags], capture_output=True, text=True, timeout=20, check=False)
    assert run.returncode == 2
    assert run.stdout == ""
    assert text in run.stderr
    assert len(run.stderr.splitlines()) == 1


def test_a_server_of_a_name_that_is_taken_does_not_start(server):
    port = server.endpoint.rsplit(":", 1)[1]
    run = subprocess.run(
        [str(SERVER), "--listen", server.endpoint], capture_output=True, text=True, timeout=20, check=False
    )
    assert run.returncode == 2
    assert port in run.stderr or "there already" in run.stderr


def test_a_server_ends_when_it_is_asked_to():
    server = Server()
    far = swath.remote.make(ENV_ID, connect=server.endpoint)
    far.reset(seed=0)
    assert server.end() == 0
    far.close()
