"""A process that measures, with the Python of its own environment, and is asked line by line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typing_extensions import Self

ROOT = Path(__file__).resolve().parent.parent
PEERS = Path("target/peers")


class Process:
    """One process; `versions` says what it runs with, and `missing` why it does not run."""

    def __init__(self, module: str, arguments: Sequence[str], log: Path, *, peer: str | None) -> None:
        """Starts the process, which says its versions first.

        Args:
            module: What it runs.
            arguments: With which arguments.
            log: Where what it has to say besides goes.
            peer: The name of the environment in `target/peers`, or None for this one.
        """
        python = sys.executable if peer is None else str(ROOT / PEERS / peer / "bin" / "python")
        self.versions: dict[str, str] = {}
        self.missing: str | None = None
        self._process: subprocess.Popen[str] | None = None
        if not Path(python).exists():
            self.missing = "its environment could not be made"
            return
        with log.open("w") as stderr:
            self._process = subprocess.Popen(
                [python, "-m", module, *arguments],
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

    def ask(self, question: object) -> Any:  # noqa: ANN401 - what the module answers
        """Asks, and returns the answer; None if there is none, and then `missing` says why."""
        if self._process is None or self._process.stdin is None or self.missing is not None:
            return None
        self._process.stdin.write(json.dumps(question) + "\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> Any:  # noqa: ANN401 - what the module answers
        line = self._process.stdout.readline() if self._process and self._process.stdout else ""
        if not line:
            self.missing = "its process broke off"
            return None
        return json.loads(line)
