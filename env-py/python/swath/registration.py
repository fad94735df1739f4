"""The environment ids that `import swath` registers."""

from __future__ import annotations

import gymnasium as gym

__all__ = ["ENTRY_POINTS", "VECTOR_ENTRY_POINTS", "register"]

ENTRY_POINTS = {"swath/MowerRouting-v0": "swath.env:MowerRoutingEnv"}
"""Entry point of every id."""

VECTOR_ENTRY_POINTS = {"swath/MowerRouting-v0": "swath.vector:MowerRoutingVectorEnv"}
"""Entry point of many environments as one, which `gym.make_vec` uses."""


def register() -> None:
    """Registers every id that Gymnasium does not know yet; calling it again changes nothing."""
    for env_id, entry_point in ENTRY_POINTS.items():
        if env_id not in gym.registry:
            gym.register(env_id, entry_point=entry_point, vector_entry_point=VECTOR_ENTRY_POINTS[env_id])
