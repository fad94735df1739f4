"""`swath top` says what real servers do."""

import io
import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from remote_server import Server, needs_server
from rich.console import Console

import swath
from swath import _native
from swath.cli import main
from swath.cli.top import _tables
from swath.registration import ENV_ID
from swath.remote.watch import Reading, SessionReading, Watch

pytestmark = needs_server


@pytest.fixture(scope="module")
def servers():
    servers = [Server(), Server(name="south")]
    yield servers
    for server in servers:
        server.end()


@pytest.fixture
def playing(servers):
    """A client that steps eight environments of the first server until the test is over."""
    env = swath.remote.make_vec(ENV_ID, 8, connect=servers[0].endpoint, client="tractor")
    env.reset(seed=0)
    is_over = threading.Event()

    def play():
        while not is_over.is_set():
            env.step(np.zeros((8, 1), np.float32))

    thread = threading.Thread(target=play)
    thread.start()
    yield env
    is_over.set()
    thread.join()
    env.close()


def test_the_numbers_are_those_of_the_client(servers):
    env = swath.remote.make_vec(ENV_ID, 3, connect=servers[0].endpoint, client="tractor")
    watch = Watch([servers[0].endpoint])
    env.reset(seed=0)
    (before,) = watch.read_all()
    for _ in range(50):
        env.step(np.zeros((3, 1), np.float32))
    (after,) = watch.read_all()
    session = after.sessions[0].stats
    assert (after.stats["sessions"], after.stats["envs"]) == (1, 3)
    assert (session["client"], session["envs"], session["steps"]) == ("tractor", 3, 150)
    seconds = (after.stats["uptime_ms"] - before.stats["uptime_ms"]) / 1000
    assert after.steps_per_s == pytest.approx(150 / seconds)
    assert after.sessions[0].steps_per_s == pytest.approx(150 / seconds)
    # The steps, and the question before.
    assert after.requests_per_s == pytest.approx(51 / seconds)
    assert 1024 <= after.latency_p50_us <= after.latency_p99_us
    env.close()
    (closed,) = watch.read_all()
    assert (closed.stats["sessions"], closed.sessions) == (0, ())
    assert closed.stats["opened"] == after.stats["opened"]
    watch.close()


def test_several_servers_are_asked_and_one_that_falls_silent_is_named():
    servers = [Server(name="north"), Server(name="south")]
    watches = [Watch([server.endpoint], [server.name]) for server in servers]
    assert [watch.read_all()[0].server for watch in watches] == ["north", "south"]
    servers[1].end(signal.SIGKILL)
    assert watches[1].read() == [Reading(servers[1].endpoint, "south")]
    with pytest.raises(swath.RemoteError, match=f"no answer from `south` at {servers[1].endpoint}"):
        watches[1].read_all()
    assert watches[0].read_all()[0].stats["sessions"] == 0
    for watch in watches:
        watch.close()
    for server in servers:
        server.end()


def test_a_server_that_is_down_at_the_start_is_shown_as_silent_until_it_comes(servers):
    late = Server(name="late")
    late.end()
    watch = Watch([late.endpoint, servers[0].endpoint])
    with pytest.raises(swath.RemoteError, match=f"no answer from `default` at {late.endpoint}"):
        watch.read_all()
    nobody, somebody = watch.read_some()
    assert nobody == Reading(late.endpoint, "default")
    assert somebody.stats is not None
    late.name = "default"
    late.start()
    assert [reading.stats is None for reading in watch.read()] == [False, False]
    watch.close()
    late.end()


def test_a_pace_is_not_made_up_from_two_starts_of_a_server():
    stats = {"boot_id": "a", "uptime_ms": 1000, "requests": 5, "steps": 100, "latency_us": [0, 5], "open": []}
    later = stats | {"uptime_ms": 3000, "requests": 15, "steps": 500, "latency_us": [0, 14, 0, 1]}
    reading = Reading.of("here", "it", later, stats)
    assert (reading.steps_per_s, reading.requests_per_s) == (200, 5)
    assert (reading.latency_p50_us, reading.latency_p99_us) == (2, 8)
    assert Reading.of("here", "it", later | {"boot_id": "b"}, stats).steps_per_s is None


def test_a_table_names_server_session_and_pace(servers, playing, capsys):
    flags = [flag for server in servers for flag in ("--connect", server.endpoint)]
    assert main(["top", *flags[:2], "--once", "--every", "0.5"]) == 0
    table = capsys.readouterr().out
    assert servers[0].endpoint in table
    assert "tractor" in table
    assert main(["top", *flags[:2], "--once", "--every", "0.5", "--json"]) == 0
    (reading,) = json.loads(capsys.readouterr().out)
    assert reading["steps_per_s"] > 0
    assert reading["sessions"][0]["stats"]["client"] == "tractor"


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("[/x] [red]field[/red]", "[/x] [red]field[/red]"),
        ("a\x1b[2Jb\rc\nd\u202ee", "a�[2Jb�c�d�e"),
        ("x" * 1000, "x" * 63 + "…"),
        ("", "-"),
    ],
    ids=["markup", "control", "long", "none"],
)
def test_a_name_that_a_client_has_chosen_is_shown_as_it_is_and_cannot_write_to_the_terminal(name, shown):
    counts = dict.fromkeys(("uptime_ms", "sessions", "envs", "faults", "lost"), 1)
    session = SessionReading({"lease": "ab", "client": name, "envs": 1, "steps": 2, "age_ms": 3, "idle_ms": 4}, 1.0)
    console = Console(file=io.StringIO(), width=200, force_terminal=True, color_system=None)
    endpoint = "tcp/[fe80::1]:7447"
    console.print(_tables([Reading(endpoint, "it", counts, sessions=(session,))]))
    text = console.file.getvalue()
    assert text.splitlines()[-2].rstrip().endswith(f" it      {shown}")
    assert endpoint in text
    assert not set(text) & set("\x1b\r\u202e")


