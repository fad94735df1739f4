"""The way to one server: Zenoh sessions that move bytes, and decide nothing.

No Python callback is given to Zenoh: with one, an interpreter that ends without `close` would hang.
"""

from __future__ import annotations

import ctypes
import logging
import os
import re
import time
import weakref
from itertools import chain
from typing import TYPE_CHECKING, Any

from swath import _native
from swath.errors import ConfigError, RemoteError
from swath.extras import need
from swath.remote.session import is_of_this_machine, opened, settings
from swath.remote.way import Way

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import zenoh

__all__ = ["Answers", "Link"]

_VERBS = ("spec", "open", "reset", "step", "snapshot", "restore", "close", "stats")
_LOOK_S = 1.0
# An answer that came sooner was quick, and for so long the next one is waited for awake, while the core and the
# interpreter are offered to others; whoever takes them for longer than this needs them more.
_AWAKE_S = 0.01
_TAKEN_S = 0.0002
# Zenoh's low-latency transport takes no message of 64 KiB, and a server that answers by it waits until there is room on
# the way, but cuts off whoever leaves none: for so much there is, though nobody reads for a while.
_SHORT_BYTES = 32 << 10
# So long after a step that was not answered by low latency, all go the usual way.
_AGAIN_S = 60.0
_OFFER = re.compile(r"low-latency/[0-9a-f]{32}/([0-9]{1,5})")
_NAME = re.compile(r"[a-z0-9-]{1,64}")

_log = logging.getLogger(__name__)
_open_links: weakref.WeakSet[Link] = weakref.WeakSet()


class _Forked:
    """Whether this process ever opened a session, and whether its parent had: then Zenoh would wait for ever."""

    has_opened = False
    is_too_late = False


_forked = _Forked()


class Link:
    """The way to one server, and one of low latency for its steps where there is that."""

    def __init__(self, endpoint: str, server: str, timeout_s: float, zenoh: dict[str, object] | None = None) -> None:
        """Connects.

        Args:
            endpoint: Such as `tcp/127.0.0.1:7447`.
            server: The name that the server was started with.
            timeout_s: How long a question may stay open, where nothing else is said.
            zenoh: Further settings of Zenoh, such as those of TLS, by their path.

        Raises:
            RemoteError: If there is nobody at the endpoint, or this process was forked from one that had a link.
            ConfigError: If the endpoint is none, the server's name is none, or Zenoh does not take a setting.
            ModuleNotFoundError: If `eclipse-zenoh` is not installed; the message names the extra.
        """
        need("`swath.remote`", "remote", "zenoh")
        if _forked.is_too_late:
            text = "the process was forked after environments on a server were opened; use `spawn` or `forkserver`"
            raise RemoteError(text)
        config = settings(endpoint, zenoh)
        if not isinstance(server, str) or not _NAME.fullmatch(server):
            text = f"`server` must be 1 to 64 lower-case letters, digits and dashes, got {server!r}"
            raise ConfigError(text)
        self.endpoint, self.server = endpoint, server
        self._pid = os.getpid()
        self._timeout_s = timeout_s
        self._zenoh = zenoh
        self._prefix = f"swath/v1/{server}"
        _forked.has_opened = True
        self._usual = Way(opened(config, endpoint), self._prefix, _VERBS, timeout_s)
        self._low_latency: Way | None = None
        # When it is looked for anew: a while after a step was not answered there.
        self._low_latency_from_s: float | None = None
        # Longest reply that a step can have, bytes.
        self._max_reply = _SHORT_BYTES
        self.is_quick = True
        """Whether the next answer may be expected soon: the last one came so."""
        self._lease_name = ""
        self._lease: Any = None
        _open_links.add(self)

    @property
    def has_low_latency(self) -> bool:
        """Whether the next step would go by the connection for low latency."""
        return self._low_latency is not None and self._low_latency_from_s is None

    def use_low_latency(self, max_reply: int) -> None:
        """Asks for steps by Zenoh's low-latency transport from now on, if the server offers it and replies are short.

        A step that is not answered there is asked again as all else is, and so are those of the next minute; then the
        server, which may have been started anew, is asked for its offer once more.

        Args:
            max_reply: Longest reply that a step can have, bytes.
        """
        self._max_reply = max_reply
        if max_reply > _SHORT_BYTES or not is_of_this_machine(self.endpoint):
            return
        offers = _tokens(self._usual.session, f"{self._prefix}/low-latency/*/*")
        found = _OFFER.fullmatch(offers[0].removeprefix(f"{self._prefix}/")) if len(offers) == 1 else None
        if found is None:
            return
        endpoint = self.low_latency_endpoint(int(found[1]))
        try:
            session = opened(settings(endpoint, self._zenoh, low_latency=True), endpoint)
        except (RemoteError, ConfigError):
            # The usual way is there.
            return
        try:
            # Whoever is at that port may be another one.
            if _tokens(session, offers[0]) == offers:
                self._low_latency = Way(session, self._prefix, ("step",), self._timeout_s)
        finally:
            if self._low_latency is None:
                session.close()

    def look_for_low_latency_again(self) -> None:
        """Asks the server for its offer once more, if it is time for that; to be called where no call is in flight."""
        if self._low_latency_from_s is not None and time.monotonic() >= self._low_latency_from_s:
            self._low_latency_from_s = None
            self._close_low_latency()
            self.use_low_latency(self._max_reply)

    def low_latency_endpoint(self, port: int) -> str:
        """Returns where the server that is at our endpoint has its low-latency transport."""
        return f"{self.endpoint.rpartition(':')[0]}:{port}"

    def ask(self, verb: str, message: bytes, timeout_s: float | None = None) -> Answers:
        """Sends a message; its answers arrive meanwhile, for at most so many seconds, or the usual ones."""
        self._check_process()
        timeout_s = self._timeout_s if timeout_s is None else timeout_s
        by_low_latency = verb == "step" and self.has_low_latency and len(message) <= _SHORT_BYTES
        way = self._low_latency if by_low_latency and self._low_latency is not None else self._usual
        return Answers(self, way.ask(verb, message, timeout_s), by_low_latency=by_low_latency)

    def leave_low_latency(self) -> None:
        """Asks the usual way for a while: a step was not answered."""
        if self._low_latency_from_s is None:
            _log.info("a step at %s was not answered by low latency, and goes the usual way", self.endpoint)
        self._low_latency_from_s = time.monotonic() + _AGAIN_S

    def look_around(self) -> Callable[[], list[str]]:
        """Looks for servers; what it returns waits, and tells the names of those that show us that they are alive."""
        found = self._usual.session.liveliness().get("swath/v1/*/alive/*", timeout=_LOOK_S)

        def names() -> list[str]:
            shown = {str(reply.ok.key_expr).split("/")[2] for reply in found if reply.ok is not None}
            return sorted(filter(_NAME.fullmatch, shown))

        return names

    def look(self) -> Callable[[], bool]:
        """Looks for a server; what it returns waits, and tells whether one of the name shows that it is alive."""
        self._check_process()
        found = self._usual.session.liveliness().get(f"{self._prefix}/alive/*", timeout=_LOOK_S)
        return lambda: any(reply.ok is not None for reply in found)

    def hold(self, lease: str) -> None:
        """Shows the server that its client is there, until another lease, `close` or the end of the process."""
        if lease == self._lease_name:
            return
        self._check_process()
        if self._lease is not None:
            self._lease.undeclare()
        self._lease_name = lease
        self._lease = self._usual.session.liveliness().declare_token(f"{self._prefix}/lease/{lease}")

    def close(self) -> None:
        """Leaves; closing twice is fine."""
        if self in _open_links and self._pid == os.getpid():
            _open_links.discard(self)
            try:
                self._usual.session.close()
            finally:
                self._close_low_latency()

    def _close_low_latency(self) -> None:
        way, self._low_latency = self._low_latency, None
        if way is not None:
            way.session.close()

    def _check_process(self) -> None:
        if self._pid != os.getpid():
            text = "the environment was opened before the process was forked; use `spawn` or `forkserver`"
            raise RemoteError(text)


