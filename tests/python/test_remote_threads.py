"""Threads of servers and clients: which there are, who waits awake, and what holds up whom."""

from __future__ import annotations

import re
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from remote_server import SERVER, SHORT, Server, actions_for, free_port, needs_server, same

import swath
from swath.registration import ENV_ID
from swath.remote.link import Answers

pytestmark = needs_server


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="threads are looked for where Linux shows them")
@pytest.mark.parametrize(
    ("first", "own", "kinds"),
    [
        ("swath", None, {"net", "rx", "tx"}),
        ("zenoh", None, {"app", "net", "rx", "tx"}),
        ("swath", "(net: (handover: rx))", {"app", "rx", "tx"}),
    ],
)
def test_zenoh_has_three_kinds_of_threads_unless_others_have_imported_it_or_the_environment_says_otherwise(
    server, first, own, kinds, monkeypatch
):
    if own is None:
        monkeypatch.delenv("ZENOH_RUNTIME", raising=False)
    else:
        monkeypatch.setenv("ZENOH_RUNTIME", own)
    code = f"""
        import os, {first}, swath
        far = swath.remote.make("{ENV_ID}", connect="{server.endpoint}")
        for thread in os.listdir("/proc/self/task"):
            try:
                with open(f"/proc/self/task/{{thread}}/comm") as name:
                    print(name.read().strip())
            except OSError:
                pass  # It has ended.
        print(os.environ.get("ZENOH_RUNTIME"))
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    client = subprocess.run(command, capture_output=True, text=True, timeout=20, check=True)
    *names, told = client.stdout.splitlines()
    assert told == str(own)
    # Those of Zenoh's are called by their kind and a number.
    assert {name.partition("-")[0] for name in names if re.fullmatch(r"[a-z]+-[0-9]+", name)} == kinds


def test_threads_that_zenoh_cannot_read_are_refused_in_one_line_by_clients_and_servers(server, monkeypatch):
    monkeypatch.setenv("ZENOH_RUNTIME", "(wx: 1)")
    code = f"""
        import swath
        try:
            swath.remote.make("{ENV_ID}", connect="{server.endpoint}")
        except swath.ConfigError as error:
            print(error)
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    client = subprocess.run(command, capture_output=True, text=True, timeout=20, check=True)
    text = "`ZENOH_RUNTIME` must be threads as Zenoh reads them, got "
    assert client.stdout == f"{text}'(wx: 1)'\n"
    command = [SERVER, "--listen", "tcp/127.0.0.1:0"]
    refused = subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
    assert refused.returncode == 2
    assert refused.stderr.endswith(f'swath-server: {text}"(wx: 1)"\n')


@pytest.mark.parametrize("filters", ["info,zenoh=quiet", "inof"])
def test_a_server_refuses_filters_of_its_log_that_are_none_in_one_line(monkeypatch, filters):
    monkeypatch.setenv("SWATH_LOG", filters)
    refused = subprocess.run([SERVER], capture_output=True, text=True, timeout=20, check=False)
    assert refused.returncode == 2
    text = "`SWATH_LOG` must be filters such as `info,zenoh=off`, got"
    assert refused.stderr == f"swath-server: {text} `{filters}`\n"


