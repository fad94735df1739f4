"""The processes of the other ways, each with the Python of its own environment."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from benchmarks.remote.server import ROOT

if TYPE_CHECKING:
    from typing_extensions import Self

PEERS = Path("target/peers")


class Side:
    """One process; `versions` says what it runs with, and `missing` why it does not run."""

    def __init__(self, module: str, arguments: list[str], log: Path, *, is_peer: bool) -> None:
        """Starts the process; what it has to say goes to `log`."""
        python = str(ROOT / PEERS / module / "bin/python") if is_peer else sys.executable
        self.versions: dict[str, str] = {}
        self.missing: str | None = None
        self._process: subprocess.Popen[str] | None = None
        if not Path(python).exists():
            self.missing = "its environment could not be made"
            return
        with log.open("w") as stderr:
            self._process = subprocess.Popen(
                [python, "-m", f"benchmarks.remote.sides.{module}", *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=stderr,
                text=True,
                cwd=ROOT,
            )
        self.versions = self._answer() or {}

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ends the process."""
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()
            self._process.wait()

    def step_us(self, steps: int) -> float | None:
        """Mean time of a step in a block of so many, microseconds; None if it cannot be had."""
        if self._process is None or self._process.stdin is None or self.missing is not None:
            return None
        self._process.stdin.write(f"{steps}\n")
        self._process.stdin.flush()
        time_us: float | None = self._answer()
        return time_us

    def _answer(self) -> Any:  # noqa: ANN401 - versions, or a time
        line = self._process.stdout.readline() if self._process and self._process.stdout else ""
        if not line:
            self.missing = "its process broke off"
            return None
        return json.loads(line)