@pytest.mark.parametrize("width", [40, 60, 80, 100, 200])
def test_a_narrow_terminal_has_fewer_columns_and_every_number_whole(width):
    counts = dict.fromkeys(("uptime_ms", "sessions", "faults", "lost"), 9_876_543) | {"envs": 16_384}
    row = {"lease": "ab12cd34", "client": "tractor", "envs": 16_384, "steps": 987_654_321, "age_ms": 3, "idle_ms": 4}
    reading = Reading(
        "tcp/field.example.org:port",
        "default",
        counts,
        905_730.0,
        123.0,
        131_072,
        262_144,
        sessions=(SessionReading(row, 905_730.0),),
    )
    console = Console(file=io.StringIO(), width=width)
    console.print(_tables([reading], width))
    words = console.file.getvalue().split()
    numbers = {word for word in words if any(map(str.isdigit, word)) and not word.startswith(("tcp/", "p"))}
    whole = {"9876543", "16384", "905,730", "123", "131.1", "262.1", "ab12cd34", "987,654,321", "0.0", "2", "44"}
    assert numbers <= whole, numbers - whole
    assert {"16384", "905,730"} <= numbers
    assert words.count("16384") == 2


def test_a_server_that_is_named_twice_is_asked_once(servers, capsys):
    endpoint = servers[0].endpoint
    assert main(["top", "--connect", endpoint, "--connect", endpoint, "--once", "--every", "0.1", "--json"]) == 0
    (reading,) = json.loads(capsys.readouterr().out)
    assert reading["stats"] is not None


@pytest.mark.parametrize("flags", [[], ["--json"]])
def test_ctrl_c_ends_it_and_says_nothing(servers, flags):
    command = [sys.executable, "-m", "swath", "top", "--connect", servers[0].endpoint, "--every", "0.1", *flags]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as top:
        assert top.stdout is not None
        assert top.stdout.readline()
        top.send_signal(signal.SIGINT)
        _, error = top.communicate(timeout=10)
        assert (top.returncode, error) == (0, "")


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="there is no pseudo-terminal")
def test_on_a_terminal_the_table_stays_in_one_place(servers):
    above, terminal = os.openpty()
    command = [sys.executable, "-m", "swath", "top", "--connect", servers[0].endpoint, "--every", "0.1"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with subprocess.Popen(command, stdout=terminal, stderr=subprocess.PIPE, env=environment) as top:
        os.close(terminal)
        shown = b""
        while shown.count(b"default") < 3:
            shown += os.read(above, 65536)
        top.send_signal(signal.SIGINT)
        assert top.wait(10) == 0
        while True:
            try:
                rest = os.read(above, 65536)
            except OSError:
                break
            shown += rest
        assert top.stderr is not None
        assert top.stderr.read() == b""
    os.close(above)
    assert b"\x1b[1A" in shown, "it goes up to draw over what was there"
    assert shown.rstrip().endswith(b"\x1b[?25h"), "it gives the cursor back"


@pytest.mark.parametrize(
    ("flags", "text"),
    [
        (["--connect", "nowhere"], "`connect` must be an endpoint such as 'tcp/127.0.0.1:7447', got 'nowhere'"),
        (["--connect", "tcp/127.0.0.1:1"], "no server at tcp/127.0.0.1:1: "),
        (["--connect", "tcp/127.0.0.1:1", "--every", "0"], "`--every` must be from 0.1 to 3600 seconds, got 0"),
        (["--connect", "tcp/127.0.0.1:1", "--tls-ca", "ca.pem"], "`--tls-key` must come together, got only some"),
        ([], "Missing option '--connect'"),
    ],
)
def test_what_cannot_be_watched_is_one_line_and_status_2(flags, text, capsys):
    assert main(["top", *flags]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert text in error
    assert len(error.splitlines()) == 1


def test_a_name_that_no_server_has_is_one_line_and_status_2(servers, capsys):
    assert main(["top", "--connect", servers[0].endpoint, "--server", "west"]) == 2
    _, error = capsys.readouterr()
    assert error.startswith(f"swath: no answer from `west` at {servers[0].endpoint}: ")
    assert len(error.splitlines()) == 1


@pytest.mark.parametrize("message", [b"", b"SWTH", b"x" * 60, _native.stats_request()])
def test_bytes_that_are_no_reply_are_refused(message):
    with pytest.raises(swath.RemoteError):
        _native.read_stats(message)


def test_an_answer_of_the_golden_messages_is_read_field_by_field():
    text = (Path(__file__).parents[2] / "docs/protocol/golden_messages.txt").read_text()
    golden = dict(line.split() for line in text.splitlines())
    stats = _native.read_stats(bytes.fromhex(golden["stats_reply"]))
    assert stats["uptime_ms"] == 60_000
    assert (stats["sessions"], stats["envs"], stats["opened"], stats["lost"]) == (1, 2, 3, 1)
    with pytest.raises(swath.RemoteError, match="busy"):
        _native.read_stats(bytes.fromhex(golden["fault_busy"]))
