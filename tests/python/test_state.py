"""An environment goes on from a copy of it, whatever the copy is made of."""

import copy
import pickle

import cloudpickle
import gymnasium as gym
import hypothesis
import hypothesis.strategies as st
import pytest
from contract import (
    ID,
    OBSERVATIONS,
    actions,
    as_bytes,
    make,
    transcript,
)

import swath


@pytest.mark.parametrize(
    "duplicate",
    [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env)), lambda env: cloudpickle.loads(cloudpickle.dumps(env))],
    ids=["deepcopy", "pickle", "cloudpickle"],
)
@pytest.mark.parametrize("is_wrapped", [False, True])
@pytest.mark.parametrize("observation", OBSERVATIONS)
def test_a_duplicate_made_in_mid_episode_goes_on_bit_for_bit(kind, observation, duplicate, is_wrapped):
    env = gym.make(ID, action={"kind": kind}, observation={"kind": observation}, scenario="cowbot-field")
    env = env if is_wrapped else env.unwrapped
    env.reset(seed=21)
    env.reset()
    for action in actions(env, 8):
        env.step(action)
    twin = duplicate(env)
    steps = actions(env, 30, seed=1)
    assert transcript(twin, steps) == transcript(env, steps)
    assert as_bytes(twin.reset()) == as_bytes(env.reset())
    assert twin.unwrapped.snapshot() == env.unwrapped.snapshot()
    assert twin.np_random.bit_generator.state == env.np_random.bit_generator.state
    assert twin.unwrapped.scenario == env.unwrapped.scenario


def test_an_environment_can_be_pickled_before_its_first_reset(env):
    twin = pickle.loads(pickle.dumps(env))
    with pytest.raises(swath.ActionError):
        twin.step(env.action_space.sample())
    assert as_bytes(twin.reset(seed=1)) == as_bytes(env.reset(seed=1))


@pytest.mark.parametrize("observation", OBSERVATIONS)
def test_a_snapshot_can_be_restored_as_often_as_wanted_and_elsewhere(kind, observation):
    env, elsewhere = (make(kind, observation={"kind": observation}) for _ in range(2))
    env.reset(seed=4)
    for action in actions(env, 25):
        env.step(action)
    snapshot, steps = env.snapshot(), actions(env, 25, seed=1)
    shown = transcript(env, steps)
    for place in (env, elsewhere, env):
        place.restore(snapshot)
        assert transcript(place, steps) == shown


def test_a_snapshot_that_does_not_fit_is_refused_and_changes_nothing(env):
    env.reset(seed=4)
    snapshot = env.snapshot()
    other = make(weeds={"count": 3})
    other.reset(seed=4)
    for wrong in (b"", b"nonsense", snapshot[:-1], snapshot + b"x", other.snapshot(), None, "text"):
        with pytest.raises(swath.SnapshotError, match="`snapshot` must"):
            env.restore(wrong)
        assert env.snapshot() == snapshot


@hypothesis.given(
    seed=st.integers(0, (1 << 64) - 1),
    steps=st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)), max_size=30),
    cut=st.integers(0, 30),
)
def test_any_episode_goes_on_from_its_snapshot(seed, steps, cut):
    env, twin = (make("drive", scenario="cowbot-field") for _ in range(2))
    env.reset(seed=seed)
    transcript(env, steps[:cut])
    twin.restore(env.snapshot())
    assert transcript(twin, steps[cut:]) == transcript(env, steps[cut:])
