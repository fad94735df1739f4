"""What `gym.make_vec` promises: the vector is its environments, bit for bit, in every autoreset mode.

It runs under the oldest Gymnasium that is supported too. Gymnasium's own `SyncVectorEnv` over single environments says
what is expected.
"""

import copy
import itertools
import math
import pickle
import re

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import DictInfoToList, NormalizeObservation, RecordEpisodeStatistics

import swath

ID = "swath/MowerRouting-v0"
KINDS = ["steer", "drive", "discrete", "target"]
MODES = list(AutoresetMode)
# Episodes of some ten steps, which end in different ways.
SHORT = {"scenario": "cowbot-field", "episode": {"budget": 0.015}, "pasture": {"headland_m": 2.0}}


def make(num_envs, mode=AutoresetMode.NEXT_STEP, kind="steer", **keywords):
    keywords = {**SHORT, "action": {"kind": kind}, **keywords}
    return gym.make_vec(ID, num_envs=num_envs, autoreset_mode=mode, **keywords)


def make_sync(num_envs, mode, kind="steer", **keywords):
    keywords = {**SHORT, "action": {"kind": kind}, **keywords}
    return SyncVectorEnv([lambda: gym.make(ID, **keywords).unwrapped] * num_envs, autoreset_mode=mode)


def tape(envs, steps, seed=0):
    """Actions that no two rows or steps share; some have to be clipped."""
    rng = np.random.default_rng(seed)
    space = envs.single_action_space
    if isinstance(space, gym.spaces.Discrete):
        return rng.integers(space.n, size=(steps, envs.num_envs))
    return rng.uniform(-1.2, 1.2, (steps, envs.num_envs, *space.shape)).astype(np.float32)


def assert_same(got, expected, where="result"):
    """Equal in structure, dtypes, shapes and every bit."""
    assert type(got) is type(expected), where
    if isinstance(expected, dict):
        assert set(got) == set(expected), where
        for key in expected:
            assert_same(got[key], expected[key], f"{where}[{key}]")
    elif isinstance(expected, tuple | list):
        assert len(got) == len(expected), where
        for index, (one, other) in enumerate(zip(got, expected, strict=True)):
            assert_same(one, other, f"{where}[{index}]")
    elif isinstance(expected, np.ndarray):
        assert (got.dtype, got.shape) == (expected.dtype, expected.shape), where
        if expected.dtype == object:
            assert_same(list(got), list(expected), where)
        else:
            assert got.tobytes() == expected.tobytes(), where
    else:
        assert got == expected, where


def play(envs, steps, mode):
    """All that an agent sees; where nothing begins anew by itself, what has ended is reset after each step."""
    shown = [envs.reset(seed=11)]
    for actions in steps:
        shown.append(envs.step(actions))
        ended = shown[-1][2] | shown[-1][3]
        if mode is AutoresetMode.DISABLED and ended.any():
            shown.append(envs.reset(options={"reset_mask": ended}))
    return shown


# The vector is its environments


@pytest.mark.parametrize("num_envs", [1, 3, 64])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", KINDS)
def test_the_vector_shows_what_a_sync_vector_of_single_environments_shows(num_envs, mode, kind):
    envs, single = make(num_envs, mode, kind), make_sync(num_envs, mode, kind)
    steps = tape(envs, 90)
    got, expected = play(envs, steps, mode), play(single, steps, mode)
    assert_same(got, expected)
    ends = sum(int((step[2] | step[3]).sum()) for step in got if len(step) == 5)
    assert ends >= num_envs, "the tape has to end episodes"


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("observation", [{"kind": "candidates"}, {"kind": "maps", "flat": False}, {"kind": "dict"}])
def test_the_vector_shows_every_kind_of_observation(observation, mode):
    keywords = {"observation": observation, "kind": "target"}
    envs, single = make(3, mode, **keywords), make_sync(3, mode, **keywords)
    steps = tape(envs, 20)
    assert_same(play(envs, steps, mode), play(single, steps, mode))


