"""What stable-baselines3 may rely on: the native `VecEnv` is its environments in a `DummyVecEnv`, bit for bit."""

import copy
import importlib.util
import os
import pickle
import re
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

import swath

if importlib.util.find_spec("stable_baselines3") is None and not os.environ.get("CI"):
    pytest.skip("stable-baselines3 is not installed", allow_module_level=True)

import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.env_util import make_vec_env as sb3_make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecNormalize

ID = "swath/MowerRouting-v0"
KINDS = ["steer", "drive", "discrete", "target"]
# Episodes of some ten steps, which end in different ways.
SHORT = {"scenario": "cowbot-field", "episode": {"budget": 0.015}, "pasture": {"headland_m": 2.0}}
LAST_KEYS = {"TimeLimit.truncated", "terminal_observation", "episode", "reward_terms", "action_clipped"} | set(
    swath.Summary.__annotations__
)


def make(num_envs, kind="steer", **keywords):
    return swath.sb3.make_vec_env(ID, num_envs, action={"kind": kind}, **{**SHORT, **keywords})


def make_dummy(num_envs, kind="steer", **keywords):
    keywords = {**SHORT, "action": {"kind": kind}, **keywords}
    return DummyVecEnv([lambda: Monitor(gym.make(ID, **keywords))] * num_envs)


def tape(env, steps, seed=0):
    rng = np.random.default_rng(seed)
    if isinstance(env.action_space, gym.spaces.Discrete):
        return rng.integers(env.action_space.n, size=(steps, env.num_envs))
    return rng.uniform(-1.2, 1.2, (steps, env.num_envs, *env.action_space.shape)).astype(np.float32)


def assert_same_arrays(got, expected):
    for one, other in zip(got, expected, strict=True):
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        assert one.tobytes() == other.tobytes()


# The vector is its environments


@pytest.mark.parametrize("num_envs", [1, 3, 64])
@pytest.mark.parametrize("kind", KINDS)
def test_the_vector_shows_what_a_vector_of_monitored_environments_shows(num_envs, kind):
    env, dummy = make(num_envs, kind), make_dummy(num_envs, kind)
    ends = 0
    for vector in (env, dummy):
        vector.seed(11)
    assert_same_arrays([env.reset()], [dummy.reset()])
    np.testing.assert_equal(env.reset_infos, dummy.reset_infos)
    for actions in tape(env, 60):
        got, expected = env.step(actions), dummy.step(actions)
        assert_same_arrays(got[:3], expected[:3])
        np.testing.assert_equal(env.reset_infos, dummy.reset_infos)
        for is_done, info, all_of_it in zip(got[2], got[3], expected[3], strict=True):
            last_keys = LAST_KEYS | ({"elapsed_m", "action_mask"} if kind == "target" else set())
            assert set(info) == (last_keys if is_done else {"TimeLimit.truncated"})
            for key in set(info) - {"terminal_observation", "episode"}:
                assert np.array_equal(info[key], all_of_it[key])
                assert type(info[key]) is type(all_of_it[key])
            if is_done:
                ends += 1
                assert_same_arrays([info["terminal_observation"]], [all_of_it["terminal_observation"]])
                assert info["episode"]["r"] == pytest.approx(all_of_it["episode"]["r"], abs=1e-6)
                assert info["episode"]["l"] == all_of_it["episode"]["l"]
                assert info["episode"]["t"] >= 0.0
    assert ends >= num_envs


@pytest.mark.parametrize("num_envs", [3, 300])
def test_the_number_of_threads_changes_nothing(num_envs):
    shown = []
    for num_threads in (1, 2, 4):
        env = make(num_envs, num_threads=num_threads, seed=3)
        shown.append([env.reset(), *(array for actions in tape(env, 30) for array in env.step(actions)[:3])])
        assert_same_arrays(shown[-1], shown[0])


