"""One environment behind OpenEnv, with its own server and WebSocket client; it simulates nothing.

The client is the asynchronous one, without the thread that its synchronous face adds.
"""

from __future__ import annotations

import asyncio
import sys
import threading
import time
from typing import Any

from benchmarks.remote.sides.blocks import FLOATS, other_end, serve, stay
from openenv.core.client_types import StepResult
from openenv.core.env_client import EnvClient
from openenv.core.env_server.http_server import create_fastapi_app
from openenv.core.env_server.interfaces import Environment
from openenv.core.env_server.types import Action, Observation, State

_NUMBERS = [-1.0 + 2.0 * i / (FLOATS - 1) for i in range(FLOATS)]


class Steer(Action):  # type: ignore[misc]
    """One number."""

    steer: float


class Features(Observation):  # type: ignore[misc]
    """As many numbers as swath's have."""

    features: list[float]


class Pasture(Environment):  # type: ignore[misc]
    """Answers every step with the same numbers."""

    def reset(self, **_: Any) -> Features:  # noqa: ANN401
        """Begins."""
        return Features(features=_NUMBERS)

    def step(self, action: Steer, **_: Any) -> Features:  # noqa: ANN401
        """Steps."""
        return Features(features=_NUMBERS, reward=-0.2, done=False)

    @property
    def state(self) -> State:
        """Nothing."""
        return State()


class Client(EnvClient[Steer, Any, Any]):  # type: ignore[misc]
    """Reads the numbers."""

    def _step_payload(self, action: Steer) -> dict[str, Any]:
        return {"steer": action.steer}

    def _parse_result(self, payload: dict[str, Any]) -> StepResult[Any]:
        observation = payload["observation"]["features"]
        return StepResult(observation=observation, reward=payload["reward"], done=payload["done"])

    def _parse_state(self, payload: dict[str, Any]) -> Any:  # noqa: ANN401
        return payload


def answer(port: int) -> None:
    """Serves."""
    import uvicorn

    app = create_fastapi_app(Pasture, Steer, Features)
    server = uvicorn.Server(uvicorn.Config(app, host="127.0.0.1", port=port, log_level="error"))
    threading.Thread(target=server.run, daemon=True).start()
    while not server.started:
        time.sleep(0.01)
    stay()


def main(port: int) -> None:
    """Steps."""
    with other_end("benchmarks.remote.sides.openenv", "serve", str(port)):
        loop = asyncio.new_event_loop()
        client = Client(base_url=f"ws://127.0.0.1:{port}")
        loop.run_until_complete(client.connect())
        loop.run_until_complete(client.reset())
        action = Steer(steer=0.0)
        result = loop.run_until_complete(client.step(action))
        assert len(result.observation) == FLOATS, "it has another length"

        async def steps(count: int) -> None:
            for _ in range(count):
                await client.step(action)

        serve(["openenv-core", "websockets", "uvicorn"], lambda count: loop.run_until_complete(steps(count)))


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        answer(int(sys.argv[2]))
    else:
        main(int(sys.argv[1]))
