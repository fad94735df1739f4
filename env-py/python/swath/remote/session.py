"""Zenoh's sessions: where they lead, their settings and their threads."""

from __future__ import annotations

import ipaddress
import json
import os
import re
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from swath.errors import ConfigError, RemoteError

if TYPE_CHECKING:
    import zenoh

__all__ = ["checked_endpoint", "endpoints_of", "is_of_this_machine", "opened", "settings"]

_CONNECT_MS = 5000
# Nobody waits long for the second connection, which may be done without; nor is it tried again.
_SECOND_OPEN_MS = 1000
# As servers take them: without settings, which Zenoh would read behind `?` or `#`.
_ENDPOINT = re.compile(r"(?:tcp|tls)/(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):([0-9]{1,5})")
_LARGEST_PORT = 65535
# What is read from the network at a time: long replies come in pieces of 64 KiB.
_READ_BYTES = 1 << 20
# Larger than the largest message by far more than Zenoh adds.
_MAX_MESSAGE_BYTES = (64 << 20) + (64 << 10)
# What is not for others to set: where a client connects, and by which transport.
_OWN = ("mode", "connect/endpoints", "transport/unicast/lowlatency", "transport/unicast/qos")
# Whoever has it sends by itself, not by Zenoh's sending thread, in one connection and without priorities. A second
# session of a client has no place to listen of its own, and may send all that it sends in one piece.
_LOW_LATENCY: dict[str, object] = {
    "transport/unicast/qos/enabled": False,
    "transport/unicast/lowlatency": True,
    "transport/link/tx/batch_size": 65535,
    "listen/endpoints": [],
    "connect/timeout_ms": 0,
    "transport/unicast/open_timeout": _SECOND_OPEN_MS,
}

# One thread of Zenoh's takes in what comes, one sends, and one looks after time-outs, which hold even where the first
# is held up; by Zenoh's own count there are six, and a message wakes most of them. Where Zenoh looks for that, once in
# a process.
_THREADS_VARIABLE = "ZENOH_RUNTIME"
_THREADS = "(acc: (handover: rx), app: (handover: rx), rx: (worker_threads: 1))"


class _Threads:
    """Whether Zenoh's threads are for us to choose: nobody in this process has imported Zenoh before.

    With ours, whoever lets the channel of a subscriber run full holds up our answers too, until their time is over.
    """

    are_ours: bool | None = None


_threads = _Threads()


def checked_endpoint(endpoint: object) -> tuple[str, int]:
    """Returns the host and the port that an endpoint names.

    Raises:
        ConfigError: If it is none.
    """
    found = _ENDPOINT.fullmatch(endpoint) if isinstance(endpoint, str) else None
    if found is None or not 1 <= int(found[2]) <= _LARGEST_PORT:
        text = f"`connect` must be an endpoint such as 'tcp/127.0.0.1:7447', got {endpoint!r}"
        raise ConfigError(text)
    return found[1].strip("[]"), int(found[2])


def endpoints_of(connect: object) -> list[str]:
    """Returns the endpoints that `connect` names: one, or a list of them.

    Raises:
        ConfigError: If one of them is none.
    """
    endpoints: list[Any] = [connect] if isinstance(connect, str) or not isinstance(connect, Iterable) else list(connect)
    for endpoint in endpoints:
        checked_endpoint(endpoint)
    return endpoints


def is_of_this_machine(endpoint: str) -> bool:
    """Tells whether an endpoint is spoken to plainly, at a number of the loopback or by its name."""
    host, _ = checked_endpoint(endpoint)
    try:
        return endpoint.startswith("tcp/") and (host == "localhost" or ipaddress.ip_address(host).is_loopback)
    except ValueError:
        return False


def settings(endpoint: str, further: dict[str, object] | None, *, low_latency: bool = False) -> zenoh.Config:
    """Returns the settings of a client, with further ones laid over them.

    Those of a second session, of `low_latency`, leave out what only the first one of a client can have: who it is, and
    where it listens.

    Raises:
        ConfigError: If the endpoint is none, or Zenoh does not take a further setting.
    """
    _see_zenoh()
    import zenoh

    checked_endpoint(endpoint)
    if not (further is None or isinstance(further, dict)):
        text = f"`zenoh` must be settings of Zenoh by their path, got {further!r}"
        raise ConfigError(text)
    config = zenoh.Config()
    for path, value in _usual(endpoint).items():
        config.insert_json5(path, json.dumps(value))
    for path, value in (further or {}).items():
        if isinstance(path, str) and (path.startswith(_OWN) or any(own.startswith(f"{path}/") for own in _OWN)):
            text = f"`zenoh` must leave {path!r} to swath, got {value!r}"
            raise ConfigError(text)
        if low_latency and path == "id":
            continue
        try:
            config.insert_json5(path, json.dumps(value))
        except (zenoh.ZError, TypeError, ValueError):
            text = f"`zenoh` must hold settings of Zenoh by their path, got {path!r}: {value!r}"
            raise ConfigError(text) from None
    for path, value in (_LOW_LATENCY if low_latency else {}).items():
        config.insert_json5(path, json.dumps(value))
    return config


def opened(config: zenoh.Config, endpoint: str) -> zenoh.Session:
    """Opens a session of these settings.

    Raises:
        RemoteError: If there is nobody at the endpoint.
        ConfigError: If Zenoh cannot read which threads the environment says.
    """
    import zenoh

    try:
        return _opened(zenoh, config)
    except zenoh.ZError as error:
        why = _first_line(error)
        if why.startswith("Unable to connect"):
            # Whoever refuses a certificate says nothing to the other end.
            or_else = ", or the certificates do not fit" if endpoint.startswith("tls/") else ""
            why = f"nobody listens there{or_else}"
        text = f"no server at {endpoint}: {why}"
        raise RemoteError(text) from None


def _see_zenoh() -> None:
    if _threads.are_ours is None:
        _threads.are_ours = "zenoh" not in sys.modules


def _opened(zenoh: Any, config: zenoh.Config) -> zenoh.Session:  # noqa: ANN401 - it is imported late
    if _THREADS_VARIABLE in os.environ:
        return _opened_as_told(zenoh, config)
    if not _threads.are_ours:
        return zenoh.open(config)
    os.environ[_THREADS_VARIABLE] = _THREADS
    try:
        session = zenoh.open(config)
        # From now on they are there.
        _threads.are_ours = False
    finally:
        # Processes that this one starts decide for themselves, unless that is while it connects.
        os.environ.pop(_THREADS_VARIABLE, None)
    return session


def _opened_as_told(zenoh: Any, config: zenoh.Config) -> zenoh.Session:  # noqa: ANN401 - it is imported late
    try:
        return zenoh.open(config)
    except BaseException as error:
        # Zenoh panics where it cannot read the variable, and Python takes a panic for no `Exception`.
        if type(error).__name__ != "PanicException":
            raise
        text = f"`{_THREADS_VARIABLE}` must be threads as Zenoh reads them, got {os.environ[_THREADS_VARIABLE]!r}"
        raise ConfigError(text) from None


def _usual(endpoint: str) -> dict[str, object]:
    return {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": _CONNECT_MS,
        "connect/exit_on_failure": True,
        "connect/retry": {"period_init_ms": 100, "period_max_ms": 500},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
        "transport/link/rx/buffer_size": _READ_BYTES,
        "transport/link/rx/max_message_size": _MAX_MESSAGE_BYTES,
    }


def _first_line(error: Exception) -> str:
    # Zenoh adds where in its own source it happened.
    line = str(error).splitlines()[0] if str(error) else type(error).__name__
    return line.partition(" at /")[0]