def test_whatever_is_returned_stays_as_it_is():
    env = make(2, seed=0)
    env.reset()
    steps = tape(env, 30)
    kept = [env.step(actions) for actions in steps[:15]]
    before = copy.deepcopy(kept)
    for actions in steps[15:]:
        env.step(actions)
    for got, expected in zip(kept, before, strict=True):
        assert_same_arrays(got[:3], expected[:3])
        assert str(got[3]) == str(expected[3])
    infos = [id(info) for step in kept for info in step[3]]
    assert len(set(infos)) == len(infos)


def test_what_is_done_to_an_info_never_shows_in_a_later_one():
    env, untouched = make(3, seed=0), make(3, seed=0)
    for vector in (env, untouched):
        vector.reset()
    changes = [
        lambda infos: infos[0].update(mine=1),
        lambda infos: infos[1].clear(),
        lambda infos: infos[2].update({"TimeLimit.truncated": True}),
        lambda infos: infos.pop(),
        lambda infos: infos.reverse(),
        lambda infos: infos.__setitem__(0, infos[1]),
        lambda infos: infos.__setitem__(0, None),
    ]
    for at, actions in enumerate(tape(env, 60)):
        infos, expected = env.step(actions)[3], untouched.step(actions)[3]
        for got, info in zip(infos, expected, strict=True):
            assert got.keys() == info.keys()
            assert got["TimeLimit.truncated"] is info["TimeLimit.truncated"]
        assert len({id(info) for info in infos}) == 3
        changes[at % len(changes)](infos)


# Learners


def learner(algorithm, env):
    keywords = {"seed": 7, "device": "cpu", "policy_kwargs": {"net_arch": [16]}}
    if algorithm is PPO:
        return PPO("MlpPolicy", env, n_steps=64, batch_size=64, n_epochs=2, **keywords)
    return SAC("MlpPolicy", env, learning_starts=64, batch_size=32, buffer_size=2000, **keywords)


@pytest.mark.parametrize(
    ("algorithm", "names"),
    [
        (PPO, ["observations", "actions", "rewards", "advantages", "returns", "episode_starts", "values", "log_probs"]),
        (SAC, ["observations", "next_observations", "actions", "rewards", "dones", "timeouts"]),
    ],
)
def test_learners_meet_the_same_rollouts_as_in_a_vector_of_single_environments(algorithm, names):
    torch.set_num_threads(1)
    models = [learner(algorithm, env).learn(512) for env in (make(4), make_dummy(4))]
    buffers = [model.rollout_buffer if algorithm is PPO else model.replay_buffer for model in models]
    for name in names:
        got, expected = (getattr(buffer, name) for buffer in buffers)
        assert got.tobytes() == expected.tobytes(), name
    got, expected = ([info["l"] for info in model.ep_info_buffer] for model in models)
    assert got == expected
    assert len(got) > 10
    got, expected = ([info["r"] for info in model.ep_info_buffer] for model in models)
    assert got == pytest.approx(expected, abs=1e-6)


def test_a_truncated_episode_is_bootstrapped():
    """A budget of two steps truncates every episode; the buffer's reward then holds the discounted value of the end."""
    env = make(2, episode={"budget": 0.002, "control_period_s": 1.0}, seed=0)
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=32, seed=0, device="cpu", gamma=0.9)
    seen, step_wait = [], env.step_wait

    def watched():
        result = step_wait()
        # A copy: the learner adds to the rewards.
        seen.append(copy.deepcopy(result))
        return result

    env.step_wait = watched
    first_policy = copy.deepcopy(model.policy)
    model.learn(32)
    buffer = model.rollout_buffer
    ends = 0
    for step, (_, rewards, dones, infos) in enumerate(seen):
        for row in range(2):
            expected = rewards[row]
            if dones[row]:
                assert infos[row]["TimeLimit.truncated"] is True
                end = torch.as_tensor(infos[row]["terminal_observation"][None])
                expected += 0.9 * first_policy.predict_values(end).item()
                ends += 1
            assert buffer.rewards[step, row] == pytest.approx(expected, abs=1e-5)
    assert ends >= 8


