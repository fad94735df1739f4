"""A bar that tells how far a long job is."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID
    from typing_extensions import Self

__all__ = ["Progress"]

PATIENCE_S = 2.0
"""A job that is over sooner shows no bar, seconds."""


class Progress:
    """A bar on stderr with the time left, once a job has taken two seconds; on no terminal, one line at the end.

    The time left is reckoned from the whole job so far: steps of a training come in rushes, with learning between them.
    """

    def __init__(self, what: str, total: int, *, is_wanted: bool) -> None:
        """Prepares a bar.

        Args:
            what: What is counted.
            total: How many there are.
            is_wanted: Whether a bar may be shown at all.
        """
        self._what, self._total, self._is_wanted = what, total, is_wanted
        self._done, self._before = 0, 0
        self._since = time.monotonic()
        self._bar: Bar | None = None
        self._task: TaskID | None = None

    def __enter__(self) -> Self:
        """Starts the clock."""
        self._since = time.monotonic()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leaves the bar as it stands, or takes it away if the job was broken off."""
        if self._bar is not None:
            self._bar.live.transient = error is not None
            self._bar.stop()

    def resume(self, count: int) -> None:
        """Counts what an earlier run has done, which says nothing about how long the rest takes."""
        self._before += count
        self.advance(count)

    def left(self) -> str:
        """Returns how long the rest will take, such as `about 4 min left`; nothing before the first of it is done."""
        done, left = self._done - self._before, self._total - self._done
        if done <= 0 or left <= 0:
            return ""
        return f"about {_duration((time.monotonic() - self._since) * left / done)} left"

    def advance(self, count: int) -> None:
        """Counts what has been done."""
        self._done += count
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=self._done, when=self._when())
        elif self._is_wanted and time.monotonic() - self._since > PATIENCE_S:
            self._show()

    def _show(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
        from rich.progress import Progress as Bar

        columns = (TextColumn(self._what), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[when]}"))
        self._bar = Bar(*columns, console=Console(stderr=True))
        self._task = self._bar.add_task(self._what, total=self._total, completed=self._done, when=self._when())
        self._bar.start()

    def _when(self) -> str:
        is_over = self._done >= self._total
        return f"in {_duration(time.monotonic() - self._since)}" if is_over else self.left()


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
