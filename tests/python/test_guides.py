"""Who follows the guide of agents word by word gets an agent that passes the contract."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs/guides/add-an-agent.md"
NOT_COPIED = shutil.ignore_patterns(".*", "target", "out", "__pycache__", "*.so")
# "In `FILE`, above `LINE`, what for:", or "above the entry with `LINE`", and the code.
STEP = re.compile(r"^In `(\S+)`, above (the entry with )?`([^`]+)`[^\n]*:\n\n```rust\n(.*?)^```$", re.M | re.S)


def follow(folder):
    """Does in a copy of the repository what the guide says."""
    shutil.copy(ROOT / "examples/straight.rs", folder / "agents/src/straight.rs")
    steps = STEP.findall(GUIDE.read_text(encoding="utf-8"))
    for name, is_entry, anchor, code in steps:
        lines = (folder / name).read_text(encoding="utf-8").splitlines(keepends=True)
        places = [number for number, line in enumerate(lines) if line.strip().startswith(anchor)]
        assert len(places) == 1, f"{name} has {len(places)} lines `{anchor}`"
        lines.insert(places[0] - bool(is_entry), code)
        (folder / name).write_text("".join(lines), encoding="utf-8")
    return [name for name, *_ in steps]


def run(folder, *command):
    environment = os.environ | {"CARGO_TARGET_DIR": str(ROOT / "target")}
    ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_an_agent_added_as_the_guide_says_passes_the_contract(tmp_path):
    folder = tmp_path / "swath"
    shutil.copytree(ROOT, folder, ignore=NOT_COPIED)
    assert follow(folder) == ["agents/src/lib.rs", *["agents/src/registry.rs"] * 5]
    run(folder, "cargo", "clippy", "--locked", "-p", "swath-agents", "--", "-D", "warnings")
    run(folder, "cargo", "fmt", "-p", "swath-agents", "--check")
    said = run(folder, "cargo", "test", "--locked", "-p", "swath-tests", "--test", "agent_contract")
    assert "test result: ok" in said


def test_every_place_that_the_guide_names_is_there(tmp_path):
    shutil.copytree(ROOT / "agents", tmp_path / "agents")
    follow(tmp_path)
