"""The wheel that `make wheel-server` builds puts a server on PATH that is the one of this version."""

import os
import subprocess
import venv
import zipfile
from pathlib import Path

import gymnasium as gym
import pytest
from remote_server import same

import swath
from swath.registration import ENV_ID

pytestmark = pytest.mark.timeout(120)

WHEELS = sorted((Path(__file__).parents[2] / "target/wheels-server").glob("swath_server-*.whl"))

if not WHEELS:
    pytest.skip("needs the server's wheel: `make wheel-server` builds it", allow_module_level=True)


def test_pip_puts_a_server_on_path_that_serves(tmp_path):
    venv.create(tmp_path, with_pip=True)
    python = next(file for file in (tmp_path / "bin/python", tmp_path / "Scripts/python.exe") if file.exists())
    command = [python, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", WHEELS[-1]]
    subprocess.run(command, check=True, timeout=60)
    environment = {"PATH": str(python.parent), "SWATH_LOG": "off", "SYSTEMROOT": os.environ.get("SYSTEMROOT", "")}
    version = subprocess.run(
        ["swath-server", "--version"], env=environment, capture_output=True, text=True, timeout=20, check=True
    )
    assert version.stdout == f"swath-server {swath.__version__}\n"
    command = ["swath-server", "--listen", "tcp/127.0.0.1:0"]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            endpoint, name = server.stdout.readline().removeprefix("swath-server ready: ").split()
            assert name == "default"
            with swath.remote.make(ENV_ID, connect=endpoint) as env:
                assert same(env.reset(seed=5), gym.make(ENV_ID).reset(seed=5))
        finally:
            server.terminate()


def test_a_wheel_holds_the_program_and_its_licences_and_nothing_else():
    with zipfile.ZipFile(WHEELS[-1]) as wheel:
        names = wheel.namelist()
    programs = [name for name in names if ".dist-info/" not in name]
    assert len(programs) == 1
    assert "/scripts/swath-server" in programs[0]
    assert sum("LICENSE" in name for name in names) == 2