@pytest.mark.parametrize(("first", "told"), [("zenoh", "stepped"), ("swath", "RemoteTimeout")])
def test_a_subscriber_that_nobody_reads_holds_up_no_step_if_zenoh_was_imported_first_and_else_no_deadline(
    server, first, told, monkeypatch
):
    monkeypatch.delenv("ZENOH_RUNTIME", raising=False)
    code = f"""
        import {first}, json, os, swath
        far = swath.remote.make("{ENV_ID}", connect="{server.endpoint}", deadline_s=2.0)
        far.reset(seed=7)
        far.action_space.seed(7)
        import zenoh

        def opened(**settings):
            config = zenoh.Config()
            config.insert_json5("scouting/multicast/enabled", "false")
            for path, value in settings.items():
                config.insert_json5(path.replace("_", "/"), json.dumps(value))
            return zenoh.open(config)

        endpoints = ["tcp/127.0.0.1:{free_port()}"]
        deaf = opened(listen_endpoints=endpoints)
        subscriber = deaf.declare_subscriber("much")
        other = opened(mode="client", connect_endpoints=endpoints)
        for _ in range(1000):
            other.put("much", b"", congestion_control=zenoh.CongestionControl.DROP)
        try:
            for _ in range(50):
                far.step(far.action_space.sample())
            print("stepped")
        except swath.RemoteTimeout:
            print("RemoteTimeout")
        print(sum(1 for _ in iter(subscriber.try_recv, None)), flush=True)
        # Zenoh would wait for the subscriber.
        os._exit(0)
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=30, check=True)
    outcome, waiting = run.stdout.split()
    assert outcome == told
    assert int(waiting) >= 256, "its channel was full"


def test_a_server_steps_few_environments_at_once_and_leaves_many_to_a_worker(tmp_path, monkeypatch):
    monkeypatch.setenv("SWATH_LOG", "swath_server=trace")
    steps = {}
    for count in (1, 2048):
        log = tmp_path / f"{count}.txt"
        server = Server(log=log)
        far = swath.remote.make_vec(ENV_ID, count, connect=server.endpoint)
        far.reset(seed=3)
        actions = np.zeros((count, *far.single_action_space.shape), np.float32)
        for _ in range(60):
            far.step(actions)
        far.close()
        server.end()
        text = log.read_text()
        assert text.count("answered") >= 60
        steps[count] = text.count("done at once")
    # Where a core is another's for a while, a step is not as brief as it was.
    assert steps[1] > 0
    assert steps[2048] == 0


@pytest.mark.parametrize("awake_s", [0.0, 60.0])
def test_answers_are_the_same_whether_they_find_their_client_awake_or_asleep(server, monkeypatch, awake_s):
    monkeypatch.setattr("swath.remote.link._AWAKE_S", awake_s)
    monkeypatch.setattr("swath.remote.link._TAKEN_S", 60.0)
    here = gym.make_vec(ENV_ID, num_envs=3, **SHORT)
    # An answer that gets lost in the client is not asked for again.
    far = swath.remote.make_vec(ENV_ID, 3, connect=[server.endpoint] * 2, attempt_s=60.0, **SHORT)
    assert same(far.reset(seed=7)[0], here.reset(seed=7)[0])
    rng = np.random.default_rng(2)
    for _ in range(50):
        actions = actions_for(here, rng)
        assert all(map(same, here.step(actions), far.step(actions)))
    far.close()


def test_only_after_a_quick_answer_is_the_next_one_waited_for_awake_until_another_takes_the_core(monkeypatch):
    class Replies:
        """Has nothing yet so many times that one looks, and is then worth a time of sleep."""

        def __init__(self, looks, sleep_s=0.0):
            self.looks, self.sleep_s = looks, sleep_s
            message = SimpleNamespace(to_bytes=lambda: b"answer")
            self.reply = SimpleNamespace(ok=SimpleNamespace(payload=message))

        def try_recv(self):
            self.looks -= 1
            return None if self.looks >= 0 else self.reply

        def __iter__(self):
            time.sleep(self.sleep_s)
            yield self.reply

    ways = []
    monkeypatch.setattr("swath._native.give_way", lambda: ways.append(1))
    monkeypatch.setattr("swath.remote.link._TAKEN_S", 0.1)
    monkeypatch.setattr("swath.remote.link._AWAKE_S", 0.2)
    own = SimpleNamespace(is_quick=True)

    def waits(replies):
        ways.clear()
        assert next(iter(Answers(own, replies))) == b"answer"
        return len(ways)

    assert waits(Replies(3)) == 3
    assert own.is_quick
    assert waits(Replies(10**9)) > 0
    assert not own.is_quick
    assert waits(Replies(3, sleep_s=0.3)) == 0
    assert not own.is_quick
    assert waits(Replies(3)) == 0
    assert own.is_quick
    assert waits(Replies(2)) == 2
    # Another takes the core.
    monkeypatch.setattr("swath.remote.link._TAKEN_S", 0.0002)
    monkeypatch.setattr("swath._native.give_way", lambda: ways.append(time.sleep(0.001)))
    assert waits(Replies(2)) == 1
    assert own.is_quick
