"""The evaluation itself."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from swath import _native
from swath.evaluation.journal import Journal
from swath.evaluation.results import Results, versus_of
from swath.evaluation.row import Row
from swath.evaluation.study import Study, whole
from swath.progress import Progress

if TYPE_CHECKING:
    from swath.evaluation.row import Task
    from swath.evaluation.study import Sources

__all__ = ["evaluate"]

_MOST_JOBS = 4096


def evaluate(
    agents: str | Sequence[str],
    *,
    scenario: Sources = None,
    instances: int = 100,
    seed: int = 0,
    jobs: int | None = None,
    only: str | None = None,
    out: str | os.PathLike[str] | None = None,
    progress: bool = False,
    versus: str | None = None,
) -> Results:
    """Runs agents natively over many instances, each until its own stop.

    Instance i has the seed `seed + i`, the same for every agent, so that agents are compared on the same weeds.
    With `out` every finished episode is kept at once, and the same call goes on where a stopped one ended.

    Args:
        agents: Names, with or without options, such as `["jump", "bcp:spacing=sensor"]`; or one text with commas.
        scenario: A shipped name, a file, a dictionary or a `Scenario`, with or without sweeps; or a list of them, whose
            cells are joined.
        instances: Number of instances of each cell, at least 1.
        seed: Seed of instance 0.
        jobs: Number of threads; None: all cores. It changes nothing but `wall_s`.
        only: The one sweep to run.
        out: Folder for `journal.jsonl`, `episodes.csv`, `scenario.toml` (`scenario-1.toml` ... for several) and
            `summary.json`; None: nothing is written.
        progress: Whether a bar on stderr tells how far it is.
        versus: The agent that the table compares the others with; None: the first one.

    Returns:
        The rows and their statistics.

    Raises:
        ConfigError: If an argument cannot be used, or `out` holds something else; nothing has been written then.
        OSError: If `out` cannot be written to.
    """
    study = Study.plan(agents, scenario=scenario, instances=instances, seed=seed, only=only)
    versus = versus_of(study, versus)
    threads = _cores() if jobs is None else whole("jobs", jobs, least=1, most=_MOST_JOBS)
    journal = None if out is None else Journal(Path(out), study)
    rows = {} if journal is None else journal.rows
    with Progress("episodes", len(study), is_wanted=progress) as bar, journal or nullcontext():
        bar.advance(len(rows))
        for row in run(study, skip=rows, threads=threads):
            rows[row.task] = row
            if journal is not None:
                journal.write(row)
            bar.advance(1)
    results = Results.of(study, rows, versus)
    if out is not None:
        results.write(Path(out))
    return results


def run(study: Study, *, skip: Mapping[Task, Row], threads: int) -> Iterator[Row]:
    """Yields the rows of a study as they get finished, but for those of `skip`."""
    labels = study.labels
    tasks = [
        (cell, labels.index(agent), instance)
        for cell, agent, instance in study.tasks()
        if (cell, agent, instance) not in skip
    ]
    scenarios = [cell.scenario for cell in study.cells]
    stream = _native.EpisodeStream(scenarios, study.agents, tasks, study.seed, threads)
    for cell, agent, instance, summary, wall_s in stream:
        yield Row(
            cell=cell,
            scenario=study.cells[cell].name,
            agent=labels[agent],
            instance=instance,
            seed=study.seed + instance,
            wall_s=wall_s,
            **summary,
        )


def _cores() -> int:
    """Returns how many cores this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1
