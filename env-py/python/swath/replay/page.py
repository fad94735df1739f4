"""The page itself: one file, which asks nobody for anything."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

from swath.replay.data import data_of
from swath.styles import YARDSTICK, is_yardstick, title_of

if TYPE_CHECKING:
    from swath.episode import Episode

__all__ = ["document", "json_block", "page_of", "script", "style"]

_SCRIPTS = ("episode.js", "scene.js", "race.js", "player.js")
# A browser that reads this loads nothing, whatever the page says.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"


def page_of(episodes: Sequence[Episode]) -> str:
    """Returns a page that plays episodes side by side.

    Args:
        episodes: At least one; of one scenario, on the same weeds.

    Returns:
        HTML that needs no other file and no network.

    Raises:
        ConfigError: If the episodes are not of one scenario and the same weeds.
    """
    first = episodes[0]
    names = " beside ".join(title_of(episode.agent) for episode in episodes)
    title = f"{names} on {first.scenario.name}, seed {first.seed}"
    about = (
        f"{first.weeds_total} weeds. All mowers drive at one speed, so the clock is the path driven, in metres; "
        "it stops for an agent when its own path ends."
    )
    for episode in episodes:
        if is_yardstick(episode.agent):
            about += f" <i>{escape(episode.agent)}</i>: a {escape(YARDSTICK)}."
    body = (
        f"<h1>{escape(title)}</h1>\n"
        '<main id="player"></main>\n'
        f'<p class="about">{about}</p>\n'
        '<p class="keys">Keys: space plays and pauses; left and right go 1&nbsp;% of the path (with shift 10&nbsp;%); '
        "up and down change the speed; home and end.</p>\n"
        + json_block("replay", data_of(episodes))
        + f"<script>{script()}\n"
        'new Player(document.getElementById("player"), '
        'JSON.parse(document.getElementById("replay").textContent), document);</script>\n'
    )
    return document(title, style(), body)


def document(title: str, css: str, body: str) -> str:
    """Returns a whole HTML document."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<link rel="icon" href="data:,">\n<title>{escape(title)}</title>\n'
        f"<style>\n{css}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )


def json_block(name: str, data: object) -> str:
    """Returns data as an element of the page, which is read when it is asked for."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return f'<script type="application/json" id="{name}">{text}</script>\n'


@cache
def script() -> str:
    """Returns the player's own JavaScript."""
    folder = files("swath.replay")
    return '"use strict";\n' + "\n".join(folder.joinpath(name).read_text("utf-8") for name in _SCRIPTS)


@cache
def style() -> str:
    """Returns the player's style sheet."""
    return files("swath.replay").joinpath("player.css").read_text("utf-8")
