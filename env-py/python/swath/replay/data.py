"""Episodes as compact data for the player of the page.

Arrays are little-endian and in base64: a path as its arcs, weeds and cells with the way driven when each was found.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from swath.errors import ConfigError
from swath.styles import YARDSTICK, is_yardstick, style, styles_of

if TYPE_CHECKING:
    from swath.episode import Episode

__all__ = ["data_of"]

_NEVER = 65535
_MOST_CELLS = 20_000
"""Larger pastures show seen ground in blocks of cells."""


def data_of(episodes: Sequence[Episode], styles: Sequence[int] | None = None) -> dict[str, object]:
    """Returns what the player shows.

    Args:
        episodes: At least one; of one scenario, on the same weeds.
        styles: Number of each agent's style; None: as `styles_of` numbers them.

    Returns:
        Plain data with arrays in base64: `weeds_m` (n, 2) float32, metres; of each agent `arcs` (n, 5) float32
        (x_m, y_m, heading_rad, curvature_per_m, length_m), `detected_m` and `mowed_m` (n,) float32 with inf for never,
        `seen_step` (rows, columns) uint16, where 65,534 is the whole path and 65,535 never, and `seen_m` (1001,)
        float32, the way driven when each thousandth of the ground was seen.

    Raises:
        ConfigError: If the episodes are not of one scenario and the same weeds.
    """
    first = episodes[0]
    for other in episodes[1:]:
        if other.scenario.hash != first.scenario.hash or not np.array_equal(other.weeds_m, first.weeds_m):
            text = (
                f"`episodes` must be of one scenario on the same weeds, got {other.agent} on others than {first.agent}"
            )
            raise ConfigError(text)
    blocks = first.scenario.to_dict()
    pasture, mower, sensor = blocks["pasture"], blocks["mower"], blocks["sensor"]
    assert isinstance(pasture, dict), "a scenario has a block `pasture`"
    assert isinstance(mower, dict), "a scenario has a block `mower`"
    assert isinstance(sensor, dict), "a scenario has a block `sensor`"
    x_m, y_m = np.concatenate([episode.trajectory[:, :2] for episode in episodes]).T
    seen = [_in_blocks(episode.cell_seen_path_m) for episode in episodes]
    if styles is None:
        styles = styles_of([episode.agent for episode in episodes])
    looks = [style(number) for number in styles]
    return {
        "length_m": pasture["length_m"],
        "width_m": pasture["width_m"],
        "deck_width_m": mower["deck_width_m"],
        "speed_mps": mower["speed_mps"],
        "range_m": sensor["range_m"],
        "sensor_width_m": sensor["width_m"],
        "left_m": round(float(x_m.min()), 2),
        "right_m": round(float(x_m.max()), 2),
        "bottom_m": round(float(y_m.min()), 2),
        "top_m": round(float(y_m.max()), 2),
        "rows": seen[0].shape[0],
        "columns": seen[0].shape[1],
        "weeds_m": _float32(first.weeds_m),
        "agents": [
            {
                "label": episode.agent,
                "yardstick": YARDSTICK if is_yardstick(episode.agent) else "",
                "colour": look.colour,
                "dash": look.dash,
                "outcome": episode.outcome,
                "length_m": episode.path_length_m,
                "boustrophedon_m": episode.bcp_length_m,
                "start": episode.trajectory[0, :3].tolist(),
                "arcs": _float32(episode.arcs),
                "detected_m": _float32(episode.weed_detected_path_m),
                "mowed_m": _float32(episode.weed_mowed_path_m),
                "seen_step": _steps(cells, episode.path_length_m),
                "seen_m": _float32(_thousandths(episode.cell_seen_path_m)),
            }
            for look, episode, cells in zip(looks, episodes, seen, strict=True)
        ],
    }


def _float32(values: npt.NDArray[np.float64]) -> str:
    return b64encode(values.astype("<f4").tobytes()).decode()


def _steps(cells_m: npt.NDArray[np.float64], length_m: float) -> str:
    """Returns after which part of the path each cell was seen."""
    share = np.where(np.isfinite(cells_m), cells_m, 0.0) / (length_m or 1.0)
    steps = np.where(np.isfinite(cells_m), np.round(share * (_NEVER - 1)), _NEVER)
    return b64encode(steps.astype("<u2").tobytes()).decode()


def _thousandths(cells_m: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns how far the mower had come when none, a thousandth ... and all of the cells were seen, (1001,)."""
    ordered_m = np.sort(cells_m, axis=None)
    cells = -(-np.arange(1, 1001) * ordered_m.size // 1000)
    return np.concatenate([[0.0], ordered_m[cells - 1]])


def _in_blocks(cells_m: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns the same of blocks of cells where there are very many: a block is seen when all of its cells are."""
    side = int(np.ceil(np.sqrt(cells_m.size / _MOST_CELLS)))
    if side == 1:
        return cells_m
    rows, columns = cells_m.shape
    padded = np.pad(cells_m, ((0, -rows % side), (0, -columns % side)), mode="edge")
    rows, columns = padded.shape
    blocks: npt.NDArray[np.float64] = padded.reshape(rows // side, side, columns // side, side).max(axis=(1, 3))
    return blocks
