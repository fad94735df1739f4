"""`swath demo`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from swath.cli.options import Jobs, Seed
from swath.cli.stop import Stopped
from swath.episode import run_episode
from swath.errors import ConfigError
from swath.evaluation import Results, evaluate
from swath.evaluation.statistics import interval, spread
from swath.evaluation.table import print_whole
from swath.files import check_folder, write_whole
from swath.film import write_film
from swath.replay import page_of

__all__ = ["demo"]

AGENTS = ("bcp", "bcp-tsp", "react", "jump", "snake", "r-snake", "greedy", "horizon", "learned")
PASTURES = ("cowbot-field", "pasture")
REPLAY, REPLAYED = "snake.html", (("pasture", "snake"), ("pasture", "horizon"))
PICTURE_SIZE = (1280, 720)


def demo(
    *,
    out: Annotated[Path, typer.Option(help="Folder for the rows, the statistics, the pictures and the replay.")] = Path(
        "out/demo"
    ),
    instances: Annotated[int, typer.Option(help="Number of instances of each pasture.")] = 20,
    seed: Seed = 0,
    jobs: Jobs = None,
) -> None:
    """Let the agents race on the shipped pastures: a table, a picture of each path, and a replay."""
    check_folder("out", out)
    _refuse_others(out)
    try:
        results = evaluate(AGENTS, scenario=PASTURES, instances=instances, seed=seed, jobs=jobs, progress=True)
        typer.echo(table_of(results), nl=False)
        out.mkdir(parents=True, exist_ok=True)
        results.write(out)
        replayed = []
        for pasture in PASTURES:
            for agent in AGENTS:
                episode = run_episode(agent, scenario=pasture, seed=seed)
                write_film([episode], out / f"{pasture}-{agent}.png", size=PICTURE_SIZE)
                if (pasture, agent) in REPLAYED:
                    replayed.append(episode)
        write_whole(out / REPLAY, page_of(replayed))
    except KeyboardInterrupt:
        raise Stopped("stopped: the demo starts afresh next time") from None  # noqa: TRY003
    pictures = len(PASTURES) * len(AGENTS)
    typer.echo(f"wrote {out / 'episodes.csv'}, {out / 'summary.json'} and {pictures} pictures beside them")
    typer.echo(f"wrote {out / REPLAY}: open it in a browser to watch snake beside horizon")


def _refuse_others(out: Path) -> None:
    """Refuses a folder that holds anything but an earlier demo."""
    ours = {
        "episodes.csv",
        "summary.json",
        REPLAY,
        *(f"{pasture}-{agent}.png" for pasture in PASTURES for agent in AGENTS),
    }
    ours |= {f"scenario-{number}.toml" for number in range(1, len(PASTURES) + 1)}
    others = sorted(entry.name for entry in out.iterdir() if entry.name not in ours) if out.exists() else []
    if others:
        text = f"`out` must be empty or hold an earlier demo, got {out} with other files, such as {others[0]}"
        raise ConfigError(text)


def table_of(results: Results) -> str:
    """Returns one line for each pasture and agent."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for name in ["pasture", "agent"]:
        table.add_column(name)
    for name in ["path m", "% of boustrophedon", "weeds mowed", "of", "mowed %"]:
        table.add_column(name, justify="right")
    for cell, pasture in enumerate(PASTURES):
        for agent in AGENTS:
            rows = results.of_cell(cell, agent)
            table.add_row(
                pasture,
                agent,
                f"{spread([row.path_length_m for row in rows])['mean']:.0f}",
                interval(spread([row.path_percent for row in rows])),
                f"{spread([row.weeds_mowed for row in rows])['mean']:.2f}",
                f"{spread([row.weeds_total for row in rows])['mean']:g}",
                interval(spread([row.mowed_percent for row in rows]), whole=100.0),
                end_section=agent == AGENTS[-1],
            )
    n = results.study.instances
    return print_whole(table) + f"means over {n} instance(s), ± half their 95 % interval (Student's t)\n"
