"""What the tests of the environment share."""

import gymnasium as gym
import numpy as np
import pytest

import swath

ID = "swath/MowerRouting-v0"
KINDS = ["steer", "drive", "discrete", "target"]
NUMBERS = ["steer", "drive"]
OBSERVATIONS = ["features", "maps", "candidates", "dict"]
STEP_KEYS = {"reward_terms", "action_clipped"}
LAST_KEYS = set(swath.Summary.__annotations__)


def make(kind="steer", **blocks):
    return gym.make(ID, action={"kind": kind}, **blocks).unwrapped


def assert_refused(env, action, text):
    """The action is refused with this text, and the environment is as it was."""
    env.reset(seed=0)
    before = env.snapshot()
    with pytest.raises(swath.ActionError) as error:
        env.step(action)
    assert str(error.value) == text
    assert env.snapshot() == before


def actions(env, count, seed=0):
    """Random actions that never repeat across calls with other seeds."""
    rng = np.random.default_rng(seed)
    if isinstance(env.action_space, gym.spaces.Discrete):
        return rng.integers(env.action_space.n, size=count)
    return rng.uniform(-1, 1, (count, *env.action_space.shape)).astype(np.float32)


def transcript(env, steps):
    """All that an episode shows until it ends, as bytes."""
    shown = []
    for action in steps:
        result = env.step(action)
        shown.append(as_bytes(result))
        if result[2] or result[3]:
            break
    return shown


def as_bytes(result):
    observation, *rest = result
    return b"".join(part.tobytes() for part in parts(observation)), repr(rest)


def parts(observation):
    return list(observation.values()) if isinstance(observation, dict) else [observation]


def step_keys(env):
    is_target = env.unwrapped.scenario.to_dict()["action"]["kind"] == "target"
    return STEP_KEYS | ({"elapsed_m", "action_mask"} if is_target else set())


def any_action(env):
    return 0 if isinstance(env.action_space, gym.spaces.Discrete) else np.ones(env.action_space.shape, np.float32)
