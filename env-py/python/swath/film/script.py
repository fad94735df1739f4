"""What a film is made from."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swath import _native
from swath.styles import title_of

if TYPE_CHECKING:
    from typing import TypeAlias

    import numpy as np
    import numpy.typing as npt

    from swath.episode import Episode

__all__ = ["Image", "Script"]

Image: TypeAlias = "npt.NDArray[np.uint8]"

_LONGEST_ROW = 3


@dataclass(frozen=True)
class Script:
    """What a film is made from.

    Attributes:
        episodes: At least one, on the same weeds.
        size: Width and height of the picture of one episode, pixels.
        fps: Pictures a second.
        frames: Pictures after the one of the start.
    """

    episodes: Sequence[Episode]
    size: tuple[int, int]
    fps: int
    frames: int

    def film(self) -> _native.Film:
        """Returns the episodes at their start: up to three side by side, more in a square."""
        first, count = self.episodes[0], len(self.episodes)
        columns = count if count <= _LONGEST_ROW else math.ceil(math.sqrt(count))
        paths = [(title_of(episode.agent), episode.trajectory) for episode in self.episodes]
        return _native.Film(first.scenario, first.weeds_m, paths, self.size, columns)

    def last_picture(self) -> Image:
        """Returns the picture of the end, (height, width, 3)."""
        film = self.film()
        film.drive_to(film.length_m)
        return film.render()

    def pictures(self) -> Iterator[Image]:
        """Yields all pictures from the start to the end."""
        film = self.film()
        for frame in range(self.frames + 1):
            film.drive_to(film.length_m * frame / self.frames)
            yield film.render()
