"""Questions to one server over one Zenoh session."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    import zenoh

__all__ = ["Way"]

# What is left of a deadline is never no time at all.
_SHORTEST_S = 0.001


class Way:
    """A session and the keys that are asked by it."""

    def __init__(self, session: zenoh.Session, prefix: str, verbs: Iterable[str], timeout_s: float) -> None:
        """Declares what will be asked.

        Args:
            session: An open session, which is closed with this.
            prefix: What the keys of the server begin with.
            verbs: What it will be asked for.
            timeout_s: How long a question stays open, where no less is said.
        """
        import zenoh

        self.session = session
        self._prefix = prefix
        self._timeout_s = timeout_s
        self._options: dict[str, Any] = {
            "target": zenoh.QueryTarget.BEST_MATCHING,
            "consolidation": zenoh.ConsolidationMode.NONE,
            "express": True,
        }
        self._queriers = {
            verb: session.declare_querier(self._key(verb), timeout=timeout_s, **self._options) for verb in verbs
        }

    def ask(self, verb: str, message: bytes, timeout_s: float) -> zenoh.Handler[zenoh.Reply]:
        """Sends a message; its answers arrive meanwhile, for at most so many seconds."""
        if timeout_s >= self._timeout_s:
            return self._queriers[verb].get(payload=message)
        # A querier knows one time-out only, and the deadline is nearer.
        timeout_s = max(timeout_s, _SHORTEST_S)
        return self.session.get(self._key(verb), payload=message, timeout=timeout_s, **self._options)

    def held(self) -> Iterator[object]:
        """Yields what is Zenoh's, for those who must not free it."""
        yield self.session
        yield from self._queriers.values()

    def _key(self, verb: str) -> str:
        return f"{self._prefix}/rpc/{verb}"