class Answers:
    """What a question brings in: at most one answer from each server of that name."""

    def __init__(self, link: Link, replies: zenoh.Handler[zenoh.Reply], *, by_low_latency: bool = False) -> None:
        """Waits for nothing yet."""
        self._link = link
        self._by_low_latency = by_low_latency
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
            yield self._read(reply)
        self._end()

    def arrived(self) -> Iterator[bytes | None]:
        """Yields the same of what has come already, and waits for nothing."""
        import zenoh

        try:
            while (reply := self._replies.try_recv()) is not None:
                yield self._read(reply)
        except zenoh.ZError:
            self._end()

    def _read(self, reply: zenoh.Reply) -> bytes | None:
        self.is_silent = False
        payload: bytes | None = reply.ok.payload.to_bytes() if reply.ok is not None else None
        # Zenoh may have connected anew, to another server at the same port: only the way by which the session was
        # opened can tell.
        if payload is None or (self._by_low_latency and _native.knows_no_session(payload)):
            self._miss()
            return None
        return payload

    def _end(self) -> None:
        self.is_over = True
        if self.is_silent:
            self._miss()

    def _miss(self) -> None:
        if self._by_low_latency:
            self._link.leave_low_latency()

    def late(self) -> Iterator[bytes]:
        """Yields the messages that have come since nobody waits for them any more."""
        return (message for message in self.arrived() if message is not None)


def _tokens(session: zenoh.Session, keys: str) -> list[str]:
    """Returns which of these liveliness tokens there are."""
    found = session.liveliness().get(keys, timeout=_LOOK_S)
    return [str(reply.ok.key_expr) for reply in found if reply.ok is not None]


def _leave_to_parent() -> None:
    """Keeps a forked child from freeing what is its parent's: it would wait for threads that it does not have."""
    for link in list(_open_links):
        ways = [way for way in (link._usual, link._low_latency) if way is not None]
        for held in (link._lease, *chain.from_iterable(way.held() for way in ways)):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))
    _open_links.clear()
    _forked.is_too_late = _forked.is_too_late or _forked.has_opened


os.register_at_fork(after_in_child=_leave_to_parent)
