"""`swath replay`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from swath import _native
from swath.episode import run_episode
from swath.errors import ConfigError
from swath.files import write_whole
from swath.film import SUFFIXES, check_film, write_film
from swath.progress import Progress
from swath.replay import page_of

__all__ = ["replay"]

_PAGES = (".html", ".htm")
_STILLS = (".png",)
_FPS = 30


def replay(
    agents: Annotated[
        list[str], typer.Argument(metavar="AGENT...", help="Agents, such as jump or bcp:spacing=sensor.")
    ],
    *,
    out: Annotated[
        Path, typer.Option(help="File to write; its suffix says what: .html, .gif, .mp4, .png (a still), .rrd (Rerun).")
    ],
    scenario: Annotated[str, typer.Option(help="A file or a shipped scenario.")] = "pasture",
    weeds: Annotated[
        Path | None,
        typer.Option(help="CSV file with one weed a line, x and y in m.", show_default="the scenario's own"),
    ] = None,
    seed: Annotated[int, typer.Option(help="Draws the weeds, and apart from them the agents' own choices.")] = 0,
    fps: Annotated[
        int | None, typer.Option(help="Films: pictures a second, at most 50 in a .gif.", show_default="30")
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            help="Films: how long the longest path takes; the last picture stands 1.5 s more.",
            show_default="1 for 100 m, from 5 to 30",
        ),
    ] = None,
) -> None:
    """Show how agents drive, side by side on the same weeds: a page that plays offline, a film or a picture."""
    _check(out, fps, seconds)
    chosen = _native.Scenario(scenario, weeds=None if weeds is None else {"file": str(weeds.resolve())})
    specs = _specs(agents)
    episodes = []
    with Progress("agents", len(specs), is_wanted=True) as bar:
        for spec in specs:
            episodes.append(run_episode(spec.label, scenario=chosen, seed=seed))
            bar.advance(1)
    if out.suffix.lower() in _PAGES:
        write_whole(out, page_of(episodes))
    else:
        write_film(episodes, out, fps=fps or _FPS, seconds=seconds)
    for episode in episodes:
        typer.echo(
            f"{episode.agent}: {episode.path_length_m:.1f} m, {100 * episode.path_fraction:.1f} % of the boustrophedon "
            f"path, {episode.weeds_mowed} of {episode.weeds_total} weeds mowed"
        )
    typer.echo(f"wrote {out}")


def _check(out: Path, fps: int | None, seconds: float | None) -> None:
    """Refuses a file that cannot be written, before anything runs."""
    if out.suffix.lower() not in (*_PAGES, *SUFFIXES):
        text = f"`out` must end with .html, {', '.join(SUFFIXES)}, got {out}"
        raise ConfigError(text)
    if out.is_dir() or not out.parent.is_dir():
        text = f"`out` must be a file in a folder that exists, got {out}"
        raise ConfigError(text)
    for name, value in (("fps", fps), ("seconds", seconds)):
        if value is not None and out.suffix.lower() in (*_PAGES, *_STILLS):
            films = [suffix for suffix in SUFFIXES if suffix not in _STILLS]
            text = f"`{name}` is for films, which end with {', '.join(films)}, got {value} for {out}"
            raise ConfigError(text)
    if out.suffix.lower() not in _PAGES:
        check_film(out, fps=_FPS if fps is None else fps, seconds=seconds)


def _specs(agents: Sequence[str]) -> list[_native.AgentSpec]:
    specs = [_native.AgentSpec(agent) for agent in agents]
    labels = [spec.label for spec in specs]
    for number, label in enumerate(labels):
        if label in labels[:number]:
            text = f"`AGENT` must differ from the others, got `{label}` twice"
            raise ConfigError(text)
    return specs
