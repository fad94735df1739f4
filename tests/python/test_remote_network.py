"""A network that loses, delays and doubles what goes through it, between environments and their server."""

from __future__ import annotations

import queue
import random
import signal
import subprocess
import sys
import textwrap
import threading
import time

import gymnasium as gym
import numpy as np
import pytest
from proxy import Proxy
from remote_server import SHORT, Server, free_port, needs_server, same

import swath
from swath.registration import ENV_ID
from swath.remote.session import opened, settings

pytestmark = needs_server

VERBS = ("open", "reset", "step", "snapshot", "restore", "close", "stats")


class Network:
    """Passes questions and answers on by Zenoh. What `harm` names befalls them, at most one thing each."""

    def __init__(self, server, harm=lambda: ""):
        import zenoh

        self.server, self.harm, self.met = server, harm, dict.fromkeys(("lost", "late", "doubled", "another"), 0)
        self.connect_anew()
        port = free_port()
        self.endpoint = f"tcp/127.0.0.1:{port}"
        config = zenoh.Config()
        for path, value in (
            ("mode", '"peer"'),
            ("listen/endpoints", f'["{self.endpoint}"]'),
            ("scouting/multicast/enabled", "false"),
            ("scouting/gossip/enabled", "false"),
        ):
            config.insert_json5(path, value)
        self.clients, self.questions = zenoh.open(config), queue.SimpleQueue()
        keys = [f"swath/v1/default/rpc/{verb}" for verb in VERBS] + ["swath/*/default/rpc/spec"]
        self.queryables = [self.clients.declare_queryable(key, self.questions.put, complete=True) for key in keys]
        threading.Thread(target=self.pass_on, daemon=True).start()

    def connect_anew(self):
        self.to = opened(settings(self.server.endpoint, None), self.server.endpoint)

    def pass_on(self):
        while (question := self.questions.get()) is not None:
            threading.Thread(target=self.ask, args=[question], daemon=True).start()

    def ask(self, question):
        key, message = str(question.key_expr), question.payload.to_bytes() if question.payload else b""
        with question:
            if not self.befalls(lambda: list(self.to.get(key, payload=message, timeout=0.2))):
                return
            for reply in self.to.get(key, payload=message, timeout=1.0):
                if reply.ok is None:
                    continue
                answer = reply.ok.payload.to_bytes()
                if self.befalls(lambda answer=answer: question.reply(key, answer)):
                    question.reply(key, answer)
                    if key.endswith("/step") and self.harm() == "another":
                        self.met["another"] += 1
                        # As of a server that was started at another time.
                        question.reply(key, answer[:8] + bytes([answer[8] ^ 1]) + answer[9:])

    def befalls(self, once_more):
        """Harms a question or an answer, and returns whether it arrives."""
        harm = self.harm()
        if harm in self.met and harm != "another":
            self.met[harm] += 1
        if harm == "doubled":
            once_more()
        elif harm in ("late", "lost"):
            # Later than an attempt takes.
            time.sleep(0.35)
        return harm != "lost"

    def end(self):
        self.questions.put(None)
        self.clients.close()


