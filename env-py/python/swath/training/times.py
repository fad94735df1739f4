"""How long a training takes, over all the processes that worked on it."""

from __future__ import annotations

import csv
import time
from pathlib import Path

from swath.files import write_whole

__all__ = ["Times"]


class Times:
    """The rows of `times.csv`: the steps of every evaluation, and the seconds that the training had taken by then.

    What a killed process did after its last checkpoint is not counted, since it is done again.
    """

    def __init__(self, path: Path, steps: int, before_s: float) -> None:
        """Starts the clock where the checkpoint was taken.

        Args:
            path: The file, which may be missing.
            steps: The step at which the training goes on.
            before_s: Seconds that the training had taken by then.
        """
        self._path = path
        self._wall_s: dict[int, float] = {}
        if steps and path.exists():
            with path.open(encoding="utf-8", newline="") as file:
                read = {int(row["steps"]): float(row["wall_s"]) for row in csv.DictReader(file)}
            self._wall_s = {at: wall_s for at, wall_s in read.items() if at <= steps}
        self._before_s = before_s
        self._since = time.monotonic()

    @property
    def wall_s(self) -> float:
        """Seconds that the training has taken until now."""
        return self._before_s + time.monotonic() - self._since

    def write(self, steps: int) -> None:
        """Adds a row."""
        self._wall_s[steps] = self.wall_s
        rows = "".join(f"{at},{wall_s:.1f}\n" for at, wall_s in sorted(self._wall_s.items()))
        write_whole(self._path, "steps,wall_s\n" + rows)
