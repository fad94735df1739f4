"""What chance decides between the instances of a scenario: the weeds, and what some agents choose.

Where it decides nothing, the instances are copies of one episode, and say no more about a mean than that one does.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from swath import _native

if TYPE_CHECKING:
    from swath.scenario import Scenario

__all__ = ["are_copies", "is_random", "same_weeds", "without_interval"]

_CHANCE = "random"
"""The policy that draws every action, as result files call it."""


def same_weeds(scenario: Scenario) -> str | None:
    """Returns why all instances of a scenario have the same weeds; None where each draws its own."""
    weeds = scenario.to_dict()["weeds"]
    if "positions_m" in weeds:  # type: ignore[operator] # a block of keys
        return "the scenario gives them"
    return None if weeds["count"] else "the scenario has none"  # type: ignore[index] # a block of keys


def is_random(label: str) -> bool:
    """Returns whether an agent chooses at random, so that instances differ whatever their weeds."""
    name = label.split(":")[0]
    return name == _CHANCE or any(name == known and chooses for known, _, chooses, _ in _native.agents())


def are_copies(reasons: Iterable[str | None], labels: Iterable[str]) -> bool:
    """Returns whether chance decides nothing between instances.

    Args:
        reasons: What `same_weeds` says of each scenario that the values are from.
        labels: The agents that they are from.
    """
    return all(reason is not None for reason in reasons) and not any(map(is_random, labels))


def without_interval(reason: str, labels: Iterable[str], instances: int) -> str:
    """Returns in words that means have no interval, and why.

    Args:
        reason: What `same_weeds` says.
        labels: All agents of the table.
        instances: Number of instances.
    """
    text = f"all {instances} instances have the same weeds, since {reason}: they count as one, without an interval"
    random = ", ".join(filter(is_random, labels))
    return f"{text}, but for {random}, whose choices are drawn anew in each" if random else text
