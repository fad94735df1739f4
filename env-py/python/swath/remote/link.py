"""The way to one server: a Zenoh session that moves bytes, and decides nothing.

No Python callback is given to Zenoh: with one, an interpreter that ends without `close` would hang.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
import sys
import time
import weakref
from itertools import chain
from typing import TYPE_CHECKING, Any

from swath import _native
from swath.errors import ConfigError, RemoteError
from swath.extras import need

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import zenoh

__all__ = ["Answers", "Link", "checked_endpoint"]

_VERBS = ("spec", "open", "reset", "step", "snapshot", "restore", "close", "stats")
_CONNECT_MS = 5000
_LOOK_S = 1.0
# An answer that came sooner was quick, and for so long the next one is waited for awake, while the core and the
# interpreter are offered to others; whoever takes them for longer than this needs them more.
_AWAKE_S = 0.01
_TAKEN_S = 0.0002
# What is left of a deadline is never no time at all.
_SHORTEST_S = 0.001
_NAME = re.compile(r"[a-z0-9-]{1,64}")
# As servers take them: without settings, which Zenoh would read behind `?` or `#`.
_ENDPOINT = re.compile(r"(?:tcp|tls)/(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):([0-9]{1,5})")
_LARGEST_PORT = 65535
# What is read from the network at a time: long replies come in pieces of 64 KiB.
_READ_BYTES = 1 << 20
# Larger than the largest message by far more than Zenoh adds.
_MAX_MESSAGE_BYTES = (64 << 20) + (64 << 10)

# One thread of Zenoh's takes in what comes, one sends, and one looks after time-outs, which hold even where the first
# is held up; by Zenoh's own count there are six, and a message wakes most of them. Where Zenoh looks for that, once in
# a process.
_THREADS_VARIABLE = "ZENOH_RUNTIME"
_THREADS = "(acc: (handover: rx), app: (handover: rx), rx: (worker_threads: 1))"

_open_links: weakref.WeakSet[Link] = weakref.WeakSet()


class _Forked:
    """Whether this process ever opened a session, and whether its parent had: then Zenoh would wait for ever."""

    has_opened = False
    is_too_late = False


class _Threads:
    """Whether Zenoh's threads are for us to choose: nobody in this process has imported Zenoh before.

    With ours, whoever lets the channel of a subscriber run full holds up our answers too, until their time is over.
    """

    are_ours: bool | None = None


_forked = _Forked()
_threads = _Threads()


class Link:
    """A Zenoh session with one server's keys."""

    def __init__(self, endpoint: str, server: str, timeout_s: float, config: dict[str, object] | None = None) -> None:
        """Connects.

        Args:
            endpoint: Such as `tcp/127.0.0.1:7447`.
            server: The name that the server was started with.
            timeout_s: How long a question may stay open, where nothing else is said.
            config: Further settings of Zenoh, such as those of TLS, by their path.

        Raises:
            RemoteError: If there is nobody at the endpoint, or this process was forked from one that had a link.
            ConfigError: If the endpoint is none, the server's name is none, or Zenoh does not take a setting.
            ModuleNotFoundError: If `eclipse-zenoh` is not installed; the message names the extra.
        """
        need("`swath.remote`", "remote", "zenoh")
        if _forked.is_too_late:
            text = "the process was forked after environments on a server were opened; use `spawn` or `forkserver`"
            raise RemoteError(text)
        if _threads.are_ours is None:
            _threads.are_ours = "zenoh" not in sys.modules
        import zenoh

        checked_endpoint(endpoint)
        if not isinstance(server, str) or not _NAME.fullmatch(server):
            text = f"`server` must be 1 to 64 lower-case letters, digits and dashes, got {server!r}"
            raise ConfigError(text)
        self.endpoint, self.server = endpoint, server
        self._pid = os.getpid()
        self._timeout_s = timeout_s
        settings = _settings(zenoh, endpoint, config)
        _forked.has_opened = True
        try:
            self._session = _opened(zenoh, settings)
        except zenoh.ZError as error:
            # Whoever refuses a certificate says nothing to the other end.
            perhaps = "; nobody listens there, or the certificates do not fit" if endpoint.startswith("tls/") else ""
            text = f"no server at {endpoint}: {_first_line(error)}{perhaps}"
            raise RemoteError(text) from None
        prefix = f"swath/v1/{server}"
        self._how: dict[str, Any] = {
            "target": zenoh.QueryTarget.BEST_MATCHING,
            "consolidation": zenoh.ConsolidationMode.NONE,
            "express": True,
        }
        self._queriers = {
            verb: self._session.declare_querier(f"{prefix}/rpc/{verb}", timeout=timeout_s, **self._how)
            for verb in _VERBS
        }
        self._prefix = prefix
        self.is_quick = True
        """Whether the next answer may be expected soon: the last one came so."""
        self._lease_name = ""
        self._lease: Any = None
        _open_links.add(self)

    def ask(self, verb: str, message: bytes, timeout_s: float | None = None) -> Answers:
        """Sends a message; its answers arrive meanwhile, for at most so many seconds, or the usual ones."""
        self._check_process()
        if timeout_s is None or timeout_s >= self._timeout_s:
            return Answers(self, self._queriers[verb].get(payload=message))
        # A querier knows one time-out only, and the deadline is nearer.
        key = f"{self._prefix}/rpc/{verb}"
        timeout_s = max(timeout_s, _SHORTEST_S)
        return Answers(self, self._session.get(key, payload=message, timeout=timeout_s, **self._how))

    def look(self) -> Callable[[], bool]:
        """Looks for a server; what it returns waits, and tells whether one of the name shows that it is alive."""
        self._check_process()
        found = self._session.liveliness().get(f"{self._prefix}/alive/*", timeout=_LOOK_S)
        return lambda: any(reply.ok is not None for reply in found)

    def hold(self, lease: str) -> None:
        """Shows the server that its client is there, until another lease, `close` or the end of the process."""
        if lease == self._lease_name:
            return
        self._check_process()
        if self._lease is not None:
            self._lease.undeclare()
        self._lease_name = lease
        self._lease = self._session.liveliness().declare_token(f"{self._prefix}/lease/{lease}")

    def close(self) -> None:
        """Leaves; closing twice is fine."""
        if self in _open_links and self._pid == os.getpid():
            _open_links.discard(self)
            self._session.close()

    def _check_process(self) -> None:
        if self._pid != os.getpid():
            text = "the environment was opened before the process was forked; use `spawn` or `forkserver`"
            raise RemoteError(text)


