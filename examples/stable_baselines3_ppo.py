# %% [markdown]
# # Train with stable-baselines3, and drive beside SNAKE
#
#     python examples/stable_baselines3_ppo.py --total-steps 500000
#
# A notebook in percent format: editors run it cell by cell, and Python as a whole.

# %%
"""PPO of stable-baselines3 on the native batch, then a contest on held-out instances."""

from __future__ import annotations

import argparse

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import swath

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--total-steps", type=int, default=500_000, help="steps of all environments together")
parser.add_argument("--num-envs", type=int, default=64)
parser.add_argument("--num-steps", type=int, default=256, help="steps of every environment between two updates")
parser.add_argument("--instances", type=int, default=20, help="held-out instances to drive on")
# A notebook has arguments of its own.
arguments, _ = parser.parse_known_args()

ENV_ID = "swath/MowerRouting-v0"
HELD_OUT_SEED = 1_000_000
PROBLEM = {"scenario": "cowbot-field", "pasture": {"headland_m": 10.0}}

# %% [markdown]
# ## Train
#
# One `VecEnv` is one native call a step. A weed one metre away is a small number in `features`, and a return some
# hundred metres, so both are normalised.

# %%
venv = VecNormalize(swath.sb3.make_vec_env(ENV_ID, num_envs=arguments.num_envs, seed=0, **PROBLEM), gamma=0.999)
model = PPO(
    "MlpPolicy",
    venv,
    n_steps=arguments.num_steps,
    batch_size=min(2048, arguments.num_envs * arguments.num_steps),
    gamma=0.999,
    gae_lambda=0.97,
    seed=0,
)
model.learn(arguments.total_steps)
print(f"trained for {model.num_timesteps} steps")

# %% [markdown]
# ## Drive on held-out instances
#
# Row i has the seed 1,000,000 + i, as instance i has in `swath.evaluate`: both drive on the same pastures.

# %%
test = swath.sb3.make_vec_env(ENV_ID, num_envs=arguments.instances, seed=HELD_OUT_SEED, **PROBLEM)
observations = test.reset()
ended: dict[int, dict] = {}
while len(ended) < arguments.instances:
    actions, _ = model.predict(venv.normalize_obs(observations), deterministic=True)
    observations, _, dones, infos = test.step(actions)
    for row in np.flatnonzero(dones):
        ended.setdefault(int(row), infos[row])

# %%
results = swath.evaluate(["snake"], scenario="cowbot-field", instances=arguments.instances, seed=HELD_OUT_SEED)
snake = results.of_cell(0, "snake")
path_m = np.mean([last["path_length_m"] for last in ended.values()])
mowed = np.mean([last["weeds_mowed"] for last in ended.values()])
print(f"PPO:   path {path_m:.0f} m, {mowed:.1f} weeds mowed")
print(
    f"SNAKE: path {np.mean([row.path_length_m for row in snake]):.0f} m, "
    f"{np.mean([row.weeds_mowed for row in snake]):.1f} weeds mowed"
)
