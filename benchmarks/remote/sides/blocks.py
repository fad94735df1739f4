"""What every side does: a line with a number comes in, and the mean time of so many steps goes out, microseconds.

Peers import it in environments of their own, so it needs nothing but Python.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version

FLOATS = 32


def serve(packages: Sequence[str], steps: Callable[[int], object]) -> None:
    """Says which versions this side has, and then times blocks; `steps` makes so many steps."""
    versions = {"Python": platform.python_version(), **{name: version(name) for name in packages}}
    print(json.dumps(versions), flush=True)
    for line in sys.stdin:
        count = int(line)
        start_s = time.perf_counter()
        steps(count)
        print(json.dumps(1e6 * (time.perf_counter() - start_s) / count), flush=True)


@contextmanager
def other_end(*arguments: str) -> Iterator[None]:
    """Runs this module's own server in a process beside this one, until this one has no more to ask."""
    command = [sys.executable, "-m", *arguments]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        line = process.stdout.readline() if process.stdout is not None else ""
        if line != "ready\n":
            text = "its server did not start"
            raise RuntimeError(text)
        yield
    finally:
        process.kill()
        process.wait()


def stay() -> None:
    """Says that this server is ready, and stays until nobody needs it."""
    print("ready", flush=True)
    sys.stdin.read()
    # Threads of the network would hold up an orderly end.
    os._exit(0)
