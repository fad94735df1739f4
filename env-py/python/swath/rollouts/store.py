"""The folder of a sweep: each shard keeps its rows and trajectories in a folder of its own.

No two workers write the same file, so folders of several machines may be copied into one.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swath.errors import ConfigError
from swath.evaluation.journal import Journal
from swath.evaluation.row import add
from swath.files import check_folder
from swath.rollouts import trajectory

if TYPE_CHECKING:
    from pathlib import Path

    from swath.datasets.episodes import Recorded
    from swath.evaluation.row import Row, Task
    from swath.rollouts.sweep import Shard, Sweep

__all__ = ["DATASET", "ELSEWHERE", "Store"]

DATASET = "dataset"
ELSEWHERE = "play the sweep into another folder"
"""What is to be done where trajectories are gone."""
_FILES = {DATASET, "episodes.csv", "summary.json"}


@dataclass(frozen=True)
class Store:
    """A sweep on disk.

    Attributes:
        folder: Where it is.
        sweep: What it holds.
    """

    folder: Path
    sweep: Sweep

    def check(self) -> None:
        """Makes sure that the folder is empty, missing, or holds this sweep.

        Raises:
            ConfigError: If it holds something else.
        """
        check_folder("out", self.folder)
        if not self.folder.is_dir():
            return
        ours = _FILES | set(self.sweep.files) | {shard.folder for shard in self.sweep.all_shards()}
        others = sorted(entry.name for entry in self.folder.iterdir() if entry.name not in ours)
        if others := [name for name in others if not name.endswith(".unfinished")]:
            text = f"`out` must be empty or hold this sweep, got {self.folder} with other files, such as {others[0]}"
            raise ConfigError(text)
        self.rows()

    def rows(self) -> dict[Task, Row]:
        """Reads the rows of all shards.

        Raises:
            ConfigError: If one of them belongs to another sweep, or is damaged.
        """
        rows: dict[Task, Row] = {}
        for shard in self.sweep.all_shards():
            if (self.folder / shard.folder).exists():
                for row in self.journal(shard).rows.values():
                    add(rows, row)
        return rows

    def journal(self, shard: Shard) -> Journal:
        """Returns the rows of one shard, to be read, or entered to be written."""
        return Journal(self.folder / shard.folder, self.sweep)

    def keep(self, journal: Journal, shard: Shard, episode: Recorded, row: Row) -> None:
        """Keeps an episode: its trajectory and then its row, so that there is none without the other."""
        trajectory.write(self._path(shard, row.instance), episode)
        journal.write(row)

    def trajectory(self, instance: int) -> Recorded:
        """Reads the trajectory of an episode.

        Raises:
            ConfigError: If it is missing or damaged.
        """
        return trajectory.read(self._path(self.sweep.shard_of(instance), instance))

    def check_trajectories(self) -> None:
        """Refuses to begin a dataset where there was one, whose trajectories are gone with it.

        Raises:
            ConfigError: If so.
        """
        has_results = (self.folder / "episodes.csv").exists()
        if has_results and not self._path(self.sweep.shard_of(0), 0).exists():
            text = f"`out` must hold the dataset of its results, got none in {self.folder / DATASET}: {ELSEWHERE}"
            raise ConfigError(text)

    def drop_trajectories(self) -> None:
        """Removes the trajectories, which stand in the dataset by now."""
        for instance in range(self.sweep.instances):
            self._path(self.sweep.shard_of(instance), instance).unlink(missing_ok=True)

    def _path(self, shard: Shard, instance: int) -> Path:
        return self.folder / shard.folder / f"episode-{instance}.npz"

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Waits until no other worker is in here, where the system can."""
        try:
            import fcntl
        except ImportError:
            yield
            return
        import os

        handle = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            yield
        finally:
            os.close(handle)
