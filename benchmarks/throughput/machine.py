"""What a table was measured on: nothing that names a person, a host or a folder."""

from __future__ import annotations

import os
import subprocess
from datetime import datetime, timezone
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


def describe(command: str, versions: dict[str, str]) -> list[tuple[str, str]]:
    """What a reader needs to judge the figures, as names and values."""
    return [
        ("command", f"`{command}`"),
        ("commit", _commit()),
        ("date", datetime.now(timezone.utc).strftime("%Y-%m-%d")),
        ("CPU", f"{_cpu()}, {os.cpu_count()} cores"),
        ("versions", ", ".join(f"{name} {version}" for name, version in versions.items())),
    ]


def load() -> float:
    """Processes that wanted to run in the last minute, on average."""
    return os.getloadavg()[0]


def _cpu() -> str:
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    fields = [line.partition(":") for line in lines]
    known = {name.strip(): value.strip() for name, _, value in reversed(fields)}
    model = " ".join(known.get("model name", "unknown").split())
    numbers = " ".join(f"{name} {known[name]}" for name in ("cpu family", "model") if name in known)
    return f"{model} ({numbers})" if numbers else model


def _commit() -> str:
    def git(*arguments: str) -> str:
        return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()

    is_changed = git("status", "--porcelain", "--untracked-files=no") != ""
    return f"{git('rev-parse', '--short=12', 'HEAD')}{', with changes' if is_changed else ''}"