def test_vec_normalize_normalises_as_over_single_environments():
    env, dummy = (VecNormalize(maker(3)) for maker in (make, make_dummy))
    for vector in (env, dummy):
        vector.seed(5)
    assert_same_arrays([env.reset()], [dummy.reset()])
    ends = 0
    for actions in tape(env, 30):
        got, expected = env.step(actions), dummy.step(actions)
        assert_same_arrays(got[:3], expected[:3])
        for row in np.flatnonzero(got[2]):
            ends += 1
            ends_of = [result[3][row]["terminal_observation"] for result in (got, expected)]
            assert_same_arrays(ends_of[:1], ends_of[1:])
    assert ends >= 3


def test_an_evaluation_needs_no_monitor():
    env = make(3, seed=0)
    model = PPO("MlpPolicy", env, device="cpu")
    returns, lengths = evaluate_policy(model, env, n_eval_episodes=6, return_episode_rewards=True)
    assert len(returns) == len(lengths) == 6
    assert env.env_is_wrapped(Monitor) == [True] * 3
    assert env.env_is_wrapped(gym.Wrapper) == [False] * 3


# Seeds and options


def test_seeds_are_used_once_and_told():
    env, single = make(2), gym.make(ID, **SHORT)
    assert env.seed(40) == [40, 41]
    first = env.reset()
    assert np.array_equal(first[1], single.reset(seed=41)[0])
    assert np.array_equal(env.reset()[1], single.reset()[0])
    assert np.array_equal(make(2, seed=40).reset(), first)
    assert len(set(env.seed())) == 2


def test_environments_without_a_seed_differ():
    snapshots = set()
    for env in (make(2), make(2)):
        env.reset()
        snapshots |= set(env.env_method("snapshot"))
    assert len(snapshots) == 4


def test_options_are_used_once_and_never_modified():
    env, single = make(2), gym.make(ID, **SHORT)
    options = {"weeds": np.array([[1.0, 1.0]])}
    env.set_options(options)
    env.seed(3)
    assert np.array_equal(env.reset()[1], single.reset(seed=4, options=options)[0])
    assert np.array_equal(env.reset()[1], single.reset()[0])
    assert list(options) == ["weeds"]
    env.set_options([{}, options])
    env.seed(3)
    observations = env.reset()
    assert np.array_equal(observations[0], single.reset(seed=3)[0])
    assert np.array_equal(observations[1], single.reset(seed=4, options=options)[0])


REFUSED_OPTIONS = [
    ({"weed": []}, "`options` must hold nothing but `weeds`, got `weed`"),
    ({"reset_mask": []}, "`options` must hold nothing but `weeds`, got `reset_mask`"),
    ([{}, {"weed": []}], "`options` must hold nothing but `weeds`, got `weed`"),
    ([{}], "`options` must be one for each of 2 environments, got 1"),
    ([{}, "weeds"], "`options` must be a dictionary or a list of them, got `str`"),
    ("weeds", "`options` must be a dictionary or a list of them, got `str`"),
    (5, "`options` must be a dictionary or a list of them, got `int`"),
]


@pytest.mark.parametrize(("options", "message"), REFUSED_OPTIONS)
def test_options_that_cannot_be_are_refused_where_they_are_set_and_spoil_no_reset(options, message):
    env, twin = make(2, seed=3), make(2, seed=3)
    with pytest.raises(swath.ConfigError) as error:
        env.set_options(options)
    assert str(error.value) == message
    assert np.array_equal(env.reset(), twin.reset())


@pytest.mark.parametrize(
    ("weeds", "message"),
    [
        ([[1.0, 99.0]], "`weeds[0][0]` must be on the pasture, 0..=36 by 0..=26 m, got [1, 99]"),
        ("weeds", "`weeds[0]` must be an array (n, 2) of numbers, metres, got `str`"),
    ],
)
def test_weeds_that_cannot_be_placed_spoil_one_reset_and_no_other(weeds, message):
    env, twin = make(2, seed=3), make(2, seed=3)
    env.set_options({"weeds": weeds})
    with pytest.raises(swath.ConfigError) as error:
        env.reset()
    assert str(error.value) == message
    assert np.array_equal(env.reset(), twin.reset())
    env.set_options([{}, {"weeds": weeds}])
    with pytest.raises(swath.ConfigError):
        env.reset()
    assert np.array_equal(env.reset(), twin.reset())


