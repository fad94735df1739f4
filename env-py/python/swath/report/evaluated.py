"""What a folder of `swath evaluate` holds, as arrays."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

import numpy as np
import numpy.typing as npt

from swath import _native
from swath.errors import ConfigError, SwathError
from swath.evaluation.journal import NAME as JOURNAL
from swath.rollouts.store import DATASET
from swath.styles import styles_of

if TYPE_CHECKING:
    from swath.scenario import Scenario

__all__ = ["Evaluated", "Place"]


@dataclass(frozen=True)
class Place:
    """One scenario of an evaluation.

    Attributes:
        name: Name of its source, with the sweep's behind a slash.
        values: Every swept key with the value it has here.
        hash: The scenario's hash.
        same_weeds: Why all instances have the same weeds; None where each draws its own.
        scenario: The scenario itself; None if the folder has no file of it.
    """

    name: str
    values: Mapping[str, object]
    hash: str
    same_weeds: str | None
    scenario: Scenario | None


@dataclass(frozen=True, eq=False)
class Evaluated:
    """A finished evaluation.

    Attributes:
        folder: Where it was read from.
        agents: Labels of the agents.
        places: The scenarios.
        seed: Seed of instance 0.
        versus: Label of the agent that the others are compared with.
        only: Name of the one sweep that was asked for.
        version: Version of swath that ran it.
        files: Name and text of the scenario files.
        origin: How it came about, as far as the folder tells: `command`, `machine`, `build`.
        path_m: (places, agents, instances) float64, way driven, metres.
        path_percent: The same in per cent of the boustrophedon path.
        mowed_percent: Weeds mowed in per cent of all; 100 where there are none.
        outcomes: Why each episode ended, names.
    """

    folder: Path
    agents: list[str]
    places: list[Place]
    seed: int
    versus: str
    only: str | None
    version: str
    files: Mapping[str, str]
    origin: Mapping[str, str]
    path_m: npt.NDArray[np.float64]
    path_percent: npt.NDArray[np.float64]
    mowed_percent: npt.NDArray[np.float64]
    outcomes: npt.NDArray[np.str_]

    @property
    def instances(self) -> int:
        """Number of instances of each place."""
        return int(self.path_m.shape[2])

    @cached_property
    def styles(self) -> list[int]:
        """Number of each agent's style."""
        return styles_of(self.agents)

    @classmethod
    def read(cls, folder: Path) -> Evaluated:
        """Reads a folder.

        Raises:
            ConfigError: If it does not hold a finished evaluation; the message says what is wrong.
            OSError: If a file cannot be read.
        """
        summary = _summary(folder)
        # A worker steps environments: its rows are no runs of agents, which the page would drive again.
        if (folder / DATASET).is_dir():
            text = f"`DIR` must be a folder of `swath evaluate`, got one of `swath worker`: {folder}"
            raise ConfigError(text)
        try:
            arguments, cells = summary["arguments"], summary["cells"]
            agents, instances, seed = list(arguments["agents"]), int(arguments["instances"]), int(arguments["seed"])
            files = {path.name: path.read_text("utf-8") for path in sorted(folder.glob("scenario*.toml"))}
            scenarios = _scenarios(folder, files)
            places = [
                Place(
                    name=cell["scenario"],
                    values=cell["values"],
                    hash=cell["hash"],
                    same_weeds=cell.get("same_weeds"),
                    scenario=scenarios.get(cell["hash"]),
                )
                for cell in cells
            ]
            versus, only, version = str(arguments["versus"]), arguments["only"], str(summary["swath"])
            means = [about["path_percent"]["mean"] for cell in cells for about in cell["agents"]]
        except (KeyError, TypeError, ValueError) as error:
            text = f"`DIR` must hold the summary.json of an evaluation, got another one in {folder}"
            raise ConfigError(text) from error
        rows = _Rows.read(folder / "episodes.csv", agents, places, instances, seed)
        found = rows.path_percent.mean(axis=2).ravel()
        if len(means) != len(found) or not np.allclose(found, means, rtol=1e-9):
            text = f"`DIR` must hold the rows and the statistics of one evaluation, got those of two in {folder}"
            raise ConfigError(text)
        return cls(
            folder=folder,
            agents=agents,
            places=places,
            seed=seed,
            versus=versus,
            only=only,
            version=version,
            files=files,
            origin=_origin(folder),
            path_m=rows.path_m,
            path_percent=rows.path_percent,
            mowed_percent=rows.mowed_percent,
            outcomes=rows.outcomes,
        )


class _Arguments(TypedDict):
    agents: list[str]
    only: str | None
    instances: int
    seed: int
    versus: str


class _Mean(TypedDict):
    mean: float


class _About(TypedDict):
    path_percent: _Mean


class _Cell(TypedDict):
    scenario: str
    hash: str
    values: dict[str, object]
    same_weeds: str | None
    agents: list[_About]


