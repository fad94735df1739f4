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

    from rich.console import JustifyMethod, RenderableType
    from rich.table import Table

    from swath.remote.watch import Reading, SessionReading, Watch

__all__ = ["top"]

_SHORTEST_S, _LONGEST_S = 0.1, 3600.0
_WIDTH = 120
"""Of a table that is not on a terminal, characters."""
_MOST_CHARACTERS = 64
"""Of a client's name."""
_SERVER_COLUMNS = (
    "server",
    "up",
    "sessions",
    "envs",
    "steps/s",
    "asked/s",
    "p50",
    "p99",
    "faults",
    "lost",
    "endpoint",
)
_SESSION_COLUMNS = ("session", "envs", "steps", "steps/s", "age", "idle", "server", "client")
_TEXTS = ("server", "endpoint", "session", "client")
_FOLDED = ("endpoint", "client")
_FIRST_LEFT_OUT = ("lost", "asked/s", "faults", "p50", "up", "p99", "sessions")
_FIRST_LEFT_OUT_OF_SESSIONS = ("idle", "age", "server", "steps", "client")
"""Columns for which a terminal is first too narrow."""
_SIDE, _BETWEEN = 1, 2
"""Characters before the first column, and after each."""


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
            live.update(_tables(readings, live.console.width), refresh=True)


def _tables(readings: Sequence[Reading], width: int = _WIDTH) -> RenderableType:
    from rich.console import Group

    servers = [_server_cells(reading) for reading in readings]
    sessions = [_session_cells(reading, session) for reading in readings for session in reading.sessions]
    tables = [_table(servers, _SERVER_COLUMNS, _FIRST_LEFT_OUT, width)]
    if sessions:
        tables.append(_table(sessions, _SESSION_COLUMNS, _FIRST_LEFT_OUT_OF_SESSIONS, width))
    return Group(*tables)


def _server_cells(reading: Reading) -> list[str]:
    stats = reading.stats
    if stats is None:
        return [reading.server, "silent", *[""] * (len(_SERVER_COLUMNS) - 3), reading.endpoint]
    return [
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
        reading.endpoint,
    ]


def _session_cells(reading: Reading, session: SessionReading) -> list[str]:
    row = session.stats
    return [
        row["lease"],
        str(row["envs"]),
        f"{row['steps']:,}",
        _rate(session.steps_per_s),
        _time(row["age_ms"]),
        _time(row["idle_ms"]),
        reading.server,
        _printable(row["client"]) or "-",
    ]


def _table(rows: Sequence[Sequence[str]], columns: Sequence[str], first_left_out: Sequence[str], width: int) -> Table:
    """Returns a table that is not wider than that: rather without a column than without the last digits of a number."""
    from rich import box
    from rich.cells import cell_len
    from rich.table import Table
    from rich.text import Text

    widths = {
        name: _BETWEEN + max(cell_len(text) for text in (name, *cells))
        for name, cells in zip(columns, zip(*rows, strict=True), strict=True)
    }
    for name in first_left_out:
        if _SIDE + sum(widths.values()) <= width:
            break
        del widths[name]
    table = Table(box=box.SIMPLE, padding=(0, 1, 0, 0))
    for name in widths:
        justify: JustifyMethod = "left" if name in _TEXTS else "right"
        table.add_column(name, justify=justify, no_wrap=name not in _FOLDED, overflow="fold")
    for row in rows:
        # An address of IPv6 has brackets, which would be read as markup.
        table.add_row(*[Text(cell) for name, cell in zip(columns, row, strict=True) if name in widths])
    return table


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
