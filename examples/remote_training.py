# %% [markdown]
# # Train through a server
#
#     make server-release
#     python examples/remote_training.py --server target/release/swath-server
#
# A notebook in percent format: editors run it cell by cell, and Python as a whole.

# %%
"""Starts a server, trains PPO through it, and compares what was learned with a training in this process."""

from __future__ import annotations

import argparse
import subprocess
import time

import numpy as np
from stable_baselines3 import PPO

import swath

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--server", default="target/release/swath-server", help="the program")
parser.add_argument("--total-steps", type=int, default=100_000, help="steps of all environments together")
parser.add_argument("--num-envs", type=int, default=64)
parser.add_argument("--num-steps", type=int, default=128, help="steps of every environment between two updates")
# A notebook has arguments of its own.
arguments, _ = parser.parse_known_args()

ENV_ID = "swath/MowerRouting-v0"

# %% [markdown]
# ## A server
#
# Port 0 is a free one, and the server says which. On another machine it would be started there, and `connect` below
# would name that machine: `examples/two_machines`.

# %%
server = subprocess.Popen([arguments.server, "--listen", "tcp/127.0.0.1:0"], stdout=subprocess.PIPE, text=True)
assert server.stdout is not None
endpoint = server.stdout.readline().split()[2]
print(f"the server listens on {endpoint}")

# %% [markdown]
# ## The same training, there and here
#
# `connect` is the whole difference. A list of endpoints shares the environments among several servers.


# %%
def trained(connect: str | None) -> tuple[np.ndarray, float]:
    """Trains, and returns all parameters in one array, and how long it took, seconds."""
    venv = swath.sb3.make_vec_env(ENV_ID, num_envs=arguments.num_envs, seed=0, connect=connect, weeds={"count": 20})
    since = time.perf_counter()
    model = PPO("MlpPolicy", venv, n_steps=arguments.num_steps, batch_size=256, n_epochs=2, seed=0, device="cpu")
    model.learn(arguments.total_steps)
    took_s = time.perf_counter() - since
    venv.close()
    return np.concatenate([part.detach().numpy().ravel() for part in model.policy.parameters()]), took_s


# %%
far, far_s = trained(endpoint)
here, here_s = trained(None)
print(f"through the server {far_s:.1f} s, in this process {here_s:.1f} s")
print("the same parameters, bit for bit" if np.array_equal(far, here) else "the parameters differ")

# %%
server.terminate()
server.wait()
server.stdout.close()
