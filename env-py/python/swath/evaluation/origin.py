"""Where results come from: the command, the build, the machine."""

from __future__ import annotations

import json
import platform
import shlex
from collections.abc import Sequence

from swath import _native
from swath.evaluation.study import build, cores

__all__ = ["origin"]


def origin(command: Sequence[str]) -> str:
    """Returns the text of `origin.json`.

    Args:
        command: The command with its arguments.

    Returns:
        The command as a shell takes it, version and hash of the compiled module, version of Python, the system,
        kind of processor and number of cores.
    """
    about = {
        "command": shlex.join(command),
        "swath": _native.VERSION,
        "build": build(),
        "python": platform.python_version(),
        "system": platform.system(),
        "machine": f"{platform.machine()}, {cores()} cores",
    }
    return json.dumps(about, indent=2) + "\n"