def test_the_masks_of_the_vector_are_those_of_its_observations():
    envs = make(8, kind="target", observation={"kind": "dict"})
    observation, infos = envs.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(40):
        assert infos["action_mask"].any(axis=1).all()
        assert np.array_equal(infos["action_mask"], observation["action_mask"].astype(bool))
        actions = np.array([rng.choice(np.flatnonzero(mask)) for mask in infos["action_mask"]])
        observation, _, _, _, infos = envs.step(actions)
        assert not infos["action_clipped"].any()


@pytest.mark.parametrize("mode", MODES)
def test_episodes_end_in_every_way(mode):
    """The comparison above would say little if all episodes ended alike."""
    key = "final_info" if mode is AutoresetMode.SAME_STEP else None
    outcomes = set()
    for result in play(make(64, mode), tape(make(64), 60), mode):
        infos = result[-1].get(key, {}) if key else result[-1]
        outcomes |= set(infos.get("outcome", ()))
    assert outcomes >= {"budget", "left_headland"}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("num_envs", [1, 3, 64, 300])
def test_the_number_of_threads_changes_nothing(num_envs, mode):
    shown = []
    for threads in (1, 2, 4):
        envs = make(num_envs, mode, num_threads=threads)
        shown.append(play(envs, tape(envs, 40), mode))
        assert_same(shown[-1], shown[0])


def test_a_row_does_not_depend_on_the_rows_beside_it():
    many, few = make(64), make(3)
    steps = tape(many, 40)
    many.reset(seed=5)
    few.reset(seed=7)
    for actions in steps:
        observations, rewards, *_ = many.step(actions)
        alone = few.step(actions[2:5])
        assert_same(alone[0], np.ascontiguousarray(observations[2:5]))
        assert_same(alone[1], np.ascontiguousarray(rewards[2:5]))


def test_make_vec_uses_the_native_batch():
    envs = gym.make_vec(ID, num_envs=2)
    assert isinstance(envs.unwrapped, swath.MowerRoutingVectorEnv)
    assert envs.unwrapped.spec.id == ID
    assert envs.spec.kwargs["vectorization_mode"] == "vector_entry_point"
    assert repr(envs) == f"MowerRoutingVectorEnv({ID}, num_envs=2)"
    assert type(gym.make_vec(envs.spec).unwrapped) is type(envs.unwrapped)


@pytest.mark.parametrize("kind", KINDS)
def test_spaces_are_batched_and_hold_what_is_shown(kind):
    envs, single = make(5, kind=kind), make_sync(5, AutoresetMode.NEXT_STEP, kind)
    for name in ("single_observation_space", "single_action_space", "observation_space", "action_space"):
        assert getattr(envs, name) == getattr(single, name), name
    envs.action_space.seed(0)
    observations, _ = envs.reset(seed=0)
    for _ in range(30):
        assert observations in envs.observation_space
        observations, *_ = envs.step(envs.action_space.sample())
    assert envs.unwrapped.observation_names == gym.make(ID, **SHORT).unwrapped.observation_names


@pytest.mark.parametrize("mode", MODES)
def test_the_mode_may_be_named_by_its_value_and_stays_with_its_vector(mode):
    first, second = make(1, mode), make(1, mode.value)
    assert first.metadata["autoreset_mode"] is second.metadata["autoreset_mode"] is mode
    assert "autoreset_mode" not in swath.MowerRoutingVectorEnv.metadata
    assert first.metadata is not second.metadata


# Arrays


def arrays_of(value):
    if isinstance(value, np.ndarray) and value.dtype == object:
        value = list(value)
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, tuple | list):
        return [array for inner in value for array in arrays_of(inner)]
    return [value] if isinstance(value, np.ndarray) else []


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_no_two_calls_share_memory(mode):
    envs = make(3, mode)
    results = [envs.reset(seed=0), *(envs.step(actions) for actions in tape(envs, 25))]
    arrays = list(itertools.chain.from_iterable(map(arrays_of, results)))
    spans = sorted((array.ctypes.data, array.nbytes) for array in arrays if array.nbytes)
    assert all(start + size <= after for (start, size), (after, _) in itertools.pairwise(spans))


def test_without_copies_the_same_arrays_come_again():
    fresh, reused = make(3), make(3, copy=False)
    first, _ = reused.reset(seed=0)
    fresh.reset(seed=0)
    for actions in tape(fresh, 25):
        expected, got = fresh.step(actions), reused.step(actions)
        assert got[0] is first
        assert_same(got, expected)


