"""The examples run."""

import importlib.util
import os
import runpy
import sys
from pathlib import Path

import pytest
from remote_server import Server, needs_server, same

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


@pytest.mark.skipif(sys.version_info < (3, 11), reason="Minari needs Python 3.11")
def test_a_clone_learns_what_a_dataset_shows_and_drives(run, tmp_path, monkeypatch):
    from swath.datasets import record

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    record("jump", episodes=4, scenario="cowbot-field", dataset_id="jump-v0", episode={"budget": 0.3})
    lines = run("behaviour_cloning.py", "jump-v0", "--epochs", 8, "--width", 32, "--instances", 2).splitlines()
    errors = [float(line.split("squared error ")[1].split()[0]) for line in lines[:-1]]
    assert errors[-1] < errors[0]
    assert lines[-1].startswith("on 2 held-out instances: path ")
