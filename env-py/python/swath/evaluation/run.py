"""The evaluation itself."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from swath.errors import ConfigError
from swath.evaluation.journal import Journal
from swath.evaluation.results import Results, versus_of
from swath.evaluation.row import Row, add
from swath.evaluation.study import Study, cores, whole
from swath.extras import need
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
    backend: str = "local",
    only: str | None = None,
    out: str | os.PathLike[str] | None = None,
    progress: bool = False,
    versus: str | None = None,
) -> Results:
    """Runs agents natively over many instances, each until its own stop.

    Instance i has the seed `seed + i`, the same for every agent, so that agents are compared on the same weeds.
    Where the scenario gives the weeds, or has none, all instances are copies of one: they count as one, without an
    interval, but for agents that choose at random.
    With `out` every finished episode is kept at once, and the same call goes on where a stopped one ended.

    Args:
        agents: Names, with or without options, such as `["jump", "bcp:spacing=sensor"]`; or one text with commas.
        scenario: A shipped name, a file, a dictionary or a `Scenario`, with or without sweeps; or a list of them, whose
            cells are joined.
        instances: Number of instances of each cell, at least 1.
        seed: Seed of instance 0.
        jobs: Number of threads, or of Ray's tasks at a time; None: all cores. It changes nothing but `wall_s`.
        backend: `local`: threads of this process; `ray`: tasks of Ray, on the cluster that `ray.init` has connected to,
            on that of the environment variable `RAY_ADDRESS`, or on workers of this machine. The rows are the same,
            whatever becomes of a worker: an episode that was lost with one runs again.
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
        ModuleNotFoundError: If Ray is wanted and not installed; the message names the extra.
    """
    study = Study.plan(agents, scenario=scenario, instances=instances, seed=seed, only=only)
    versus = versus_of(study, versus)
    jobs = None if jobs is None else whole("jobs", jobs, least=1, most=_MOST_JOBS)
    if backend not in ("local", "ray"):
        text = f"`backend` must be local or ray, got {backend!r}"
        raise ConfigError(text)
    if backend == "ray":
        need("`backend`", "ray", "ray")
    journal = None if out is None else Journal(Path(out), study)
    rows = {} if journal is None else journal.rows
    with Progress("episodes", len(study), is_wanted=progress) as bar, journal or nullcontext():
        bar.resume(len(rows))
        for row in _rows(study, rows, backend, jobs):
            if not add(rows, row):
                continue
            if journal is not None:
                journal.write(row)
            bar.advance(1)
    results = Results.of(study, rows, versus)
    if out is not None:
        results.write(Path(out))
    return results


def _rows(study: Study, known: Mapping[Task, Row], backend: str, jobs: int | None) -> Iterator[Row]:
    """Yields the rows that are not known yet, as they get finished."""
    tasks = [task for task in study.tasks() if task not in known]
    if backend == "ray":
        from swath.evaluation.on_ray import run_on_ray

        return run_on_ray(study, tasks, jobs)
    return study.run(tasks, threads=jobs or cores())
