"""What is played, and the episodes of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import swath
from swath import _native
from swath.evaluation.study import build
from swath.files import write_whole

if TYPE_CHECKING:
    from swath.evaluation.row import Row


@dataclass(frozen=True)
class Part:
    """One part of the league.

    Attributes:
        name: Name of its folder, and in the data.
        title: What stands over its table.
        scenario: A shipped scenario or a file.
        only: The sweep of that scenario, or None.
        instances: Instances a cell: the same ones for all agents.
    """

    name: str
    title: str
    scenario: str
    only: str | None
    instances: int


PASTURE = "configs/league/pasture.toml"
PARTS = (
    Part("density", "100 x 40 m, R = B = 2 m, sensor 12 x 12 m", PASTURE, "density", 10),
    Part("field", "The cowbot field: 36 x 26 m, R = 1.5 m, B = 1.3 m, 14 weeds", "cowbot-field", None, 40),
    Part("turning-radius", "Other turning radii", PASTURE, "turning-radius", 4),
    Part("sensor", "Other sensors", PASTURE, "sensor", 4),
    Part("large", "200 x 80 m", PASTURE, "large", 3),
)
QUICK = (
    Part("density", "100 x 40 m, R = B = 2 m, sensor 12 x 12 m", PASTURE, "quick", 2),
    Part("field", "The cowbot field: 36 x 26 m, R = 1.5 m, B = 1.3 m, 14 weeds", "cowbot-field", None, 2),
)
"""What is played to try it."""

COLUMNS = ("part", "cell", "agent", "instance", "weeds_total", "weeds_mowed", "path_m", "bcp_m", "seen", "outcome")


@dataclass(frozen=True)
class Played:
    """One episode, as the data file has it.

    Attributes:
        part: Name of the part.
        cell: The swept keys and their values, as in `R 2, 40 weeds`; empty where nothing is swept.
        agent: Name of the agent.
        instance: Number of the instance, from 0.
        weeds_total: Number of weeds.
        weeds_mowed: Number of those mowed.
        path_m: Way driven, metres.
        bcp_m: Length of the boustrophedon path, metres.
        seen: Share of the ground that was seen, 0 to 1.
        outcome: Why the episode ended.
    """

    part: str
    cell: str
    agent: str
    instance: int
    weeds_total: int
    weeds_mowed: int
    path_m: float
    bcp_m: float
    seen: float
    outcome: str

    @property
    def path_percent(self) -> float:
        """Way driven, in per cent of the boustrophedon path."""
        return 100 * self.path_m / self.bcp_m

    @property
    def mowed_percent(self) -> float:
        """Weeds mowed, in per cent of all."""
        return 100 * self.weeds_mowed / self.weeds_total if self.weeds_total else 100.0


def agents() -> dict[str, bool]:
    """Returns the name of every agent of the registry, and whether it sees only what the mower may know."""
    return {name: is_online for name, _, _, is_online in _native.agents()}


def play(parts: Sequence[Part], out: Path, jobs: int | None) -> tuple[list[Played], float]:
    """Plays what this build has not played yet; returns all episodes, and how long they took together, seconds."""
    played: list[Played] = []
    wall_s = 0.0
    for part in parts:
        for agent in agents():
            print(f"{part.name}: {agent}", flush=True)
            results = swath.evaluate(
                agent,
                scenario=part.scenario,
                only=part.only,
                instances=part.instances,
                jobs=jobs,
                out=out / build() / f"{part.only or part.name}-{part.instances}" / agent,
                progress=True,
            )
            cells = [cell_name(cell.values) for cell in results.study.cells]
            played.extend(episode(part.name, cells[row.cell], row) for row in results.rows)
            wall_s += sum(row.wall_s for row in results.rows)
    return played, wall_s


def episode(part: str, cell: str, row: Row) -> Played:
    """Returns what the league keeps of a row, rounded as its data file is."""
    return Played(
        part=part,
        cell=cell,
        agent=row.agent,
        instance=row.instance,
        weeds_total=row.weeds_total,
        weeds_mowed=row.weeds_mowed,
        path_m=round(row.path_length_m, 3),
        bcp_m=round(row.bcp_length_m, 3),
        seen=round(row.seen_fraction, 6),
        outcome=row.outcome,
    )


WORDS = {
    "weeds.distribution": "{}",
    "weeds.count": "{} weeds",
    "mower.turning_radius_m": "R {:g}",
    "sensor.range_m": "range {:g}",
    "sensor.width_m": "width {:g}",
}


def cell_name(values: Mapping[str, object]) -> str:
    """Returns the swept values of a cell in words; what is the same in all cells of a part is left to its title."""
    return ", ".join(WORDS[key].format(value) for key, value in values.items() if key in WORDS)


def write(file: Path, played: Sequence[Played]) -> None:
    """Writes the data file."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([getattr(one, name) for name in COLUMNS] for one in played)
    write_whole(file, text.getvalue())


def read(file: Path) -> Iterator[Played]:
    """Yields the episodes of a data file."""
    with file.open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            yield Played(
                part=row["part"],
                cell=row["cell"],
                agent=row["agent"],
                instance=int(row["instance"]),
                weeds_total=int(row["weeds_total"]),
                weeds_mowed=int(row["weeds_mowed"]),
                path_m=float(row["path_m"]),
                bcp_m=float(row["bcp_m"]),
                seen=float(row["seen"]),
                outcome=row["outcome"],
            )
