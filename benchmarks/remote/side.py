"""The processes of the other ways."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchmarks.process import Process

if TYPE_CHECKING:
    from pathlib import Path


class Side(Process):
    """One of them."""

    def __init__(self, module: str, arguments: list[str], log: Path, *, is_peer: bool) -> None:
        """Starts the process; what it has to say goes to `log`."""
        super().__init__(f"benchmarks.remote.sides.{module}", arguments, log, peer=module if is_peer else None)

    def step_us(self, steps: int) -> float | None:
        """Mean time of a step in a block of so many, microseconds; None if it cannot be had."""
        time_us: float | None = self.ask(steps)
        return time_us
