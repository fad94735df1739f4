"""Clones the behaviour that a Minari dataset holds, in plain PyTorch.

    swath record --agent snake --episodes 200 --dataset swath/snake-v0
    python examples/behaviour_cloning.py swath/snake-v0

A network learns which action follows on which observation: the mean squared error of the action, on nine of ten
episodes. The tenth part tells how well it has learned. Then it drives on held-out instances, which tells more: small
errors take a clone to places where nobody has shown it what to do.
"""

from __future__ import annotations

import argparse

import gymnasium as gym
import minari
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import nn

import swath  # noqa: F401 - registers the ids

HELD_OUT_SEED = 1_000_000


class Clone(nn.Module):
    """A network from observations to actions in [-1, 1]."""

    def __init__(self, observations: torch.Tensor, num_actions: int, width: int) -> None:
        """Makes the layers, and remembers how observations are spread."""
        super().__init__()
        self.register_buffer("mean", observations.mean(0))
        self.register_buffer("deviation", observations.std(0) + 1e-3)
        self.layers = nn.Sequential(
            nn.Linear(observations.shape[1], width),
            nn.ReLU(),
            nn.Linear(width, width),
            nn.ReLU(),
            nn.Linear(width, num_actions),
            nn.Tanh(),
        )

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Maps (n, num_features) to (n, num_actions)."""
        return self.layers((observations - self.mean) / self.deviation)


def pairs(episodes: list) -> tuple[torch.Tensor, torch.Tensor]:
    """Returns the observations that actions followed on, and the actions."""
    observations = np.concatenate([episode.observations[:-1] for episode in episodes])
    return torch.as_tensor(observations), torch.as_tensor(np.concatenate([episode.actions for episode in episodes]))


def clone(dataset: minari.MinariDataset, *, epochs: int, batch_size: int, width: int, seed: int) -> Clone:
    """Trains a clone, and prints the error on the episodes that it does not learn from."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    episodes = [dataset[int(index)] for index in rng.permutation(len(dataset))]
    held_out = max(1, len(episodes) // 10)
    observations, actions = pairs(episodes[held_out:])
    unseen_observations, unseen_actions = pairs(episodes[:held_out])
    network = Clone(observations, actions.shape[1], width)
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)
    for epoch in range(1, epochs + 1):
        for index in torch.as_tensor(rng.permutation(len(actions))).split(batch_size):
            loss = (network(observations[index]) - actions[index]).square().mean()
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
        with torch.no_grad():
            error = (network(unseen_observations) - unseen_actions).square().mean()
        print(f"epoch {epoch}: squared error {error:.4f} on {held_out} episodes that were not learned from")
    return network


def drive(network: Clone, dataset: minari.MinariDataset, instances: int) -> None:
    """Lets a clone drive on held-out instances, and prints what came of it."""
    spec = dataset.env_spec
    envs = gym.make_vec(spec.id, num_envs=instances, autoreset_mode=AutoresetMode.SAME_STEP, **spec.kwargs)
    observations, _ = envs.reset(seed=HELD_OUT_SEED)
    ended: dict[int, dict] = {}
    while len(ended) < instances:
        with torch.no_grad():
            actions = network(torch.as_tensor(observations)).numpy()
        observations, _, terminated, truncated, infos = envs.step(actions)
        for row in np.flatnonzero(terminated | truncated):
            ended.setdefault(int(row), {key: infos["final_info"][key][row] for key in ("path_length_m", "weeds_mowed")})
    envs.close()
    path_m, mowed = (np.mean([last[key] for last in ended.values()]) for key in ("path_length_m", "weeds_mowed"))
    print(f"on {instances} held-out instances: path {path_m:.0f} m, {mowed:.1f} weeds mowed")


def main() -> None:
    """Reads the arguments, clones and drives."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", help="name in Minari")
    parser.add_argument("--epochs", type=int, default=10)
    parser.add_argument("--batch-size", type=int, default=512)
    parser.add_argument("--width", type=int, default=128)
    parser.add_argument("--instances", type=int, default=20, help="held-out instances to drive on")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    dataset = minari.load_dataset(arguments.dataset)
    network = clone(
        dataset,
        epochs=arguments.epochs,
        batch_size=arguments.batch_size,
        width=arguments.width,
        seed=arguments.seed,
    )
    drive(network, dataset, arguments.instances)


if __name__ == "__main__":
    main()