# Seeds and options


def test_a_list_of_seeds_may_leave_some_to_go_on():
    envs, single = make(3), make_sync(3, AutoresetMode.NEXT_STEP)
    for seed in (40, [7, 8, 9], [None, 3, None], None, [2**64 - 1, None, 0], np.int64(5)):
        listed = [int(seed) + row for row in range(3)] if isinstance(seed, np.int64) else seed
        assert_same(envs.reset(seed=seed), single.reset(seed=listed))


def test_unseeded_vectors_differ_and_follow_np_random():
    snapshots = set()
    for envs in (make(2), make(2)):
        envs.reset()
        snapshots |= {envs.unwrapped.snapshot(row) for row in range(2)}
    assert len(snapshots) == 4
    states = []
    for _ in range(2):
        envs = make(2)
        envs.unwrapped.np_random = np.random.default_rng(3)
        envs.reset(seed=[None, 4])
        states.append(envs.unwrapped.snapshot())
    assert states[0] == states[1]


def test_a_seed_seeds_np_random_too():
    envs = make(2)
    envs.reset(seed=9)
    assert envs.unwrapped.np_random_seed == 9


def test_weeds_are_placed_in_all_environments_or_in_each():
    envs = make(3, AutoresetMode.DISABLED)
    single = [gym.make(ID, **SHORT).unwrapped for _ in range(3)]
    one, other = [[1.0, 2.0], [4.0, 3.0]], np.array([[2.0, 2.0]])
    cases = [
        (one, [one] * 3),
        (np.array(one), [one] * 3),
        ([], [[]] * 3),
        ([one, None, other], [one, None, other]),
        (np.array([one] * 3), [one] * 3),
        ([np.empty((0, 2)), other, one], [np.empty((0, 2)), other, one]),
        ([[], [], []], [[]] * 3),
        ([[], other, np.array([])], [[], other, []]),
    ]
    for seed, (given, by_row) in enumerate(cases):
        options = {"weeds": given}
        before = copy.deepcopy(options)
        observations, _ = envs.reset(seed=seed, options=options)
        assert options.keys() == before.keys()
        assert_same(options["weeds"], before["weeds"])
        for row, weeds in enumerate(by_row):
            expected, _ = single[row].reset(seed=seed + row, options={"weeds": weeds})
            assert_same(np.ascontiguousarray(observations[row]), expected)


def test_a_reset_mask_leaves_the_others_as_they_are():
    envs = make(4, AutoresetMode.DISABLED)
    envs.reset(seed=0)
    (actions,) = tape(envs, 1)
    observations, *_ = envs.step(actions)
    before = [envs.unwrapped.snapshot(row) for row in range(4)]
    mask = np.array([False, True, False, True])
    options = {"reset_mask": mask, "weeds": [[1.0, 1.0]]}
    again, infos = envs.reset(seed=50, options=options)
    assert set(options) == {"reset_mask", "weeds"}
    assert options["reset_mask"] is mask
    assert np.array_equal(mask, [False, True, False, True])
    for row in range(4):
        assert np.array_equal(again[row], observations[row]) is not bool(mask[row])
        assert (envs.unwrapped.snapshot(row) == before[row]) is not bool(mask[row])
    for key in ("_reward_terms", "_action_clipped"):
        assert np.array_equal(infos[key], mask)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_a_reset_mask_works_where_rows_begin_anew_by_themselves(mode):
    envs, single = make(3, mode), make_sync(3, mode)
    for vector in (envs, single):
        vector.reset(seed=0)
    for step, actions in enumerate(tape(envs, 60)):
        assert_same(envs.step(actions), single.step(actions))
        if step % 7 == 0:
            mask = np.array([True, step % 2 == 0, False])
            expected = single.reset(seed=[step, None, None], options={"reset_mask": mask.copy()})
            assert_same(envs.reset(seed=[step, None, None], options={"reset_mask": mask}), expected)


