"""Drives environments on the server behind the router, and the same ones here: every number must be equal.

python client.py --connect tls/10.77.2.1:7447 --name robot
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np

import swath

ENV_ID = "swath/MowerRouting-v0"


def main() -> int:
    """Steps both and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tls/10.77.2.1:7447", metavar="ENDPOINT", help="the router")
    parser.add_argument("--server", default="field", help="the server's name")
    parser.add_argument("--name", default="robot", help="common name of our certificate")
    parser.add_argument("--certificates", type=Path, default=Path("certificates"), metavar="DIR")
    parser.add_argument("--num-envs", type=int, default=16)
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--deadline-s", type=float, default=60.0, help="how long to go on asking")
    arguments = parser.parse_args()
    folder, name = arguments.certificates, arguments.name
    try:
        far = swath.remote.make_vec(
            ENV_ID,
            arguments.num_envs,
            connect=arguments.connect,
            server=arguments.server,
            client=name,
            deadline_s=arguments.deadline_s,
            zenoh=swath.remote.tls(
                ca=folder / "ca.pem", certificate=folder / f"{name}.pem", key=folder / f"{name}.key.pem"
            ),
        )
    except swath.SwathError as error:
        print(f"client: {error}", file=sys.stderr)
        return 2
    here = gym.make_vec(ENV_ID, num_envs=arguments.num_envs)
    rng = np.random.default_rng(0)
    is_same = same(here.reset(seed=0)[0], far.reset(seed=0)[0])
    for _ in range(arguments.steps):
        actions = rng.uniform(-1, 1, here.action_space.shape).astype(np.float32)
        is_same &= all(map(same, here.step(actions)[:4], far.step(actions)[:4]))
    far.close()
    what = f"{arguments.steps} steps of {arguments.num_envs} environments"
    print(f"client: {what}, {'equal' if is_same else 'NOT equal'} to those here, bit for bit")
    return 0 if is_same else 1


def same(one: np.ndarray, other: np.ndarray) -> bool:
    """Tells whether two arrays hold the same bits."""
    return one.dtype == other.dtype and one.tobytes() == other.tobytes()


if __name__ == "__main__":
    sys.exit(main())