# Attributes and methods


def test_attributes_belong_to_environments():
    env = make(3)
    assert env.render_mode is None
    assert env.get_attr("render_mode") == [None] * 3
    assert [spec.id for spec in env.get_attr("spec")] == [ID] * 3
    assert env.get_attr("action_space", indices=[0, 2]) == [env.action_space] * 2
    assert env.get_attr("scenario", indices=1)[0].to_dict()["action"]["kind"] == "steer"
    assert env.get_attr("unwrapped")[0].observation_names == gym.make(ID, **SHORT).unwrapped.observation_names
    assert not env.has_attr("stage")
    env.set_attr("stage", 2, indices=[0, 1])
    env.set_attr("stage", 5, indices=2)
    assert env.get_attr("stage") == [2, 2, 5]
    with pytest.raises(AttributeError):
        env.get_attr("no_such_thing")
    with pytest.raises(AttributeError):
        env.env_method("no_such_thing")


def test_the_spec_makes_the_same_environment_again():
    keywords = {"scenario": "cowbot-field", "weeds": {"count": 7}}
    env = swath.sb3.make_vec_env(ID, 2, **keywords)
    for spec in [*env.get_attr("spec"), env.spec]:
        assert spec.kwargs == keywords
        assert gym.make(spec).unwrapped.scenario == env.get_attr("scenario")[0]
    assert swath.sb3.make_vec_env(ID).spec == gym.spec(ID)


def test_action_kinds_without_masks_say_so():
    env = make(2)
    assert not env.has_attr("action_masks")
    with pytest.raises(AttributeError):
        env.env_method("action_masks")


def test_masked_actions_reach_the_learner():
    env, single = make(3, "target", seed=5), gym.make(ID, **SHORT, action={"kind": "target"}).unwrapped
    env.reset()
    single.reset(seed=6)
    assert env.has_attr("action_masks")
    for _ in range(10):
        masks = env.env_method("action_masks")
        assert np.array_equal(masks[1], single.action_masks())
        actions = np.array([np.flatnonzero(mask)[-1] for mask in masks])
        _, _, dones, _ = env.step(actions)
        _, _, terminated, truncated, _ = single.step(actions[1])
        if terminated or truncated:
            single.reset()
        assert dones[1] == (terminated or truncated)


