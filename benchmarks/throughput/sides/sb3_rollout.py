"""Rollouts of stable-baselines3's PPO, on swath, on CartPole and on environments that do nothing."""

from __future__ import annotations

import time
from importlib import import_module
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from benchmarks.throughput.sides.worker import Run, serve
from gymnasium import Space
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

import swath
from swath.registration import ENV_ID


class NullVecEnv(VecEnv):  # type: ignore[misc] # stable-baselines3 is read as untyped
    """Returns the same arrays at every step: the speed that the learner would have if environments cost nothing."""

    def __init__(self, num_envs: int, observation_space: Space[Any], action_space: Space[Any]) -> None:
        """Prepares what every step returns."""
        super().__init__(num_envs, observation_space, action_space)
        self._observations = np.zeros((num_envs, *(observation_space.shape or ())), np.float32)
        self._rewards, self._dones = np.zeros(num_envs, np.float32), np.zeros(num_envs, bool)
        self._infos: list[dict[str, object]] = [{} for _ in range(num_envs)]

    def reset(self) -> object:  # noqa: D102
        return self._observations

    def step_async(self, actions: object) -> None:  # noqa: D102
        pass

    def step_wait(self) -> object:  # noqa: D102
        return self._observations, self._rewards, self._dones, self._infos

    def close(self) -> None:  # noqa: D102
        pass

    def get_attr(self, attr_name: str, indices: object = None) -> list[object]:  # noqa: D102
        return [None] * self.num_envs

    def set_attr(self, attr_name: str, value: object, indices: object = None) -> None:  # noqa: D102
        pass

    def env_method(self, method_name: str, *args: object, indices: object = None, **kwargs: object) -> list[object]:  # noqa: D102
        return [None] * self.num_envs

    def env_is_wrapped(self, wrapper_class: object, indices: object = None) -> list[bool]:  # noqa: D102
        return [False] * self.num_envs


class CartPoleVecEnv(NullVecEnv):
    """Gymnasium's batch of CartPole, behind the least that PPO can do with: no infos, no last observations."""

    def __init__(self, num_envs: int) -> None:
        """Makes the batch."""
        self._vec = gym.make_vec("CartPole-v1", num_envs, vectorization_mode="vector_entry_point")
        super().__init__(num_envs, self._vec.single_observation_space, self._vec.single_action_space)

    def reset(self) -> object:  # noqa: D102
        return self._vec.reset(seed=0)[0]

    def close(self) -> None:  # noqa: D102
        self._vec.close()

    def step_async(self, actions: object) -> None:  # noqa: D102
        self._actions = actions

    def step_wait(self) -> object:  # noqa: D102
        observations, rewards, terminated, truncated, _ = self._vec.step(self._actions)
        return observations, rewards, terminated | truncated, self._infos


def vec_of(case: dict[str, Any]) -> VecEnv:
    """What a case steps; what does nothing has the spaces of what it is compared with."""
    face, num_envs = case["face"], case["num_envs"]
    if face == "swath.sb3":
        make_vec_env = import_module("swath.sb3").make_vec_env
        return make_vec_env(ENV_ID, num_envs=num_envs, weeds={"count": case["weeds"]})
    if face == "null":
        env = swath.MowerRoutingEnv()
        return NullVecEnv(num_envs, env.observation_space, env.action_space)
    cartpole = CartPoleVecEnv(num_envs)
    if face == "null of CartPole":
        return NullVecEnv(num_envs, cartpole.observation_space, cartpole.action_space)
    assert face == "CartPole", face
    return cartpole


def measure(case: dict[str, Any]) -> Run:
    """Collects rollouts as PPO does by default, with an untrained MlpPolicy, torch on one thread."""
    torch.set_num_threads(1)
    num_envs = case["num_envs"]
    vec = vec_of(case)
    model = PPO("MlpPolicy", vec, seed=0, device="cpu")
    _, callback = model._setup_learn(total_timesteps=10**9)

    def collect() -> None:
        model.collect_rollouts(model.env, callback, model.rollout_buffer, model.n_steps)

    collect()
    rollouts, idle = 0, 0
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    while time.process_time() - cpu_s < case["enough_s"]:
        collect()
        rollouts += 1
        if case["face"] == "CartPole":
            # The step after the last one of an episode only begins the next.
            idle += int(model.rollout_buffer.episode_starts.sum())
    run = Run(rollouts * model.n_steps * num_envs - idle, time.process_time() - cpu_s, time.perf_counter() - wall_s)
    vec.close()
    return run


if __name__ == "__main__":
    serve(["swath", "gymnasium", "stable-baselines3", "torch"], measure)
