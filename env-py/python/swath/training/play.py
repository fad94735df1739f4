"""Episodes of a policy on a batch of environments."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, cast

import numpy as np

from swath import _native
from swath.evaluation.row import Row
from swath.summary import Summary
from swath.training.config import refuse_endless
from swath.training.environments import make_venv

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swath.scenario import Scenario, ScenarioSource
    from swath.training.policy import Player

__all__ = ["evaluate_policy"]

_BATCH = 256
"""Largest number of environments that play together."""


def evaluate_policy(
    player: Player,
    *,
    scenario: ScenarioSource,
    instances: int = 50,
    seed: int = 1_000_000,
    label: str = "policy",
    num_threads: int = 1,
) -> list[Row]:
    """Plays one episode on every instance; a policy has no stop rule, so it ends where the Gymnasium episode does.

    Args:
        player: The policy, or a `RandomPlayer`.
        scenario: What it plays on: a shipped name, a file, a dictionary, a `Scenario`, or None for the defaults; its
            observation and action kinds are those of the policy.
        instances: Number of instances; instance i has the seed `seed + i`, as in `swath.evaluate`.
        seed: Seed of instance 0.
        label: The agent's name in the rows.
        num_threads: Threads that step the environments; they change no result.

    Returns:
        One row for each instance, in order.

    Raises:
        ConfigError: If the scenario cannot be used, or its `episode.budget` is infinite, with which an episode need not
            end.
    """
    scenario = scenario if isinstance(scenario, _native.Scenario) else _native.Scenario(scenario)
    refuse_endless("episode.budget", scenario)
    rows: list[Row] = []
    for first in range(0, instances, _BATCH):
        count = min(_BATCH, instances - first)
        since = time.perf_counter()
        played = _play(player, scenario, count, seed + first, num_threads)
        wall_s = (time.perf_counter() - since) / count
        for index, summary in enumerate(played):
            instance = first + index
            about = {"cell": 0, "scenario": scenario.name, "agent": label, "instance": instance}
            rows.append(Row(**about, seed=seed + instance, wall_s=wall_s, **summary))  # type: ignore[arg-type]
    return rows


def _play(player: Player, scenario: Scenario, count: int, seed: int, num_threads: int) -> Sequence[Summary]:
    venv = make_venv(scenario, count, num_threads)
    venv.seed(seed)
    observations = venv.reset()
    player.begin(range(seed, seed + count))
    is_masked = scenario.to_dict()["action"]["kind"] == "target"  # type: ignore[index] # a block of keys
    played: dict[int, Summary] = {}
    # Who has finished plays on in its next episode, which nobody reads.
    while len(played) < count:
        masks = np.stack(venv.env_method("action_masks")) if is_masked else None
        observations, _, dones, infos = venv.step(player.predict(observations, masks))
        for index in np.flatnonzero(dones):
            if index not in played:
                played[int(index)] = cast("Summary", {key: infos[index][key] for key in Summary.__annotations__})
    player.begin(())
    venv.close()
    return [played[index] for index in range(count)]
