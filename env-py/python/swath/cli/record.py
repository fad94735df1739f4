"""`swath record`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swath.cli.stop import Stopped

__all__ = ["record"]


def record(
    *,
    agent: Annotated[str, typer.Option(help="A scripted agent, random, or the .zip of a trained model.")],
    episodes: Annotated[int, typer.Option(help="Number of episodes.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of episode 0; episode i has the seed plus i.")] = 0,
    scenario: Annotated[
        str | None, typer.Option(help="A file or a shipped scenario.", show_default="the trained model's, or pasture")
    ] = None,
    observation: Annotated[
        str | None, typer.Option(help="Observation kind instead of the scenario's.", show_default="the scenario's")
    ] = None,
    action: Annotated[
        str | None, typer.Option(help="Action kind instead of the scenario's.", show_default="the scenario's")
    ] = None,
    dataset: Annotated[str | None, typer.Option(help="Name in Minari.", show_default="swath/AGENT-v0")] = None,
    root: Annotated[Path | None, typer.Option(help="Folder of Minari's datasets.", show_default="Minari's own")] = None,
) -> None:
    """Record episodes of an agent as a Minari dataset."""
    from swath import datasets

    try:
        folder = datasets.record(
            agent,
            episodes=episodes,
            seed=seed,
            scenario=scenario,
            dataset_id=dataset,
            root=root,
            progress=True,
            observation=None if observation is None else {"kind": observation},
            action=None if action is None else {"kind": action},
        )
    except KeyboardInterrupt:
        raise Stopped("stopped: nothing was kept") from None  # noqa: TRY003
    typer.echo(f"wrote {folder}")
