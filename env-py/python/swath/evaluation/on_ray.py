"""Episodes as tasks of Ray.

An episode is a function of its agent, its scenario and its seed, so a task whose worker was lost simply runs again, and
its rows are the same. Ray sees to that; what is decided here is only how many episodes make a task.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING

import ray

from swath.errors import SwathError
from swath.evaluation.study import build, cores

if TYPE_CHECKING:
    from swath.evaluation.row import Row, Task
    from swath.evaluation.study import Study

__all__ = ["run_on_ray"]

_MOST_EPISODES = 32
"""A lost worker costs no more than these, and a task costs Ray about a millisecond."""

_TASKS_OF_A_JOB = 4
"""A short sweep makes at least so many tasks for each worker, so that none is idle for long at its end."""

_RETRIES = 10
"""An episode whose worker dies more often than this is held to be what kills it."""

_CONNECT_S = 5.0


def run_on_ray(study: Study, tasks: Sequence[Task], jobs: int | None) -> Iterator[Row]:
    """Yields the rows of these tasks as they get finished.

    Args:
        study: The study that the tasks belong to.
        tasks: Which of its episodes are to run.
        jobs: How many of Ray's tasks are there at a time; None: one for each of its CPUs.

    Raises:
        SwathError: If Ray cannot run them; the message says why in one line.
    """
    try:
        with _cluster(jobs):
            yield from _rows(study, tasks, jobs or max(1, int(ray.cluster_resources().get("CPU", 1))))
    except ray.exceptions.RayTaskError as error:
        raise (error.cause if isinstance(error.cause, SwathError) else error) from None
    except (ray.exceptions.RayError, ConnectionError) as error:
        text = f"Ray has given up on the sweep: {_first_line(error)}"
        raise SwathError(text) from error


def _rows(study: Study, tasks: Sequence[Task], jobs: int) -> Iterator[Row]:
    size = min(max(1, len(tasks) // (_TASKS_OF_A_JOB * jobs)), _MOST_EPISODES)
    parts = (tasks[first : first + size] for first in range(0, len(tasks), size))
    shared = ray.put(study)
    run = ray.remote(num_cpus=1, max_retries=_RETRIES)(_episodes)
    waiting: list[ray.ObjectRef[list[Row]]] = []
    try:
        while True:
            waiting += [run.remote(shared, part, build()) for part in islice(parts, jobs - len(waiting))]
            if not waiting:
                return
            done, waiting = ray.wait(waiting)
            for rows in ray.get(done):
                yield from rows
    finally:
        for part in waiting:
            ray.cancel(part)


def _first_line(error: Exception) -> str:
    """Returns the first line of what an error says, or its kind if it says nothing."""
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def _episodes(study: Study, tasks: Sequence[Task], wanted: str) -> list[Row]:
    """Runs on a worker."""
    if build() != wanted:
        text = f"`backend` must have workers with this build of swath, {wanted}, got one with {build()}"
        raise SwathError(text)
    return list(study.run(tasks, threads=1))


@contextmanager
def _cluster(jobs: int | None) -> Iterator[None]:
    """Connects to Ray where nobody has, and starts it on this machine where nobody says where it is."""
    if ray.is_initialized():
        yield
        return
    address = os.environ.get("RAY_ADDRESS", "local")
    _check(address)
    local = {"num_cpus": jobs or cores(), "include_dashboard": False} if address == "local" else {}
    try:
        try:
            ray.init(address, log_to_driver=False, logging_level=logging.ERROR, **local)
        except (OSError, RuntimeError, ValueError) as error:
            text = f"Ray cannot be {'started' if local else 'reached'}: {_first_line(error)}"
            raise SwathError(text) from error
        yield
    finally:
        ray.shutdown()


def _check(address: str) -> None:
    """Refuses an address where nobody listens: Ray would try for many minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not port.isdecimal():
        return  # `local` or `auto`
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_CONNECT_S).close()
    except (OSError, OverflowError) as error:
        text = f"`RAY_ADDRESS` must be where the head of a Ray cluster listens, got {address}: {error}"
        raise SwathError(text) from None
