"""Episodes for the Rerun viewer."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swath.files import unfinished

if TYPE_CHECKING:
    import numpy.typing as npt
    import rerun as rr

    from swath.episode import Episode
    from swath.film.script import Script

__all__ = ["write_rrd"]

_TIMELINE = "path_m"
_EVERY = 5
"""Of the points of a path, so many make one of a recording: it holds the path anew for every time."""

_PATH, _FENCE, _SENSOR, _DECK = (0, 114, 178), (70, 70, 70), (150, 120, 0), (30, 30, 30)
_UNDETECTED, _DETECTED, _MOWED = (120, 120, 120), (213, 94, 0), (122, 31, 98)


def write_rrd(path: Path, script: Script) -> None:
    """Writes the episodes, each under its number and its agent, with a time line that counts metres of path.

    A viewer's y goes down: y is counted from the far fence, so that the pasture is not mirrored.
    """
    import rerun as rr
    import rerun.blueprint as rrb

    names = [f"{number} {episode.agent}" for number, episode in enumerate(script.episodes, 1)]
    views = [rrb.Spatial2DView(origin=rr.new_entity_path([name]), name=name) for name in names]
    numbers = rrb.TimeSeriesView(origin="/numbers", name="over the path, m")
    blueprint = rrb.Blueprint(rrb.Vertical(rrb.Horizontal(*views), numbers, row_shares=[3, 1]))
    with unfinished(path) as file:
        recording = rr.RecordingStream("swath", recording_id=_id_of(script))
        recording.save(file, default_blueprint=blueprint)
        try:
            for number, (name, episode) in enumerate(zip(names, script.episodes, strict=True)):
                _log_pasture(recording, name, episode)
                _log_path(recording, name, number, episode, script)
        finally:
            recording.flush()
            recording.disconnect()


def _id_of(script: Script) -> str:
    """Returns the same name for the same episodes."""
    content = hashlib.sha256()
    for episode in script.episodes:
        content.update(f"{episode.scenario.hash} {episode.agent} {episode.seed}".encode())
        content.update(episode.trajectory.tobytes())
    return content.hexdigest()[:16]


def _log_pasture(recording: rr.RecordingStream, name: str, episode: Episode) -> None:
    """Logs the fence."""
    import rerun as rr

    pasture = _block(episode, "pasture")
    size_m = [pasture["length_m"], pasture["width_m"]]
    box = rr.Boxes2D(mins=[[0.0, 0.0]], sizes=[size_m], colors=[_FENCE], radii=0.1, labels=["pasture, m"])
    recording.log([name, "fence"], box, static=True)


def _log_path(recording: rr.RecordingStream, name: str, number: int, episode: Episode, script: Script) -> None:
    """Logs the mower and what it has done, as often as a film would show it."""
    import rerun as rr

    film = script.film()
    width_m, weeds_m = _block(episode, "pasture")["width_m"], episode.weeds_m
    # The time line counts whole metres.
    frames = max(min(script.frames, round(film.length_m)), 1)
    for frame in range(frames + 1):
        path_m = film.length_m * frame / frames
        film.drive_to(path_m)
        path = _points_until(episode.trajectory, path_m)
        pose = path[-1]
        detected, mowed, seen_fraction = film.state(number)
        recording.set_time(_TIMELINE, sequence=round(path_m))
        recording.log([name, "path"], rr.LineStrips2D([_down(path[:, :2], width_m)], colors=[_PATH], radii=0.08))
        deck, triangle = (_down(shape, width_m) for shape in _mower(pose, episode))
        recording.log([name, "deck"], rr.LineStrips2D([deck], colors=[_DECK], radii=0.25))
        recording.log([name, "sensor"], rr.LineStrips2D([triangle], colors=[_SENSOR], radii=0.08))
        for kind, colour, chosen in (
            ("undetected", _UNDETECTED, ~detected & ~mowed),
            ("detected", _DETECTED, detected & ~mowed),
            ("mowed", _MOWED, mowed),
        ):
            points = rr.Points2D(_down(weeds_m[chosen], width_m), colors=[colour], radii=0.5)
            recording.log([name, "weeds", kind], points)
        for what, value in (("weeds mowed", mowed.sum()), ("seen, %", 100 * seen_fraction)):
            recording.log(["numbers", what, name], rr.Scalars([float(value)]))


def _points_until(trajectory: npt.NDArray[np.float64], path_m: float) -> npt.NDArray[np.float64]:
    """Returns points of a path as far as a length, about half a metre apart, (n, 4) with at least one."""
    passed = trajectory[: max(int(np.searchsorted(trajectory[:, 3], path_m, side="right")), 1)]
    return np.concatenate([passed[:-1:_EVERY], passed[-1:]])


def _mower(pose: npt.NDArray[np.float64], episode: Episode) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Returns the ends of the deck, (2, 2), and the border of the detection triangle, (4, 2): world frame, metres."""
    x_m, y_m, heading_rad, _ = pose
    ahead = np.array([math.cos(heading_rad), math.sin(heading_rad)])
    left = np.array([-ahead[1], ahead[0]])
    half_m = _block(episode, "mower")["deck_width_m"] / 2
    sensor = _block(episode, "sensor")
    at = np.array([x_m, y_m])
    far, side = at + sensor["range_m"] * ahead, sensor["width_m"] / 2 * left
    return np.array([at + half_m * left, at - half_m * left]), np.array([at, far + side, far - side, at])


def _down(points_m: npt.NDArray[np.float64], width_m: float) -> npt.NDArray[np.float64]:
    """Returns points (n, 2) with y counted down from the far fence."""
    return np.column_stack([points_m[:, 0], width_m - points_m[:, 1]])


def _block(episode: Episode, name: str) -> dict[str, float]:
    block = episode.scenario.to_dict()[name]
    assert isinstance(block, dict), f"a scenario has a block `{name}`"
    return block
