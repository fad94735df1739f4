"""A second opinion on paths, in NumPy, from points alone: it knows nothing of arcs, grids or looks."""

import numpy as np

BAND_M = 0.005
"""Weeds this close to the end of the bar are not judged: a chord of 0.1 m leaves its arc by less, metres."""


def length(trajectory):
    """Length of the polyline through the points, metres."""
    return np.hypot(*np.diff(trajectory[:, :2], axis=0).T).sum()


def thinned(trajectory, spacing_m):
    """Points at least `spacing_m` apart along the path: rounding must not bend the line through three of them."""
    kept = [trajectory[0]]
    for point in trajectory:
        if point[3] - kept[-1][3] >= spacing_m:
            kept.append(point)
    return np.array(kept)


def curvatures(points):
    """Curvature of the circle through each point and its two neighbours, 1/m."""
    a, b, c = points[:-2, :2], points[1:-1, :2], points[2:, :2]
    (abx, aby), (acx, acy) = (b - a).T, (c - a).T
    doubled_area = np.abs(abx * acy - aby * acx)
    sides = [np.hypot(*(p - q).T) for p, q in ((a, b), (b, c), (a, c))]
    return 2 * doubled_area / np.prod(sides, axis=0)


def swept(trajectory, weeds_m, deck_width_m):
    """Which weeds the bar has surely passed over, and which it may have passed over.

    Between two points the bar sweeps the strip between its two lines; a weed is in it if it is ahead of the first line,
    behind the second and within half the bar of the path. It is surely in with `BAND_M` to spare, and maybe in with as
    much missing.
    """
    start, end = trajectory[:-1], trajectory[1:]
    surely = np.zeros(len(weeds_m), dtype=bool)
    maybe = np.zeros(len(weeds_m), dtype=bool)
    for number, (x, y) in enumerate(weeds_m):
        ahead, left = in_frame(start, x, y)
        ahead_of_end, left_of_end = in_frame(end, x, y)
        is_between = (ahead >= -1e-9) & (ahead_of_end <= 1e-9)
        is_nearly_between = (ahead >= -BAND_M) & (ahead_of_end <= BAND_M)
        off = np.minimum(np.abs(left), np.abs(left_of_end))
        furthest_off = np.maximum(np.abs(left), np.abs(left_of_end))
        surely[number] = np.any(is_between & (furthest_off <= 0.5 * deck_width_m - BAND_M))
        maybe[number] = np.any(is_nearly_between & (off <= 0.5 * deck_width_m + BAND_M))
    return surely, maybe


def in_frame(poses, x, y):
    """Forward and left offset of a point in the frame of each pose, metres."""
    dx, dy = x - poses[:, 0], y - poses[:, 1]
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return cos * dx + sin * dy, cos * dy - sin * dx
