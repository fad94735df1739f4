"""Zenoh's low-latency transport, which servers offer: steps of few environments go by it, and nothing else changes."""

from __future__ import annotations

import logging
import signal
import subprocess
import sys
import textwrap
import time

import gymnasium as gym
import numpy as np
import pytest
from proxy import Proxy
from remote_server import SHORT, Server, actions_for, needs_server, same

import swath
from swath.registration import ENV_ID
from swath.remote.session import opened, settings
from swath.remote.watch import Watch

pytestmark = needs_server


@pytest.fixture
def server(tmp_path):
    server = Server("--allow-snapshot", "--grace-ms", "500", log=tmp_path / "log")
    yield server
    server.end(signal.SIGKILL)


def low_latency_port(server):
    """Where a server has its low-latency transport."""
    session = opened(settings(server.endpoint, None), server.endpoint)
    offer = next(iter(session.liveliness().get("swath/v1/default/low-latency/*/*")))
    port = int(str(offer.ok.key_expr).rsplit("/", 1)[1])
    session.close()
    return port


def low_latency_endpoint(server):
    return f"tcp/127.0.0.1:{low_latency_port(server)}"


@pytest.fixture
def proxy(server, monkeypatch):
    """Between a server's low-latency transport and its clients in this process."""
    proxy = Proxy(low_latency_port(server))
    monkeypatch.setattr("swath.remote.link.Link.low_latency_endpoint", lambda *_: proxy.endpoint)
    yield proxy
    proxy.listener.close()
    for mute in proxy.muted:
        mute.clear()


def is_by_low_latency(far):
    assert far.has_low_latency == all(link.has_low_latency for link in far._batch._links)
    return [link.has_low_latency for link in far._batch._links]


def answers(way, payload):
    """What a server answers to a question that is none."""
    replies = way.session.get("swath/v1/default/rpc/step", payload=payload, timeout=2.0)
    return sum(reply.ok is not None for reply in replies)


def pair(at, num_envs, **arguments):
    """Environments here and on the server that have begun."""
    here = gym.make_vec(ENV_ID, num_envs=num_envs, **SHORT)
    far = swath.remote.make_vec(ENV_ID, num_envs, connect=at.endpoint, **arguments, **SHORT)
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


def test_the_name_of_the_loopback_will_do(server):
    far = swath.remote.make(ENV_ID, connect=server.endpoint.replace("127.0.0.1", "localhost"))
    assert is_by_low_latency(far) == [True]
    far.close()


def test_the_transport_of_steps_is_the_one_that_takes_no_long_message(server):
    far = swath.remote.make(ENV_ID, connect=server.endpoint)
    link = far._batch._links[0]
    for payload, by_low_latency in ((bytes(1000), 1), (bytes(70_000), 0)):
        assert answers(link._usual, payload) == 1
        assert answers(link._low_latency, payload) == by_low_latency
    far.reset(seed=0)
    far.step([0.1])
    far.close()


def test_a_server_that_does_not_offer_it_is_asked_as_ever(server):
    usual = Server("--low-latency=off")
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


@pytest.mark.parametrize(("attempt_s", "deadline_s"), [(0.3, 30.0), (0.5, 0.9), (0.503, 60.0)])
def test_a_step_that_is_not_answered_there_is_asked_again_as_ever_and_done_once(
    server, proxy, attempt_s, deadline_s, caplog
):
    here, far = pair(server, 3, attempt_s=attempt_s, deadline_s=deadline_s)
    step_both(here, far, 20)
    assert is_by_low_latency(far) == [True]
    proxy.muted[0].set()
    begin_s = time.monotonic()
    with caplog.at_level(logging.INFO, logger="swath.remote.link"):
        step_both(here, far, 1)
    assert time.monotonic() - begin_s > 0.9 * attempt_s
    assert [record.getMessage().partition(", ")[2] for record in caplog.records] == ["and goes the usual way"]
    assert is_by_low_latency(far) == [False]
    # All others, too.
    begin_s = time.monotonic()
    step_both(here, far, 20)
    assert time.monotonic() - begin_s < 5 * attempt_s
    far.close()


