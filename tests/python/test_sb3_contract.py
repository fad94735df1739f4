"""What stable-baselines3 may rely on, for every action kind."""

import importlib.util
import os

import gymnasium as gym
import numpy as np
import pytest

import swath  # noqa: F401 - registers the ids

if importlib.util.find_spec("stable_baselines3") is None and not os.environ.get("CI"):
    pytest.skip("stable-baselines3 is not installed", allow_module_level=True)

from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import DummyVecEnv

ID = "swath/MowerRouting-v0"


def make(kind):
    return gym.make(ID, scenario="cowbot-field", action={"kind": kind}, episode={"budget": 0.02})


@pytest.mark.parametrize("observation", ["features", "maps", "candidates", "dict"])
@pytest.mark.parametrize("kind", ["steer", "drive", "discrete", "target"])
def test_the_checker_has_nothing_to_say(kind, observation):
    blocks = {"action": {"kind": kind}, "observation": {"kind": observation}}
    check_env(gym.make(ID, **blocks).unwrapped)
    check_env(gym.make(ID, scenario="pasture", **blocks).unwrapped)


def test_a_vector_of_environments_hands_out_last_observations_and_truncation():
    vector = DummyVecEnv([lambda: make("steer") for _ in range(2)])
    vector.seed(3)
    vector.reset()
    single = make("steer")
    observation, _ = single.reset(seed=3)
    done = False
    while not done:
        observations, _, dones, infos = vector.step(np.zeros((2, 1), np.float32))
        observation, _, terminated, truncated, _ = single.step(np.zeros(1, np.float32))
        done = terminated or truncated
        assert dones[0] == done
    assert infos[0]["TimeLimit.truncated"] is True
    assert np.array_equal(infos[0]["terminal_observation"], observation)
    assert np.array_equal(observations[0], single.reset()[0])


@pytest.mark.parametrize("kind", ["steer", "drive", "discrete", "target"])
def test_training_twice_from_one_seed_gives_the_same_network(kind):
    weights = []
    for _ in range(2):
        model = PPO("MlpPolicy", make(kind), n_steps=64, batch_size=32, n_epochs=1, seed=1, device="cpu")
        model.learn(128)
        weights.append([parameter.detach().numpy().copy() for parameter in model.policy.parameters()])
    assert all(np.isfinite(first).all() for first in weights[0])
    assert all(np.array_equal(first, second) for first, second in zip(*weights, strict=True))


@pytest.mark.parametrize("observation", ["maps", "candidates", "dict"])
def test_every_observation_can_be_learnt_from(observation):
    env = gym.make(ID, scenario="cowbot-field", action={"kind": "target"}, observation={"kind": observation})
    policy = "MultiInputPolicy" if observation == "dict" else "MlpPolicy"
    model = PPO(policy, env, n_steps=16, batch_size=16, n_epochs=1, seed=1, device="cpu")
    model.learn(16)
    action, _ = model.predict(env.reset(seed=0)[0])
    env.step(action)
