"""The page `benchmarks/RESULTS.md`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from statistics import median

from benchmarks.throughput import machine
from benchmarks.throughput.case import ACTIONS, BATCHES, LARGEST, OBSERVATIONS, PASTURES, Case
from benchmarks.throughput.figures import Figures, short

SINGLE = Case("swath", "unwrapped")
BATCH = Case("swath", "make_vec", LARGEST)
MAPS = replace(BATCH, observation="maps")
NULL, ROLLOUT = Case("rollout", "null", 64), Case("rollout", "swath.sb3", 64)
CARTPOLE_NULL, CARTPOLE_ROLLOUT = replace(NULL, face="null of CartPole"), replace(NULL, face="CartPole")
RESET = Case("swath", "reset")
_BOTH = ["one environment, unwrapped", f"batch of {LARGEST}"]

_METHOD = """\
A figure is env steps per CPU-second: the steps of all environments together over the user and system time of the
process and its threads.
It is the median of the runs after one warm-up, with the lowest and the highest run in brackets.
All cases run in turn, round by round; with one thread the process is pinned to one core.
Actions are ready before the clock starts; resets are timed, the making of environments is not.

swath and the NumPy batch drive the same tape: laps of `snake` turned into `steer` on 16 pastures, at most 4000 steps of
each; row i of a batch is on pasture i modulo 16.
A run drives whole laps, for at least 0.3 CPU-seconds; after 3 it is broken off, and the last lap then bears its share
of its reset.
In `discrete` the lap is rounded to five curvatures, each step making up for the rounding of the steps before.
In `target` each decision is the first choice that the mask allows, and the figure counts decisions.

CartPole is driven with random actions; its steps that do nothing but reset are not counted.
EnvPool steps on a thread of its own: it is measured pinned to one core and free to use two, and the better counts.
The NumPy batch (`benchmarks/throughput/numpy_env.py`) gives the same rewards, but keeps no seen ground: 30 of the 39
numbers of an observation, and no goal.
A rollout is PPO's own `collect_rollouts` with its defaults, 2048 steps with `MlpPolicy`, torch on one thread; the
environment that does nothing returns the same arrays at every step, with the spaces of the one beside it.
CartPole stands behind a few lines that hand over what its batch returns, without infos and last observations: less than
an adaptor has to do.

