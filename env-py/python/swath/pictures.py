"""Pictures of episodes, with matplotlib."""

from __future__ import annotations

import importlib.util
import io
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from swath.episode import Episode

__all__ = ["check_matplotlib", "picture"]

_PASTURE, _FENCE, _PATH, _WEED, _START = "#dcecd0", "#6b8f52", "#2459a9", "#c8102e", "#111111"
_EDGE_M = 2.0


def check_matplotlib() -> None:
    """Makes sure that pictures can be drawn.

    Raises:
        ModuleNotFoundError: If matplotlib is not installed; the message names the extra.
    """
    if importlib.util.find_spec("matplotlib") is None:
        text = "pictures need matplotlib: pip install 'swath[plot]'"
        raise ModuleNotFoundError(text)


def picture(episode: Episode) -> bytes:
    """Draws the path of an episode over its pasture.

    Args:
        episode: The episode.

    Returns:
        A PNG file: the pasture green, weeds red (filled: mowed, crosses: missed), the path blue, the start black.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    pasture = episode.scenario.to_dict()["pasture"]
    assert isinstance(pasture, dict), "a scenario has a block `pasture`"
    x_m, y_m, heading_rad, _ = episode.trajectory.T
    left_m, right_m = _around(x_m, pasture["length_m"])
    low_m, high_m = _around(y_m, pasture["width_m"])
    weeds_m, is_mowed = episode.weeds_m, episode.weed_mowed

    height = 1.6 + 10 * (high_m - low_m) / (right_m - left_m)
    figure = Figure(figsize=(11, height), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    field = Rectangle((0, 0), pasture["length_m"], pasture["width_m"], facecolor=_PASTURE, edgecolor=_FENCE)
    axes.add_patch(field)
    axes.plot(x_m, y_m, color=_PATH, linewidth=0.9, label="path")
    for chosen, marker, size, label in ((is_mowed, "o", 5, "weed, mowed"), (~is_mowed, "x", 8, "weed, missed")):
        x, y = weeds_m[chosen].T
        axes.plot(x, y, marker, color=_WEED, markersize=size, markeredgewidth=2, label=f"{label}: {len(x)}")
    arrow = (3, 0, math.degrees(heading_rad[0]) - 90)
    axes.plot(x_m[0], y_m[0], marker=arrow, color=_START, markersize=12, linestyle="none", label="start")
    axes.set(xlim=(left_m, right_m), ylim=(low_m, high_m), xlabel="x in m", ylabel="y in m", aspect="equal")
    axes.set_title(
        f"{episode.agent} on {episode.scenario.name}, seed {episode.seed}: {episode.path_length_m:.0f} m, "
        f"{100 * episode.path_fraction:.1f} % of the boustrophedon path, "
        f"{episode.weeds_mowed} of {episode.weeds_total} weeds mowed",
        fontsize=10,
    )
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    data = io.BytesIO()
    # Without the name of the program the same episode gives the same bytes.
    figure.savefig(data, format="png", metadata={"Software": None})
    return data.getvalue()


def _around(path_m: npt.NDArray[np.float64], size_m: float) -> tuple[float, float]:
    """Returns the limits of an axis that shows the path and the pasture."""
    return min(path_m.min(), 0.0) - _EDGE_M, max(path_m.max(), size_m) + _EDGE_M
