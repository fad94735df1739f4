"""The processes that measure, one a side."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from benchmarks.process import Process

from swath.throughput import Run

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.throughput.case import Case

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


class Side(Process):
    """One of them."""

    def __init__(self, name: str, log: Path) -> None:
        """Starts the process; what it has to say goes to `log`."""
        peer = name if name in ("cartpole", "envpool") else None
        super().__init__(f"benchmarks.throughput.sides.{MODULES[name]}", [], log, peer=peer)

    def measure(self, case: Case, limits: Limits) -> Run | str:
        """One run, or why there is none."""
        answer = self.ask({**asdict(case), **asdict(limits)})
        if answer is None:
            return self.missing or "the process has ended"
        return answer.get("error") or Run(answer["steps"], answer["cpu_s"], answer["wall_s"])
