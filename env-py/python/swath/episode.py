"""One whole episode of an agent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from swath import _native

if TYPE_CHECKING:
    from swath.scenario import Scenario, ScenarioSource

__all__ = ["Episode", "run_episode"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Episode:
    """An episode that is over.

    Attributes:
        path_length_m: Way driven, metres.
        bcp_length_m: Length of the boustrophedon path over the whole pasture, metres.
        path_fraction: Way driven, in lengths of the boustrophedon path.
        weeds_total: Number of weeds on the pasture.
        weeds_detected: Number of weeds that the sensor has seen.
        weeds_mowed: Number of weeds mowed, seen or not.
        seen_fraction: Share of the pasture's cells seen, 0 to 1.
        outcome: `done` (the agent's own stop), `capped` (its safety cap) or `left_headland` (a failure).
        trajectory: (n, 4) float64: x_m, y_m, heading_rad in [-pi, pi) and path_m, at most 0.1 m and 0.1 radians apart,
            from start to end; the start alone where nothing was driven.
        arcs: (n, 5) float64: x_m, y_m and heading_rad where each arc of the path begins, curvature_per_m (0: straight)
            and length_m, in driving order.
        weeds_m: (weeds_total, 2) float64, world frame, metres.
        weed_detected: (weeds_total,) bool.
        weed_mowed: (weeds_total,) bool.
        weed_detected_path_m: (weeds_total,) float64: way driven when the sensor saw the weed, metres; inf: never.
        weed_mowed_path_m: (weeds_total,) float64: way driven when the weed was mowed, up to 0.2 m; inf: never.
        cell_seen_path_m: (rows, columns) float64: way driven when the ground in a cell of at most 1 m was seen; inf:
            never. Rows go along y from 0, columns along x.
        scenario: The scenario with every key resolved.
        agent: The agent's name with its options.
        seed: The seed of the instance.
    """

    path_length_m: float
    bcp_length_m: float
    path_fraction: float
    weeds_total: int
    weeds_detected: int
    weeds_mowed: int
    seen_fraction: float
    outcome: str
    trajectory: npt.NDArray[np.float64]
    arcs: npt.NDArray[np.float64]
    weeds_m: npt.NDArray[np.float64]
    weed_detected: npt.NDArray[np.bool_]
    weed_mowed: npt.NDArray[np.bool_]
    weed_detected_path_m: npt.NDArray[np.float64]
    weed_mowed_path_m: npt.NDArray[np.float64]
    cell_seen_path_m: npt.NDArray[np.float64]
    scenario: Scenario
    agent: str
    seed: int


def run_episode(
    agent: str,
    *,
    scenario: ScenarioSource = None,
    seed: int = 0,
    weeds: npt.ArrayLike | None = None,
    agent_options: Mapping[str, object] | None = None,
) -> Episode:
    """Runs an agent on one instance of a scenario until it stops by itself.

    It runs natively: the agent starts where it likes to, its commands are not rounded to float32, and the scenario's
    budget and goal do not end it. Instance i of an evaluation with seed s is `run_episode(..., seed=s + i)`.

    Args:
        agent: A name that `swath agents` lists, or a name with options such as `bcp:spacing=sensor`.
        scenario: A shipped name, a file, a dictionary, a `Scenario`, or None for the defaults.
        seed: From 0 to 2**64 - 1; draws the weeds, and apart from them the agent's own choices.
        weeds: (n, 2) positions, world frame, metres, instead of drawing them.
        agent_options: The agent's options.

    Returns:
        The episode with its path.

    Raises:
        ConfigError: If an argument cannot be used; the message names it.
    """
    resolved = _native.Scenario(scenario)
    spec = _native.AgentSpec(agent, None if agent_options is None else dict(agent_options))
    native = _native.run_episode(resolved, spec, seed, weeds)
    return Episode(
        **native.summary,
        trajectory=native.trajectory,
        arcs=native.arcs,
        weeds_m=native.weeds_m,
        weed_detected=native.weed_detected,
        weed_mowed=native.weed_mowed,
        weed_detected_path_m=native.weed_detected_path_m,
        weed_mowed_path_m=native.weed_mowed_path_m,
        cell_seen_path_m=native.cell_seen_path_m,
        scenario=resolved,
        agent=spec.label,
        seed=int(seed),
    )
