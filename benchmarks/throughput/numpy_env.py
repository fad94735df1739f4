"""The mower routing problem in NumPy: what a careful Python user would write, as a yardstick for swath.

Like `swath/MowerRouting-v0`: the motion on exact arcs, the swept bar, the looks at every 0.2 m of path, the triangle,
the reward, the eight nearest known weeds, the budget and the headland, all in float64.
Left out: the seen ground, and so its share and its eight rays in the observation (30 of 39 numbers are left), the goal,
the charge for failures, the terms of the reward, snapshots, any other observation or action.
What swath does beyond this makes its figures lower, not higher.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

Floats = npt.NDArray[np.float64]
Observations = npt.NDArray[np.float32]
Flags = npt.NDArray[np.bool_]
Step = tuple[Observations, Floats, Flags, Flags, dict[str, Any]]

LENGTH_M, WIDTH_M, HEADLAND_M = 100.0, 40.0, 10.0
RADIUS_M, DECK_M, RANGE_M, SENSOR_M = 2.0, 2.0, 12.0, 12.0
STEP_M, BUDGET_M = 0.5, 2229.2361265
NEAREST = 8

# Of all the weeds of a block of environments: at this size the arrays of a step stay in the cache.
_BLOCK = 1 << 14
# The way to the looks of a step that begins on a mark, and of one that begins half way between two.
_LOOKS_M = np.array([[0.2, 0.4, np.nan], [0.1, 0.3, 0.5]])
_TOLERANCE_M = 1e-6


class NumpyMowerRoutingVectorEnv(VectorEnv[Observations, npt.NDArray[np.float32], npt.NDArray[Any]]):
    """A batch of pastures of 100 x 40 m with the same number of weeds; episodes begin anew in the next step.

    Observation: (num_envs, 30) float32: x, y, cosine, sine, budget left, share of known weeds, and for each of the
    nearest known weeds forward, left and 1. Action: (num_envs, 1) float32, curvature over 1/R.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 # as Gymnasium declares it

    def __init__(self, num_envs: int, *, weeds: int = 160) -> None:
        """Makes a batch that waits for its first reset.

        Args:
            num_envs: How many pastures.
            weeds: Weeds of each.
        """
        self.num_envs, self._count = num_envs, weeds
        self.single_observation_space = Box(-1.0, 1.0, (6 + 3 * NEAREST,), np.float32)
        self.single_action_space = Box(-1.0, 1.0, (1,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        rows = max(1, _BLOCK // max(weeds, 1))
        self._blocks = [slice(at, min(at + rows, num_envs)) for at in range(0, num_envs, rows)]
        self._x, self._y = np.zeros((num_envs, weeds)), np.zeros((num_envs, weeds))
        self._seen = np.zeros((num_envs, weeds), bool)
        self._mowed = np.zeros((num_envs, weeds), bool)
        self._pose = np.zeros((num_envs, 3))
        self._steps = np.zeros(num_envs, np.int64)
        self._is_over = np.zeros(num_envs, bool)
        self._observations = np.zeros((num_envs, 6 + 3 * NEAREST), np.float32)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begins an episode in every row.

        Args:
            seed: For the weeds that are drawn.
            options: `{"weeds": array (num_envs, weeds, 2)}` places them instead, in metres.
        """
        super().reset(seed=seed if isinstance(seed, int) else None)
        self._begin(np.arange(self.num_envs), (options or {}).get("weeds"))
        return self._observations.copy(), {}

    def step(self, actions: npt.NDArray[np.float32]) -> Step:
        """Drives every mower 0.5 m; a row whose episode is over begins the next one instead."""
        curvature = np.clip(actions[:, 0].astype(np.float64), -1.0, 1.0) / RADIUS_M
        rewards = np.empty(self.num_envs)
        for block in self._blocks:
            rewards[block] = self._drive(block, curvature[block]) - STEP_M
        x, y = self._pose[:, 0], self._pose[:, 1]
        terminated = (np.abs(x - 0.5 * LENGTH_M) > 0.5 * LENGTH_M + HEADLAND_M) | (
            np.abs(y - 0.5 * WIDTH_M) > 0.5 * WIDTH_M + HEADLAND_M
        )
        truncated = (self._steps * STEP_M >= BUDGET_M) & ~terminated
        begins = np.flatnonzero(self._is_over)
        if begins.size:
            self._begin(begins, None)
            rewards[begins], terminated[begins], truncated[begins] = 0.0, False, False
        self._is_over = terminated | truncated
        return self._observations.copy(), rewards, terminated, truncated, {}

    def _begin(self, rows: npt.NDArray[np.intp], weeds: Floats | None) -> None:
        if weeds is None:
            weeds = self.np_random.random((rows.size, self._count, 2)) * (LENGTH_M, WIDTH_M)
        self._x[rows], self._y[rows] = weeds[..., 0], weeds[..., 1]
        self._seen[rows] = self._mowed[rows] = False
        self._pose[rows] = 0.0, 0.5 * DECK_M, 0.0
        self._steps[rows] = 0
        for block in self._blocks:
            forward, left = self._in_frame(block)
            self._seen[block] |= _in_triangle(forward, left)
            self._observe(block, forward, left)

    def _in_frame(self, block: slice) -> tuple[Floats, Floats]:
        """The weeds of a block in the frames of its mowers: forward and left, metres."""
        x, y, heading = (column[:, None] for column in self._pose[block].T)
        cosine, sine = np.cos(heading), np.sin(heading)
        dx, dy = self._x[block] - x, self._y[block] - y
        return cosine * dx + sine * dy, cosine * dy - sine * dx

    def _drive(self, block: slice, curvature: Floats) -> Floats:
        """Moves the mowers of a block and returns how many weeds each has mowed."""
        forward, left = self._in_frame(block)
        end = _arc(curvature, np.full_like(curvature, STEP_M))
        ahead, aside = _moved(forward, left, end)
        # Between the bar at the start and the bar at the end, and between the two circles that its ends drive on.
        k, half_m = curvature[:, None], 0.5 * DECK_M + _TOLERANCE_M
        band = k * (forward * forward + left * left - half_m * half_m) - 2.0 * left
        swept = (forward >= -_TOLERANCE_M) & (ahead <= _TOLERANCE_M) & (np.abs(band) <= 2.0 * half_m)
        swept &= ~self._mowed[block]
        self._mowed[block] |= swept
        for way_m in _LOOKS_M[self._steps[block] % 2].T:
            # A row without a third look has NaN there, and no comparison with NaN holds.
            self._seen[block] |= _in_triangle(*_moved(forward, left, _arc(curvature, way_m)))
        pose = self._pose[block]
        cosine, sine = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        pose[:, 0] += cosine * end[0] - sine * end[1]
        pose[:, 1] += sine * end[0] + cosine * end[1]
        pose[:, 2] += curvature * STEP_M
        self._steps[block] += 1
        self._observe(block, ahead, aside)
        mowed: Floats = np.count_nonzero(swept, axis=1).astype(np.float64)
        return mowed

    def _observe(self, block: slice, forward: Floats, left: Floats) -> None:
        out, pose = self._observations[block], self._pose[block]
        out[:, 0] = (pose[:, 0] + HEADLAND_M) / (0.5 * LENGTH_M + HEADLAND_M) - 1.0
        out[:, 1] = (pose[:, 1] + HEADLAND_M) / (0.5 * WIDTH_M + HEADLAND_M) - 1.0
        out[:, 2], out[:, 3] = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        out[:, 4] = np.maximum(1.0 - self._steps[block] * STEP_M / BUDGET_M, 0.0)
        is_known = self._seen[block] & ~self._mowed[block]
        known = np.count_nonzero(is_known, axis=1)
        out[:, 5] = known / (known + NEAREST)
        nearest = min(NEAREST, self._count)
        squared = np.where(is_known, forward * forward + left * left, np.inf)
        some = np.argpartition(squared, nearest - 1, axis=1)[:, :nearest]
        order = np.argsort(np.take_along_axis(squared, some, axis=1), axis=1)
        some = np.take_along_axis(some, order, axis=1)
        is_there = np.take_along_axis(is_known, some, axis=1)
        table = out[:, 6:].reshape(-1, NEAREST, 3)[:, :nearest]
        table[..., 0] = np.where(is_there, np.take_along_axis(forward, some, axis=1), 0.0) / (LENGTH_M + WIDTH_M)
        table[..., 1] = np.where(is_there, np.take_along_axis(left, some, axis=1), 0.0) / (LENGTH_M + WIDTH_M)
        table[..., 2] = is_there


def _arc(curvature: Floats, way_m: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Where arcs end, in the frames of their starts: forward, left, cosine and sine of the heading."""
    turn = curvature * way_m
    chord_m = way_m * np.sinc(0.5 * turn / np.pi)
    return chord_m * np.cos(0.5 * turn), chord_m * np.sin(0.5 * turn), np.cos(turn), np.sin(turn)


def _moved(forward: Floats, left: Floats, end: tuple[Floats, Floats, Floats, Floats]) -> tuple[Floats, Floats]:
    """Points in the frames at the ends of arcs."""
    x, y, cosine, sine = (column[:, None] for column in end)
    dx, dy = forward - x, left - y
    return cosine * dx + sine * dy, cosine * dy - sine * dx


def _in_triangle(forward: Floats, left: Floats) -> Flags:
    """Which points the sensor sees."""
    return (forward <= RANGE_M + 1e-9) & (np.abs(left) <= forward * (0.5 * SENSOR_M / RANGE_M) + 1e-9)
