"""Zenoh alone: a question with as many bytes as a step, and an answer with as many as its reply; nobody looks at them.

Both ends are Python's Zenoh, with the settings of swath's client and server, and with Zenoh's own threads.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from benchmarks.remote.sides.blocks import other_end, serve, stay

KEY = "echo"
_QUIET = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "transport/shared_memory/enabled": False,
    "transport/link/rx/buffer_size": 1 << 20,
    "transport/link/tx/queue/size/data": 16,
}


def _session(settings: dict[str, object]) -> Any:  # noqa: ANN401 - a Zenoh session
    import zenoh

    config = zenoh.Config()
    for path, value in (_QUIET | settings).items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def echo(endpoint: str, reply_bytes: int) -> None:
    """Answers every question alike."""
    import zenoh

    reply = zenoh.ZBytes(bytes(reply_bytes))
    session = _session({"mode": "peer", "listen/endpoints": [endpoint]})
    answer = session.declare_queryable(
        KEY, lambda query: query.reply(query.key_expr, reply, express=True), complete=True
    )
    stay()
    answer.undeclare()


def main(endpoint: str, request_bytes: int, reply_bytes: int) -> None:
    """Asks."""
    import zenoh

    with other_end("benchmarks.remote.sides.zenoh_echo", "echo", endpoint, str(reply_bytes)):
        session = _session({"mode": "client", "connect/endpoints": [endpoint]})
        querier = session.declare_querier(
            KEY, target=zenoh.QueryTarget.BEST_MATCHING, consolidation=zenoh.ConsolidationMode.NONE, express=True
        )
        request = bytes(request_bytes)

        def ask(count: int) -> None:
            for _ in range(count):
                reply = next(iter(querier.get(payload=request)))
                assert len(reply.ok.payload.to_bytes()) == reply_bytes, "it has another length"

        serve(["eclipse-zenoh"], ask)


if __name__ == "__main__":
    if sys.argv[1] == "echo":
        echo(sys.argv[2], int(sys.argv[3]))
    else:
        main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
