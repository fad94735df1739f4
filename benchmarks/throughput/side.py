"""The processes that measure, one a side, each with the Python of its own environment."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from benchmarks.throughput.case import Case

from swath.throughput import Run

if TYPE_CHECKING:
    from typing_extensions import Self

ROOT = Path(__file__).resolve().parent.parent.parent
PEERS = Path("target/peers")
MODULES = {
    "swath": "swath_faces",
    "numpy": "numpy_batch",
    "rollout": "sb3_rollout",
    "cartpole": "gymnasium_cartpole",
    "envpool": "envpool_cartpole",
}


@dataclass(frozen=True)
class Limits:
    """How long a run goes on, in CPU-seconds.

    Attributes:
        enough_s: No further lap begins after this.
        most_s: A lap is broken off after this.
    """

    enough_s: float
    most_s: float


class Side:
    """One process; `versions` says what it runs with, and `missing` why it does not run."""

    def __init__(self, name: str, log: Path) -> None:
        """Starts the process; what it has to say goes to `log`."""
        peer = ROOT / PEERS / name / "bin" / "python"
        python = str(peer) if name in ("cartpole", "envpool") else sys.executable
        self.versions: dict[str, str] = {}
        self.missing: str | None = None
        self._process: subprocess.Popen[str] | None = None
        if not Path(python).exists():
            self.missing = "its environment could not be made"
            return
        with log.open("w") as stderr:
            self._process = subprocess.Popen(
                [python, "-m", f"benchmarks.throughput.sides.{MODULES[name]}"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=stderr,
                text=True,
                cwd=ROOT,
            )
        self.versions = self._answer()

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

    def measure(self, case: Case, limits: Limits) -> Run | str:
        """One run, or why there is none."""
        if self._process is None or self._process.stdin is None or self.missing is not None:
            return self.missing or "the process has ended"
        self._process.stdin.write(json.dumps({**asdict(case), **asdict(limits)}) + "\n")
        self._process.stdin.flush()
        answer = self._answer()
        return self.missing or answer.get("error") or Run(answer["steps"], answer["cpu_s"], answer["wall_s"])

    def _answer(self) -> dict[str, Any]:
        line = self._process.stdout.readline() if self._process and self._process.stdout else ""
        if not line:
            self.missing = "its process broke off"
            return {}
        answer: dict[str, Any] = json.loads(line)
        return answer
