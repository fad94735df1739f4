"""What a server says of itself: its reply to `stats`, whose fields `docs/protocol` describes."""

from __future__ import annotations

from typing import TypedDict

__all__ = ["SessionStats", "Stats"]


class SessionStats(TypedDict):
    """What a session does.

    Attributes:
        lease: First 8 hexadecimal digits of its lease.
        client: Who opened it.
        envs: Number of environments.
        steps: Environment steps so far.
        age_ms: Since it was opened, milliseconds.
        idle_ms: Since its last request, milliseconds.
    """

    lease: str
    client: str
    envs: int
    steps: int
    age_ms: int
    idle_ms: int


class Stats(TypedDict):
    """What a server does at present.

    Attributes:
        boot_id: 32 hexadecimal digits, drawn when it started.
        uptime_ms: Since it started, milliseconds.
        sessions: Sessions that are open.
        envs: Their environments.
        opened: Sessions opened since the start.
        lost: Sessions freed because their client was gone or silent, or they failed.
        requests: Requests answered since the start.
        faults: Faults among the answers.
        steps: Environment steps since the start.
        latency_us: How many requests took up to 2^i microseconds, and more than half of that, for i from 0.
        open: Each session that is open.
    """

    boot_id: str
    uptime_ms: int
    sessions: int
    envs: int
    opened: int
    lost: int
    requests: int
    faults: int
    steps: int
    latency_us: list[int]
    open: list[SessionStats]
