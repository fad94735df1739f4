"""Films of recorded episodes: moving pictures, the last picture, or a recording for the Rerun viewer.

```python
episodes = [swath.run_episode(agent, scenario="cowbot-field", seed=7) for agent in ("snake", "horizon")]
swath.film.write_film(episodes, Path("race.gif"))
```
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swath.errors import ConfigError
from swath.extras import need
from swath.film import moving, recording
from swath.film.script import Script
from swath.rendering import RENDER_SIZE

if TYPE_CHECKING:
    from typing import TypeAlias

    from swath.episode import Episode

__all__ = ["SUFFIXES", "check_film", "write_film"]

Writer: TypeAlias = "Callable[[Path, Script], None]"

# Who writes such a file, the extra that this needs and its package.
_WRITERS: dict[str, tuple[Writer, str, tuple[str, ...]]] = {
    ".gif": (moving.write_gif, "film", ("PIL",)),
    ".mp4": (moving.write_mp4, "film", ("imageio_ffmpeg",)),
    ".png": (moving.write_png, "", ()),
    ".rrd": (recording.write_rrd, "rerun", ("rerun",)),
}

SUFFIXES = tuple(_WRITERS)
"""What the name of a film may end in."""

_MOST_FPS = 100
_MOST_S = 3600
_MOST_EPISODES = 64


def check_film(path: Path, *, fps: int = 30, seconds: float | None = None) -> None:
    """Makes sure that a film can be written so, which is known before its episodes are; arguments as for `write_film`.

    Raises:
        ConfigError: If an argument cannot be used; the message names it.
        ModuleNotFoundError: If a package is missing; the message names the extra.
    """
    suffix = path.suffix.lower()
    if suffix not in _WRITERS:
        text = f"`path` must end in {', '.join(SUFFIXES)}, got {path}"
        raise ConfigError(text)
    if isinstance(fps, bool) or not isinstance(fps, int) or not 1 <= fps <= _MOST_FPS:
        text = f"`fps` must be a whole number from 1 to {_MOST_FPS}, got {fps!r}"
        raise ConfigError(text)
    if seconds is not None and not 0 < seconds <= _MOST_S:
        text = f"`seconds` must be above 0 and at most {_MOST_S}, got {seconds!r}"
        raise ConfigError(text)
    _, extra, packages = _WRITERS[suffix]
    need(f"a film as `{suffix}`", extra, *packages)


def write_film(
    episodes: Sequence[Episode],
    path: Path,
    *,
    size: tuple[int, int] = RENDER_SIZE,
    fps: int = 30,
    seconds: float | None = None,
) -> None:
    """Writes a film of episodes on the same weeds, side by side; at one time all have come equally far.

    | suffix | what | needs |
    |---|---|---|
    | `.png` | the last picture | nothing |
    | `.gif` | a film that repeats | `swath[film]` |
    | `.mp4` | a film, H.264 | `swath[film]` |
    | `.rrd` | path, mower, weeds and numbers over the path length, for the Rerun viewer | `swath[rerun]` |

    The episodes are driven once more, natively; undetected weeds are shown too. The same episodes give the same bytes,
    but for `.rrd`, which notes when it was written.

    Args:
        episodes: What `run_episode` returned: from 1 to 64, of one scenario and with the same weeds.
        path: The file, replaced if there is one; it is complete or not there.
        size: Width and height of the picture of one episode, pixels, from (160, 90) to (4096, 4096).
        fps: Pictures a second, from 1 to 100; a GIF shows each for whole hundredths of a second, 2 or more.
        seconds: How long the longest episode takes, at most 3600; the last picture stands 1.5 s longer. None: 1 s for
            100 m, but from 5 s to 30 s.

    Raises:
        ConfigError: If an argument cannot be used; the message names it.
        ModuleNotFoundError: If a package is missing; the message names the extra.
        OSError: If the file cannot be written.
    """
    path = Path(path)
    check_film(path, fps=fps, seconds=seconds)
    _check_episodes(episodes)
    if seconds is None:
        seconds = min(max(max(episode.path_length_m for episode in episodes) / 100, 5.0), 30.0)
    writer, _, _ = _WRITERS[path.suffix.lower()]
    writer(path, Script(list(episodes), size, fps, max(round(seconds * fps), 1)))


def _check_episodes(episodes: Sequence[Episode]) -> None:
    if not 1 <= len(episodes) <= _MOST_EPISODES:
        text = f"`episodes` must hold from 1 to {_MOST_EPISODES} episodes, got {len(episodes)}"
        raise ConfigError(text)
    first = episodes[0]
    for number, episode in enumerate(episodes):
        for name, is_same in (
            ("scenario", episode.scenario == first.scenario),
            ("weeds", np.array_equal(episode.weeds_m, first.weeds_m)),
        ):
            if not is_same:
                text = f"`episodes` must have the same {name}, got another one in `episodes[{number}]`"
                raise ConfigError(text)
