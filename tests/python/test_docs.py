"""What the pages show runs: every block of Python and of shell on the site, in the README and in the docstrings.

The blocks of a page run in its order, in one namespace and one folder that looks like the top of the repository.
Numbers that take long are made smaller, and ports become free ones. What is not run says why: in the page, in a comment
`<!-- skip: next "the reason" -->` above the block, or here.
"""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from unittest import SkipTest

import gymnasium as gym
import pytest
from remote_server import SERVER, Server, needs_server

import swath
from swath._native import shipped_trainings

if importlib.util.find_spec("torch") is None and not os.environ.get("CI"):
    pytest.skip("PyTorch is not installed", allow_module_level=True)
if sys.version_info < (3, 11):
    pytest.skip("Sybil and Minari need Python 3.11", allow_module_level=True)

import tomllib
from sybil.document import Document, PythonDocStringDocument
from sybil.evaluators.python import PythonEvaluator
from sybil.parsers.markdown import CodeBlockParser, SkipParser

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    page.relative_to(ROOT).as_posix()
    for pattern in ("README.md", "docs/**/*.md", "examples/**/*.md", "agents/learned/*.md", "benchmarks/*.md")
    for page in ROOT.glob(pattern)
    if re.search(r"^ *```(python|sh)$", page.read_text(encoding="utf-8"), re.MULTILINE)
)
DOCSTRINGS = sorted(
    module.relative_to(ROOT).as_posix()
    for module in ROOT.glob("env-py/python/swath/**/*.py")
    if "```python" in module.read_text(encoding="utf-8")
)
LANGUAGES = {"", "json5", "math", "python", "rust", "sh", "text", "toml"}

NOT_RUN = {
    r"swath evaluate .*--backend ray": "Ray has an environment of its own, where `make test-ray` runs this",
    r"swath bench": "it holds a clock for some seconds, and test_throughput.py runs it",
    r"python examples/": "test_examples.py runs it, where PyTorch is loaded already",
}
"""Lines of shell that are not run, and why; beside those that begin with `make` or `pip`.

Targets, extras and scripts are looked up."""

SMALLER = {
    r"\binstances=\d+": "instances=2",
    r"--instances \d+": "--instances 2",
    r"\bepisodes=\d+": "episodes=2",
    r"--episodes \d+": "--episodes 2",
    r"\bswath train ([\w-]+)": r"swath train tiny/\1.toml",
    r"write_film\((\w+), Path\(\"(\S+\.gif)\"\)\)": r'write_film(\1, Path("\2"), fps=5, seconds=1)',
    r"\bswath top\b": "swath top --once --every 0.1",
}
"""What is written in a page, and what takes its place, so that it runs in seconds."""


class Desk:
    """Where the blocks of one page run: a folder, and servers at the endpoints that the page names."""

    def __init__(self, folder):
        self.folder = folder
        self.servers = {}

    def placed(self, text):
        """Returns a text with smaller numbers, and with the endpoints of running servers."""
        for written, smaller in SMALLER.items():
            text = re.sub(written, smaller, text)
        for endpoint in sorted(set(re.findall(r"tcp/127\.0\.0\.1:74\d\d", text))):
            text = text.replace(endpoint, self.server(endpoint).endpoint)
        return text

    def server(self, endpoint):
        if endpoint not in self.servers:
            self.servers[endpoint] = Server()
        return self.servers[endpoint]

    def run_python(self, example):
        example.parsed = type(example.parsed)(
            self.placed(example.parsed), example.parsed.offset, example.parsed.line_offset
        )
        example.namespace.setdefault("__name__", "__page__")
        PythonEvaluator()(example)

    def run_shell(self, example):
        lines = []
        for line in example.parsed.replace("\\\n", " ").splitlines():
            command = line.partition("  #")[0].strip()
            if command.startswith("make "):
                assert command.split()[1] in targets(), f"the Makefile has no target for `{command}`"
            elif command.startswith("pip install "):
                assert set(extras_in(command)) <= extras(), f"there is no such extra: `{command}`"
            elif re.match(r"\S*swath-server\b", command):
                endpoint = re.search(r"--listen (\S+)", command)
                self.server(endpoint[1] if endpoint else "tcp/127.0.0.1:7447")
            elif command.startswith("python "):
                assert (ROOT / command.split()[1]).is_file(), f"there is no script for `{command}`"
            elif not any(re.match(pattern, command) for pattern in NOT_RUN):
                lines.append(self.placed(line))
        if not lines:
            return
        environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        command = ["bash", "-euo", "pipefail", "-c", "\n".join(lines)]
        ran = subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)
        assert ran.returncode == 0, f"{example.path}:{example.line}\n{ran.stdout}{ran.stderr}"

    def close(self, namespace):
        for thing in namespace.values():
            if not isinstance(thing, type) and callable(getattr(thing, "close", None)):
                thing.close()
        for server in self.servers.values():
            server.end()