# State


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("move", ["pickle", "deepcopy", "restore", "rows"])
def test_a_copy_goes_on_as_the_original(mode, move):
    envs = make(3, mode, copy=False)
    steps = tape(envs, 60)
    play(envs, steps[:20], mode)
    if move == "pickle":
        twin = pickle.loads(pickle.dumps(envs))
    elif move == "deepcopy":
        twin = copy.deepcopy(envs)
    else:
        twin = make(3, mode)
        if move == "restore":
            twin.unwrapped.restore(envs.unwrapped.snapshot())
        else:
            for row in range(3):
                twin.unwrapped.restore(envs.unwrapped.snapshot(row), row)
    assert twin.metadata["autoreset_mode"] is mode
    for actions in steps[20:]:
        got, expected = copy.deepcopy(twin.step(actions)), envs.step(actions)
        assert_same(got, expected)
        ended = got[2] | got[3]
        if mode is AutoresetMode.DISABLED and ended.any():
            for vector in (twin, envs):
                vector.reset(options={"reset_mask": ended})
    assert twin.unwrapped.snapshot() == envs.unwrapped.snapshot()


def test_a_single_environment_and_a_row_exchange_snapshots():
    envs, single = make(3), gym.make(ID, **SHORT).unwrapped
    envs.reset(seed=0)
    steps = tape(envs, 8)
    for actions in steps[:4]:
        envs.step(actions)
    single.restore(envs.unwrapped.snapshot(row=1))
    for actions in steps[4:]:
        assert np.array_equal(envs.step(actions)[0][1], single.step(actions[1])[0])
    assert single.snapshot() == envs.unwrapped.snapshot(row=1)


def test_a_snapshot_that_does_not_fit_changes_nothing():
    envs = make(3).unwrapped
    envs.reset(seed=0)
    before = envs.snapshot()
    other = make(3, weeds={"count": 3}).unwrapped
    other.reset(seed=0)
    fewer = make(2).unwrapped
    fewer.reset(seed=0)
    half = bytearray(before)
    half[-20] ^= 1
    for damaged in (b"", before[:-1], before + b"x", bytes(half), other.snapshot(), fewer.snapshot()):
        with pytest.raises(swath.SnapshotError, match="`snapshot` must"):
            envs.restore(damaged)
        assert envs.snapshot() == before
    with pytest.raises(swath.SnapshotError):
        envs.restore(other.snapshot(0), row=1)
    assert envs.snapshot() == before
    with pytest.raises(swath.ConfigError, match="`row` must be from 0 to 2, got 3"):
        envs.snapshot(3)


# Wrappers of Gymnasium


@pytest.mark.parametrize("mode", MODES)
def test_episode_statistics_are_sums_over_the_steps_of_each_episode(mode):
    if mode is AutoresetMode.SAME_STEP and gym.__version__ < "1.3":
        pytest.skip("that Gymnasium drops a step of every later episode")
    envs = RecordEpisodeStatistics(make(3, mode))
    play(envs, tape(envs, 60), mode)
    returns, lengths = [], []
    summed, counted = np.zeros(3), np.zeros(3, int)
    for result in play(make(3, mode), tape(envs, 60), mode)[1:]:
        if len(result) == 2:
            continue
        _, rewards, terminated, truncated, _ = result
        summed += rewards
        counted += 1
        ended = terminated | truncated
        returns += summed[ended].tolist()
        lengths += counted[ended].tolist()
        summed[ended] = 0
        counted[ended] = -1 if mode is AutoresetMode.NEXT_STEP else 0
    assert len(returns) >= 3
    assert list(envs.return_queue) == pytest.approx(returns)
    assert list(envs.length_queue) == lengths


def test_normalised_observations_are_those_of_single_environments():
    envs, single = (NormalizeObservation(maker(3, AutoresetMode.NEXT_STEP)) for maker in (make, make_sync))
    assert_same(envs.reset(seed=0)[0], single.reset(seed=0)[0])
    for actions in tape(envs, 30):
        assert_same(envs.step(actions)[0], single.step(actions)[0])


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_infos_can_be_taken_apart_again(mode):
    envs, single = (DictInfoToList(maker(3, mode)) for maker in (make, make_sync))
    envs.reset(seed=0)
    single.reset(seed=0)
    for actions in tape(envs, 40):
        assert_same(envs.step(actions)[-1], single.step(actions)[-1])


