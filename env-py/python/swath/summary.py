"""The numbers of an episode that is over."""

from __future__ import annotations

from typing import TypedDict

__all__ = ["Summary"]


class Summary(TypedDict):
    """The numbers of an episode that is over; they know the truth, so agents never see them.

    Attributes:
        path_length_m: Way driven, metres.
        bcp_length_m: Length of the boustrophedon path over the whole pasture, metres.
        path_fraction: Way driven, in lengths of the boustrophedon path.
        weeds_total: Number of weeds on the pasture.
        weeds_detected: Number of weeds that the sensor has seen.
        weeds_mowed: Number of weeds mowed, seen or not.
        seen_fraction: Share of the pasture's cells seen, 0 to 1.
        outcome: Why the episode ended: `done`, `goal`, `budget`, `step_limit`, `capped` or `left_headland`.
    """

    path_length_m: float
    bcp_length_m: float
    path_fraction: float
    weeds_total: int
    weeds_detected: int
    weeds_mowed: int
    seen_fraction: float
    outcome: str
