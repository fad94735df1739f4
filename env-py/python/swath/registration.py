"""The environment ids that `import swath` registers."""

from __future__ import annotations

import gymnasium as gym

__all__ = ["ENTRY_POINTS", "ENV_ID", "VECTOR_ENTRY_POINTS", "register"]

ENV_ID = "swath/MowerRouting-v0"
"""The id of the mower routing problem, as scenarios name it too."""

ENTRY_POINTS = {ENV_ID: "swath.env:MowerRoutingEnv"}
"""Entry point of every id."""

VECTOR_ENTRY_POINTS = {ENV_ID: "swath.vector:MowerRoutingVectorEnv"}
"""Entry point of many environments as one, which `gym.make_vec` uses."""


def register() -> None:
    """Registers every id that Gymnasium does not know yet; calling it again changes nothing."""
    for env_id, entry_point in ENTRY_POINTS.items():
        if env_id not in gym.registry:
            gym.register(env_id, entry_point=entry_point, vector_entry_point=VECTOR_ENTRY_POINTS[env_id])
