"""How many steps this machine makes a second, with mowers that drive a lap of `snake`.

The mowers repeat recorded actions, so that they are where mowers are in use, on the pasture, and no agent is timed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from swath.agents import make_agent
from swath.registration import ENV_ID

if TYPE_CHECKING:
    from typing import TypeAlias

    from swath.scenario import Block

__all__ = [
    "Blocks",
    "Replay",
    "Run",
    "Tape",
    "drive",
    "record",
    "replay_env",
    "replay_vec",
    "share_inside",
]

LAP_STEPS = 4000
"""Longest lap, in steps: shorter than the default budget on 100 x 40 m."""

PASTURES = 16
"""Pastures that a tape has, each with a lap of its own."""

Blocks: TypeAlias = "Mapping[str, Block]"
Replay: TypeAlias = "tuple[Callable[[], object], Callable[[Any], object], Sequence[object]]"
"""Begins a lap; makes one step; the actions of a lap, in order."""


class Run(NamedTuple):
    """One measurement.

    Attributes:
        steps: Steps of all environments together.
        cpu_s: CPU time of this process and its threads, seconds.
        wall_s: Time that passed, seconds.
    """

    steps: int
    cpu_s: float
    wall_s: float

    @property
    def per_cpu_s(self) -> float:
        """Steps per CPU-second."""
        return self.steps / self.cpu_s


@dataclass(frozen=True)
class Tape:
    """Laps of `snake` on several pastures, as actions of the kind `steer`.

    Attributes:
        seeds: (pastures,), the seeds of the pastures.
        actions: (steps, pastures, 1) float32.
        rewards: (steps, pastures) float64, what each step brought.
        share_inside: Share of the steps that end with the mower on the pasture.
    """

    seeds: tuple[int, ...]
    actions: npt.NDArray[np.float32]
    rewards: npt.NDArray[np.float64]
    share_inside: float

    def rows(self, num_envs: int) -> npt.NDArray[np.intp]:
        """(num_envs,) The pasture of each row of a batch."""
        return np.arange(num_envs) % len(self.seeds)


def record(blocks: Blocks, *, pastures: int = PASTURES, steps: int = LAP_STEPS, seed: int = 0) -> Tape:
    """Records a tape.

    Args:
        blocks: Blocks of the scenario.
        pastures: How many laps to record.
        steps: Longest lap.
        seed: Seed of the first pasture; pasture i has the seed plus i.

    Returns:
        The tape, cut where the first of its episodes would end.
    """
    env = gym.make(ENV_ID, **dict(blocks)).unwrapped  # type: ignore[arg-type] # Gymnasium types keywords as its own
    seeds = tuple(range(seed, seed + pastures))
    laps, rewards = [], []
    for one in seeds:
        env.reset(seed=one)
        agent = make_agent("snake")
        actions: list[npt.NDArray[np.float32]] = []
        gains: list[float] = []
        while len(actions) < steps and (action := agent.act(env)) is not None:
            _, reward, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                break
            actions.append(action)
            gains.append(float(reward))
        laps.append(actions)
        rewards.append(gains)
    shortest = min(len(lap) for lap in laps)
    tape = np.array([lap[:shortest] for lap in laps], dtype=np.float32).swapaxes(0, 1)
    gained = np.array([gains[:shortest] for gains in rewards]).swapaxes(0, 1)
    scenario: dict[str, Any] = env.scenario.to_dict()  # type: ignore[attr-defined]
    return Tape(seeds, tape, gained, share_inside(tape[..., 0], scenario))


def replay_env(env: gym.Env[Any, Any], tape: Tape, actions: Iterable[object] | None = None) -> Replay:
    """Drives the first lap of a tape in one environment, wrapped or not; `actions` stand for those of the tape."""
    seed = tape.seeds[0]
    lap = list(tape.actions[:, 0]) if actions is None else list(actions)
    return lambda: env.reset(seed=seed), env.step, lap


def replay_vec(vec: gym.vector.VectorEnv[Any, Any, Any], tape: Tape, actions: npt.NDArray[Any] | None = None) -> Replay:
    """Drives a tape in a batch, row i on pasture i modulo their number.

    Args:
        vec: The batch.
        tape: The tape.
        actions: (steps, pastures, ...), what to do instead of the tape's actions.
    """
    rows = tape.rows(vec.num_envs)
    seeds = [tape.seeds[row] for row in rows]
    lap = list((tape.actions if actions is None else actions)[:, rows])
    return lambda: vec.reset(seed=seeds), vec.step, lap  # type: ignore[arg-type] # a list is allowed, and untyped


def drive(replay: Replay, num_envs: int = 1, *, enough_s: float = 0.3, most_s: float = 4.0) -> Run:
    """Drives laps and times them, resets included; a lap that is broken off bears its share of its reset.

    Args:
        replay: What to drive.
        num_envs: Environments that a step moves.
        enough_s: CPU time after which no further lap begins, seconds; the first lap always does.
        most_s: CPU time after which a lap is broken off, seconds.
    """
    reset, step, lap = replay
    chunks = [lap[at : at + 50] for at in range(0, len(lap), 50)]
    steps, spent_s = 0, 0.0
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    while steps == 0 or spent_s < min(enough_s, most_s):
        begin_s = time.process_time()
        reset()
        reset_s = time.process_time() - begin_s
        driven = 0
        for chunk in chunks:
            for action in chunk:
                step(action)
            driven += len(chunk)
            spent_s = time.process_time() - cpu_s
            if spent_s > most_s:
                break
        steps += driven
        unearned_s = reset_s * (1 - driven / len(lap))
    return Run(steps * num_envs, spent_s - unearned_s, time.perf_counter() - wall_s - unearned_s)


def share_inside(steer: npt.NDArray[np.floating], scenario: Mapping[str, Any]) -> float:
    """Share of the ends of steps that lie on the pasture.

    Args:
        steer: (steps, mowers), curvatures over 1/R.
        scenario: Its blocks; the mower starts in the corner.
    """
    mower, pasture = scenario["mower"], scenario["pasture"]
    step_m = mower["speed_mps"] * scenario["episode"]["control_period_s"]
    turn_rad = steer.astype(np.float64) / mower["turning_radius_m"] * step_m
    heading_rad = np.cumsum(turn_rad, axis=0) - 0.5 * turn_rad
    chord_m = step_m * np.sinc(0.5 * turn_rad / np.pi)
    x_m = np.cumsum(chord_m * np.cos(heading_rad), axis=0)
    y_m = 0.5 * mower["deck_width_m"] + np.cumsum(chord_m * np.sin(heading_rad), axis=0)
    inside = (x_m >= 0) & (x_m <= pasture["length_m"]) & (y_m >= 0) & (y_m <= pasture["width_m"])
    return float(inside.mean())
