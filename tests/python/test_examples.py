"""The examples run."""

import importlib.util
import os
import runpy
import sys
from pathlib import Path

import pytest
from remote_server import SERVER, Server, needs_server, same

from swath.remote.watch import Watch

if importlib.util.find_spec("torch") is None and not os.environ.get("CI"):
    pytest.skip("PyTorch is not installed", allow_module_level=True)

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs an example in this process, and returns what it printed."""

    def call(name, *arguments):
        monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
        runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        return capsys.readouterr().out

    return call


def test_ppo_in_one_file_learns_from_every_rollout(run):
    lines = run("cleanrl_ppo.py", "--total-steps", 512, "--num-steps", 64, "--num-envs", 4).splitlines()
    assert [line.split(":")[0] for line in lines] == ["step 256", "step 512"]


@needs_server
def test_ppo_in_one_file_learns_through_two_servers_what_it_learns_here():
    train = runpy.run_path(str(EXAMPLES / "cleanrl_ppo.py"))
    servers = [Server(), Server()]

    def learned(**where):
        agent = train["train"](train["Args"](total_steps=1024, num_steps=128, num_envs=4, seed=3, **where))
        return {name: part.numpy() for name, part in agent.state_dict().items()}

    here = learned()
    watch = Watch([server.endpoint for server in servers])
    before = watch.read_all()
    far = learned(connect=tuple(server.endpoint for server in servers))
    steps = [now.stats["steps"] - then.stats["steps"] for now, then in zip(watch.read_all(), before, strict=True)]
    watch.close()
    for server in servers:
        server.end()
    assert steps == [512, 512]
    assert same(here, far)
    assert not same(here, learned(clip=0.1)), "what is learned depends on what was done"


def test_ppo_of_stable_baselines3_is_trained_and_drives_beside_snake(run):
    lines = run("stable_baselines3_ppo.py", "--total-steps", 512, "--num-steps", 64, "--num-envs", 4, "--instances", 2)
    trained, ppo, snake = lines.splitlines()
    assert trained == "trained for 512 steps"
    assert ppo.startswith("PPO:   path ")
    assert snake.startswith("SNAKE: path ")


@needs_server
def test_a_training_through_a_server_learns_what_one_here_learns(run):
    arguments = ("--server", SERVER, "--total-steps", 512, "--num-steps", 64, "--num-envs", 4)
    lines = run("remote_training.py", *arguments).splitlines()
    assert lines[0].startswith("the server listens on tcp/127.0.0.1:")
    assert lines[-1] == "the same parameters, bit for bit"


needs_minari = pytest.mark.skipif(sys.version_info < (3, 11), reason="Minari needs Python 3.11")


@needs_minari
def test_a_clone_learns_what_a_dataset_shows_and_drives(run, tmp_path, monkeypatch):
    from swath.datasets import record

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    record("jump", episodes=4, scenario="cowbot-field", dataset_id="jump-v0", episode={"budget": 0.3})
    lines = run("behaviour_cloning.py", "jump-v0", "--epochs", 8, "--width", 32, "--instances", 2).splitlines()
    assert lines[0].startswith("jump-v0: 4 episodes, ")
    errors = [float(line.split("squared error ")[1].split()[0]) for line in lines[1:-1]]
    assert errors[-1] < errors[0]
    assert lines[-1].startswith("on 2 held-out instances: path ")


@needs_minari
def test_a_clone_learns_choices_too(run, tmp_path, monkeypatch):
    from swath.datasets import record

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    blocks = {"action": {"kind": "target"}, "observation": {"kind": "candidates"}, "pasture": {"headland_m": 10.0}}
    record("random", episodes=4, scenario="cowbot-field", dataset_id="chance-v0", **blocks)
    lines = run("behaviour_cloning.py", "chance-v0", "--epochs", 2, "--width", 16, "--instances", 2).splitlines()
    assert [line.split(":")[1][:14] for line in lines[1:-1]] == [" cross entropy", " cross entropy"]
    assert lines[-1].startswith("on 2 held-out instances: path ")


@needs_minari
def test_what_is_to_be_cloned_is_recorded_if_it_is_missing(run, tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    options = ("--agent", "horizon:iterations=100", "--episodes", 2, "--epochs", 1, "--width", 16, "--instances", 1)
    lines = run("behaviour_cloning.py", *options).splitlines()
    assert lines[0].startswith("swath/horizon-drive-v0: 2 episodes, ")
