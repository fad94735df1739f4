"""What every side does; peers import it in environments of their own, so it needs nothing but Python."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from typing import Any, NamedTuple

_PINNED_TO = max(os.sched_getaffinity(0))
_ALL = os.sched_getaffinity(0)


class Run(NamedTuple):
    """One measurement: steps of all environments together, CPU time of the process, time that passed."""

    steps: int
    cpu_s: float
    wall_s: float


def serve(packages: Sequence[str], measure: Callable[[dict[str, Any]], Run]) -> None:
    """Says which versions this side has, and then measures each case that comes in."""
    out = sys.stdout
    versions = {"Python": platform.python_version(), **{name: version(name) for name in packages}}
    print(json.dumps(versions), file=out, flush=True)
    for line in sys.stdin:
        case = json.loads(line)
        os.sched_setaffinity(0, {_PINNED_TO} if case["threads"] == 1 else _ALL)
        # What a library prints must not stand between the answers.
        with contextlib.redirect_stdout(sys.stderr):
            try:
                answer = measure(case)._asdict()
            except Exception as error:  # whatever is wrong with a case, the next one may go
                answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=out, flush=True)


def live_steps(step: Callable[[Any], Sequence[Any]], actions: Iterable[Any], num_envs: int, enough_s: float) -> Run:
    """Steps a batch that resets itself in the next step, and counts the steps that were not such resets.

    Args:
        step: Makes one step; its third and fourth results are the flags of the ends.
        actions: The actions, driven again and again.
        num_envs: Environments in the batch.
        enough_s: CPU time after which no further round of actions begins, seconds; the first always does.
    """
    flags: list[tuple[Any, Any]] = []
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    while not flags or time.process_time() - cpu_s < enough_s:
        for action in actions:
            _, _, terminated, truncated, _ = step(action)
            flags.append((terminated, truncated))
    cpu_s, wall_s = time.process_time() - cpu_s, time.perf_counter() - wall_s
    ends = sum(int((terminated | truncated).sum()) for terminated, truncated in flags[:-1])
    return Run(len(flags) * num_envs - ends, cpu_s, wall_s)