# Mistakes


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"num_envs": 0}, "`num_envs` must be a whole number from 1 to 1000000, got 0"),
        ({"num_envs": 2.5}, "`num_envs` must be a whole number from 1 to 1000000, got 2.5"),
        ({"num_envs": True}, "`num_envs` must be a whole number"),
        ({"num_threads": 0}, "`num_threads` must be a whole number from 1 to 1024, got 0"),
        ({"num_threads": "all"}, "`num_threads` must be a whole number from 1 to 1024, got 'all'"),
        ({"autoreset_mode": "Sometimes"}, "`autoreset_mode` must be an AutoresetMode or one of `NextStep`, `SameStep`"),
        ({"autoreset_mode": None}, "`autoreset_mode` must be"),
        ({"render_mode": "human"}, "`render_mode` must be None or `rgb_array`, got 'human'"),
        ({"weeds": {"cuont": 3}}, "cuont"),
    ],
)
def test_a_vector_that_cannot_be_is_refused_by_name(keywords, message):
    with pytest.raises(swath.ConfigError, match=re.escape(message)):
        gym.make_vec(ID, **{"num_envs": 1, **keywords})


def test_the_action_of_a_row_that_only_begins_anew_is_ignored():
    envs, single = make(4), make_sync(4, AutoresetMode.NEXT_STEP)
    envs.reset(seed=2)
    single.reset(seed=2)
    ended = np.zeros(4, bool)
    ignored = 0
    for actions in tape(envs, 60):
        actions[ended] = np.nan
        ignored += ended.sum()
        got, expected = envs.step(actions), single.step(actions)
        assert_same(got, expected)
        ended = got[2] | got[3]
    assert ignored >= 4


def test_a_reset_that_cannot_be_written_begins_nothing():
    envs = make(2, copy=False)
    observation, _ = envs.reset(seed=1)
    before = envs.snapshot()
    observation.flags.writeable = False
    with pytest.raises(TypeError):
        envs.reset(seed=5)
    observation.flags.writeable = True
    assert envs.snapshot() == before


@pytest.mark.parametrize(
    ("kind", "actions", "message"),
    [
        ("steer", np.zeros(4, np.float32), "`actions` must have the shape (4, 1), got (4,)"),
        ("steer", np.zeros((3, 1), np.float32), "`actions` must have the shape (4, 1), got (3, 1)"),
        ("drive", np.zeros((4, 1)), "`actions` must have the shape (4, 2), got (4, 1)"),
        ("steer", [["a"]] * 4, "`actions` must be numbers of the shape (4, 1), got `list`"),
        ("steer", None, "`actions` must be numbers of the shape (4, 1), got `NoneType`"),
        ("steer", np.array([["0.1"]] * 4), "`actions` must be numbers of the shape (4, 1), got an array of <U3"),
        (
            "steer",
            np.zeros((4, 1), complex),
            "`actions` must be numbers of the shape (4, 1), got an array of complex128",
        ),
        ("steer", np.zeros((4, 1), bool), "`actions` must be numbers of the shape (4, 1), got an array of bool"),
        ("steer", [[0.0], [0.0], [0.0], [math.nan]], "row 3: `action[0]` must be finite, got NaN"),
        ("drive", np.array([[0, 0], [0, np.inf], [0, 0], [0, 0]]), "row 1: `action[1]` must be finite, got inf"),
        ("discrete", np.zeros((4, 1), int), "`actions` must have the shape (4,), got (4, 1)"),
        ("discrete", np.zeros(4), "`actions` must be whole numbers from 0 to 4, got an array of float64"),
        ("discrete", [0, 5, 0, -1], "row 1: `action` must be from 0 to 4, got 5"),
        ("discrete", None, "`actions` must be whole numbers from 0 to 4"),
    ],
)
@pytest.mark.parametrize("mode", MODES)
def test_bad_actions_are_refused_before_anything_moves(kind, actions, message, mode):
    envs = make(4, mode, kind)
    envs.reset(seed=0)
    before = envs.unwrapped.snapshot()
    with pytest.raises(swath.ActionError, match=re.escape(message)):
        envs.step(actions)
    assert envs.unwrapped.snapshot() == before


