"""One episode as a file, until all of a sweep are there."""

from __future__ import annotations

import io
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np

from swath.datasets.episodes import Recorded
from swath.errors import ConfigError
from swath.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    import numpy.typing as npt

__all__ = ["read", "write"]

_LISTS = ("observations", "actions", "rewards", "terminations", "truncations", "infos")


def write(path: Path, episode: Recorded) -> None:
    """Writes an episode, as a whole or not at all.

    Raises:
        OSError: If the file cannot be written.
    """
    arrays = {"seed": np.array(episode.seed, np.uint64), "outcome": np.array(episode.outcome)}
    for name in _LISTS:
        arrays.update(_columns(name, getattr(episode, name)))
    content = io.BytesIO()
    np.savez(content, **arrays)  # type: ignore[arg-type] # no array has the name of an option
    write_whole(path, content.getvalue())


def read(path: Path) -> Recorded:
    """Reads an episode.

    Raises:
        ConfigError: If the file is missing or damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        lists: dict[str, Any] = {name: _rows(name, arrays) for name in _LISTS}
        return Recorded(int(arrays["seed"]), **lists, outcome=str(arrays["outcome"]))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        text = f"`out` must hold every episode as it was written, got a damaged or missing {path}"
        raise ConfigError(text) from error


def _columns(name: str, rows: Sequence[Any]) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    """Yields an array with a row a step; where every row is a dictionary, one for each of its keys."""
    if isinstance(rows[0], dict):
        for key in rows[0]:
            yield from _columns(f"{name}/{key}", [row[key] for row in rows])
    else:
        yield name, np.stack(rows)


def _rows(name: str, arrays: Mapping[str, npt.NDArray[Any]]) -> list[Any]:
    """Puts back what `_columns` has taken apart."""
    if name in arrays:
        return list(arrays[name])
    keys = dict.fromkeys(key[len(name) + 1 :].split("/")[0] for key in arrays if key.startswith(f"{name}/"))
    columns = {key: _rows(f"{name}/{key}", arrays) for key in keys}
    return [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
