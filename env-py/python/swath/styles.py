"""How agents are told apart wherever they are drawn: by a colour, a dash and a mark, and yardsticks by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from swath import _native

__all__ = ["YARDSTICK", "Style", "is_yardstick", "style", "styles_of", "title_of"]

_COUNT = 12
# In pixels: drawn, left out, drawn ...
_DASHES = (
    (),
    (7, 3),
    (2, 3),
    (9, 3, 2, 3),
    (4, 4),
    (12, 3),
    (1, 2),
    (7, 2, 2, 2, 2, 2),
    (14, 3, 4, 3),
    (5, 2),
    (3, 6),
    (12, 2, 1, 2),
)
_MARKS = (
    "circle",
    "triangle",
    "square",
    "diamond",
    "wedge",
    "plus",
    "cross",
    "bar",
    "ring",
    "box",
    "star",
    "kite",
)

YARDSTICK = "yardstick, not an online agent: it is told where the weeds stand"
"""What is said of an agent that knows more than the others."""


@dataclass(frozen=True)
class Style:
    """What tells an agent from others, for colour-blind readers and in grey too.

    Attributes:
        colour: Number of a colour of the page's style sheet, from 0 to 11.
        dash: Lengths in pixels, drawn and left out in turn; empty: a solid line.
        mark: Name of a shape.
    """

    colour: int
    dash: tuple[int, ...]
    mark: str


def style(number: int) -> Style:
    """Returns a style: the first 12 differ in colour, dash and mark, the first 144 in dash or mark, so in grey too."""
    round_, place = divmod(number, _COUNT)
    return Style(place, _DASHES[(place + round_) % _COUNT], _MARKS[(place + 2 * round_) % _COUNT])


def styles_of(labels: Sequence[str]) -> list[int]:
    """Returns the number of each agent's style: that of a shipped agent is the same everywhere.

    Args:
        labels: Names of agents, with options or without; a second one of a name, and one that is not shipped, gets a
            style that no shipped agent has.
    """
    shipped = [name for name, *_ in _native.agents()]
    found: dict[str, int] = {}
    # A name alone comes before the same with options.
    for label in sorted(labels, key=lambda label: ":" in label):
        name = label.split(":")[0]
        number = shipped.index(name) if name in shipped else len(shipped)
        if number in found.values():
            number = len(shipped)
        while number in found.values():
            number += 1
        found[label] = number
    return [found[label] for label in labels]


def is_yardstick(label: str) -> bool:
    """Returns whether an agent is told more than an online agent may know."""
    return any(name == label.split(":")[0] and not is_online for name, _, _, is_online in _native.agents())


def title_of(label: str) -> str:
    """Returns an agent's label, and whether it is a yardstick."""
    return f"{label} (yardstick)" if is_yardstick(label) else label