def targets():
    return set(re.findall(r"^\.PHONY: (\S+)$", (ROOT / "Makefile").read_text(), re.MULTILINE))


def extras():
    return set(tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"])


def extras_in(command):
    return [name for names in re.findall(r"\[([\w,]+)\]", command) for name in names.split(",")]


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A desk in a folder that looks like the top of the repository, but for what commands write there."""
    for entry in ROOT.iterdir():
        if entry.name not in ("out", "target") and not entry.name.startswith("."):
            (tmp_path / entry.name).symlink_to(entry)
    # What `make server-release` would have built stands in for itself, as `make server` has built it.
    (tmp_path / "target/release").mkdir(parents=True)
    (tmp_path / "target/release/swath-server").symlink_to(SERVER)
    (tmp_path / "tiny").mkdir()
    for name, text in shipped_trainings():
        (tmp_path / "tiny" / f"{name}.toml").write_text(tiny(text))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    return Desk(tmp_path)


def tiny(training):
    """Returns the text of a training file with the same keys, for some hundred steps."""
    sizes = {
        "total_steps": 256,
        "num_envs": 4,
        "n_steps": 32,
        "batch_size": 64,
        "n_epochs": 1,
        "checkpoint_every": 256,
        "every": 256,
        "instances": 2,
        "learning_starts": 64,
        "buffer_size": 1000,
    }
    for key, value in sizes.items():
        training = re.sub(rf"^{key} = [\d_]+", f"{key} = {value}", training, flags=re.MULTILINE)
    return re.sub(r"^budget = .*", "", training, flags=re.MULTILINE)


def run_blocks(desk, path, kind, **namespace):
    parsers = [CodeBlockParser("python", desk.run_python), CodeBlockParser("sh", desk.run_shell), SkipParser()]
    document = kind.parse(str(ROOT / path), *parsers)
    document.evaluators.clear()  # a module needs no second import
    document.namespace.update(namespace)
    skipped = []
    try:
        for example in document:
            try:
                example.evaluate()
            except SkipTest as reason:
                skipped.append(f"{path}:{example.line}: {reason}")
    finally:
        desk.close(document.namespace)
    print("\n".join(skipped))


@needs_server
@pytest.mark.timeout(240)
@pytest.mark.parametrize("path", PAGES)
def test_the_blocks_of_a_page_run(desk, path):
    run_blocks(desk, path, Document)


@needs_server
@pytest.mark.timeout(120)
@pytest.mark.parametrize("path", DOCSTRINGS)
def test_the_blocks_of_docstrings_run(desk, path):
    import minari
    from stable_baselines3 import PPO

    if path.endswith("/rllib.py"):
        pytest.importorskip("ray", reason="Ray has an environment of its own")
    run_blocks(desk, path, PythonDocStringDocument, gym=gym, swath=swath, PPO=PPO, minari=minari, Path=Path)


def test_a_block_that_is_not_run_says_why():
    for path in PAGES:
        text = (ROOT / path).read_text(encoding="utf-8")
        for mark in re.findall(r"^<!-- skip:.*$", text, re.MULTILINE):
            assert re.fullmatch(r'<!-- skip: next "(\S+ ){2,}\S+" -->', mark), f"{path}: {mark}"
        languages = set(re.findall(r"^ *```(\S*)\n(?:.*\n)*?^ *```$", text, re.MULTILINE))
        assert languages <= LANGUAGES, f"{path} has blocks that no test knows"


@pytest.mark.parametrize("pattern", NOT_RUN)
def test_what_is_never_run_is_still_shown_somewhere(pattern):
    assert any(re.search(pattern, (ROOT / path).read_text(encoding="utf-8")) for path in PAGES)
