"""swath: a Gymnasium environment for autonomous pasture mowing, with scripted planners and their evaluation.

```python
import gymnasium as gym
import swath  # registers the ids

env = gym.make("swath/MowerRouting-v0", action={"kind": "drive"})
agent = swath.make_agent("jump")
observation, info = env.reset(seed=7)
while (action := agent.act(env)) is not None:
    observation, reward, terminated, truncated, info = env.step(action)
```
"""

from swath import _native, datasets, film, remote, rllib, sb3, training
from swath.agents import Agent, make_agent
from swath.env import MowerRoutingEnv
from swath.episode import Episode, run_episode
from swath.errors import (
    ActionError,
    ClosedError,
    ConfigError,
    RemoteError,
    RemoteTimeout,
    ResumeError,
    SnapshotError,
    SwathError,
)
from swath.evaluation import Results, evaluate
from swath.registration import register
from swath.scenario import Scenario
from swath.summary import Summary
from swath.vector import MowerRoutingVectorEnv

__all__ = [
    "ActionError",
    "Agent",
    "ClosedError",
    "ConfigError",
    "Episode",
    "MowerRoutingEnv",
    "MowerRoutingVectorEnv",
    "RemoteError",
    "RemoteTimeout",
    "Results",
    "ResumeError",
    "Scenario",
    "SnapshotError",
    "Summary",
    "SwathError",
    "__version__",
    "datasets",
    "evaluate",
    "film",
    "make_agent",
    "register",
    "remote",
    "rllib",
    "run_episode",
    "sb3",
    "training",
]

__version__ = _native.VERSION

register()
