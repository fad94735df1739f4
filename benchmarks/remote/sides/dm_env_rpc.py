"""One environment behind dm_env_rpc, with its own connection and `DmEnvAdaptor`; it simulates nothing."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent import futures
from typing import Any

import grpc
import numpy as np
from benchmarks.remote.sides.blocks import FLOATS, other_end, serve, stay
from dm_env_rpc.v1 import connection, dm_env_adaptor, dm_env_rpc_pb2, dm_env_rpc_pb2_grpc, tensor_utils

ACTION, OBSERVATION, REWARD = 1, 1, 2


class Environment(dm_env_rpc_pb2_grpc.EnvironmentServicer):  # type: ignore[misc]
    """Answers every step with the same numbers."""

    def Process(self, requests: Iterator[Any], _: grpc.ServicerContext) -> Iterator[Any]:  # noqa: N802 - gRPC's name
        """Takes one request after another."""
        observation = tensor_utils.pack_tensor(np.linspace(-1, 1, FLOATS, dtype=np.float32))
        reward = tensor_utils.pack_tensor(np.float64(-0.2))
        for request in requests:
            response = dm_env_rpc_pb2.EnvironmentResponse()
            what = request.WhichOneof("payload")
            if what == "create_world":
                response.create_world.world_name = "world"
            elif what == "join_world":
                _describe(response.join_world.specs)
            elif what == "reset":
                _describe(response.reset.specs)
            elif what == "step":
                tensor_utils.unpack_tensor(request.step.actions[ACTION]) if request.step.actions else None
                response.step.state = dm_env_rpc_pb2.EnvironmentStateType.RUNNING
                for uid in request.step.requested_observations:
                    response.step.observations[uid].CopyFrom(observation if uid == OBSERVATION else reward)
            yield response


def _describe(specs: Any) -> None:  # noqa: ANN401 - a message of dm_env_rpc
    action = specs.actions[ACTION]
    action.name, action.dtype = "action", dm_env_rpc_pb2.FLOAT
    action.shape[:] = [1]
    observation = specs.observations[OBSERVATION]
    observation.name, observation.dtype = "observation", dm_env_rpc_pb2.FLOAT
    observation.shape[:] = [FLOATS]
    reward = specs.observations[REWARD]
    reward.name, reward.dtype = "reward", dm_env_rpc_pb2.DOUBLE


def answer(port: int) -> None:
    """Serves."""
    server = grpc.server(futures.ThreadPoolExecutor(max_workers=1))
    dm_env_rpc_pb2_grpc.add_EnvironmentServicer_to_server(Environment(), server)
    server.add_secure_port(f"127.0.0.1:{port}", grpc.local_server_credentials())
    server.start()
    stay()


def main(port: int) -> None:
    """Steps."""
    with (
        other_end("benchmarks.remote.sides.dm_env_rpc", "serve", str(port)),
        connection.create_secure_channel_and_connect(f"127.0.0.1:{port}", timeout=30) as way,
    ):
        way.send(dm_env_rpc_pb2.CreateWorldRequest())
        specs = way.send(dm_env_rpc_pb2.JoinWorldRequest(world_name="world")).specs
        env = dm_env_adaptor.DmEnvAdaptor(way, specs)
        env.reset()
        action = {"action": np.zeros(1, np.float32)}
        assert env.step(action).observation["observation"].shape == (FLOATS,), "it has another length"

        def steps(count: int) -> None:
            for _ in range(count):
                env.step(action)

        serve(["dm_env_rpc", "grpcio", "protobuf"], steps)


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        answer(int(sys.argv[2]))
    else:
        main(int(sys.argv[1]))
