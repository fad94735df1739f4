"""Scripted agents that act in a Gymnasium environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swath import _native
from swath.env import Action, MowerRoutingEnv, Observation
from swath.errors import ConfigError

if TYPE_CHECKING:
    import gymnasium as gym
    import numpy as np
    import numpy.typing as npt

__all__ = ["Agent", "make_agent"]


class Agent:
    """A planner that is asked at every step. It sees what the mower may know and nothing else."""

    def __init__(self, spec: _native.AgentSpec, seed: int) -> None:
        """Makes an agent of a checked specification; `make_agent` is the shorter way.

        Args:
            spec: The agent's name and options.
            seed: For the agent's own choices, from 0 to 2**64 - 1.
        """
        self._agent = _native.Agent(spec, seed)

    @property
    def label(self) -> str:
        """The name with the options, as result files write it."""
        return self._agent.label

    @property
    def outcome(self) -> str | None:
        """Why the agent has stopped in this episode: `done`, `capped` (its safety cap), or None while it drives."""
        return self._agent.outcome

    def act(self, env: gym.Env[Observation, Action]) -> npt.NDArray[np.float32] | None:
        """Decides on the next action.

        The agent starts afresh when the environment's episode has changed since it was last asked, be it by a reset, a
        restored snapshot or another environment.

        With the action kind `drive` it drives its path exactly, up to the rounding to float32. With `steer` it follows
        its path, and plans with a deck that is narrower by 0.1 m on either side (`bcp`: no narrower), so that straying
        from the path costs no weeds.

        Args:
            env: A swath environment, wrapped or not.

        Returns:
            The action, float32 of the environment's action shape; None when the agent has stopped or the episode is
            over.

        Raises:
            ConfigError: If the environment is not one of swath's or lies on a server, where `swath worker` plays,
                or its action is a choice: agents steer and drive.
            ActionError: If the environment has not been reset.
        """
        inner = env.unwrapped
        if not isinstance(inner, MowerRoutingEnv):
            if type(inner).__module__.startswith("swath.remote."):
                text = (
                    "`env` must be an environment of this process, such as `gym.make` makes, "
                    f"got {type(inner).__name__}; `swath worker` plays scripted agents on servers"
                )
                raise ConfigError(text)
            text = f"`env` must be a swath environment, got {type(inner).__name__}"
            raise ConfigError(text)
        return self._agent.act(inner.core)

    def __repr__(self) -> str:
        """Returns the label in brackets."""
        return f"<Agent {self.label}>"


def make_agent(name: str, *, seed: int = 0, **options: object) -> Agent:
    """Makes an agent by its name.

    ```python
    agent = swath.make_agent("bcp", spacing="sensor")
    ```

    Args:
        name: One of the names that `swath agents` lists, or a name with options such as `bcp:spacing=sensor`.
        seed: For the agent's own choices, from 0 to 2**64 - 1; it never changes the weeds.
        **options: The agent's options.

    Returns:
        The agent, which has not acted yet.

    Raises:
        ConfigError: If there is no such agent or option, or an option's value cannot be used.
    """
    return Agent(_native.AgentSpec(name, options), seed)
