# %% [markdown]
# # Clone the behaviour that a dataset holds
#
#     python examples/behaviour_cloning.py                     # records `horizon` first, then clones it
#     swath record --agent snake --episodes 200 --dataset swath/snake-v0
#     python examples/behaviour_cloning.py swath/snake-v0      # or any dataset that is there
#
# A notebook in percent format: editors run it cell by cell, and Python as a whole.

# %%
"""Clones the behaviour that a Minari dataset holds, in plain PyTorch.

A network learns which action follows on which observation, on nine of ten episodes; the tenth part tells how well it
has learned. Then it drives on held-out instances, which tells more: small errors take a clone to places where nobody
has shown it what to do.
"""

from __future__ import annotations

import argparse

import gymnasium as gym
import minari
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import nn

import swath

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("dataset", nargs="?", default="swath/horizon-drive-v0", help="name in Minari; recorded if missing")
parser.add_argument("--agent", default="horizon", help="who is recorded")
parser.add_argument("--episodes", type=int, default=100, help="how many are recorded")
parser.add_argument("--epochs", type=int, default=10)
parser.add_argument("--batch-size", type=int, default=512)
parser.add_argument("--width", type=int, default=128)
parser.add_argument("--instances", type=int, default=20, help="held-out instances to drive on")
parser.add_argument("--seed", type=int, default=0)
# A notebook has arguments of its own.
arguments, _ = parser.parse_known_args()

HELD_OUT_SEED = 1_000_000

# %% [markdown]
# ## The dataset
#
# With the action `drive` a planner's path is driven exactly: a step ends where an arc ends.

# %%
if arguments.dataset not in minari.list_local_datasets():
    swath.datasets.record(
        arguments.agent,
        episodes=arguments.episodes,
        scenario="cowbot-field",
        dataset_id=arguments.dataset,
        action={"kind": "drive"},
    )
dataset = minari.load_dataset(arguments.dataset)
print(f"{arguments.dataset}: {dataset.total_episodes} episodes, {dataset.total_steps} steps")

# %% [markdown]
# ## The clone
#
# Where actions are numbers, the error is their mean squared difference. Where they are a choice (`discrete`, `target`),
# it is the cross entropy.


# %%
class Clone(nn.Module):
    """A network from observations to actions in [-1, 1], or to a score for each choice."""

    def __init__(self, observations: torch.Tensor, num_outputs: int, *, is_choice: bool) -> None:
        """Makes the layers, and remembers how observations are spread."""
        super().__init__()
        self.register_buffer("mean", observations.mean(0))
        self.register_buffer("deviation", observations.std(0) + 1e-3)
        self.layers = nn.Sequential(
            nn.Linear(observations.shape[1], arguments.width),
            nn.ReLU(),
            nn.Linear(arguments.width, arguments.width),
            nn.ReLU(),
            nn.Linear(arguments.width, num_outputs),
            nn.Identity() if is_choice else nn.Tanh(),
        )

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Maps (n, num_features) to (n, num_outputs)."""
        return self.layers((observations - self.mean) / self.deviation)


def pairs(episodes: list) -> tuple[torch.Tensor, torch.Tensor]:
    """Returns the observations that actions followed on, and the actions."""
    observations = np.concatenate([episode.observations[:-1] for episode in episodes])
    return torch.as_tensor(observations), torch.as_tensor(np.concatenate([episode.actions for episode in episodes]))


# %%
torch.manual_seed(arguments.seed)
rng = np.random.default_rng(arguments.seed)
episodes = [dataset[int(index)] for index in rng.permutation(len(dataset))]
held_out = max(1, len(episodes) // 10)
observations, actions = pairs(episodes[held_out:])
unseen_observations, unseen_actions = pairs(episodes[:held_out])

is_choice = isinstance(dataset.action_space, gym.spaces.Discrete)
error_of = nn.functional.cross_entropy if is_choice else nn.functional.mse_loss
error_name = "cross entropy" if is_choice else "squared error"
num_outputs = int(dataset.action_space.n) if is_choice else actions.shape[1]
network = Clone(observations, num_outputs, is_choice=is_choice)
optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)
for epoch in range(1, arguments.epochs + 1):
    for index in torch.as_tensor(rng.permutation(len(actions))).split(arguments.batch_size):
        loss = error_of(network(observations[index]), actions[index])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    with torch.no_grad():
        error = error_of(network(unseen_observations), unseen_actions)
    print(f"epoch {epoch}: {error_name} {error:.4f} on {held_out} episodes that were not learned from")

# %% [markdown]
# ## The clone drives

# %%
spec = dataset.env_spec
envs = gym.make_vec(spec.id, num_envs=arguments.instances, autoreset_mode=AutoresetMode.SAME_STEP, **spec.kwargs)
rows, _ = envs.reset(seed=HELD_OUT_SEED)
ended: dict[int, dict] = {}
while len(ended) < arguments.instances:
    with torch.no_grad():
        outputs = network(torch.as_tensor(rows))
    chosen = outputs.argmax(1) if is_choice else outputs
    rows, _, terminated, truncated, infos = envs.step(chosen.numpy())
    for row in np.flatnonzero(terminated | truncated):
        ended.setdefault(int(row), {key: infos["final_info"][key][row] for key in ("path_length_m", "weeds_mowed")})
envs.close()
path_m, mowed = (np.mean([last[key] for last in ended.values()]) for key in ("path_length_m", "weeds_mowed"))
print(f"on {arguments.instances} held-out instances: path {path_m:.0f} m, {mowed:.1f} weeds mowed")