Every run is in `RESULTS.csv` beside this page.
"""


def text(figures: Figures, command: str, profile: str | None) -> str:
    """The whole page; `profile` says where the instructions go."""
    sections = [
        ("# Results", _machine(figures, command)),
        ("## Targets", targets(figures)),
        ("## Side by side", _side_by_side(figures)),
        ("## One environment", _one(figures)),
        ("## Observations and actions", _kinds(figures)),
        ("## Weeds and pastures", _pastures(figures)),
        ("## Threads and copies", _threads(figures)),
        ("## Resets", _resets(figures)),
        ("## stable-baselines3", _rollouts(figures)),
        ("## Where the time goes", f"```text\n{profile.strip()}\n```" if profile else ""),
        ("## How it is measured", _METHOD),
        ("## Not measured", _missing(figures)),
    ]
    return "\n".join(f"{title}\n\n{body.strip()}\n" for title, body in sections if body)


def targets(figures: Figures) -> str:
    """What was promised, what was measured, and whether that is enough."""
    rows = [
        _row("batch of 1024, `features`, `steer`, 160 weeds: steps", 2e6, figures.median(BATCH)),
        _row("one environment, unwrapped: steps", 3e5, figures.median(SINGLE)),
        _row("batch of 1024, `maps`: steps", 4e4, figures.median(MAPS)),
    ]
    for ours in _batches():
        envpool = figures.median(_envpool(figures, ours.num_envs))
        rows.append(_row(f"batch of {ours.num_envs}: steps, EnvPool's CartPole", envpool, figures.median(ours)))
    share, resets = _share(figures, ROLLOUT, NULL), figures.median(RESET)
    rows.append(_row("SB3 rollout of 64, % of an environment that does nothing", 90.0, share))
    rows.append(_row("resets at 160 weeds (below 50 us each)", 1 / 50e-6, resets))
    return _table(["per CPU-second", "at least", "measured", ""], rows)


def _row(what: str, target: float | None, measured: float | None) -> list[str]:
    if target is None or measured is None:
        return [
            what,
            "-" if target is None else short(target),
            "-" if measured is None else short(measured),
            "not compared",
        ]
    return [what, short(target), short(measured), "met" if measured >= target else "**missed**"]


def _machine(figures: Figures, command: str) -> str:
    versions = {name: version for side in figures.versions.values() for name, version in side.items()}
    loads = ", ".join(f"{load:.2f}" for load in figures.loads)
    rows = [*machine.describe(command, versions), ("load average", f"{loads} (before, and after each round)")]
    shares = "; ".join(f"{100 * share:.1f} % ({pasture})" for pasture, share in figures.shares_inside.items())
    return _table(["", ""], [*rows, ("steps that end on the pasture", shares)])


def _batches() -> list[Case]:
    """The plain batch at every size."""
    return [replace(BATCH, num_envs=num_envs) for num_envs in BATCHES]


def _envpool(figures: Figures, num_envs: int) -> Case:
    return figures.better(*(Case("envpool", "envpool", num_envs, threads=threads) for threads in (1, 2)))


def _side_by_side(figures: Figures) -> str:
    rows = []
    for ours in _batches():
        num_envs = ours.num_envs
        others = [
            Case("numpy", "make_vec", num_envs),
            _envpool(figures, num_envs),
            Case("cartpole", "SyncVectorEnv", num_envs),
            Case("cartpole", "vector_entry_point", num_envs),
        ]
        cells = [f"{figures.cell(other)}<br>{figures.ratio(ours, other)}" for other in others]
        rows.append([str(num_envs), figures.cell(ours), *cells])
    head = [
        "environments",
        "swath",
        "NumPy",
        "EnvPool CartPole",
        "SyncVectorEnv CartPole",
        "Gymnasium's CartPole batch",
    ]
    about = "`make_vec`, `features`, `steer`, 160 weeds; below each figure, how many times as fast swath is."
    return f"{about}\n\n{_table(head, rows)}"


def _one(figures: Figures) -> str:
    made, peer = Case("swath", "gym.make"), Case("cartpole", "gym.make")
    rows = [
        ["swath, unwrapped", figures.cell(SINGLE)],
        ["swath, `gym.make`", figures.cell(made)],
        ["CartPole, `gym.make`", f"{figures.cell(peer)}<br>{figures.ratio(made, peer)}"],
    ]
    return _table(["", "steps"], rows)


def _kinds(figures: Figures) -> str:
    rows = [["`features`, `steer`", *_both(figures)]]
    rows += [[f"`{kind}`, `steer`", *_both(figures, observation=kind)] for kind in OBSERVATIONS]
    rows += [[f"`features`, `{kind}`", *_both(figures, action=kind)] for kind in ACTIONS]
    return _table(["observation, action", *_BOTH], rows)


def _pastures(figures: Figures) -> str:
    rows = [
        [f"{weeds:,} weeds, {length_m} x {width_m} m", *_both(figures, weeds=weeds, length_m=length_m, width_m=width_m)]
        for weeds, length_m, width_m in PASTURES
    ]
    numpy = [
        [f"NumPy, {weeds} weeds, 64 environments", "", figures.cell(Case("numpy", "make_vec", 64, weeds=weeds))]
        for weeds in (40, 160, 640)
    ]
    return _table(["pasture", *_BOTH], [*rows, *numpy])


def _both(figures: Figures, **change: int | str) -> list[str]:
    return [figures.cell(replace(case, **change)) for case in (SINGLE, BATCH)]  # type: ignore[arg-type]


def _threads(figures: Figures) -> str:
    rows = []
    for plain in _batches():
        for case in (plain, replace(plain, threads=2), replace(plain, copy=False)):
            if case in figures.runs:
                name = f"batch of {case.num_envs}, threads: {case.threads}{'' if case.copy else ', `copy=False`'}"
                rows.append([name, figures.cell(case), figures.cell(case, by_wall=True)])
    return _table(["`make_vec`", "steps per CPU-second", "steps per second that passed"], rows)


def _resets(figures: Figures) -> str:
    rows = []
    for weeds in (40, 160, 640):
        rates = figures.rates(replace(RESET, weeds=weeds))
        micros = [1e6 / rate for rate in reversed(rates)]
        cell = f"{median(micros):.1f} ({micros[0]:.1f} to {micros[-1]:.1f})" if micros else "not measured"
        rows.append([str(weeds), cell])
    return _table(["weeds", "`unwrapped.reset(seed=...)`, us"], rows)


def _rollouts(figures: Figures) -> str:
    rows = []
    for name, case, null in (
        ("`swath.sb3.make_vec_env`", ROLLOUT, NULL),
        ("Gymnasium's CartPole batch", CARTPOLE_ROLLOUT, CARTPOLE_NULL),
    ):
        share = _share(figures, case, null)
        percent = "not measured" if share is None else f"{share:.1f}"
        rows.append([name, figures.cell(case), figures.cell(null), percent, _beyond(figures, case, null)])
    head = ["64 environments", "steps of a PPO rollout", "where the environment does nothing", "% of that"]
    return _table([*head, "CPU time of a step beyond that, us"], rows)


def _beyond(figures: Figures, case: Case, null: Case) -> str:
    """What a step takes more in the rollouts of a case than where the environment does nothing."""
    rollout, most = figures.median(case), figures.median(null)
    return f"{1e6 / rollout - 1e6 / most:.2f}" if rollout and most else "not measured"


def _share(figures: Figures, case: Case, null: Case) -> float | None:
    """How fast the rollouts of a case are, in percent of those where the environment does nothing."""
    rollout, most = figures.median(case), figures.median(null)
    return 100 * rollout / most if rollout and most else None


def _missing(figures: Figures) -> str:
    lines = []
    for case, reason in figures.missing.items():
        told = {name: value for name, value in asdict(case).items() if value != Case.__dataclass_fields__[name].default}
        lines.append(f"- {', '.join(f'{name} {value}' for name, value in told.items())}: {reason}")
    return "\n".join(lines)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
