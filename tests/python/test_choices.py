"""Actions that are choices: which are open, what a closed one does, and what they stand for."""

import numpy as np
import pytest
from contract import actions, as_bytes, assert_refused, make

import swath


@pytest.mark.parametrize(
    ("action", "text"),
    [
        (16, "`action` must be from 0 to 15, got 16"),
        (-1, "`action` must be from 0 to 15, got -1"),
        (1.5, "`action` must be a whole number from 0 to 15, got `float`"),
        (np.zeros(2, np.int64), "`action` must be a whole number from 0 to 15, got `ndarray`"),
        (None, "`action` must be a whole number from 0 to 15, got `NoneType`"),
    ],
)
def test_a_choice_that_there_is_not_is_refused_before_anything_moves(action, text):
    env = make("target")
    assert_refused(env, action, text)


def test_choices_may_be_any_whole_number():
    shown = []
    for action in (15, np.int64(15), np.uint8(15), np.array(15)):
        env = make("target")
        env.reset(seed=0)
        shown.append(as_bytes(env.step(action)))
    assert all(one == shown[0] for one in shown)


def test_the_mask_is_told_in_three_places():
    env = make("target", observation={"kind": "dict"})
    observation, info = env.reset(seed=5)
    for action in actions(env, 60):
        mask = env.action_masks()
        assert (mask.shape, mask.dtype) == ((16,), bool)
        assert mask[-1]
        assert np.array_equal(mask, info["action_mask"])
        assert np.array_equal(mask, observation["action_mask"])
        rows = observation["candidates"].reshape(16, 18)
        assert np.array_equal(mask, rows[:, :3].any(axis=1))
        observation, _, _, _, info = env.step(action)
        assert info["action_clipped"] is not bool(mask[action])
        assert info["elapsed_m"] == pytest.approx(-info["reward_terms"]["path"])


def test_a_closed_candidate_stands_for_the_search():
    closed, search = make("target"), make("target")
    _, info = closed.reset(seed=5, options={"weeds": []})
    search.reset(seed=5, options={"weeds": []})
    assert not info["action_mask"][0]
    first, second = closed.step(0), search.step(15)
    assert np.array_equal(first[0], second[0])
    assert (first[1], first[4]["action_clipped"], second[4]["action_clipped"]) == (second[1], True, False)


def test_the_search_alone_wins():
    env = make("target", scenario="cowbot-field")
    env.reset(seed=1)
    terminated = truncated = False
    while not (terminated or truncated):
        _, _, terminated, truncated, info = env.step(env.action_space.n - 1)
    assert info["outcome"] == "goal"
    assert info["seen_fraction"] == 1.0


def test_masks_are_for_choices():
    env = make("discrete")
    with pytest.raises(swath.ActionError, match="`reset` must come before the first step"):
        env.action_masks()
    env.reset(seed=0)
    assert env.action_masks().tolist() == [True] * 5
    env = make("steer")
    env.reset(seed=0)
    with pytest.raises(swath.ConfigError) as error:
        env.action_masks()
    assert str(error.value) == "`action.kind` must be `discrete` or `target` where actions are masked, got steer"


def test_the_five_curvatures_are_those_of_steer():
    for choice, curvature in enumerate([-1.0, -0.5, 0.0, 0.5, 1.0]):
        chosen, steered = make("discrete"), make("steer")
        chosen.reset(seed=0)
        steered.reset(seed=0)
        assert as_bytes(chosen.step(choice)) == as_bytes(steered.step([curvature]))
