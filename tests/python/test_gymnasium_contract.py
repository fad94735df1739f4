"""What Gymnasium and its users may rely on, for every action kind.

It runs under the oldest Gymnasium that is supported too, with nothing else installed.
So do the tests of choices, state and scenarios.
"""

import copy
import itertools
import math

import gymnasium as gym
import numpy as np
import pytest
from contract import (
    ID,
    LAST_KEYS,
    NUMBERS,
    OBSERVATIONS,
    actions,
    any_action,
    as_bytes,
    assert_refused,
    make,
    parts,
    step_keys,
    transcript,
)
from gymnasium.utils.env_checker import check_env

import swath

# The checker


@pytest.mark.parametrize("observation", OBSERVATIONS)
@pytest.mark.parametrize("scenario", [None, "pasture", "cowbot-field"])
def test_the_checker_has_nothing_to_say(kind, observation, scenario):
    check_env(make(kind, observation={"kind": observation}, scenario=scenario))


def test_the_checker_has_nothing_to_say_about_short_episodes(kind):
    check_env(make(kind, scenario="cowbot-field", episode={"control_period_s": 2.0, "budget": 0.01}))


def test_registering_again_changes_nothing():
    before = gym.registry[ID]
    swath.register()
    assert gym.registry[ID] is before
    assert isinstance(gym.make(f"swath:{ID}").unwrapped, swath.MowerRoutingEnv)


def test_scenarios_name_the_id_that_is_registered():
    assert swath.Scenario().to_dict()["id"] == swath.registration.ENV_ID == ID


def test_the_spec_is_json():
    env = gym.make(ID, scenario="pasture", weeds={"count": 3})
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.scenario == env.unwrapped.scenario


def test_closing_twice_is_fine_and_nothing_moves_after_it(env):
    env.reset(seed=0)
    snapshot = env.unwrapped.snapshot()
    env.close()
    env.close()
    inner = env.unwrapped
    action = env.action_space.sample()
    calls = [inner.reset, lambda: inner.step(action), inner.action_masks, lambda: inner.restore(snapshot)]
    for call in [*calls, inner.snapshot, env.reset, lambda: env.step(action)]:
        with pytest.raises(swath.ClosedError, match=r"^`reset` and `step` must come before `close`$"):
            call()
    assert inner.scenario.to_dict()["id"] == ID


def test_gymnasium_copies_of_the_environment_follow_seed_plus_index():
    vector = gym.make_vec(ID, num_envs=3, vectorization_mode="sync", scenario="cowbot-field")
    observations, _ = vector.reset(seed=40)
    for row, observation in enumerate(observations):
        assert np.array_equal(observation, make(scenario="cowbot-field").reset(seed=40 + row)[0])
    vector.close()


# Spaces


def test_bounds_are_finite_and_every_number_has_a_name(env, kind):
    space = env.observation_space
    assert (space.shape, space.dtype) == ((39,), np.float32)
    assert np.isfinite(space.low).all()
    assert np.isfinite(space.high).all()
    assert len(set(env.observation_names)) == 39
    assert (
        env.action_space
        == {
            "steer": gym.spaces.Box(-1, 1, (1,)),
            "drive": gym.spaces.Box(-1, 1, (2,)),
            "discrete": gym.spaces.Discrete(5),
            "target": gym.spaces.Discrete(16),
        }[kind]
    )


def test_the_parts_of_an_observation_have_the_documented_forms():
    spaces = {kind: make(observation={"kind": kind}).observation_space for kind in OBSERVATIONS}
    assert (spaces["candidates"].shape, spaces["candidates"].dtype) == ((16 * 18,), np.float32)
    assert spaces["maps"] == gym.spaces.Box(0, 255, (12 * 32 * 32,), np.uint8)
    mask = gym.spaces.MultiBinary(16)
    expected = {part: spaces[part] for part in ("features", "candidates", "maps")} | {"action_mask": mask}
    assert spaces["dict"] == gym.spaces.Dict(expected)
    tables = gym.make(ID, observation={"kind": "dict", "flat": False}, action={"weeds": 3, "views": 0})
    assert tables.observation_space["candidates"].shape == (4, 18)
    assert tables.observation_space["maps"].shape == (12, 32, 32)