class Answers:
    """What a question brings in: at most one answer from each server of that name."""

    def __init__(self, link: Link, replies: zenoh.Handler[zenoh.Reply]) -> None:
        """Waits for nothing yet."""
        self._link = link
        self._replies = replies
        self.is_silent = True
        """Whether nothing has come yet, not even an error."""
        self.is_over = False
        """Whether there will be no more."""

    def __iter__(self) -> Iterator[bytes | None]:
        """Waits for each message and yields it, and None for an error of the network such as a time-out.

        Where the last answer was quick, it waits awake at first: a core that slept begins slowly, since it was
        another's meanwhile.
        """
        begin_s = time.perf_counter()
        for message in chain(self._awake(begin_s), self._asleep()):
            self._link.is_quick = message is not None and time.perf_counter() - begin_s < _AWAKE_S
            yield message

    def _awake(self, begin_s: float) -> Iterator[bytes | None]:
        now_s = begin_s
        while self._link.is_quick and not self.is_over and now_s - begin_s < _AWAKE_S:
            yield from self.arrived()
            given_s = time.perf_counter()
            _native.give_way()
            now_s = time.perf_counter()
            if now_s - given_s > _TAKEN_S:
                return

    def _asleep(self) -> Iterator[bytes | None]:
        for reply in self._replies:
            self.is_silent = False
            yield reply.ok.payload.to_bytes() if reply.ok is not None else None
        self.is_over = True

    def arrived(self) -> Iterator[bytes | None]:
        """Yields the same of what has come already, and waits for nothing."""
        import zenoh

        try:
            while (reply := self._replies.try_recv()) is not None:
                self.is_silent = False
                yield reply.ok.payload.to_bytes() if reply.ok is not None else None
        except zenoh.ZError:
            self.is_over = True

    def late(self) -> Iterator[bytes]:
        """Yields the messages that have come since nobody waits for them any more."""
        return (message for message in self.arrived() if message is not None)


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


def _opened(zenoh: Any, settings: Any) -> Any:  # noqa: ANN401 - it is imported late
    if _THREADS_VARIABLE in os.environ:
        return _opened_as_told(zenoh, settings)
    if not _threads.are_ours:
        return zenoh.open(settings)
    os.environ[_THREADS_VARIABLE] = _THREADS
    try:
        session = zenoh.open(settings)
        # From now on they are there.
        _threads.are_ours = False
    finally:
        # Processes that this one starts decide for themselves, unless that is while it connects.
        os.environ.pop(_THREADS_VARIABLE, None)
    return session


def _opened_as_told(zenoh: Any, settings: Any) -> Any:  # noqa: ANN401 - it is imported late
    try:
        return zenoh.open(settings)
    except BaseException as error:
        # Zenoh panics where it cannot read the variable, and Python takes a panic for no `Exception`.
        if type(error).__name__ != "PanicException":
            raise
        text = f"`{_THREADS_VARIABLE}` must be threads as Zenoh reads them, got {os.environ[_THREADS_VARIABLE]!r}"
        raise ConfigError(text) from None


def _settings(zenoh: Any, endpoint: str, further: dict[str, object] | None) -> Any:  # noqa: ANN401 - it is imported late
    """Returns the settings of a client, with further ones laid over them."""
    if not (further is None or isinstance(further, dict)):
        text = f"`zenoh` must be settings of Zenoh by their path, got {further!r}"
        raise ConfigError(text)
    settings = zenoh.Config()
    for path, value in _usual(endpoint).items():
        settings.insert_json5(path, json.dumps(value))
    for path, value in (further or {}).items():
        try:
            settings.insert_json5(path, json.dumps(value))
        except (zenoh.ZError, TypeError, ValueError):
            text = f"`zenoh` must hold settings of Zenoh by their path, got {path!r}: {value!r}"
            raise ConfigError(text) from None
    return settings


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


def _leave_to_parent() -> None:
    """Keeps a forked child from freeing what is its parent's: it would wait for threads that it does not have."""
    for link in list(_open_links):
        for held in (link._session, link._lease, *link._queriers.values()):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))
    _open_links.clear()
    _forked.is_too_late = _forked.is_too_late or _forked.has_opened


os.register_at_fork(after_in_child=_leave_to_parent)
