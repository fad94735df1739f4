"""What Gymnasium and its users may rely on, for every action kind.

It runs under the oldest Gymnasium that is supported too, with nothing else installed.
"""

import copy
import itertools
import math
import pickle
from pathlib import Path

import cloudpickle
import gymnasium as gym
import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import swath

ID = "swath/MowerRouting-v0"
KINDS = ["steer", "drive", "discrete", "target"]
NUMBERS = ["steer", "drive"]
OBSERVATIONS = ["features", "maps", "candidates", "dict"]
STEP_KEYS = {"reward_terms", "action_clipped"}
LAST_KEYS = set(swath.Summary.__annotations__)


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


@pytest.fixture
def env(kind):
    return make(kind)


def make(kind="steer", **blocks):
    return gym.make(ID, action={"kind": kind}, **blocks).unwrapped


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


def test_the_spec_is_json():
    env = gym.make(ID, scenario="pasture", weeds={"count": 3})
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.scenario == env.unwrapped.scenario


def test_closing_twice_is_fine(env):
    env.close()
    env.close()


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
    assert (spaces["candidates"].shape, spaces["candidates"].dtype) == ((16 * 11,), np.float32)
    assert spaces["maps"] == gym.spaces.Box(0, 255, (12 * 32 * 32,), np.uint8)
    mask = gym.spaces.MultiBinary(16)
    expected = {part: spaces[part] for part in ("features", "candidates", "maps")} | {"action_mask": mask}
    assert spaces["dict"] == gym.spaces.Dict(expected)
    tables = gym.make(ID, observation={"kind": "dict", "flat": False}, action={"weeds": 3, "views": 0})
    assert tables.observation_space["candidates"].shape == (4, 11)
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
    _, reward, terminated, truncated, info = env.step(env.action_space.sample())
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
    env.reset(seed=0)
    before = env.snapshot()
    with pytest.raises(swath.ActionError) as error:
        env.step(action)
    assert str(error.value) == text
    assert env.snapshot() == before


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


# Choices


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
    env.reset(seed=0)
    before = env.snapshot()
    with pytest.raises(swath.ActionError) as error:
        env.step(action)
    assert str(error.value) == text
    assert env.snapshot() == before


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
        rows = observation["candidates"].reshape(16, 11)
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


# State


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
    for wrong in (b"", b"nonsense", snapshot[:-1], snapshot + b"x", other.snapshot()):
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


# Scenarios


def test_every_way_to_name_a_scenario_gives_the_same_one(tmp_path):
    file = tmp_path / "field.toml"
    file.write_text(swath.Scenario("cowbot-field").to_toml())
    blocks = swath.Scenario("cowbot-field").to_dict()
    del blocks["id"]
    ways = [
        make(scenario="cowbot-field"),
        make(scenario=str(file)),
        make(scenario=file),
        make(scenario=blocks),
        make(scenario=swath.Scenario("cowbot-field")),
        swath.MowerRoutingEnv(**blocks),
    ]
    assert {env.scenario.hash for env in ways} == {swath.Scenario("cowbot-field").hash}


def test_blocks_are_laid_over_the_scenario_key_by_key():
    blocks = make(scenario="cowbot-field", weeds={"count": 3}, mower=None).scenario.to_dict()
    assert blocks["weeds"]["count"] == 3
    assert blocks["weeds"]["distribution"] == "uniform"
    assert blocks["mower"]["deck_width_m"] == 1.3


def test_numpy_numbers_and_arrays_are_numbers():
    weeds = np.array([[1.0, 2.0], [3.0, 4.0]])
    one = swath.Scenario(
        weeds={"positions_m": weeds}, mower={"deck_width_m": np.float32(1.5), "speed_mps": np.int64(2)}
    )
    other = swath.Scenario(weeds={"positions_m": weeds.tolist()}, mower={"deck_width_m": 1.5, "speed_mps": 2.0})
    assert one == other
    assert one.to_dict()["weeds"]["count"] == 2


def test_a_weed_file_among_keywords_lies_where_python_runs(tmp_path, monkeypatch):
    (tmp_path / "farm").mkdir()
    (tmp_path / "farm" / "field.toml").write_text('[weeds]\nfile = "weeds.csv"\n')
    (tmp_path / "farm" / "weeds.csv").write_text("1,2\n")
    (tmp_path / "mine.csv").write_text("x_m,y_m\n3,4\n5,6\n")
    monkeypatch.chdir(tmp_path)
    field = Path("farm") / "field.toml"
    assert swath.Scenario(field).to_dict()["weeds"]["positions_m"] == [[1.0, 2.0]]
    mine = swath.Scenario(field, weeds={"file": "mine.csv"})
    assert mine.to_dict()["weeds"]["positions_m"] == [[3.0, 4.0], [5.0, 6.0]]


def test_a_scenario_can_be_pickled():
    scenario = swath.Scenario("pasture", pasture={"headland_m": math.inf}, name="mine")
    twin = pickle.loads(pickle.dumps(scenario))
    assert (twin, twin.name, twin.hash) == (scenario, "mine", scenario.hash)
    assert copy.deepcopy(scenario) == scenario


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"wedes": {"count": 3}}, "`wedes` is not a known key; did you mean `weeds`?"),
        ({"weeds": {"cuont": 3}}, "`weeds.cuont` is not a known key; did you mean `weeds.count`?"),
        ({"weeds": {"count": -3}}, "`weeds.count` must be a whole number >= 0, got integer `-3`"),
        ({"weeds": {"count": None}}, "`weeds.count` must be a number, a text, a list or a block of keys, got None"),
        ({"weeds": {"count": 1 << 70}}, f"`weeds.count` must be a whole number of at most 63 bits, got {1 << 70}"),
        ({"weeds": 3}, "`weeds` must be a block of keys, got 3"),
        ({"mower": {"deck_width_m": math.nan}}, "`mower.deck_width_m` must be finite and > 0, got NaN"),
        ({"scenario": "table1"}, "table1 declares the sweep `density`: it is for `swath evaluate`, "),
        ({"scenario": "nowhere"}, "cannot read nowhere: no such file, and no shipped scenario"),
        ({"scenario": 3}, "`scenario` must be a name, a path, a dictionary or a Scenario, got 3"),
        ({"scenario": {1: {}}}, "`scenario` must be a block with text keys, got 1"),
    ],
)
def test_a_scenario_that_cannot_be_used_is_refused_by_name(arguments, text):
    with pytest.raises(swath.ConfigError) as error:
        swath.MowerRoutingEnv(**arguments)
    assert str(error.value).startswith(text)


def test_a_render_mode_is_refused():
    with pytest.raises(swath.ConfigError, match="`render_mode` must be None, got 'human'"):
        swath.MowerRoutingEnv(render_mode="human")


# Errors


@pytest.mark.parametrize("kind_of_error", [swath.ConfigError, swath.ActionError, swath.SnapshotError])
def test_errors_form_one_tree_and_survive_pickling(kind_of_error):
    error = kind_of_error("`field` must be this, got that")
    twin = pickle.loads(pickle.dumps(error))
    assert (type(twin), str(twin)) == (kind_of_error, str(error))
    assert isinstance(twin, swath.SwathError)
    assert isinstance(twin, ValueError)
