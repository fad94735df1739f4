"""What environments have in common when they are looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swath.errors import RenderModeError
from swath.extras import need

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    import numpy as np
    import numpy.typing as npt

__all__ = ["RENDER_FPS", "RENDER_SIZE", "Screen", "check_render_mode"]

RENDER_FPS = 30
"""Pictures a second of a film with one picture a step: by default 15 times as fast as the mower."""

RENDER_SIZE = (640, 360)
"""Width and height of a picture, pixels."""

Image: TypeAlias = "npt.NDArray[np.uint8]"


def check_render_mode(mode: str | None, modes: Sequence[str]) -> None:
    """Makes sure that an environment can be looked at so.

    Raises:
        RenderModeError: If `mode` is neither None nor one of `modes`.
    """
    if mode is not None and mode not in modes:
        names = [f"`{known}`" for known in modes]
        expected = f"None or {' or '.join(names)}" if names else "None"
        text = f"`render_mode` must be {expected}, got {mode!r}"
        raise RenderModeError(text)


class Screen:
    """A window that shows pictures, by pygame."""

    def __init__(self, title: str) -> None:
        """Opens no window yet: its size is that of the first picture.

        Raises:
            ModuleNotFoundError: If pygame is not installed; the message names the extra.
        """
        need('`render_mode="human"`', "human", "pygame")
        self._title = title
        self._is_open = False

    def show(self, image: Image, *, waits: bool = True) -> None:
        """Shows a picture (height, width, 3); with `waits` the next one is shown at `RENDER_FPS`."""
        import pygame

        if not self._is_open:
            pygame.display.init()
            self._window = pygame.display.set_mode((image.shape[1], image.shape[0]))
            pygame.display.set_caption(self._title)
            self._clock = pygame.time.Clock()
            self._is_open = True
        # The desktop asks a window that never listens whether it is alive.
        pygame.event.pump()
        self._window.blit(pygame.image.frombuffer(image.tobytes(), (image.shape[1], image.shape[0]), "RGB"), (0, 0))
        pygame.display.flip()
        if waits:
            self._clock.tick(RENDER_FPS)

    def __getstate__(self) -> dict[str, object]:
        """Returns what a copy begins with: it opens a window of its own."""
        return {"_title": self._title, "_is_open": False}

    def close(self) -> None:
        """Closes the window; closing twice is fine."""
        if self._is_open:
            import pygame

            pygame.display.quit()
            self._is_open = False
