"""PPO in one file, in the style of CleanRL, on swath's vector environment.

    python examples/cleanrl_ppo.py --total-steps 500000
    python examples/cleanrl_ppo.py --connect tcp/127.0.0.1:7447 --connect tcp/127.0.0.1:7448

With `--connect` the environments are shared among those servers, and what is learned is the same to the bit.
`gym.make_vec` autoresets in the next step by default: the step after an episode's end ignores its action and returns
the next episode's first observation. That step is no experience, so it is left out of the update.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, fields

import gymnasium as gym
import numpy as np
import torch
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics
from torch import nn
from torch.distributions import Normal

import swath


@dataclass
class Args:
    """The arguments of the command line."""

    env_id: str = "swath/MowerRouting-v0"
    total_steps: int = 500_000
    num_envs: int = 16
    num_steps: int = 256  # steps of every environment between two updates
    num_epochs: int = 8
    num_minibatches: int = 8
    learning_rate: float = 3e-4
    gamma: float = 0.999
    gae_lambda: float = 0.97
    clip: float = 0.2
    entropy: float = 0.001
    value: float = 0.5
    max_grad_norm: float = 0.5
    reward_scale: float = 0.02  # returns are some hundred metres
    seed: int = 0
    connect: tuple[str, ...] = ()  # endpoints of servers; none: the environments are here


class Agent(nn.Module):
    """An actor with a Gaussian over the actions, and a critic."""

    def __init__(self, num_features: int, num_actions: int) -> None:
        """Makes two networks of two layers."""
        super().__init__()

        def network(outputs: int, gain: float) -> nn.Sequential:
            layers = [nn.Linear(num_features, 128), nn.Linear(128, 128), nn.Linear(128, outputs)]
            for layer, scale in zip(layers, (2**0.5, 2**0.5, gain), strict=True):
                nn.init.orthogonal_(layer.weight, scale)
                nn.init.zeros_(layer.bias)
            return nn.Sequential(layers[0], nn.Tanh(), layers[1], nn.Tanh(), layers[2])

        self.actor, self.critic = network(num_actions, 0.01), network(1, 1.0)
        self.log_std = nn.Parameter(torch.zeros(num_actions))

    def value(self, observations: torch.Tensor) -> torch.Tensor:
        """Returns the values, (n,)."""
        return self.critic(observations).squeeze(-1)

    def policy(self, observations: torch.Tensor) -> Normal:
        """Returns the distribution of the actions."""
        return Normal(self.actor(observations), self.log_std.exp())


def train(args: Args) -> Agent:
    """Trains an agent, and prints the mean return of the episodes that ended in each rollout."""
    torch.manual_seed(args.seed)
    rng = np.random.default_rng(args.seed)
    scenario = {"scenario": "pasture", "weeds": {"count": 20}}
    if args.connect:
        envs = swath.remote.make_vec(args.env_id, args.num_envs, connect=args.connect, **scenario)
    else:
        envs = gym.make_vec(args.env_id, num_envs=args.num_envs, **scenario)
    envs = NormalizeObservation(RecordEpisodeStatistics(envs))
    agent = Agent(envs.single_observation_space.shape[0], envs.single_action_space.shape[0])
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)

    shape = (args.num_steps, args.num_envs)
    observations = torch.zeros(*shape, envs.single_observation_space.shape[0])
    actions = torch.zeros(*shape, envs.single_action_space.shape[0])
    log_probs, rewards, values = torch.zeros(shape), torch.zeros(shape), torch.zeros(shape)
    terminations, truncations = torch.zeros(shape, dtype=torch.bool), torch.zeros(shape, dtype=torch.bool)
    is_live = torch.zeros(shape, dtype=torch.bool)  # False where the environment only resets

    observation = torch.as_tensor(envs.reset(seed=args.seed)[0], dtype=torch.float32)
    ended = torch.zeros(args.num_envs, dtype=torch.bool)
    num_updates = args.total_steps // (args.num_steps * args.num_envs)
    since = time.monotonic()
    for update in range(1, num_updates + 1):
        optimizer.param_groups[0]["lr"] = args.learning_rate * (1 - (update - 1) / num_updates)
        returns_seen = []
        for step in range(args.num_steps):
            with torch.no_grad():
                distribution = agent.policy(observation)
                action = distribution.sample()
                values[step] = agent.value(observation)
            observations[step], actions[step], is_live[step] = observation, action, ~ended
            log_probs[step] = distribution.log_prob(action).sum(-1)
            raw, reward, terminated, truncated, info = envs.step(action.clamp(-1, 1).numpy())
            observation = torch.as_tensor(raw, dtype=torch.float32)
            rewards[step] = torch.as_tensor(reward * args.reward_scale)
            terminations[step], truncations[step] = torch.as_tensor(terminated), torch.as_tensor(truncated)
            ended = terminations[step] | truncations[step]
            if "episode" in info:
                returns_seen.extend(info["episode"]["r"][info["_episode"]])

        # Generalised advantages. The observation of an episode's last step is the true one, so what lies beyond a
        # truncation is worth what the critic says; the step after it is dead and starts anew.
        advantages = torch.zeros(shape)
        with torch.no_grad():
            next_value, running = agent.value(observation), torch.zeros(args.num_envs)
            for step in reversed(range(args.num_steps)):
                goes_on = ~(terminations[step] | truncations[step])
                delta = rewards[step] + args.gamma * next_value * ~terminations[step] - values[step]
                running = (delta + args.gamma * args.gae_lambda * goes_on * running) * is_live[step]
                advantages[step], next_value = running, values[step]
            targets = advantages + values

        live = torch.nonzero(is_live.flatten()).squeeze(-1)
        flat = [part.flatten(0, 1)[live] for part in (observations, actions, log_probs, advantages, targets)]
        for _ in range(args.num_epochs):
            for index in np.array_split(rng.permutation(len(live)), args.num_minibatches):
                seen, taken, old_log_prob, advantage, target = (part[index] for part in flat)
                distribution = agent.policy(seen)
                ratio = (distribution.log_prob(taken).sum(-1) - old_log_prob).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                gain = torch.min(ratio * advantage, ratio.clamp(1 - args.clip, 1 + args.clip) * advantage).mean()
                error = (agent.value(seen) - target).square().mean()
                loss = -gain + args.value * error - args.entropy * distribution.entropy().sum(-1).mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), args.max_grad_norm)
                optimizer.step()

        steps = update * args.num_steps * args.num_envs
        mean = f"{np.mean(returns_seen):.1f}" if returns_seen else "no episode ended"
        print(f"step {steps}: return {mean}, loss {loss.item():.3f}, {steps / (time.monotonic() - since):.0f} steps/s")
    envs.close()
    return agent


def main() -> None:
    """Reads the arguments and trains."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for field in fields(Args):
        flag, default = f"--{field.name.replace('_', '-')}", field.default
        if isinstance(default, tuple):
            parser.add_argument(flag, action="append", default=[], help="may be given again")
        else:
            parser.add_argument(flag, type=type(default), default=default)
    train(Args(**vars(parser.parse_args())))


if __name__ == "__main__":
    main()
