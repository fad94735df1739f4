"""What servers do: their own numbers, asked again and again, and what they say of the time between."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swath import _native
from swath.errors import RemoteError
from swath.remote.link import Link
from swath.remote.session import checked_endpoint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swath.stats import SessionStats, Stats

__all__ = ["Reading", "SessionReading", "Watch"]

# How long somebody who listens may take to say so where nobody did before.
_KNOCK_S = 0.25
_CONNECT_MS = 500


@dataclass(frozen=True)
class SessionReading:
    """A session and its pace.

    Attributes:
        stats: What its server says of it.
        steps_per_s: Environment steps per second since the reading before; None where there is none.
    """

    stats: SessionStats
    steps_per_s: float | None


@dataclass(frozen=True)
class Reading:
    """A server at one time, and since the reading before; what needs one is None where there is none.

    Attributes:
        endpoint: Where it was asked.
        server: Its name.
        stats: What it says; None where it did not answer.
        steps_per_s: Environment steps per second.
        requests_per_s: Answers per second.
        latency_p50_us: Half of the requests took no longer, microseconds, rounded up to a power of two.
        latency_p99_us: So did 99 in 100.
        sessions: Its open sessions.
    """

    endpoint: str
    server: str
    stats: Stats | None = None
    steps_per_s: float | None = None
    requests_per_s: float | None = None
    latency_p50_us: int | None = None
    latency_p99_us: int | None = None
    sessions: tuple[SessionReading, ...] = ()

    @classmethod
    def of(cls, endpoint: str, server: str, stats: Stats | None, before: Stats | None) -> Reading:
        """Returns what two replies of a server say; those of two starts have nothing to do with each other."""
        if stats is None:
            return cls(endpoint, server)
        if before is None or before["boot_id"] != stats["boot_id"] or before["uptime_ms"] >= stats["uptime_ms"]:
            return cls(
                endpoint, server, stats, sessions=tuple(SessionReading(session, None) for session in stats["open"])
            )
        seconds = (stats["uptime_ms"] - before["uptime_ms"]) / 1000
        older = before["latency_us"] + [0] * len(stats["latency_us"])
        counts = [now - then for now, then in zip(stats["latency_us"], older, strict=False)]
        steps = {session["lease"]: session["steps"] for session in before["open"]}
        return cls(
            endpoint,
            server,
            stats,
            steps_per_s=(stats["steps"] - before["steps"]) / seconds,
            requests_per_s=(stats["requests"] - before["requests"]) / seconds,
            latency_p50_us=_percentile(counts, 50),
            latency_p99_us=_percentile(counts, 99),
            sessions=tuple(
                SessionReading(session, (session["steps"] - steps.get(session["lease"], 0)) / seconds)
                for session in stats["open"]
            ),
        )


class Watch:
    """Asks servers for their numbers; it opens no session and changes nothing."""

    def __init__(
        self,
        connect: Sequence[str],
        servers: Sequence[str] = ("default",),
        *,
        timeout_s: float = 2.0,
        zenoh: dict[str, object] | None = None,
    ) -> None:
        """Connects to every endpoint, for each of the names; where nobody is, it is tried again with every look.

        Args:
            connect: Endpoints of servers or routers.
            servers: Names of servers, each of which is looked for at every endpoint.
            timeout_s: How long to wait for an answer, seconds.
            zenoh: As for `swath.remote.make`.

        Raises:
            ConfigError: If an argument cannot be used.
            RemoteError: If there is nobody at any endpoint.
            ModuleNotFoundError: If `eclipse-zenoh` is not installed; the message names the extra.
        """
        # One that is named twice is asked once.
        self._places = list(dict.fromkeys((endpoint, server) for endpoint in connect for server in servers))
        self._links: dict[tuple[str, str], Link] = {}
        self._before: dict[tuple[str, str], Stats] = {}
        self._timeout_s, self._zenoh = timeout_s, zenoh
        errors: dict[str, RemoteError] = {}
        try:
            for endpoint in connect:
                checked_endpoint(endpoint)
            for endpoint, server in self._places:
                if endpoint not in errors:
                    try:
                        self._links[endpoint, server] = Link(endpoint, server, timeout_s, zenoh)
                    except RemoteError as error:
                        errors[endpoint] = error
        except BaseException:
            self.close()
            raise
        if errors and not self._links:
            raise next(iter(errors.values()))

    def read(self) -> list[Reading]:
        """Asks all of them at the same time.

        Raises:
            RemoteError: If one answers with a fault, or in a way that this version does not know.
        """
        request = _native.stats_request()
        for place in self._places:
            if place not in self._links:
                self._try_again(*place)
        asked = {place: link.ask("stats", request) for place, link in self._links.items()}
        readings = []
        for place in self._places:
            message = next((message for message in asked.get(place, ()) if message is not None), None)
            stats = None if message is None else _native.read_stats(message)
            readings.append(Reading.of(*place, stats, self._before.get(place)))
            if stats is not None:
                self._before[place] = stats
        return readings

    def _try_again(self, endpoint: str, server: str) -> None:
        """Connects if somebody listens there by now; Zenoh itself would wait for seconds for somebody to come."""
        try:
            socket.create_connection(checked_endpoint(endpoint), _KNOCK_S).close()
            zenoh = {**(self._zenoh or {}), "connect/timeout_ms": _CONNECT_MS}
            self._links[endpoint, server] = Link(endpoint, server, self._timeout_s, zenoh)
        except (OSError, RemoteError):
            pass

    def read_all(self) -> list[Reading]:
        """Asks all of them, and wants all of them to answer.

        Raises:
            RemoteError: As `read`, and if one does not answer.
        """
        readings = self.read()
        for reading in readings:
            if reading.stats is None:
                raise _silence(reading)
        return readings

    def read_some(self) -> list[Reading]:
        """Asks all of them, and wants one of them to answer.

        Raises:
            RemoteError: As `read`, and if none answers.
        """
        readings = self.read()
        if readings and all(reading.stats is None for reading in readings):
            raise _silence(readings[0])
        return readings

    def close(self) -> None:
        """Leaves; closing twice is fine."""
        links, self._links = self._links, {}
        for link in links.values():
            link.close()


def _silence(reading: Reading) -> RemoteError:
    text = f"no answer from `{reading.server}` at {reading.endpoint}: wrong name, not authorised, or stopped"
    return RemoteError(text)


def _percentile(counts: Sequence[int], percent: int) -> int | None:
    """Returns the upper end of the power of two within which so many of the requests took, microseconds."""
    total, below = sum(counts), 0
    for power, count in enumerate(counts):
        below += count
        if total and 100 * below >= percent * total:
            return 1 << power
    return None