def test_flat_tables_are_the_tables_row_by_row():
    flat, shaped = (make("target", observation={"kind": "dict", "flat": is_flat}) for is_flat in (True, False))
    one, other = flat.reset(seed=3)[0], shaped.reset(seed=3)[0]
    for action in actions(flat, 20):
        assert list(one) == list(other) == ["features", "candidates", "action_mask", "maps"]
        for part in one:
            assert np.array_equal(one[part], other[part].reshape(-1))
        one, other = flat.step(action)[0], shaped.step(action)[0]


@pytest.mark.parametrize("observation", OBSERVATIONS)
def test_every_observation_of_an_episode_of_any_kind_lies_in_the_space(kind, observation):
    env = make(kind, scenario="cowbot-field", observation={"kind": observation})
    shown, _ = env.reset(seed=1)
    for action in actions(env, 100):
        assert shown in env.observation_space
        shown, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            shown, _ = env.reset()


def test_every_observation_of_an_episode_lies_in_the_space(env):
    observation, _ = env.reset(seed=1)
    for action in actions(env, 500):
        assert observation in env.observation_space
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            observation, _ = env.reset()


def test_the_size_of_the_observation_follows_the_scenario():
    env = make(observation={"nearest_weeds": 3, "rays": 5})
    assert env.reset(seed=0)[0].shape == env.observation_space.shape == (7 + 3 * 3 + 5,)


# Seeds


def test_a_seed_and_the_resets_behind_it_repeat_as_a_sequence(env):
    steps = actions(env, 30)

    def sequence():
        shown = [as_bytes(env.reset(seed=7)), *transcript(env, steps)]
        for _ in range(3):
            shown += [as_bytes(env.reset()), *transcript(env, steps)]
        return shown, env.snapshot(), env.np_random.bit_generator.state

    assert sequence() == sequence()


def test_later_episodes_of_a_seed_have_other_weeds(env):
    env.reset(seed=7)
    first = env.snapshot()
    env.reset()
    assert env.snapshot() != first


def test_a_first_reset_without_a_seed_draws_it_from_np_random(kind):
    one, twin, other = make(kind), make(kind), make(kind)
    for env, seed in ((one, 5), (twin, 5), (other, 6)):
        env.np_random = np.random.default_rng(seed)
        env.reset()
    assert one.snapshot() == twin.snapshot()
    assert one.snapshot() != other.snapshot()


def test_environments_that_nobody_seeds_differ(kind):
    one, other = make(kind), make(kind)
    one.reset()
    other.reset()
    assert one.snapshot() != other.snapshot()


def test_numpy_seeds_are_seeds(env):
    env.reset(seed=np.int64(7))
    snapshot = env.snapshot()
    env.reset(seed=7)
    assert env.snapshot() == snapshot


@pytest.mark.parametrize("seed", [-1, 1 << 64, 1.5, "seven"])
def test_a_seed_that_is_none_is_refused_by_name(env, seed):
    env.reset(seed=3)
    before = env.snapshot(), env.np_random.bit_generator.state
    with pytest.raises(swath.ConfigError) as error:
        env.reset(seed=seed)
    assert str(error.value) == f"`seed` must be a whole number from 0 to {(1 << 64) - 1}, got {seed!r}"
    assert (env.snapshot(), env.np_random.bit_generator.state) == before


def test_the_largest_seed_is_a_seed(env):
    env.reset(seed=(1 << 64) - 1)
    env.reset()


# Options


def test_options_place_the_weeds_and_are_never_modified(env):
    weeds = np.array([[10.0, 1.0], [20.0, 39.0]])
    options = {"weeds": weeds}
    env.reset(seed=0, options=options)
    assert list(options) == ["weeds"]
    assert options["weeds"] is weeds
    assert np.array_equal(weeds, [[10.0, 1.0], [20.0, 39.0]])
    placed = env.snapshot()
    env.reset(seed=0, options={"weeds": weeds.tolist()})
    assert env.snapshot() == placed


def test_one_weed_on_the_first_pass_is_worth_one_less_the_way_to_it():
    env = make(episode={"control_period_s": 1.0})
    env.reset(seed=0, options={"weeds": [[10.0, 1.0]]})
    rewards = [env.step(np.zeros(1, np.float32))[1] for _ in range(12)]
    # Straight along y = 1 at 1 m a step: the bar passes x = 10 with the tenth step.
    assert rewards == pytest.approx([-1.0] * 9 + [0.0] + [-1.0] * 2, abs=1e-9)


