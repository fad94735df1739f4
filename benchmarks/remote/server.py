"""The release server, on a free port of the loopback."""

from __future__ import annotations

import os
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
SERVER = TARGET / "release/swath-server"


def free_port() -> int:
    """A port of 127.0.0.1 that nobody listens at."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
        return port


@contextmanager
def serving(log: Path, *flags: str) -> Iterator[str]:
    """Runs a server with some flags, whose log goes to `log`, and yields its endpoint."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with log.open("w") as stderr:
        process = subprocess.Popen(
            [SERVER, "--listen", endpoint, *flags], stdout=subprocess.PIPE, stderr=stderr, text=True, cwd=ROOT
        )
    try:
        line = process.stdout.readline() if process.stdout is not None else ""
        if not line.startswith("swath-server ready: "):
            text = f"the server did not start; see {log}"
            raise RuntimeError(text)
        yield endpoint
    finally:
        process.terminate()
        process.wait()
