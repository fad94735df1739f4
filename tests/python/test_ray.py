"""On Ray a sweep has the rows of the local run, whatever becomes of a worker; RLlib and Tune train, here and far off.

`make test-ray` runs this in an environment of its own, where only the loopback exists if the system allows it.
"""

import csv
import importlib.util
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from remote_server import Server, needs_server

import swath
from swath.cli import main

if importlib.util.find_spec("ray") is None:
    pytest.skip("needs Ray: `make test-ray` installs it", allow_module_level=True)

import ray

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

EXAMPLES = Path(__file__).parents[2] / "examples"


def rows_of(folder):
    """The rows of a finished evaluation but for the only number that a clock has written."""
    with (folder / "episodes.csv").open(newline="") as file:
        return [{key: row[key] for key in row if key != "wall_s"} for row in csv.DictReader(file)]


def busy_workers():
    """The processes below this one that run episodes for Ray."""
    parents, names = {}, {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat, command = (entry / "stat").read_text(), (entry / "cmdline").read_bytes()
            except OSError:
                continue
            # The name in parentheses may hold anything.
            parents[int(entry.name)] = int(stat.rpartition(")")[2].split()[1])
            names[int(entry.name)] = command
    for pid, name in names.items():
        above = pid
        while above in parents and above != os.getpid():
            above = parents[above]
        if above == os.getpid() and name.startswith(b"ray::_episodes"):
            yield pid


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="finds its workers in /proc")
def test_a_sweep_of_200_episodes_with_killed_workers_has_the_rows_of_the_local_run(tmp_path):
    sweep = {
        "scenario": {"pasture": {"length_m": 400.0, "width_m": 300.0}, "weeds": {"count": 400}},
        "instances": 100,
        "seed": 7,
    }
    agents = ["jump", "bcp-tsp"]
    swath.evaluate(agents, **sweep, out=tmp_path / "here")
    killed = []
    is_over = threading.Event()

    def kill():
        journal = tmp_path / "ray" / "journal.jsonl"
        for count in (1, 60, 120):
            while not is_over.is_set():
                lines = journal.read_bytes().count(b"\n") if journal.exists() else 0
                pid = next(busy_workers(), None) if lines >= count else None
                if pid is not None:
                    os.kill(pid, signal.SIGKILL)
                    killed.append(lines)
                    break
                time.sleep(0.005)

    killer = threading.Thread(target=kill)
    killer.start()
    swath.evaluate(agents, **sweep, jobs=2, backend="ray", out=tmp_path / "ray")
    is_over.set()
    killer.join()
    assert len(killed) == 3
    assert max(killed) < 200
    assert len(rows_of(tmp_path / "ray")) == 200
    assert rows_of(tmp_path / "ray") == rows_of(tmp_path / "here")
    # Every episode was kept once.
    assert (tmp_path / "ray" / "journal.jsonl").read_bytes().count(b"\n") == 201


def test_a_sweep_that_was_begun_here_goes_on_on_ray(tmp_path, capsys):
    command = ["evaluate", "cowbot-field", "--agents", "jump,snake", "--instances", "20"]
    assert main([*command, "--out", str(tmp_path / "here")]) == 0
    journal = (tmp_path / "here" / "journal.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "ray").mkdir()
    (tmp_path / "ray" / "journal.jsonl").write_bytes(b"".join(journal[:15]))
    capsys.readouterr()
    assert main([*command, "--backend", "ray", "--jobs", "2", "--out", str(tmp_path / "ray")]) == 0
    assert rows_of(tmp_path / "ray") == rows_of(tmp_path / "here")
    assert (tmp_path / "ray" / "journal.jsonl").read_bytes().startswith(b"".join(journal[:15]))
    assert "wrote " in capsys.readouterr().out


def test_a_cluster_that_is_there_is_used_and_left_running(tmp_path):
    import ray

    ray.init(address="local", num_cpus=1, include_dashboard=False, log_to_driver=False)
    try:
        far = swath.evaluate("jump", scenario="cowbot-field", instances=3, backend="ray")
        assert ray.is_initialized()
    finally:
        ray.shutdown()
    here = swath.evaluate("jump", scenario="cowbot-field", instances=3)
    assert [row.path_length_m for row in far.rows] == [row.path_length_m for row in here.rows]


def test_workers_of_another_build_are_refused_by_name(monkeypatch):
    monkeypatch.setattr("swath.evaluation.on_ray.build", lambda: "another")
    with pytest.raises(swath.SwathError, match="`backend` must have workers with this build of swath, another"):
        swath.evaluate("jump", scenario="cowbot-field", instances=3, backend="ray", jobs=1)


def test_an_error_of_ray_without_a_text_is_called_by_its_kind(monkeypatch):
    def fail(*_, **__):
        raise ConnectionError

    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    monkeypatch.setattr(ray, "init", fail)
    with pytest.raises(swath.SwathError, match=r"^Ray cannot be started: ConnectionError$"):
        swath.evaluate("jump", scenario="cowbot-field", instances=1, backend="ray")


def test_ray_that_does_not_start_is_one_line_and_status_2(tmp_path, monkeypatch, capfd):
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    # Longer than the name of a socket may be.
    monkeypatch.setenv("RAY_TMPDIR", str(tmp_path / ("x" * 110)))
    (tmp_path / ("x" * 110)).mkdir()
    arguments = ["--agents", "jump", "--instances", "1", "--out", str(tmp_path / "out")]
    assert main(["evaluate", "cowbot-field", *arguments, "--backend", "ray"]) == 2
    last = capfd.readouterr().err.splitlines()[-1]
    assert last.startswith("swath: Ray cannot be started: ")
    assert "107 bytes" in last


def test_a_cluster_that_is_not_there_is_one_line_and_status_2(monkeypatch, capfd):
    monkeypatch.setenv("RAY_ADDRESS", "127.0.0.1:1")
    assert main(["evaluate", "cowbot-field", "--agents", "jump", "--instances", "1", "--backend", "ray"]) == 2
    error = capfd.readouterr().err
    assert error.startswith("swath: `RAY_ADDRESS` must be where the head of a Ray cluster listens, got 127.0.0.1:1: ")
    assert len(error.splitlines()) == 1


def example(name, *arguments):
    """Runs an example in a process of its own, and returns the numbers that it prints."""
    command = [sys.executable, str(EXAMPLES / name), *map(str, arguments)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
    assert run.returncode == 0, run.stderr
    return re.findall(r"^(?:iteration|learning rate) .*: return .*$|^iteration .*$", run.stdout, re.MULTILINE)


SHORT = ("--num-envs", 4, "--batch-size", 256, "--budget", 0.02)


@needs_server
@pytest.mark.parametrize("mode", ["vector_entry_point", "sync"])
def test_rllib_learns_through_servers_what_it_learns_here(mode):
    flags = ("--iterations", 3, "--minibatch-size", 64, "--vectorize-mode", mode, *SHORT)
    servers = [Server(), Server()]
    here = example("rllib_ppo.py", *flags)
    far = example("rllib_ppo.py", *flags, *(word for server in servers for word in ("--connect", server.endpoint)))
    for server in servers:
        server.end()
    assert len(here) == 3
    assert here == far


def test_tune_runs_trials_side_by_side_and_names_the_best_first(tmp_path):
    lines = example("ray_tune.py", "--samples", 2, "--jobs", 2, "--iterations", 3, "--out", tmp_path, *SHORT)
    returns = [float(line.rsplit(" ", 1)[1]) for line in lines]
    assert len(returns) == 2
    assert returns == sorted(returns, reverse=True)
