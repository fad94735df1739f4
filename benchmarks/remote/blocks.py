"""Blocks of steps, timed in turn: what disturbs the machine for longer than a block disturbs both sides of a pair."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

_RESAMPLES = 2000

T = TypeVar("T")


@dataclass
class Pair:
    """The same steps on both sides, block by block.

    Attributes:
        local_us: Mean time of a call in each block, microseconds.
        remote_us: The same for the other side, in the same order.
    """

    local_us: list[float] = field(default_factory=list)
    remote_us: list[float] = field(default_factory=list)

    def differences(self) -> list[float]:
        """By how much the other side took longer, block by block, microseconds a call."""
        return [remote - local for local, remote in zip(self.local_us, self.remote_us, strict=True)]


def timed(call: Callable[[T], object], arguments: Iterable[T]) -> float:
    """Mean time of a call, microseconds."""
    count = 0
    start_s = time.perf_counter()
    for argument in arguments:
        call(argument)
        count += 1
    return 1e6 * (time.perf_counter() - start_s) / count


def drive(local: Callable[[Any], object], remote: Callable[[Any], object], tape: Sequence[Any], block: int) -> Pair:
    """Drives both sides along a tape, a block on one and then on the other, who is first taking turns."""
    pair = Pair()
    sides = [(local, pair.local_us), (remote, pair.remote_us)]
    for start in range(0, len(tape) - block + 1, block):
        for step, times_us in sides:
            times_us.append(timed(step, tape[start : start + block]))
        sides.reverse()
    return pair


def interval(numbers: Sequence[float], rounds: int) -> tuple[float, float] | None:
    """The 95 % interval of the median, by bootstrap over whole rounds: blocks of a round share what disturbs them.

    None of a single round, or where rounds have not as many numbers each.
    """
    if rounds < 2 or not numbers or len(numbers) % rounds != 0:
        return None
    of_rounds = np.reshape(numbers, (rounds, -1))
    drawn = np.random.default_rng(0).integers(rounds, size=(_RESAMPLES, rounds))
    medians = np.median(of_rounds[drawn].reshape(_RESAMPLES, -1), axis=1)
    low, high = np.quantile(medians, [0.025, 0.975])
    return float(low), float(high)


def spread(numbers: Sequence[float]) -> tuple[float, float, float]:
    """First quartile, median, third quartile."""
    first, middle, third = statistics.quantiles(numbers, n=4, method="inclusive")
    return first, middle, third
