"""Finished episodes on disk, one line each, so that a stopped evaluation can go on.

The first line says which study the rows belong to.
A line that was not written to its end is dropped: its episode runs again.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from swath.errors import ConfigError
from swath.evaluation.row import Row, add
from swath.files import check_folder

if TYPE_CHECKING:
    from typing import BinaryIO

    from typing_extensions import Self

    from swath.evaluation.row import Task
    from swath.evaluation.study import Study

__all__ = ["Journal"]

NAME = "journal.jsonl"


class Journal:
    """The rows of one study in one folder.

    Making one only reads; entering it opens the file, reads what another run may have written since, and from then on
    every row is written as it is added.
    """

    def __init__(self, folder: Path, study: Study) -> None:
        """Reads what an earlier run has left in the folder.

        Args:
            folder: The folder, which may be missing.
            study: The study that is to be run.

        Raises:
            ConfigError: If the folder holds another study or other files.
        """
        self.rows: dict[Task, Row] = {}
        self._study = study
        self._path = folder / NAME
        self._identity = study.identity()
        self._whole_bytes = 0
        self._file: BinaryIO | None = None
        check_folder("out", folder)
        if self._path.exists():
            self._read()
        elif folder.is_dir():
            self._refuse_others(folder)

    def __enter__(self) -> Self:
        """Opens the file, without the torn end that an earlier run may have left.

        Raises:
            ConfigError: If another run uses the folder, or has written something else into it.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._file = self._path.open("ab")
        try:
            self._lock()
            # Another run may have come and gone since this one has read.
            self._read()
            self._file.truncate(self._whole_bytes)
            if not self._whole_bytes:
                self._write(self._identity)
        except BaseException:
            self._file.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Closes the file."""
        if self._file is not None:
            self._file.close()

    def _lock(self) -> None:
        """Keeps other runs out of the folder until the file is closed, where the system can."""
        assert self._file is not None, "a journal is locked after its opening"
        try:
            import fcntl
        except ImportError:
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            text = f"`out` must not be in use by another run, got {self._path.parent}"
            raise ConfigError(text) from error

    def write(self, row: Row) -> None:
        """Writes a row."""
        self._write(asdict(row))

    def _write(self, line: Mapping[str, object]) -> None:
        assert self._file is not None, "a journal is written to between its opening and its closing"
        self._file.write(json.dumps(line, allow_nan=False).encode() + b"\n")
        self._file.flush()

    def _read(self) -> None:
        self.rows.clear()
        lines = self._path.read_bytes().split(b"\n")[:-1]
        for number, line in enumerate(lines):
            with self._readable(number + 1):
                parsed = json.loads(line)
                row = None if number == 0 else self._row(parsed)
            if row is None:
                self._refuse_another(parsed)
            else:
                add(self.rows, row)
        self._whole_bytes = sum(len(line) + 1 for line in lines)

    def _row(self, parsed: Mapping[str, object]) -> Row:
        """Returns a row that the study may have brought about.

        Raises:
            ValueError, TypeError: If it cannot have.
        """
        row, study = Row(**parsed), self._study  # type: ignore[arg-type] # checked below
        if not (
            row.is_possible
            and row.cell in range(len(study.cells))
            and row.scenario == study.cells[row.cell].name
            and row.agent in study.labels
            and row.instance in range(study.instances)
            and row.seed == study.seed + row.instance
            and row.weeds_total == study.cells[row.cell].weeds
        ):
            raise ValueError
        return row

    @contextmanager
    def _readable(self, line: int) -> Iterator[None]:
        try:
            yield
        except (ValueError, TypeError) as error:
            text = f"`out` must hold the journal as it was written, got a damaged line {line} in {self._path}"
            raise ConfigError(text) from error

    def _refuse_another(self, found: object) -> None:
        wanted = json.loads(json.dumps(self._identity))
        if found != wanted:
            what = _difference(found, wanted)
            text = f"`out` must be empty or hold this study, got {self._path.parent} with {what}"
            raise ConfigError(text)

    def _refuse_others(self, folder: Path) -> None:
        others = sorted(entry.name for entry in folder.iterdir())
        if others:
            text = f"`out` must be empty or hold this study, got {folder} with other files, such as {others[0]}"
            raise ConfigError(text)


def _difference(found: object, wanted: Mapping[str, object]) -> str:
    """Says what the first difference is between the identities of two studies."""
    if not isinstance(found, dict):
        return "another journal"
    key = next((key for key in wanted if found.get(key) != wanted[key]), "other keys")
    was, now = found.get(key), wanted.get(key)
    if not (isinstance(was, list) and isinstance(now, list)):
        return f"{key} {was} instead of {now}"
    if len(was) != len(now):
        return f"{len(was)} {key} instead of {len(now)}"
    was, now = next(pair for pair in zip(was, now, strict=True) if pair[0] != pair[1])
    if not (isinstance(was, dict) and isinstance(now, dict)):
        return f"{key} {was} instead of {now}"
    if was.get("scenario") != now["scenario"]:
        return f"scenario {was.get('scenario')} instead of {now['scenario']}"
    return f"another {now['scenario']} (hash {str(was.get('hash'))[:12]} instead of {str(now['hash'])[:12]})"
