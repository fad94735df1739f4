"""What workers are asked: whose episodes, on which scenario, and which of them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swath import _native
from swath.errors import ConfigError
from swath.evaluation.study import Cell, Study, whole
from swath.seeds import LARGEST_SEED

if TYPE_CHECKING:
    from collections.abc import Iterator

    from typing_extensions import Self

__all__ = ["Label", "Shard", "Sweep"]

_MOST_EPISODES = 1 << 32
_MOST_SHARDS = 4096


@dataclass(frozen=True)
class Label:
    """The name of a policy in result files."""

    label: str


@dataclass(frozen=True)
class Shard:
    """One of the parts that a sweep is cut into.

    Attributes:
        number: From 1 to `count`.
        count: Number of parts.
    """

    number: int
    count: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Reads `2/3`: the second of three.

        Raises:
            ConfigError: If it is none.
        """
        found = re.fullmatch(r"([1-9]\d{0,3})/([1-9]\d{0,3})", text)
        shard = cls(*map(int, found.groups())) if found else cls(0, 0)
        if not 1 <= shard.number <= shard.count <= _MOST_SHARDS:
            error = f"`shard` must be `I/N` with I from 1 to N and N at most {_MOST_SHARDS}, got `{text}`"
            raise ConfigError(error)
        return shard

    @property
    def folder(self) -> str:
        """Name of its folder."""
        return f"shard-{self.number}-of-{self.count}"

    def __str__(self) -> str:
        """Returns it as it is written."""
        return f"{self.number}/{self.count}"


@dataclass(frozen=True)
class Sweep(Study):
    """A study of one policy on one scenario, cut into shards.

    Attributes:
        model: SHA-256 of the text file beside a trained model, which holds those of the model's other files; None for
            others.
        shards: Number of shards.
    """

    model: str | None
    shards: int

    @classmethod
    def of(
        cls,
        label: str,
        scenario: _native.Scenario,
        *,
        episodes: int,
        seed: int,
        model: str | None,
        shards: int,
    ) -> Sweep:
        """Checks the question.

        Raises:
            ConfigError: For the first part that cannot be used.
        """
        episodes = whole("episodes", episodes, least=1, most=_MOST_EPISODES)
        return cls(
            agents=(Label(label),),  # type: ignore[arg-type] # it is asked for its label and nothing else
            cells=(Cell(scenario.name, {}, scenario),),
            instances=episodes,
            seed=whole("seed", seed, least=0, most=LARGEST_SEED - (episodes - 1)),
            only=None,
            files={"scenario.toml": scenario.to_toml()},
            model=model,
            shards=shards,
        )

    @property
    def label(self) -> str:
        """Name of the policy."""
        return self.labels[0]

    @property
    def scenario(self) -> _native.Scenario:
        """What is driven on."""
        return self.cells[0].scenario

    def instances_of(self, shard: Shard) -> range:
        """Returns the numbers of a shard's episodes: of N shards each has every N-th."""
        return range(shard.number - 1, self.instances, shard.count)

    def all_shards(self) -> Iterator[Shard]:
        """Yields all parts."""
        return (Shard(number, self.shards) for number in range(1, self.shards + 1))

    def shard_of(self, instance: int) -> Shard:
        """Returns the part that an episode belongs to."""
        return Shard(instance % self.shards + 1, self.shards)

    def identity(self) -> dict[str, object]:
        """Returns what tells this sweep from others, as plain data."""
        return super().identity() | {"model": self.model, "shards": self.shards}
