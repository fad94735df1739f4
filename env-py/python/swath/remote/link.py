"""The way to one server: Zenoh sessions that move bytes, and decide nothing.

No Python callback is given to Zenoh: with one, an interpreter that ends without `close` would hang.
"""

from __future__ import annotations

import ctypes
import os
import re
import time
import weakref
from itertools import chain
from typing import TYPE_CHECKING, Any

from swath import _native
from swath.errors import ConfigError, RemoteError
from swath.extras import need
from swath.remote.session import opened, settings

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
# the way: for so much there is, though nobody reads.
_SHORT_BYTES = 32 << 10
# What is left of a deadline is never no time at all.
_SHORTEST_S = 0.001
_NAME = re.compile(r"[a-z0-9-]{1,64}")

_open_links: weakref.WeakSet[Link] = weakref.WeakSet()


class _Forked:
    """Whether this process ever opened a session, and whether its parent had: then Zenoh would wait for ever."""

    has_opened = False
    is_too_late = False


_forked = _Forked()


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
        how = settings(endpoint, config)
        if not isinstance(server, str) or not _NAME.fullmatch(server):
            text = f"`server` must be 1 to 64 lower-case letters, digits and dashes, got {server!r}"
            raise ConfigError(text)
        self.endpoint, self.server = endpoint, server
        self._pid = os.getpid()
        self._timeout_s = timeout_s
        self._config = config
        _forked.has_opened = True
        self._session = opened(how, endpoint)
        import zenoh

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
        self._low_latency: zenoh.Session | None = None
        # By low latency; None where steps are asked for as all else is.
        self._steps: zenoh.Querier | None = None
        self._asked = b""
        self.is_quick = True
        """Whether the next answer may be expected soon: the last one came so."""
        self._lease_name = ""
        self._lease: Any = None
        _open_links.add(self)

    def shorten_steps(self, max_reply: int) -> None:
        """Asks for steps by Zenoh's low-latency transport from now on, if the server offers it and replies are short.

        What is not answered there is asked again as all else is, and so are all later steps.

        Args:
            max_reply: Longest reply that a step can have, bytes.
        """
        if max_reply > _SHORT_BYTES:
            return
        offers = self._session.liveliness().get(f"{self._prefix}/low-latency", timeout=_LOOK_S)
        if not any(reply.ok is not None for reply in offers):
            return
        self._low_latency = opened(settings(self.endpoint, self._config, low_latency=True), self.endpoint)
        key = f"{self._prefix}/rpc/step"
        self._steps = self._low_latency.declare_querier(key, timeout=self._timeout_s, **self._how)

    def ask(self, verb: str, message: bytes, timeout_s: float | None = None) -> Answers:
        """Sends a message; its answers arrive meanwhile, for at most so many seconds, or the usual ones."""
        self._check_process()
        if timeout_s is None or timeout_s >= self._timeout_s:
            if self._steps is not None and verb == "step" and len(message) <= _SHORT_BYTES:
                is_unanswered, self._asked = message == self._asked, message
                if not is_unanswered:
                    return Answers(self, self._steps.get(payload=message))
                self._steps = None
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
            if self._low_latency is not None:
                self._low_latency.close()

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


def _leave_to_parent() -> None:
    """Keeps a forked child from freeing what is its parent's: it would wait for threads that it does not have."""
    for link in list(_open_links):
        for held in (link._session, link._low_latency, link._lease, link._steps, *link._queriers.values()):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))
    _open_links.clear()
    _forked.is_too_late = _forked.is_too_late or _forked.has_opened


os.register_at_fork(after_in_child=_leave_to_parent)
