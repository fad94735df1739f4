"""`swath run`."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Annotated

import typer

from swath.cli.options import AsJson
from swath.episode import Episode, run_episode
from swath.errors import ConfigError
from swath.files import write_whole
from swath.share import share

__all__ = ["run"]


def run(
    agent: Annotated[str, typer.Argument(metavar="AGENT", help="An agent, such as jump or bcp:spacing=sensor.")],
    *,
    scenario: Annotated[str, typer.Option(help="A file or a shipped scenario.")] = "pasture",
    seed: Annotated[int, typer.Option(help="Draws the weeds, and apart from them the agent's own choices.")] = 0,
    trajectory: Annotated[
        Path | None, typer.Option(help="CSV file for the path: x_m, y_m, heading_rad, path_m.", show_default="none")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run one episode and print its numbers."""
    if trajectory is not None and (not trajectory.name or trajectory.is_dir()):
        text = f"`trajectory` must be a file, got the folder {trajectory}"
        raise ConfigError(text)
    episode = run_episode(agent, scenario=scenario, seed=seed)
    if trajectory is not None:
        write_whole(trajectory, csv_of(episode))
    numbers = numbers_of(episode)
    if as_json:
        typer.echo(json.dumps(numbers, indent=2))
        return
    for name, value in numbers.items():
        typer.echo(f"{name:16} {_rounded(name, value)}")


def _rounded(name: str, value: object) -> str:
    """Returns a number as people read it: lengths in millimetres, shares to a hundredth of a per cent."""
    if not isinstance(value, float):
        return str(value)
    return f"{value:.3f}" if name.endswith("_m") else share(value, 4)


def numbers_of(episode: Episode) -> dict[str, object]:
    """Returns what an episode was and how it ended."""
    return {
        "scenario": episode.scenario.name,
        "agent": episode.agent,
        "seed": episode.seed,
        "path_length_m": episode.path_length_m,
        "bcp_length_m": episode.bcp_length_m,
        "path_fraction": episode.path_fraction,
        "weeds_total": episode.weeds_total,
        "weeds_detected": episode.weeds_detected,
        "weeds_mowed": episode.weeds_mowed,
        "seen_fraction": episode.seen_fraction,
        "outcome": episode.outcome,
    }


def csv_of(episode: Episode) -> str:
    """Returns the path as CSV, with numbers as `repr` writes them."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["x_m", "y_m", "heading_rad", "path_m"])
    writer.writerows(episode.trajectory.tolist())
    return text.getvalue()
