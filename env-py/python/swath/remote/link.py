"""The way to one server: a Zenoh session that moves bytes, and decides nothing.

No Python callback is given to Zenoh: with one, an interpreter that ends without `close` would hang.
"""

from __future__ import annotations

import ctypes
import json
import os
import weakref
from typing import TYPE_CHECKING, Any

from swath.errors import ConfigError, RemoteError
from swath.extras import need

if TYPE_CHECKING:
    from collections.abc import Iterator

    import zenoh

__all__ = ["Answers", "Link"]

_VERBS = ("open", "reset", "step", "snapshot", "restore", "close")
_CONNECT_MS = 5000
# What is read from the network at a time: long replies come in pieces of 64 KiB.
_READ_BYTES = 1 << 20
# Larger than the largest message by far more than Zenoh adds.
_MAX_MESSAGE_BYTES = (64 << 20) + (64 << 10)

_open_links: weakref.WeakSet[Link] = weakref.WeakSet()


class Link:
    """A Zenoh session with one server's keys."""

    def __init__(self, endpoint: str, server: str, timeout_s: float, config: dict[str, object] | None = None) -> None:
        """Connects.

        Args:
            endpoint: Such as `tcp/127.0.0.1:7447`.
            server: The name that the server was started with.
            timeout_s: How long a question may stay open.
            config: Further settings of Zenoh, such as those of TLS, by their path.

        Raises:
            RemoteError: If there is nobody at the endpoint.
            ConfigError: If the endpoint is none.
            ModuleNotFoundError: If `eclipse-zenoh` is not installed; the message names the extra.
        """
        need("`swath.remote`", "remote", "zenoh")
        import zenoh

        if not isinstance(endpoint, str) or "/" not in endpoint:
            text = f"`connect` must be an endpoint such as 'tcp/127.0.0.1:7447', got {endpoint!r}"
            raise ConfigError(text)
        self.endpoint, self.server = endpoint, server
        self._pid = os.getpid()
        settings = zenoh.Config()
        for path, value in (_settings(endpoint) | (config or {})).items():
            settings.insert_json5(path, json.dumps(value))
        try:
            self._session: Any = zenoh.open(settings)
        except zenoh.ZError as error:
            text = f"no server at {endpoint}: {_first_line(error)}"
            raise RemoteError(text) from None
        prefix = f"swath/v1/{server}"
        self._queriers = {
            verb: self._session.declare_querier(
                f"{prefix}/rpc/{verb}",
                target=zenoh.QueryTarget.BEST_MATCHING,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=timeout_s,
                express=True,
            )
            for verb in _VERBS
        }
        self._prefix = prefix
        self._lease: zenoh.LivelinessToken | None = None
        _open_links.add(self)

    def ask(self, verb: str, message: bytes) -> Answers:
        """Sends a message; its answers arrive meanwhile."""
        self._check_process()
        return Answers(self._queriers[verb].get(payload=message))

    def hold(self, lease: str) -> None:
        """Shows the server that its client is there, until `close` or the end of the process."""
        self._check_process()
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

    def __init__(self, replies: zenoh.Handler[zenoh.Reply]) -> None:
        """Waits for nothing yet."""
        self._replies = replies

    def __iter__(self) -> Iterator[bytes | None]:
        """Waits for each message and yields it, and None for an error of the network such as a time-out."""
        for reply in self._replies:
            yield reply.ok.payload.to_bytes() if reply.ok is not None else None

    def late(self) -> Iterator[bytes]:
        """Yields the messages that have come since nobody waits for them any more."""
        import zenoh

        try:
            while (reply := self._replies.try_recv()) is not None:
                if reply.ok is not None:
                    yield reply.ok.payload.to_bytes()
        except zenoh.ZError:
            # There will be no more.
            return


def _settings(endpoint: str) -> dict[str, object]:
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


os.register_at_fork(after_in_child=_leave_to_parent)