class _Summary(TypedDict):
    swath: str
    arguments: _Arguments
    cells: list[_Cell]


def _summary(folder: Path) -> _Summary:
    wanted = "`DIR` must be the folder of a finished evaluation"
    if not folder.is_dir():
        text = f"{wanted}, got {folder}, which is {'a file' if folder.exists() else 'not there'}"
        raise ConfigError(text)
    path, journal = folder / "summary.json", folder / JOURNAL
    if not path.exists():
        found = _progress(journal) if journal.exists() else "no summary.json"
        text = f"{wanted}, got {folder} with {found}"
        raise ConfigError(text)
    try:
        summary = json.loads(path.read_text("utf-8"))
    except ValueError as error:
        text = f"{wanted}, got {path}, which is not JSON"
        raise ConfigError(text) from error
    if not isinstance(summary, dict):
        text = f"{wanted}, got {path}, which is another file"
        raise ConfigError(text)
    return summary  # type: ignore[return-value] # what is missing shows when it is read


def _progress(journal: Path) -> str:
    """Says how far an unfinished evaluation has come."""
    lines = journal.read_bytes().split(b"\n")[:-1]
    try:
        head = json.loads(lines[0])
        total = len(head["cells"]) * len(head["agents"]) * head["instances"]
    except (IndexError, KeyError, TypeError, ValueError):
        return f"a damaged {journal.name}"
    return f"{len(lines) - 1} of {total} episodes: the command that began it goes on from there"


def _scenarios(folder: Path, files: Mapping[str, str]) -> dict[str, Scenario]:
    """Returns every scenario of the files, by its hash."""
    try:
        cells = [cell for name in files for cell in _native.cells(str(folder / name))]
    except SwathError as error:
        text = f"`DIR` must hold the scenario files as they were written, got {error}"
        raise ConfigError(text) from error
    return {scenario.hash: scenario for _, _, scenario in cells}


def _origin(folder: Path) -> dict[str, str]:
    """Returns what the folder tells of the command; an evaluation within Python tells of its build only."""
    path, journal = folder / "origin.json", folder / JOURNAL
    source = path if path.exists() else journal
    if not source.exists():
        return {}
    try:
        with source.open("rb") as file:
            found = dict(json.load(file) if source is path else json.loads(file.readline()))
    except (TypeError, ValueError) as error:
        text = f"`DIR` must hold {source.name} as it was written, got a damaged one in {folder}"
        raise ConfigError(text) from error
    return {key: str(found[key]) for key in _ORIGIN if key in found}


_ORIGIN = ("command", "build", "python", "system", "machine")


@dataclass(frozen=True, eq=False)
class _Rows:
    path_m: npt.NDArray[np.float64]
    path_percent: npt.NDArray[np.float64]
    mowed_percent: npt.NDArray[np.float64]
    outcomes: npt.NDArray[np.str_]

    @classmethod
    def read(cls, path: Path, agents: Sequence[str], places: Sequence[Place], instances: int, seed: int) -> _Rows:
        shape = (len(places), len(agents), instances)
        numbers = np.empty((4, *shape))
        outcomes: list[str] = []
        expected = (
            (place.name, agent, str(i), str(seed + i)) for place in places for agent in agents for i in range(instances)
        )
        flat = numbers.reshape(4, -1)
        for line, (row, key) in enumerate(_paired(path, expected)):
            try:
                if (row["scenario"], row["agent"], row["instance"], row["seed"]) != key:
                    raise ValueError  # noqa: TRY301 - one message for all that is wrong with a line
                flat[:, line] = [float(row[name]) for name in _NUMBERS]
                outcomes.append(row["outcome"])
            except (KeyError, TypeError, ValueError) as error:
                text = f"`DIR` must hold the rows as they were written, got a damaged line {line + 2} in {path}"
                raise ConfigError(text) from error
        path_m, fraction, mowed, total = numbers
        mowed_percent = np.where(total > 0, 100.0 * mowed / np.maximum(total, 1.0), 100.0)
        return cls(path_m, 100.0 * fraction, mowed_percent, np.array(outcomes).reshape(shape))


_NUMBERS = ("path_length_m", "path_fraction", "weeds_mowed", "weeds_total")


def _paired(
    path: Path, expected: Iterator[tuple[str, str, str, str]]
) -> Iterator[tuple[dict[str, str], tuple[str, str, str, str]]]:
    """Yields each row with what it must be about."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = csv.DictReader(file)
        for key in expected:
            row = next(rows, None)
            if row is None:
                text = f"`DIR` must hold all rows of the evaluation, got {path}, which ends at line {rows.line_num}"
                raise ConfigError(text)
            yield row, key
        if next(rows, None) is not None:
            text = f"`DIR` must hold the rows of one evaluation, got {path} with more lines than summary.json tells of"
            raise ConfigError(text)
