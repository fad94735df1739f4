"""RLlib is given batches that it reads rightly, here and on servers; nothing of Ray is needed for that."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from remote_server import Server, needs_server, same

import swath
from swath.registration import ENV_ID

BLOCKS = {"episode": {"budget": 0.01}}


def test_a_runner_gets_a_native_batch_that_begins_anew_in_the_step_after():
    env = swath.rllib.env_creator({"num_envs": 4, "scenario": "pasture", **BLOCKS})
    assert isinstance(env.unwrapped, swath.MowerRoutingVectorEnv)
    assert env.num_envs == 4
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    one = swath.rllib.env_creator(BLOCKS)
    assert isinstance(one.unwrapped, swath.MowerRoutingEnv)


@pytest.mark.parametrize("mode", ["SameStep", AutoresetMode.DISABLED])
def test_a_mode_that_rllib_would_read_wrongly_is_refused(mode):
    with pytest.raises(swath.ConfigError, match="`autoreset_mode` must be NextStep, the one that RLlib reads rightly"):
        swath.rllib.env_creator({"num_envs": 4, "autoreset_mode": mode})


@pytest.mark.parametrize("key", ["weed", "worker_index"])
def test_a_key_that_nobody_knows_is_named(key):
    with pytest.raises(swath.ConfigError, match=f"`{key}`"):
        swath.rllib.env_creator({"num_envs": 2, key: 1})


@needs_server
def test_environments_on_servers_are_those_here_to_the_bit():
    servers = [Server(), Server()]
    far = swath.rllib.env_creator({"num_envs": 4, "connect": [server.endpoint for server in servers], **BLOCKS})
    here = gym.make_vec(ENV_ID, num_envs=4, **BLOCKS)
    assert same(here.reset(seed=3), far.reset(seed=3))
    for _ in range(60):
        actions = np.full((4, 1), 0.5, np.float32)
        assert all(map(same, here.step(actions), far.step(actions)))
    far.close()
    one = swath.rllib.env_creator({"connect": servers[0].endpoint, **BLOCKS})
    assert same(one.reset(seed=3), gym.make(ENV_ID, **BLOCKS).reset(seed=3))
    one.close()
    for server in servers:
        server.end()