def test_maskable_ppo_never_chooses_what_is_masked():
    env = make(4, "target", observation={"kind": "candidates"}, seed=0)
    chosen = []

    def watch(local, _):
        chosen.extend(zip(local["actions"], local["action_masks"], strict=True))
        return True

    from sb3_contrib import MaskablePPO

    MaskablePPO("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0).learn(256, callback=watch)
    assert len(chosen) == 256
    assert all(mask[action] for action, mask in chosen)


def test_an_environment_can_be_put_back():
    env, single = make(2, seed=0), gym.make(ID, **SHORT).unwrapped
    env.reset()
    steps = tape(env, 6)
    for actions in steps[:3]:
        env.step(actions)
    (snapshot,) = env.env_method("snapshot", indices=1)
    single.restore(snapshot)
    shown = [env.step(actions)[0][1] for actions in steps[3:]]
    assert_same_arrays(shown, [single.step(actions[1])[0] for actions in steps[3:]])
    env.env_method("restore", snapshot, indices=1)
    assert_same_arrays(shown, [env.step(actions)[0][1] for actions in steps[3:]])


def test_there_are_no_images_without_a_render_mode():
    env = make(2)
    with pytest.warns(UserWarning, match="render mode"):
        assert env.get_images() == [None, None]


@pytest.mark.parametrize("move", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_as_the_original(move):
    env = make(3, seed=0)
    env.reset()
    steps = tape(env, 40)
    for actions in steps[:9]:
        env.step(actions)
    twin = move(env)
    for actions in steps[9:]:
        got, expected = twin.step(actions), env.step(actions)
        assert_same_arrays(got[:3], expected[:3])
        for one, other in zip(got[3], expected[3], strict=True):
            assert ("episode" in one) == ("episode" in other)
            if "episode" in one:
                assert (one["episode"]["r"], one["episode"]["l"]) == (other["episode"]["r"], other["episode"]["l"])


# Mistakes


@pytest.mark.parametrize("seed", ["a", 1.0, -1, (1 << 64) - 2])
def test_a_seed_that_cannot_be_is_refused_where_it_is_given(seed):
    message = f"^`seed` must be a whole number from 0 to {(1 << 64) - 3}, got {re.escape(repr(seed))}$"
    with pytest.raises(swath.ConfigError, match=message):
        make(3, seed=seed)
    env = make(3, seed=5)
    with pytest.raises(swath.ConfigError, match=message):
        env.seed(seed)
    assert np.array_equal(env.reset(), make(3, seed=5).reset())
    assert env.seed(np.int64(7)) == [7, 8, 9]


@pytest.mark.parametrize(
    ("keyword", "meant"),
    [({"n_envs": 4}, "`num_envs`"), ({"env_kwargs": {}}, "its entries as keywords, such as `weeds={...}`")],
)
def test_the_keywords_of_stable_baselines3_are_answered_with_those_that_are_meant(keyword, meant):
    with pytest.raises(swath.ConfigError) as error:
        swath.sb3.make_vec_env(ID, **keyword)
    assert str(error.value) == f"`{next(iter(keyword))}` is not a known key; did you mean {meant}?"


def test_mistakes_are_refused_by_name():
    with pytest.raises(swath.ConfigError, match=f"`env_id` must be one of {ID}, got 'swath/Mower-v0'"):
        swath.sb3.make_vec_env("swath/Mower-v0")
    with pytest.raises(swath.ConfigError, match="`num_envs` must be a whole number from 1"):
        make(0)
    env = make(3, seed=0)
    actions = np.zeros((3, 1), np.float32)
    with pytest.raises(swath.ActionError, match="row 0: `reset` must come before the first step"):
        env.step(actions)
    env.reset()
    actions[2] = np.nan
    with pytest.raises(swath.ActionError, match=re.escape("row 2: `action[0]` must be finite, got NaN")):
        env.step(actions)
    env.close()
    env.close()
    for call in (env.reset, lambda: env.step(np.zeros((3, 1), np.float32))):
        with pytest.raises(swath.ClosedError, match="`close`"):
            call()


def test_importing_swath_imports_no_learner():
    code = "import sys, swath; swath.sb3; sys.exit('torch' in sys.modules or 'stable_baselines3' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("package", ["stable_baselines3", "torch"])
def test_whichever_package_is_missing_the_extra_is_named(package, monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == package else found(name))
    with pytest.raises(ModuleNotFoundError, match=re.escape(f"needs {package}: pip install 'swath[train]'")):
        make(1)


@pytest.mark.filterwarnings("ignore:.*render_mode")  # Gymnasium's word on what is asked for first
def test_stable_baselines3_makes_the_environment_by_its_id():
    model = PPO("MlpPolicy", ID, n_steps=16, batch_size=16, n_epochs=1, device="cpu")
    assert model.learn(16).num_timesteps == 16


@pytest.mark.filterwarnings("ignore:.*render_mode")  # Gymnasium's word on what is asked for first
@pytest.mark.parametrize("vec_env_class", [DummyVecEnv, SubprocVecEnv])
def test_the_vector_helper_of_stable_baselines3_makes_the_environment_by_its_id(vec_env_class):
    # Named with its module, the id is known in other processes too.
    env = sb3_make_vec_env(f"swath:{ID}", n_envs=2, seed=3, vec_env_cls=vec_env_class)
    first = env.reset()
    env.close()
    expected = [gym.make(ID).reset(seed=3 + row)[0] for row in range(2)]
    assert np.array_equal(first, expected)


def test_a_step_that_nobody_asked_for_is_refused():
    vec = swath.sb3.make_vec_env("swath/MowerRouting-v0", num_envs=2)
    vec.reset()
    actions = np.zeros((2, 1), np.float32)
    vec.step(actions)
    with pytest.raises(swath.ActionError, match=r"^`step_wait` must follow `step_async`"):
        vec.step_wait()
    vec.step_async(actions)
    vec.step_wait()
