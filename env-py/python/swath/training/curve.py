"""How a policy does while it learns, beside agents that do not learn."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from swath.errors import ConfigError
from swath.evaluation.row import NUMBERS, Row
from swath.evaluation.statistics import Spread, interval, spread
from swath.files import write_whole

if TYPE_CHECKING:
    from typing import TypeAlias

__all__ = ["POLICY", "Curve", "line_of"]

POLICY = "policy"
"""The learning agent's name."""

_COLUMNS = (
    "steps",
    "agent",
    "instance",
    "seed",
    *NUMBERS,
)

Key: TypeAlias = "tuple[int, str]"


class Curve:
    """The rows of `evaluations.csv`: one for each episode that was played for evaluation.

    Agents that do not learn stand at step 0.
    """

    def __init__(self) -> None:
        """Begins without rows."""
        self._rows: dict[Key, Sequence[Row]] = {}

    @property
    def steps(self) -> list[int]:
        """The steps at which the policy was evaluated, rising."""
        return sorted(steps for steps, agent in self._rows if agent == POLICY)

    @property
    def agents(self) -> list[str]:
        """The agents that do not learn."""
        return [agent for _, agent in self._rows if agent != POLICY]

    def add(self, steps: int, agent: str, rows: Sequence[Row]) -> None:
        """Adds the episodes of an agent, instance by instance."""
        self._rows[steps, agent] = rows

    def of(self, agent: str, steps: int = 0) -> Sequence[Row]:
        """Returns the episodes of an agent, instance by instance."""
        return self._rows[steps, agent]

    def forget_after(self, steps: int) -> None:
        """Drops the policy's episodes after a step: what a killed training played after its last checkpoint."""
        self._rows = {key: rows for key, rows in self._rows.items() if key[0] <= steps}

    def path_m(self, agent: str, steps: int = 0) -> Spread:
        """Sums up the paths of an agent, metres."""
        return spread([row.path_length_m for row in self.of(agent, steps)])

    def weeds_mowed(self, agent: str, steps: int = 0) -> Spread:
        """Sums up the weeds that an agent mowed."""
        return spread([row.weeds_mowed for row in self.of(agent, steps)])

    def longer_m(self, steps: int, other: str, other_steps: int = 0) -> Spread:
        """Sums up how much longer the policy's path is than another's on the same instances, metres."""
        pairs = zip(self.of(POLICY, steps), self.of(other, other_steps), strict=True)
        return spread([row.path_length_m - twin.path_length_m for row, twin in pairs])

    def write(self, path: Path) -> None:
        """Writes the rows, as a whole or not at all, with numbers as `repr` writes them."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(_COLUMNS)
        # The agents that do not learn first, then the policy as it learns.
        for steps, agent in sorted(self._rows, key=lambda key: (key[1] == POLICY, key[0])):
            for row in self._rows[steps, agent]:
                writer.writerow([steps, *(getattr(row, name) for name in _COLUMNS[1:])])
        write_whole(path, text.getvalue())

    @classmethod
    def read(cls, path: Path) -> Curve:
        """Reads what `write` has written; without the file there are no rows.

        Raises:
            ConfigError: If the file is damaged.
        """
        curve = cls()
        if not path.exists():
            return curve
        kinds = {field.name: {"int": int, "float": float, "str": str}[str(field.type)] for field in fields(Row)}
        found: dict[Key, list[Row]] = {}
        try:
            with path.open(encoding="utf-8", newline="") as file:
                for line in csv.DictReader(file):
                    values = {name: kinds[name](line[name]) for name in _COLUMNS[1:]}
                    row = Row(cell=0, scenario="", wall_s=0.0, **values)
                    found.setdefault((int(line["steps"]), row.agent), []).append(row)
        except (ValueError, KeyError, TypeError) as error:
            text = f"`out` must hold {path.name} as it was written, got a damaged {path}"
            raise ConfigError(text) from error
        curve._rows.update(found)
        return curve


def line_of(curve: Curve, steps: int) -> str:
    """Returns one line about an evaluation of the policy."""
    first = curve.of(POLICY, steps)[0]
    line = (
        f"step {steps}: path {interval(curve.path_m(POLICY, steps))} m, "
        f"{interval(curve.weeds_mowed(POLICY, steps))} of {first.weeds_total} weeds mowed"
    )
    versus = ", ".join(f"{interval(curve.longer_m(steps, agent), sign='+')} m to {agent}" for agent in curve.agents)
    return f"{line}; {versus}" if versus else line
