"""`swath top`."""

from __future__ import annotations

import json
import sys
import time
from contextlib import closing
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from swath.cli.options import TlsCa, TlsCertificate, TlsKey, tls_from
from swath.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rich.console import RenderableType

    from swath.remote.watch import Reading, Watch

__all__ = ["top"]

_SHORTEST_S, _LONGEST_S = 0.1, 3600.0
_WIDTH = 120
"""Of a table that is not on a terminal, characters."""
_MOST_CHARACTERS = 64
"""Of a client's name."""


def top(
    *,
    connect: Annotated[list[str], typer.Option(help="Endpoint of a server or a router; again for more.")],
    server: Annotated[
        list[str] | None, typer.Option(help="Name of a server; again for more.", show_default="default")
    ] = None,
    every: Annotated[float, typer.Option(metavar="S", help="Seconds between two looks.")] = 2.0,
    once: Annotated[bool, typer.Option("--once", help="Look twice, so far apart, print once, and end.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print a line of JSON for each look.")] = False,
    tls_ca: TlsCa = None,
    tls_certificate: TlsCertificate = None,
    tls_key: TlsKey = None,
) -> None:
    """Watch servers: sessions, environments, steps per second, latency. Ctrl-C ends it.

    A server that does not answer is shown as silent, until it does; if none answers at first, that is an error.

    Latency is from a request's arrival to its answer, by the server's clock of milliseconds, rounded up to a power of
    two; 50 and 99 in 100 requests of the time between two looks took no longer.
    """
    if not _SHORTEST_S <= every <= _LONGEST_S:
        text = f"`--every` must be from {_SHORTEST_S:g} to {_LONGEST_S:g} seconds, got {every:g}"
        raise ConfigError(text)
    zenoh = tls_from(tls_ca, tls_certificate, tls_key)
    from swath.remote.watch import Watch

    try:
        with closing(Watch(connect, server or ["default"], zenoh=zenoh)) as watch:
            looks = _looks(watch, every, is_once=once)
            if as_json:
                for readings in looks:
                    typer.echo(json.dumps([asdict(reading) for reading in readings], allow_nan=False))
            else:
                _show(looks)
    except KeyboardInterrupt:
        # The usual end: nothing was cut off.
        return


def _looks(watch: Watch, every_s: float, *, is_once: bool) -> Iterator[list[Reading]]:
    """Yields what every look brings; at the first one some server has to answer."""
    readings = watch.read_some()
    if not is_once:
        yield readings
    while True:
        time.sleep(every_s)
        yield watch.read()
        if is_once:
            return


def _show(looks: Iterator[list[Reading]]) -> None:
    """Draws the tables in one place on a terminal, and one after another elsewhere."""
    from rich.console import Console
    from rich.live import Live

    if not sys.stdout.isatty():
        console = Console(width=_WIDTH)
        for readings in looks:
            console.print(_tables(readings))
        return
    with Live(auto_refresh=False) as live:
        for readings in looks:
            live.update(_tables(readings), refresh=True)


def _tables(readings: Sequence[Reading]) -> RenderableType:
    from rich import box
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    servers, sessions = (Table(box=box.SIMPLE, padding=(0, 1, 0, 0)) for _ in range(2))
    for table, names in (
        (servers, "server up sessions envs steps/s asked/s p50 p99 faults lost endpoint"),
        (sessions, "session envs steps steps/s age idle server client"),
    ):
        for name in names.split():
            is_text = name in ("server", "endpoint", "session", "client")
            table.add_column(name, justify="left" if is_text else "right", no_wrap=name != "endpoint", overflow="fold")
    for reading in readings:
        stats = reading.stats
        if stats is None:
            servers.add_row(reading.server, "silent", *[""] * 8, Text(reading.endpoint))
            continue
        servers.add_row(
            reading.server,
            _time(stats["uptime_ms"]),
            str(stats["sessions"]),
            str(stats["envs"]),
            _rate(reading.steps_per_s),
            _rate(reading.requests_per_s),
            _latency(reading.latency_p50_us),
            _latency(reading.latency_p99_us),
            str(stats["faults"]),
            str(stats["lost"]),
            # An address of IPv6 has brackets, which would be read as markup.
            Text(reading.endpoint),
        )
        for session in reading.sessions:
            row = session.stats
            sessions.add_row(
                row["lease"],
                str(row["envs"]),
                f"{row['steps']:,}",
                _rate(session.steps_per_s),
                _time(row["age_ms"]),
                _time(row["idle_ms"]),
                reading.server,
                Text(_printable(row["client"]) or "-"),
            )
    return Group(servers, sessions) if sessions.rows else servers


def _printable(name: str) -> str:
    """Returns a name that its client has chosen, without what would move the cursor or break the table."""
    shown = "".join(character if character.isprintable() else "\N{REPLACEMENT CHARACTER}" for character in name)
    return shown if len(shown) <= _MOST_CHARACTERS else f"{shown[: _MOST_CHARACTERS - 1]}\N{HORIZONTAL ELLIPSIS}"


def _rate(per_s: float | None) -> str:
    return "-" if per_s is None else f"{per_s:,.0f}"


def _latency(us: int | None) -> str:
    return "-" if us is None else f"{us / 1000:.1f} ms"


def _time(ms: int) -> str:
    """Returns the two largest units of a time: `4.2 s`, `5 min 03 s`, `2 h 07 min`."""
    seconds = ms // 1000
    if seconds < 60:
        return f"{ms / 1000:.1f} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02} s"
    return f"{seconds // 3600} h {seconds // 60 % 60:02} min"
