"""What may be named as a scenario, and the blocks that one consists of."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, TypedDict

from swath._native import Scenario

if TYPE_CHECKING:
    from typing import TypeAlias

__all__ = ["Block", "Blocks", "Scenario", "ScenarioSource"]

Block: TypeAlias = "Mapping[str, object]"
"""Keys of one block of a scenario; values may be NumPy scalars and arrays."""

ScenarioSource: TypeAlias = "str | os.PathLike[str] | Mapping[str, object] | Scenario | None"
"""A shipped name such as `pasture`, a file, a dictionary of blocks, a `Scenario`, or None for the defaults."""


class Blocks(TypedDict, total=False):
    """The blocks of a scenario as keywords; `configs/default.toml` lists their keys. None: the block is not given."""

    pasture: Block | None
    weeds: Block | None
    mower: Block | None
    sensor: Block | None
    reward: Block | None
    episode: Block | None
    observation: Block | None
    action: Block | None
