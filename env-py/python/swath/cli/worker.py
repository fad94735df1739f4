"""`swath worker`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swath.cli.options import AsJson, TlsCa, TlsCertificate, TlsKey, tls_from
from swath.cli.stop import Stopped

if TYPE_CHECKING:
    from swath.rollouts import Work

__all__ = ["worker"]


def worker(
    *,
    connect: Annotated[list[str], typer.Option(help="A server, such as tcp/127.0.0.1:7447; once for each of several.")],
    policy: Annotated[str, typer.Option(help="A scripted agent, random, or the .zip of a trained model.")],
    out: Annotated[Path, typer.Option(help="Folder for rows and trajectories.")],
    scenario: Annotated[
        str | None, typer.Option(help="A file or a shipped scenario.", show_default="the trained model's, or pasture")
    ] = None,
    episodes: Annotated[int, typer.Option(help="Number of episodes of the whole sweep.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of episode 0; episode i has the seed plus i.")] = 0,
    num_envs: Annotated[int, typer.Option(help="Number of episodes that are played together.")] = 16,
    shard: Annotated[str, typer.Option(help="The part of the sweep to play, I/N with I from 1 to N.")] = "1/1",
    observation: Annotated[
        str | None, typer.Option(help="Observation kind instead of the scenario's.", show_default="the scenario's")
    ] = None,
    action: Annotated[
        str | None, typer.Option(help="Action kind instead of the scenario's.", show_default="the scenario's")
    ] = None,
    server: Annotated[str, typer.Option(help="The name that the servers were started with.")] = "default",
    deadline_s: Annotated[
        float, typer.Option(help="How long a server may be silent before it counts as gone, seconds.")
    ] = 60.0,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on at once when a server that sends snapshots was started anew.")
    ] = False,
    tls_ca: TlsCa = None,
    tls_certificate: TlsCertificate = None,
    tls_key: TlsKey = None,
    as_json: AsJson = False,
) -> None:
    """Play episodes of a policy on servers, and keep their trajectories and results.

    The folder gets a part for each shard (every finished episode, at once) and, once all shards are done, episodes.csv
    (one row an episode), summary.json (the statistics), scenario.toml (as resolved) and dataset (for Minari). The same
    command goes on where a stopped one ended. Folders of several machines are copied into one; there, one of the
    commands, given once more, joins them.

    The rows of a scripted agent have the columns of `swath evaluate` and other numbers: there it drives its path
    itself, here it steps an environment with actions that hold for one control period.
    """
    from swath import rollouts

    try:
        work = rollouts.work(
            policy,
            connect=connect,
            out=out,
            scenario=scenario,
            episodes=episodes,
            seed=seed,
            num_envs=num_envs,
            shard=shard,
            server=server,
            deadline_s=deadline_s,
            resume=resume,
            zenoh=tls_from(tls_ca, tls_certificate, tls_key),
            progress=True,
            observation=None if observation is None else {"kind": observation},
            action=None if action is None else {"kind": action},
        )
    except KeyboardInterrupt:
        raise Stopped("stopped: the same command goes on from here") from None  # noqa: TRY003
    if as_json:
        typer.echo(json.dumps(_plain(work, out), indent=2, allow_nan=False))
    elif work.results is None:
        typer.echo(f"shard {work.shard} is done; {work.missing} of {len(work.sweep)} episodes are left to other shards")
    else:
        typer.echo(work.results.table(), nl=False)
        typer.echo(f"wrote {out / 'episodes.csv'}, {out / 'summary.json'} and {work.dataset}")


def _plain(work: Work, out: Path) -> dict[str, object]:
    """Returns what was done as plain data."""
    return {
        "policy": work.sweep.label,
        "scenario": work.sweep.scenario.name,
        "episodes": len(work.sweep),
        "seed": work.sweep.seed,
        "shard": str(work.shard),
        "played": work.played,
        "missing": work.missing,
        "out": str(out),
        "dataset": None if work.dataset is None else str(work.dataset),
        "summary": None if work.results is None else work.results.summary(),
    }
