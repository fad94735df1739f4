"""`swath evaluate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swath import evaluation
from swath.cli.options import AsJson, Jobs, Seed
from swath.cli.stop import Stopped
from swath.evaluation.origin import origin
from swath.files import write_whole

__all__ = ["evaluate"]

PLANNERS = "bcp,bcp-tsp,react,jump,snake,r-snake"
"""Those of Maini, Gonultas & Isler (2022)."""


def evaluate(
    scenario: Annotated[list[str], typer.Argument(metavar="SCENARIO...", help="Files or shipped scenarios.")],
    *,
    agents: Annotated[str, typer.Option(help="Agents with commas between: jump,bcp:spacing=sensor.")] = PLANNERS,
    instances: Annotated[int, typer.Option(help="Number of instances of each scenario.")] = 100,
    seed: Seed = 0,
    jobs: Jobs = None,
    backend: Annotated[str, typer.Option(help="local for threads, ray for tasks of Ray.")] = "local",
    out: Annotated[Path | None, typer.Option(help="Folder for rows and statistics.", show_default="none")] = None,
    only: Annotated[str | None, typer.Option(help="The one sweep to run.", show_default="all")] = None,
    versus: Annotated[
        str | None, typer.Option(help="Agent that the others are compared with.", show_default="the first one")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run agents over many instances and print a table.

    With --out, the folder gets journal.jsonl (every finished episode, at once), episodes.csv (one row an episode),
    scenario.toml (as resolved), summary.json (the statistics) and origin.json (this command, the build, the machine).
    The same command goes on where a stopped one ended.
    """
    try:
        results = evaluation.evaluate(
            agents,
            scenario=scenario,
            instances=instances,
            seed=seed,
            jobs=jobs,
            backend=backend,
            only=only,
            out=out,
            progress=True,
            versus=versus,
        )
    except KeyboardInterrupt:
        kept = "nothing was kept, since there is no --out" if out is None else "the same command goes on from here"
        raise Stopped(f"stopped: {kept}") from None  # noqa: TRY003
    typer.echo(results.json() if as_json else results.table(), nl=False)
    if out is not None:
        given = {"--only": only, "--jobs": jobs, "--backend": backend, "--versus": versus}
        options = [str(part) for name, value in given.items() if value is not None for part in (name, value)]
        always = ["--agents", agents, "--instances", str(instances), "--seed", str(seed), "--out", _shown(str(out))]
        command = ["swath", "evaluate", *(_shown(name) for name in scenario), *always, *options]
        write_whole(out / "origin.json", origin(command))
        typer.echo(f"wrote {out / 'episodes.csv'} and {out / 'summary.json'}", err=as_json)


def _shown(scenario: str) -> str:
    """Returns a scenario as results name it: a file of another place by its name alone."""
    return Path(scenario).name if Path(scenario).is_absolute() else scenario
