"""Films as pictures."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swath import _native
from swath.files import unfinished, write_whole

if TYPE_CHECKING:
    from swath.film.script import Script

__all__ = ["write_gif", "write_mp4", "write_png"]

_LAST_SHOWN_S = 1.5
"""How long the last picture of a film stands, seconds."""

_SHORTEST = 2
"""Hundredths of a second that a picture of a GIF is shown at least."""

_MP4 = ["-f", "mp4", "-crf", "20", "-threads", "1", "-fflags", "+bitexact", "-flags", "+bitexact"]


def write_png(path: Path, script: Script) -> None:
    """Writes the last picture."""
    write_whole(path, _native.png(script.last_picture()))


def write_gif(path: Path, script: Script) -> None:
    """Writes a film that repeats.

    A GIF counts hundredths of a second, and browsers slow down what is faster than two of them: so the pictures are as
    many as fit in evenly, at about the rate asked for.
    """
    from PIL import Image

    each = max(round(100 / script.fps), _SHORTEST)
    length = round(100 * script.frames / script.fps)
    script = replace(script, frames=max(round(length / each), 1))
    # One palette for all: the legend is in every picture, and the last one has all that is mixed from its colours.
    palette = Image.fromarray(script.last_picture()).quantize(255, dither=Image.Dither.NONE)
    pictures = [
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in script.pictures()
    ]
    ends = [round(length * (number + 1) / script.frames) for number in range(script.frames)]
    times_ms = [10 * (end - start) for start, end in itertools.pairwise([0, *ends])]
    times_ms.append(round(1000 * _LAST_SHOWN_S))
    first, *others = pictures
    with unfinished(path) as file:
        first.save(file, format="GIF", save_all=True, append_images=others, duration=times_ms, loop=0)


def write_mp4(path: Path, script: Script) -> None:
    """Writes a film in H.264, by the ffmpeg that imageio-ffmpeg brings."""
    import imageio_ffmpeg

    height, width, _ = script.film().render().shape
    # H.264 keeps colours at half the resolution, so sides are even.
    height, width = height + height % 2, width + width % 2
    stands = max(round(_LAST_SHOWN_S * script.fps) - 1, 0)
    with unfinished(path) as file:
        writer = imageio_ffmpeg.write_frames(
            str(file),
            (width, height),
            fps=script.fps,
            codec="libx264",
            quality=None,
            macro_block_size=1,
            ffmpeg_log_level="error",
            output_params=_MP4,
        )
        writer.send(None)
        try:
            for picture in script.pictures():
                even = np.pad(
                    picture,
                    ((0, height - picture.shape[0]), (0, width - picture.shape[1]), (0, 0)),
                    mode="edge",
                )
                writer.send(even)
            for _ in range(stands):
                writer.send(even)
        finally:
            writer.close()
        # What ffmpeg could not write at the end, it does not tell.
        written, _ = imageio_ffmpeg.count_frames_and_secs(str(file))
        if written != script.frames + 1 + stands:
            text = f"{path} was not written whole: {written} of {script.frames + 1 + stands} pictures"
            raise OSError(text)
