"""Processes with environments on servers that end, or fork: nothing hangs, and places become free."""

from __future__ import annotations

import os
import re
import resource
import signal
import subprocess
import sys
import textwrap
import time

import pytest
from remote_server import Server, needs_server

import swath
from swath.registration import ENV_ID

pytestmark = needs_server


@pytest.fixture
def own_server():
    server = Server("--grace-ms", "300", "--max-sessions", "2")
    yield server
    server.end(signal.SIGKILL)


def test_environments_that_are_forgotten_make_room(own_server):
    for _ in range(5):
        env = swath.remote.make(ENV_ID, connect=own_server.endpoint)
        env.reset(seed=0)
        del env
        end_s = time.monotonic() + 10
        while time.monotonic() < end_s:
            try:
                swath.remote.make(ENV_ID, connect=own_server.endpoint).close()
                break
            except swath.RemoteError:
                time.sleep(0.1)
        assert time.monotonic() < end_s


@pytest.mark.parametrize("end", ["pass", "raise SystemExit(0)", "env.close()"])
def test_a_process_ends_promptly_with_or_without_close(server, end):
    code = f"""
        import swath
        env = swath.remote.make("{ENV_ID}", connect="{server.endpoint}")
        env.reset(seed=0)
        {end}
    """
    assert subprocess.run([sys.executable, "-c", textwrap.dedent(code)], timeout=20, check=False).returncode == 0


def test_a_process_that_ends_closes_its_sessions_and_the_log_says_whose_and_why(tmp_path):
    server = Server("--grace-ms", "500", log=tmp_path / "log")
    code = f"""
        import os, swath
        env = swath.remote.make_vec("{ENV_ID}", 3, connect="{server.endpoint}", client="tractor")
        if hasattr(os, "fork") and os.fork() == 0:
            raise SystemExit(0)
        elif hasattr(os, "fork"):
            os.wait()
        env.reset(seed=0)
    """
    try:
        subprocess.run([sys.executable, "-c", textwrap.dedent(code)], timeout=20, check=True)
        subprocess.run(
            [sys.executable, "-c", textwrap.dedent(code) + "os.kill(os.getpid(), 9)"], timeout=20, check=False
        )
        end_s = time.monotonic() + 10
        while len(said := re.findall(r"(opened|freed) (.*)", (tmp_path / "log").read_text())) < 4:
            assert time.monotonic() < end_s, said
            time.sleep(0.1)
    finally:
        server.end()
    for (opened, first), (freed, last), why in [(*said[:2], "closed"), (*said[2:], "client gone")]:
        of = re.fullmatch(r'session="(\w{8})" lease="(\w{8})" client="tractor" envs=3', first)
        assert (opened, freed) == ("opened", "freed")
        assert of is not None, first
        assert last == f'session="{of[1]}" lease="{of[2]}" why="{why}"'


def test_a_process_ends_within_moments_though_its_server_stands_still():
    server = Server()
    code = f"""
        import os, signal, swath
        envs = [swath.remote.make("{ENV_ID}", connect="{server.endpoint}") for _ in range(3)]
        os.kill({server.process.pid}, signal.SIGSTOP)
        print("over", flush=True)
    """
    try:
        with subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE) as client:
            assert client.stdout is not None
            assert client.stdout.readline() == b"over\n"
            start_s = time.monotonic()
            assert client.wait(15) == 0
            assert time.monotonic() - start_s < 4
    finally:
        server.process.send_signal(signal.SIGCONT)
        server.end(signal.SIGKILL)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_child_is_told_and_ends(server):
    code = f"""
        import os, sys, swath
        env = swath.remote.make("{ENV_ID}", connect="{server.endpoint}")
        env.reset(seed=0)
        child = os.fork()
        if child == 0:
            try:
                env.step([0.0])
            except swath.RemoteError as error:
                assert "forked" in str(error), error
                sys.exit(7)
            sys.exit(1)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
        env.step([0.0])
        env.close()
    """
    assert subprocess.run([sys.executable, "-c", textwrap.dedent(code)], timeout=20, check=False).returncode == 0


def test_a_server_takes_as_many_connections_as_the_system_lets_it_have():
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (256, hard))
    try:
        server = Server()
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE) == (hard, hard)
    server.end()