def test_a_call_that_is_interrupted_is_no_reason_to_leave_it(server, monkeypatch):
    here, far = pair(server, 2)
    with monkeypatch.context() as patch:
        patch.setattr("swath.remote.link.Answers.__iter__", lambda _: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            far.step(np.zeros((2, 1), np.float32))
    assert all(map(same, here.step(np.zeros((2, 1), np.float32)), far.retry()))
    assert is_by_low_latency(far) == [True]
    step_both(here, far, 5)
    far.close()


@pytest.mark.parametrize(
    "zenoh", [{"id": "abc123"}, {"listen/endpoints": ["tcp/127.0.0.1:0"]}, {"transport/link/tx": {"batch_size": 8192}}]
)
def test_what_only_one_session_of_a_client_can_have_is_not_asked_for_twice(server, zenoh):
    here, far = pair(server, 64, zenoh=zenoh)
    step_both(here, far, 5)
    assert is_by_low_latency(far) == [True]
    far.close()


@pytest.mark.parametrize("resume", [False, True])
def test_where_its_connection_comes_to_lead_to_another_server_of_the_name_all_goes_as_ever(server, proxy, resume):
    other = Server("--allow-snapshot")
    here, far = pair(server, 3, resume=resume)
    step_both(here, far, 5)
    proxy.lead_to(low_latency_port(other))
    proxy.break_off(0)
    end_s = time.monotonic() + 10
    while len(proxy.clients) < 2:
        assert time.monotonic() < end_s
        time.sleep(0.05)
    step_both(here, far, 20)
    assert far._core.resumed == 0
    assert is_by_low_latency(far) == [False]
    far.close()
    other.end()


def test_where_the_second_connection_cannot_be_made_all_goes_as_ever(server, monkeypatch):
    real, sessions = swath.remote.link.opened, []

    def opened_once(config, endpoint):
        if sessions:
            text = "no more connections"
            raise swath.RemoteError(text)
        sessions.append(real(config, endpoint))
        return sessions[0]

    monkeypatch.setattr("swath.remote.link.opened", opened_once)
    here, far = pair(server, 2)
    assert is_by_low_latency(far) == [False]
    step_both(here, far, 5)
    far.close()


def longest_wait_beside(server, proxy, attack, others=lambda: None, num_envs=2, attackers=1):
    """Steps beside a client of another kind, of whose last connections so many are read by nobody from when it attacks.

    Goes on until they are cut off; returns how long the longest step and what `others` do took, seconds.
    """
    begin = f"""
        import struct
        import numpy as np
        import swath
        from swath.remote.link import Link
        from swath.remote.session import opened, settings
        from swath.remote.watch import Watch
        ask, asked = Link.ask, {{}}
        Link.ask = lambda link, verb, *what: (asked.update({{verb: what[0]}}), ask(link, verb, *what))[1]
        session = opened(settings("{proxy.endpoint}", None, low_latency=True), "{proxy.endpoint}")
        get = lambda message: session.get("swath/v1/default/rpc/step", payload=message, timeout=60.0)
        answer = lambda message: next(iter(get(message))).ok.payload.to_bytes()
        endpoint, log, replies = "{server.endpoint}", "{server.log}", []
        far = swath.remote.make_vec("{ENV_ID}", 64, connect=endpoint)
        far.reset(seed=0)
        far.step(np.zeros((64, 1), np.float32))
    """
    here, far = pair(server, num_envs, attempt_s=0.5, deadline_s=15.0)
    command = [sys.executable, "-c", textwrap.dedent(begin) + textwrap.dedent(attack)]
    longest_s, end_s = 0.0, time.monotonic() + 60
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout.readline() == "answered\n"
        for mute in proxy.muted[-attackers:]:
            mute.set()
        print(file=client.stdin, flush=True)
        while server.log.read_text().count("cut off") < attackers:
            assert time.monotonic() < end_s
            begin_s = time.monotonic()
            step_both(here, far, 1)
            others()
            longest_s = max(longest_s, time.monotonic() - begin_s)
        step_both(here, far, 50)
        assert server.end() == 0
        client.kill()
    far.close()
    return longest_s


def test_whoever_asks_again_and_again_and_reads_nothing_holds_up_nobody_for_long(server, proxy):
    # The answer that is kept leaves from a thread of its own.
    attack = """
        assert len(answer(asked["step"])) > 8000
        print("answered", flush=True)
        input()
        while "cut off" not in open(log).read():
            replies.append(get(asked["step"]))
        input()
    """

    def newcomer():
        swath.remote.make(ENV_ID, connect=server.endpoint).close()

    assert longest_wait_beside(server, proxy, attack, newcomer) < 4.0


def test_whoever_steps_and_reads_nothing_is_cut_off_after_a_second(server, proxy):
    attack = """
        message, watch = asked["step"], Watch([endpoint], timeout_s=0.2)
        number = struct.unpack("<Q", message[40:48])[0]
        step = lambda: message[:40] + struct.pack("<Q", number) + message[48:]

        def steps_done():
            stats = watch.read()[0].stats
            return stats and next(of["steps"] for of in stats["open"] if of["envs"] == 64) // 64

        first = number - steps_done()
        number += 1
        assert answer(step())[48] != 255
        print("answered", flush=True)
        input()
        # Each step after the one before it was done, or its reply does not leave at once.
        for _ in range(4000):
            number += 1
            replies.append(get(step()))
            done = steps_done()
            while done is not None and done < number - first:
                done = steps_done()
            if done is None:
                break
        input()
    """
    assert longest_wait_beside(server, proxy, attack) < 4.0


@pytest.mark.slow
def test_as_many_as_there_is_room_for_that_read_nothing_do_not_hold_up_those_that_go_the_usual_way(server, proxy):
    attack = """
        import threading

        def ask_and_ask(session):
            while True:
                replies.append(session.get("swath/v1/default/rpc/step", payload=asked["step"], timeout=60.0))

        attackers = [opened(settings("PROXY", None, low_latency=True), "PROXY") for _ in range(29)]
        print("answered", flush=True)
        input()
        for session in attackers:
            threading.Thread(target=ask_and_ask, args=[session], daemon=True).start()
        input()
    """
    # The rest are this process's own and two of the attacker's, which has asked the kept question.
    assert longest_wait_beside(server, proxy, attack.replace("PROXY", proxy.endpoint), num_envs=512, attackers=29) < 4.0


@pytest.mark.parametrize("low_latency", ["on", "off"])
def test_environments_go_on_to_the_bit_when_their_server_is_started_anew(low_latency):
    server = Server("--allow-snapshot", f"--low-latency={low_latency}")
    here, far = pair(server, 4, resume=True, hash_every=2, attempt_s=0.3)
    assert is_by_low_latency(far) == [low_latency == "on"]
    for _ in range(3):
        step_both(here, far, 15)
        server.end(signal.SIGKILL)
        server.start()
    step_both(here, far, 15)
    assert here.unwrapped.snapshot() == far.snapshot()
    assert far._core.resumed == 3
    far.close()
    server.end()


def test_a_while_after_its_server_was_started_anew_steps_go_by_low_latency_again(server, monkeypatch):
    monkeypatch.setattr("swath.remote.link._AGAIN_S", 1.0)
    here, far = pair(server, 2, resume=True, attempt_s=0.3)
    server.end(signal.SIGKILL)
    server.start()
    step_both(here, far, 1)
    assert is_by_low_latency(far) == [False]
    time.sleep(1.0)
    step_both(here, far, 1)
    assert is_by_low_latency(far) == [True]
    step_both(here, far, 20)
    assert is_by_low_latency(far) == [True]
    far.close()


def test_more_clients_than_low_latency_has_connections_for_go_the_usual_way(server):
    others = [opened(settings(low_latency_endpoint(server), None, low_latency=True), "") for _ in range(32)]
    here, far = pair(server, 2)
    assert is_by_low_latency(far) == [False]
    step_both(here, far, 5)
    far.close()
    for other in others:
        other.close()


def test_an_offer_that_is_none_is_nobodys_concern():
    server = Server("--low-latency=off")
    session = opened(settings(server.endpoint, None), server.endpoint)
    token = session.liveliness().declare_token("swath/v1/default/low-latency/x/abc")
    here, far = pair(server, 2)
    assert is_by_low_latency(far) == [False]
    step_both(here, far, 5)
    far.close()
    token.undeclare()
    session.close()
    server.end()


@pytest.mark.parametrize("how", [signal.SIGSTOP, signal.SIGKILL])
def test_a_client_that_stands_still_or_is_killed_while_it_steps_holds_up_nobody_and_makes_room(server, how):
    code = f"""
        import swath
        far = swath.remote.make_vec(
            "{ENV_ID}", 64, connect="{server.endpoint}", zenoh={{"transport/link/tx/lease": 1000}}
        )
        far.reset(seed=0)
        assert far._batch._links[0].has_low_latency
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
