"""Calls to servers that are not answered, or not taken in: what is known afterwards, and what may follow."""

from __future__ import annotations

import signal
import threading
import time

import gymnasium as gym
import numpy as np
import pytest
from remote_server import Server, actions_for, needs_server, same

import swath
from swath.registration import ENV_ID

pytestmark = needs_server


@pytest.fixture(scope="module")
def server():
    server = Server("--allow-snapshot")
    yield server
    server.end()


@pytest.fixture
def patient_server():
    server = Server()
    yield server
    server.end(signal.SIGKILL)


def test_who_waits_for_a_silent_server_sleeps(patient_server):
    far = swath.remote.make_vec(ENV_ID, 2, connect=patient_server.endpoint, attempt_s=0.5, deadline_s=2.0)
    far.reset(seed=0)
    patient_server.process.send_signal(signal.SIGSTOP)
    begin_s, begin_work_s = time.monotonic(), time.process_time()
    with pytest.raises(swath.RemoteTimeout):
        far.step(np.zeros((2, 1), np.float32))
    work_s, waited_s = time.process_time() - begin_work_s, time.monotonic() - begin_s
    patient_server.process.send_signal(signal.SIGCONT)
    assert work_s < 0.25 * waited_s, f"{work_s:.3f} s of work in {waited_s:.3f} s"
    far.close()


@pytest.mark.parametrize("mode", ["NextStep", "Disabled"])
@pytest.mark.parametrize("kind", ["steer", "target"])
def test_a_reset_that_was_not_answered_in_time_is_settled_by_a_retry(patient_server, kind, mode):
    blocks = {"action": {"kind": kind}, "num_envs": 3, "autoreset_mode": mode}
    here = gym.make_vec(ENV_ID, **blocks)
    far = swath.remote.make_vec(ENV_ID, connect=patient_server.endpoint, attempt_s=0.3, deadline_s=0.5, **blocks)
    actions = actions_for(far, np.random.default_rng(0))
    for seed in (1, 2):
        patient_server.process.send_signal(signal.SIGSTOP)
        with pytest.raises(swath.RemoteTimeout):
            far.reset(seed=seed)
        patient_server.process.send_signal(signal.SIGCONT)
        assert same(far.retry(), here.reset(seed=seed))
        assert all(map(same, here.step(actions), far.step(actions)))
    far.close()


def test_a_mask_does_not_leave_out_environments_of_which_nobody_knows_how_they_stand(server, patient_server):
    far = swath.remote.make_vec(
        ENV_ID,
        2,
        connect=[server.endpoint, patient_server.endpoint],
        autoreset_mode="Disabled",
        attempt_s=0.3,
        deadline_s=0.5,
    )
    far.reset(seed=0)
    patient_server.process.send_signal(signal.SIGSTOP)
    with pytest.raises(swath.RemoteTimeout):
        far.step(np.zeros((2, 1), np.float32))
    patient_server.process.send_signal(signal.SIGCONT)
    with pytest.raises(swath.RemoteError, match="retry"):
        far.reset(options={"reset_mask": np.array([True, False])})
    far.retry()
    far.reset(options={"reset_mask": np.array([True, False])})
    far.close()


def test_a_step_that_cannot_be_written_is_not_lost(server):
    far = swath.remote.make_vec(ENV_ID, 2, connect=server.endpoint, copy=False)
    here = gym.make_vec(ENV_ID, num_envs=2)
    observation, _ = far.reset(seed=1)
    here.reset(seed=1)
    observation.flags.writeable = False
    actions = np.zeros((2, 1), np.float32)
    with pytest.raises(TypeError):
        far.step(actions)
    with pytest.raises(swath.RemoteError, match="retry"):
        far.step(actions)
    observation.flags.writeable = True
    assert all(map(same, here.step(actions), far.retry()))
    far.close()


def test_a_call_that_was_interrupted_leaves_environments_that_can_be_reset(server, monkeypatch):
    far = swath.remote.make_vec(ENV_ID, 4, connect=[server.endpoint] * 2)
    here = gym.make_vec(ENV_ID, num_envs=4)
    far.reset(seed=0)
    batch = far._core
    take_in = type(batch)._take_in

    def interrupted(self, part, answers, *, waits):
        if part == 1:
            raise KeyboardInterrupt
        return take_in(self, part, answers, waits=waits)

    actions = np.zeros((4, 1), np.float32)
    with monkeypatch.context() as patch:
        patch.setattr(type(batch), "_take_in", interrupted)
        with pytest.raises(KeyboardInterrupt):
            far.step(actions)
    here.reset(seed=0)
    assert all(map(same, here.step(actions), far.retry()))
    with monkeypatch.context() as patch:
        patch.setattr(type(batch), "_take_in", interrupted)
        with pytest.raises(KeyboardInterrupt):
            far.step(actions)
    assert same(far.reset(seed=3), here.reset(seed=3))
    assert all(map(same, here.step(actions), far.step(actions)))
    far.close()