def test_actions_may_be_any_numbers_of_the_right_shape():
    envs, twin = make(3), make(3)
    envs.reset(seed=0)
    twin.reset(seed=0)
    for actions in tape(envs, 10):
        expected = twin.step(actions)
        wide = np.zeros((3, 2), np.float32)
        wide[:, :1] = actions
        form = [actions.astype(np.float64), actions.tolist(), wide[:, :1], np.asfortranarray(actions)]
        for other in form:
            clone = copy.deepcopy(envs)
            assert_same(clone.step(other), expected)
        envs.step(actions)


@pytest.mark.parametrize("mode", MODES)
def test_a_step_before_the_first_reset_is_refused(mode):
    envs = make(2, mode)
    with pytest.raises(swath.ActionError, match="row 0: `reset` must come before the first step"):
        envs.step(np.zeros((2, 1), np.float32))


def test_a_step_of_an_ended_row_is_refused_where_nothing_begins_by_itself():
    envs = make(3, AutoresetMode.DISABLED)
    envs.reset(seed=0)
    for actions in tape(envs, 60):
        *_, terminated, truncated, _ = envs.step(actions)
        if (terminated | truncated).any():
            break
    row = int(np.flatnonzero(terminated | truncated)[0])
    before = envs.unwrapped.snapshot()
    with pytest.raises(swath.ActionError, match=f"row {row}: `reset` must come before the next step"):
        envs.step(actions)
    assert envs.unwrapped.snapshot() == before
    envs.reset(options={"reset_mask": terminated | truncated})
    envs.step(actions)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"seed": -1}, "`seed` must be a whole number from 0 to"),
        ({"seed": 2**64 - 1}, "`seed` must be a whole number from 0 to"),
        ({"seed": [1, 2]}, "`seed` must be one seed for each of 3 environments, got 2"),
        ({"seed": [1, "two", 3]}, "`seed` must be a whole number from 0 to"),
        ({"seed": "one"}, "`seed` must be a whole number, a list of 3 of them, or None, got 'one'"),
        ({"options": {"weed": []}}, "`options` must hold nothing but `weeds` and `reset_mask`, got `weed`"),
        ({"options": {"weeds": [[1.0, 99.0]]}}, "`weeds[0]` must be on the pasture"),
        ({"options": {"weeds": [None, [[1.0, 1.0], [1.0, 99.0]], None]}}, "`weeds[1][1]` must be on the pasture"),
        ({"options": {"weeds": [[], []]}}, "one for each of 3 environments, got 2"),
        ({"options": {"weeds": [None, None]}}, "one for each of 3 environments, got 2"),
        ({"options": {"weeds": np.zeros((2, 4, 2))}}, "one for each of 3 environments, got 2"),
        ({"options": {"reset_mask": [True, True, False]}}, '`options["reset_mask"]` must be a bool array'),
        ({"options": {"reset_mask": np.ones(3)}}, "with a True, got float64 of the shape (3,)"),
        ({"options": {"reset_mask": np.ones(2, bool)}}, "with a True, got bool of the shape (2,)"),
        ({"options": {"reset_mask": np.zeros(3, bool)}}, "with a True, got no True"),
    ],
)
def test_a_reset_that_cannot_be_changes_nothing(keywords, message):
    envs = make(3)
    envs.reset(seed=0)
    before, state = envs.unwrapped.snapshot(), envs.unwrapped.np_random.bit_generator.state
    with pytest.raises(swath.ConfigError, match=re.escape(message)):
        envs.reset(**keywords)
    assert envs.unwrapped.snapshot() == before
    assert envs.unwrapped.np_random.bit_generator.state == state


def test_a_first_reset_begins_every_environment():
    envs = make(2)
    with pytest.raises(
        swath.ConfigError, match=re.escape('`options["reset_mask"]` must be True for every environment')
    ):
        envs.reset(seed=0, options={"reset_mask": np.array([True, False])})
    with pytest.raises(swath.ActionError):
        envs.step(np.zeros((2, 1), np.float32))


def test_closing_twice_is_fine_and_nothing_works_after_it():
    envs = make(2)
    envs.reset(seed=0)
    envs.close()
    envs.close()
    assert envs.closed
    for call in (envs.reset, envs.unwrapped.snapshot, lambda: envs.step(np.zeros((2, 1), np.float32))):
        with pytest.raises(swath.ClosedError, match="`close`"):
            call()
    assert issubclass(swath.ClosedError, gym.error.ClosedEnvironmentError)