def test_without_weeds_there_is_only_the_way(env):
    env.reset(seed=0, options={"weeds": []})
    _, reward, _, _, info = env.step(any_action(env))
    assert reward == info["reward_terms"]["path"] == pytest.approx(-info.get("elapsed_m", 0.5))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"weed": [[1, 1]]}, "`options` must hold nothing but `weeds`, got `weed`"),
        ({"weeds": [[1.0, 41.0]]}, "`weeds[0]` must be on the pasture, 0..=100 by 0..=40 m, got [1, 41]"),
        ({"weeds": [[1.0, math.inf]]}, "`weeds[0]` must be on the pasture, 0..=100 by 0..=40 m, got [1, inf]"),
        ({"weeds": [1.0, 2.0]}, "`weeds` must be an array (n, 2) of numbers, metres, got the shape (2,)"),
        ({"weeds": [["a", "b"]]}, "`weeds` must be an array (n, 2) of numbers, metres, got `list`"),
    ],
)
def test_options_that_cannot_be_used_are_refused_by_name(env, options, text):
    env.reset(seed=3)
    before = env.snapshot()
    for seed in (None, 4):
        with pytest.raises(swath.ConfigError) as error:
            env.reset(seed=seed, options=options)
        assert str(error.value) == text
        assert env.snapshot() == before


# Steps


def test_flags_are_bool_and_the_reward_is_a_float(env):
    env.reset(seed=0)
    _, reward, terminated, truncated, info = env.step(any_action(env))
    assert type(reward) is float
    assert terminated is False
    assert truncated is False
    assert set(info) == step_keys(env)
    assert type(info["action_clipped"]) is bool


def test_the_terms_sum_to_the_reward_and_every_step_has_the_same_keys(env):
    _, info = env.reset(seed=2)
    assert set(info) == step_keys(env)
    assert info["reward_terms"] == {"weed": 0.0, "path": 0.0, "failure": 0.0}
    assert info["action_clipped"] is False
    for action in actions(env, 300):
        _, reward, terminated, truncated, info = env.step(action)
        assert reward == sum(info["reward_terms"].values())
        assert list(info["reward_terms"]) == ["weed", "path", "failure"]
        if terminated or truncated:
            assert set(info) == step_keys(env) | LAST_KEYS
            break
        assert set(info) == step_keys(env)


def test_an_action_beyond_the_box_is_clipped_and_said_to_be():
    beyond, within = make(), make()
    beyond.reset(seed=0)
    within.reset(seed=0)
    first, _, _, _, info = beyond.step(np.array([2.5], np.float32))
    second, *_ = within.step(np.array([1.0], np.float32))
    assert info["action_clipped"] is True
    assert np.array_equal(first, second)


@pytest.mark.parametrize("kind", NUMBERS)
def test_actions_may_be_anything_that_numpy_reads(env):
    size = env.action_space.shape[0]
    shown = []
    for action in ([0.25] * size, (0.25,) * size, np.full(size, 0.25), np.full(2 * size, 0.25, np.float32)[::2]):
        env.reset(seed=0)
        shown.append(as_bytes(env.step(action)))
    assert len(set(shown)) == 1


@pytest.mark.parametrize(
    ("action", "text"),
    [
        (np.array([math.nan], np.float32), "`action[0]` must be finite, got NaN"),
        (np.array([-math.inf]), "`action[0]` must be finite, got -inf"),
        (np.array([math.inf]), "`action[0]` must be finite, got inf"),
        (None, "`action` must be numbers, got None, which an agent returns when it has stopped"),
        (np.zeros(2, np.float32), "`action` must have 1 value(s), got 2"),
        (np.zeros(0, np.float32), "`action` must have 1 value(s), got 0"),
        (np.zeros((1, 1), np.float32), "`action` must have the shape (1,), got (1, 1)"),
        (0.5, "`action` must have the shape (1,), got ()"),
        (["left"], "`action` must have 1 number(s), got `list`"),
        ({}, "`action` must have 1 number(s), got `dict`"),
    ],
)
def test_an_action_that_cannot_be_driven_is_refused_before_anything_moves(action, text):
    env = make()
    assert_refused(env, action, text)


def test_a_step_before_the_first_reset_is_refused(env):
    with pytest.raises(swath.ActionError, match="`reset` must come before the first step"):
        env.step(env.action_space.sample())