def test_a_call_of_another_thread_is_refused_and_disturbs_nothing(server):
    here, far = (gym.make_vec(ENV_ID, num_envs=64), swath.remote.make_vec(ENV_ID, 64, connect=server.endpoint))
    assert same(here.reset(seed=1), far.reset(seed=1))
    actions, refused, is_over = np.zeros((64, 1), np.float32), [], threading.Event()

    def disturb():
        while not is_over.wait(0.001):
            try:
                far._core.snapshot(0)
            except swath.RemoteError as error:
                refused.append(str(error))

    disturber = threading.Thread(target=disturb)
    disturber.start()
    try:
        for _ in range(300):
            told = None
            while told is None:
                try:
                    told = far.step(actions)
                except swath.RemoteError as error:
                    # The other one was first.
                    refused.append(str(error))
            assert all(map(same, here.step(actions), told))
    finally:
        is_over.set()
        disturber.join()
    assert set(refused) == {"another call is in flight: an environment is for one thread at a time"}
    far.close()


def test_whoever_closes_while_another_thread_waits_is_refused_and_that_one_goes_on(patient_server):
    far = swath.remote.make_vec(ENV_ID, 2, connect=patient_server.endpoint)
    far.reset(seed=1)
    told, actions = [], np.zeros((2, 1), np.float32)
    patient_server.process.send_signal(signal.SIGSTOP)
    stepper = threading.Thread(target=lambda: told.append(far.step(actions)))
    stepper.start()
    time.sleep(0.1)
    with pytest.raises(swath.RemoteError, match="another call is in flight"):
        far._batch.close()
    patient_server.process.send_signal(signal.SIGCONT)
    stepper.join()
    here = gym.make_vec(ENV_ID, num_envs=2)
    here.reset(seed=1)
    assert same(here.step(actions), told[0])
    far.close()


def test_where_one_server_has_begun_episodes_and_another_refused_none_is_stepped_until_all_have_begun_anew(server):
    small = Server("--max-all-weeds", "250")
    blocks = {"num_envs": 2, "autoreset_mode": "Disabled"}
    here = gym.make_vec(ENV_ID, **blocks)
    far = swath.remote.make_vec(ENV_ID, connect=[server.endpoint, small.endpoint], **blocks)
    actions = np.zeros((2, 1), np.float32)
    far.reset(seed=1)
    weeds = [(float(x), 5.0) for x in np.linspace(1, 30, 400)]
    with pytest.raises(swath.SwathError, match="at most 250 weeds"):
        far.reset(seed=2, options={"weeds": weeds})
    text = "one server refused what another one has carried out: reset every row, or close"
    for refused in (
        lambda: far.step(actions),
        lambda: far.reset(options={"reset_mask": np.array([True, False])}),
        far._core.snapshot,
    ):
        with pytest.raises(swath.RemoteError, match=text):
            refused()
    assert same(far.reset(seed=3), here.reset(seed=3))
    assert all(map(same, far.step(actions), here.step(actions)))
    far.close()
    small.end()


def test_a_request_that_is_too_large_for_the_server_is_refused_by_name_and_the_next_one_is_carried_out():
    here = gym.make_vec(ENV_ID, num_envs=200)
    here.reset(seed=0)
    snapshot = here.unwrapped.snapshot()
    # So much more than the server takes in that its Zenoh drops it without a word.
    most = len(snapshot) - 100_000
    server = Server("--max-msg", str(most))
    far = swath.remote.make_vec(ENV_ID, 200, connect=server.endpoint, deadline_s=10.0)
    assert same(far.reset(seed=1), here.reset(seed=1))
    with pytest.raises(swath.RemoteError, match=f"^a message must have at most {most} bytes, `max_msg` of the server"):
        far._core.restore(snapshot)
    actions = np.zeros((200, 1), np.float32)
    assert all(map(same, far.step(actions), here.step(actions)))
    far.close()
    server.end()


def test_whoever_closes_in_a_signal_handler_while_a_call_waits_ends_that_call(patient_server):
    far = swath.remote.make_vec(ENV_ID, 2, connect=patient_server.endpoint, attempt_s=0.3, deadline_s=5.0)
    far.reset(seed=0)
    before = signal.signal(signal.SIGALRM, lambda *_: far.close())
    patient_server.process.send_signal(signal.SIGSTOP)
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    with pytest.raises(swath.ClosedError, match="while a call was in flight"):
        far.step(np.zeros((2, 1), np.float32))
    patient_server.process.send_signal(signal.SIGCONT)
    signal.signal(signal.SIGALRM, before)
