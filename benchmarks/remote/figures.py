"""What is measured, and the figures."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from benchmarks.remote.blocks import Pair

BATCHES = (1, 64, 1024, 4096)
# By what one environment is measured beside the server's defaults.
USUAL = "--low-latency=off"
PEERS = {"dm_env_rpc": "dm_env_rpc", "openenv": "OpenEnv"}
# The bytes of a step's request and reply around the numbers of the environments.
REQUEST_BYTES, REPLY_BYTES = 53 + 16, 53 + 20 * 8 + 9
# Of an environment: an action; 32 floats, a reward and two flags.
ACTION_BYTES, ROW_BYTES = 4, 32 * 4 + 8 + 2


@dataclass(frozen=True)
class Kind:
    """What every step tells.

    Attributes:
        name: How it is called.
        blocks: Blocks of the scenario.
        infos: Whether infos are among it, on servers and here.
    """

    name: str
    blocks: dict[str, Any] = field(hash=False)
    infos: bool


SHORT = Kind("32 floats, no infos", {"observation": {"nearest_weeds": 8, "rays": 1}}, infos=False)
FULL = Kind("`features` (39 floats), infos", {}, infos=True)


@dataclass
class Figures:
    """What was measured.

    Attributes:
        one: One environment, here and behind `swath.remote.make`; a pair of times a block.
        usual_us: The same environment on a server that offers no low latency, in the order of `one`.
        batches: The same of batches.
        others: Times of a step, block by block, in the order of `one`: each peer, and `echo` for Zenoh alone.
        echoes: Zenoh alone with as many bytes as batches of each size have, microseconds.
        missing: Why a peer was not measured.
        versions: What each side ran with.
        loads: Load average before, and after each round.
        rounds: In how many rounds; each has as many blocks.
    """

    one: Pair = field(default_factory=Pair)
    usual_us: list[float] = field(default_factory=list)
    batches: dict[tuple[Kind, int], Pair] = field(default_factory=dict)
    others: dict[str, list[float]] = field(default_factory=dict)
    echoes: dict[int, list[float]] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    loads: list[float] = field(default_factory=list)
    rounds: int = 1

    def shares_of(self, other: str, *, usual: bool) -> list[float]:
        """One remote environment's time by that of another way, block by block; empty if that was not measured."""
        others = self.others.get(other, [])
        if not others or other in self.missing:
            return []
        ours = self.usual_us if usual else self.one.remote_us
        return [own / theirs for own, theirs in zip(ours, others, strict=True)]

    def added_us(self, kind: Kind, num_envs: int) -> list[float]:
        """What the wire adds to each environment's step, block by block, microseconds."""
        return [difference / num_envs for difference in self.batches[kind, num_envs].differences()]
