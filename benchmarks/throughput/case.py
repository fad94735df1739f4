"""What is measured."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

BATCHES = (1, 8, 64, 256, 1024)
LARGEST = BATCHES[-1]
OBSERVATIONS = ("maps", "dict", "candidates")
# Weeds, length and width in metres.
PASTURES = ((40, 100, 40), (160, 100, 40), (640, 100, 40), (10_000, 100, 40), (160, 1000, 400))
ACTIONS = ("drive", "discrete", "target")


@dataclass(frozen=True)
class Case:
    """One figure.

    Attributes:
        side: Whose process measures it.
        face: Which way in: `gym.make`, `unwrapped`, `make_vec`, `reset`, or what a peer offers.
        num_envs: Environments that one call steps.
        weeds: Weeds of each pasture.
        length_m: Length of the pasture, metres.
        width_m: Width of the pasture, metres.
        observation: Kind of the observation.
        action: Kind of the action.
        threads: Threads that may be used; with one, the process is pinned to one core.
        copy: Whether each step returns fresh arrays.
    """

    side: str
    face: str
    num_envs: int = 1
    weeds: int = 160
    length_m: int = 100
    width_m: int = 40
    observation: str = "features"
    action: str = "steer"
    threads: int = 1
    copy: bool = True


def cases() -> list[Case]:
    """All cases; those that are compared stand beside one another, since they are measured in turn."""
    found = [
        Case("swath", "unwrapped"),
        Case("swath", "gym.make"),
        Case("cartpole", "gym.make"),
    ]
    for num_envs in BATCHES:
        found += [
            Case("swath", "make_vec", num_envs),
            Case("envpool", "envpool", num_envs),
            Case("envpool", "envpool", num_envs, threads=2),
            Case("cartpole", "SyncVectorEnv", num_envs),
            Case("cartpole", "vector_entry_point", num_envs),
            Case("numpy", "make_vec", num_envs),
        ]
    found += [Case("swath", "make_vec", num_envs, threads=2) for num_envs in BATCHES if num_envs >= 64]
    found += [Case("swath", "make_vec", LARGEST, copy=False)]
    ways = (("unwrapped", 1), ("make_vec", LARGEST))
    for (face, num_envs), kind in product(ways, OBSERVATIONS):
        found.append(Case("swath", face, num_envs, observation=kind))
    for (face, num_envs), kind in product(ways, ACTIONS):
        found.append(Case("swath", face, num_envs, action=kind))
    for (face, num_envs), (weeds, length_m, width_m) in product(ways, PASTURES):
        found.append(Case("swath", face, num_envs, weeds=weeds, length_m=length_m, width_m=width_m))
    found += [Case("numpy", "make_vec", 64, weeds=weeds) for weeds in (40, 640)]
    found += [Case("swath", "reset", weeds=weeds) for weeds in (40, 160, 640)]
    found += [Case("rollout", face, 64) for face in ("null", "swath.sb3", "null of CartPole", "CartPole")]
    return list(dict.fromkeys(found))
