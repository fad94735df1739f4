"""Whole episodes of a batch, one a row, as they are recorded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from swath.errors import ConfigError
from swath.summary import Summary

if TYPE_CHECKING:
    from swath.datasets.drivers import AnyBatch, Driver

__all__ = ["Recorded", "play"]

# What only the last info of an episode holds.
_LAST = frozenset(Summary.__annotations__)


@dataclass
class Recorded:
    """One episode of n steps.

    Attributes:
        seed: Seed of the episode.
        observations: n + 1 observations, the last one included; each an array or a dictionary of arrays.
        actions: n actions.
        rewards: n rewards.
        terminations: n flags, True at most for the last step.
        truncations: n flags, True at most for the last step: where the budget ends, and where the driver has stopped.
        infos: n + 1 infos, that of the reset first; without what only a last info holds.
        outcome: Why it ended; `done` or `capped` where the driver has stopped.
        numbers: What result files say of it, but for the outcome.
    """

    seed: int
    observations: list[Any] = field(default_factory=list)
    actions: list[Any] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    terminations: list[bool] = field(default_factory=list)
    truncations: list[bool] = field(default_factory=list)
    infos: list[dict[str, Any]] = field(default_factory=list)
    outcome: str = ""
    numbers: dict[str, float] = field(default_factory=dict)

    def stop(self, outcome: str, numbers: dict[str, float]) -> None:
        """Ends the episode where its driver has stopped: its last step counts as truncated.

        Raises:
            ConfigError: If it has not driven at all.
        """
        if not self.truncations:
            text = f"`agent` must drive, but it stopped at once in the episode of seed {self.seed}"
            raise ConfigError(text)
        self.truncations[-1] = True
        self.outcome, self.numbers = outcome, numbers


def play(batch: AnyBatch, driver: Driver, seeds: Sequence[int]) -> Iterator[Recorded]:
    """Plays one episode in every row.

    Args:
        batch: The environments, which begin anew in the step that ends an episode (`SameStep`).
        driver: Who drives.
        seeds: The seed of every row.

    Yields:
        The episodes, each as soon as it is over; of those that end with the same step the first row first.
    """
    observations, infos = batch.reset(list(seeds))
    driver.begin(batch, seeds)
    episodes = [Recorded(seed) for seed in seeds]
    for row, episode in enumerate(episodes):
        episode.observations.append(_row(observations, row))
        episode.infos.append(_info(infos, row))
    live = np.ones(len(seeds), dtype=bool)
    while live.any():
        masks = getattr(batch, "action_masks", None)
        actions, stops = driver.act(batch, observations, masks, live)
        for row in np.flatnonzero(live).tolist():
            outcome = stops[row]
            if outcome is not None:
                episodes[row].stop(outcome, batch.summary(row))
                live[row] = False
                yield episodes[row]
        if not live.any():
            break
        # Rows without a running episode step too, and nobody looks.
        observations, rewards, terminated, truncated, infos = batch.step(actions)
        for row in np.flatnonzero(live).tolist():
            is_over = bool(terminated[row] or truncated[row])
            last = infos["final_info"] if is_over else infos
            assert isinstance(last, dict), "an episode that is over has a last info"
            episode = episodes[row]
            episode.actions.append(actions[row].copy())
            episode.rewards.append(float(rewards[row]))
            episode.terminations.append(bool(terminated[row]))
            episode.truncations.append(bool(truncated[row]))
            episode.observations.append(infos["final_obs"][row] if is_over else _row(observations, row))  # type: ignore[index] # an array of objects
            episode.infos.append(_info(last, row))
            if is_over:
                episode.outcome = str(last["outcome"][row])
                episode.numbers = {
                    name: last[name][row].item() for name in Summary.__annotations__ if name != "outcome"
                }
                live[row] = False
                yield episode


def _row(observations: Any, row: int) -> Any:  # noqa: ANN401 - an array, or a dictionary of arrays
    if isinstance(observations, dict):
        return {name: part[row].copy() for name, part in observations.items()}
    return observations[row].copy()


def _info(infos: dict[str, Any], row: int) -> dict[str, Any]:
    return dict(_entries(infos, row))


def _entries(infos: dict[str, Any], row: int) -> Iterator[tuple[str, Any]]:
    for key, value in infos.items():
        if key.startswith("_") or key in _LAST or key.startswith("final_"):
            continue
        yield key, _info(value, row) if isinstance(value, dict) else value[row]