def test_a_step_after_the_end_is_refused(kind):
    env = make(kind, episode={"budget": 1e-6})
    env.reset(seed=0)
    env.step(any_action(env))
    with pytest.raises(swath.ActionError, match="`reset` must come before the next step: the episode has ended"):
        env.step(env.action_space.sample())


# Ends


def test_the_budget_truncates_at_its_last_centimetre_and_the_last_info_tells_the_truth():
    env = make(scenario="cowbot-field", episode={"budget": 0.05})
    _, info = env.reset(seed=0)
    truncated, total = False, 0.0
    while not truncated:
        assert LAST_KEYS.isdisjoint(info)
        _, reward, terminated, truncated, info = env.step([0.0])
        total += reward
    assert terminated is False
    assert info["outcome"] == "budget"
    assert info["path_length_m"] == pytest.approx(0.05 * info["bcp_length_m"], abs=1e-9)
    assert info["bcp_length_m"] == pytest.approx(897.519, abs=1e-3)
    assert info["path_fraction"] == pytest.approx(0.05, abs=1e-12)
    assert total == pytest.approx(info["weeds_mowed"] - info["path_length_m"], abs=1e-9)
    assert (info["weeds_total"], type(info["weeds_total"])) == (14, int)


def test_leaving_the_headland_costs_the_whole_budget():
    env = make(pasture={"headland_m": 3.0}, mower={"start": [0.0, 20.0, math.pi]})
    env.reset(seed=0, options={"weeds": []})
    steps = [env.step([0.0]) for _ in range(7)]
    assert [step[2] for step in steps] == [False] * 6 + [True]
    info = steps[-1][4]
    assert info["outcome"] == "left_headland"
    assert sum(step[1] for step in steps) == pytest.approx(-info["bcp_length_m"], abs=1e-9)


def test_a_pasture_that_is_seen_and_mowed_is_won():
    env = make(episode={"seen_goal": 1e-6})
    env.reset(seed=0, options={"weeds": [[0.4, 1.0]]})
    _, _, terminated, _, info = env.step([0.0])
    assert terminated is True
    assert (info["outcome"], info["weeds_mowed"], info["weeds_total"]) == ("goal", 1, 1)


@pytest.mark.parametrize("huge", [2.0, 1e300])
def test_a_finite_action_beyond_its_bounds_is_clipped_and_that_is_said(huge):
    env, twin = make(), make()
    env.reset(seed=0)
    twin.reset(seed=0)
    observation, *_, info = env.step(np.array([huge]))
    assert info["action_clipped"] is True
    assert np.array_equal(observation, twin.step(np.array([1.0]))[0])


def test_standing_still_ends_too():
    env = make("drive", episode={"budget": 0.001})
    env.reset(seed=0)
    rewards, truncated = [], False
    while not truncated:
        _, reward, _, truncated, info = env.step([0.0, -1.0])
        rewards.append(reward)
    # Four times the steps of the budget at 0.5 m a step; the last one is charged what driving it would have cost.
    budget_m = 0.001 * info["bcp_length_m"]
    assert rewards[:-1] == [0.0] * (math.ceil(4 * budget_m / 0.5) - 1)
    assert rewards[-1] == pytest.approx(-budget_m)
    assert info["outcome"] == "step_limit"


# Fresh data


def test_what_a_step_returns_is_not_touched_by_later_ones(env):
    kept = [env.reset(seed=0), *(env.step(action) for action in actions(env, 20))]
    copies = copy.deepcopy(kept)
    env.reset()
    for action in actions(env, 20, seed=1):
        env.step(action)
    assert [as_bytes(one) for one in kept] == [as_bytes(one) for one in copies]
    arrays = [part for result in kept for part in parts(result[0])]
    assert not any(np.shares_memory(one, other) for one, other in itertools.combinations(arrays, 2))


def test_what_the_caller_does_to_results_does_not_reach_the_environment(kind):
    spoilt, clean = (make(kind, observation={"kind": "dict"}) for _ in range(2))
    spoilt.reset(seed=0)
    clean.reset(seed=0)
    for action in actions(clean, 20):
        theirs = np.array(action)
        observation, *_, info = spoilt.step(theirs)
        theirs[...] = 0
        for part in observation.values():
            part[...] = 0
        info["reward_terms"].clear()
        info.get("action_mask", np.zeros(1))[:] = False
        clean.step(action)
    assert spoilt.snapshot() == clean.snapshot()