@pytest.mark.parametrize(
    ("calls", "resume"),
    [
        (100, False),
        (100, True),
        pytest.param(800, False, marks=pytest.mark.slow),
        pytest.param(240, True, marks=pytest.mark.slow),
    ],
)
def test_whatever_the_network_does_every_call_is_carried_out_once_and_as_it_is_here(calls, resume):
    dice = random.Random(calls)
    server = Server("--allow-snapshot", "--grace-ms", "60000")
    network = Network(server, lambda: dice.choices(["", "lost", "late", "doubled"], [0.82, 0.05, 0.05, 0.08])[0])
    patience = {"attempt_s": 0.2, "deadline_s": 20.0, "resume": resume, "hash_every": 3}
    here = gym.make_vec(ENV_ID, num_envs=3, **SHORT)
    far = swath.remote.make_vec(ENV_ID, 3, connect=network.endpoint, **patience, **SHORT)
    assert same(far.reset(seed=1), here.reset(seed=1))
    kept = []
    for number in range(calls):
        if resume and number % 40 == 20:
            server.end(signal.SIGKILL)
            server.start()
            network.connect_anew()
        call, row = (
            dice.choices(["step", "reset", "snapshot", "restore"], [16, 1, 2, 1])[0],
            dice.choice([None, 0, 1, 2]),
        )
        if call == "step":
            actions = np.array([[dice.uniform(-1, 1)] for _ in range(3)], np.float32)
            assert all(map(same, far.step(actions), here.step(actions))), number
        elif call == "reset":
            assert same(far.reset(seed=number), here.reset(seed=number)), number
        elif call == "snapshot":
            kept.append((row, far._core.snapshot(row)))
            assert kept[-1][1] == here.unwrapped._core.snapshot(row), number
        elif kept:
            row, snapshot = dice.choice(kept)
            far._core.restore(snapshot, row)
            here.unwrapped._core.restore(snapshot, row)
    assert far._core.snapshot() == here.unwrapped._core.snapshot()
    assert all(network.met[harm] > calls // 20 for harm in ("lost", "late", "doubled")), network.met
    assert not resume or far._core.resumed >= calls // 40
    far.close()
    network.end()
    server.end(signal.SIGKILL)


def test_a_second_server_of_the_name_that_answers_too_is_told_at_the_next_call():
    server = Server()
    is_there = threading.Event()
    network = Network(server, lambda: "another" if is_there.is_set() else "")
    far = swath.remote.make_vec(ENV_ID, 2, connect=network.endpoint, **SHORT)
    far.reset(seed=0)
    actions = np.zeros((2, 1), np.float32)
    for _ in range(20):
        far.step(actions)
    is_there.set()
    far.step(actions)
    end_s = time.monotonic() + 5
    while not network.met["another"]:
        assert time.monotonic() < end_s
        time.sleep(0.01)
    time.sleep(0.1)
    with pytest.raises(swath.RemoteError, match=r"^two servers have the same name$"):
        far.step(actions)
    far.close()
    network.end()
    server.end(signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.parametrize("reads", ["nothing", "slowly"])
def test_a_client_that_steps_on_without_reading_holds_up_the_others_once_at_most(reads):
    server = Server()
    proxy = Proxy(int(server.endpoint.rpartition(":")[2]))
    attack = f"""
        import struct
        import numpy as np
        import swath
        from swath.remote.link import Link
        from swath.remote.watch import Watch
        Link.use_low_latency = lambda *_: None
        ask, asked = Link.ask, {{}}
        Link.ask = lambda link, verb, *what: (asked.update({{verb: what[0]}}), ask(link, verb, *what))[1]
        far = swath.remote.make_vec("{ENV_ID}", 64, connect="{proxy.endpoint}")
        far.reset(seed=0)
        far.step(np.zeros((64, 1), np.float32))
        session, watch = far._core._links[0]._usual.session, Watch(["{server.endpoint}"], timeout_s=30)
        message = asked["step"]
        number = struct.unpack("<Q", message[40:48])[0]
        steps_done = lambda: next(of["steps"] for of in watch.read()[0].stats["open"] if of["envs"] == 64) // 64
        before = number - steps_done()
        print("begun", flush=True)
        input()
        replies = []
        while True:
            number += 1
            step = message[:40] + struct.pack("<Q", number) + message[48:]
            replies.append(session.get("swath/v1/default/rpc/step", payload=step, timeout=60.0))
            while steps_done() < number - before:
                pass
    """
    command = [sys.executable, "-c", textwrap.dedent(attack)]
    far = swath.remote.make_vec(ENV_ID, 2, connect=server.endpoint, **SHORT)
    far.reset(seed=0)
    actions, waits_s, end_s = np.zeros((2, 1), np.float32), [], time.monotonic() + 25
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout.readline() == "begun\n"
        if reads == "slowly":
            proxy.is_slow.set()
        else:
            proxy.muted[0].set()
        print(file=client.stdin, flush=True)
        while time.monotonic() < end_s:
            begin_s = time.monotonic()
            far.step(actions)
            waits_s.append(time.monotonic() - begin_s)
        client.kill()
    # Nor does the first time always come.
    assert sum(wait_s > 0.5 for wait_s in waits_s) <= 1, sorted(waits_s)[-4:]
    proxy.listener.close()
    for mute in proxy.muted:
        mute.clear()
    far.close()
    server.end(signal.SIGKILL)
