"""What is timed is what it says: the same laps everywhere, on the pasture, every step counted once."""

import json
import sys
import time
from importlib import import_module

import gymnasium as gym
import numpy as np
import pytest
from benchmarks.throughput.case import cases
from benchmarks.throughput.figures import Figures, short
from benchmarks.throughput.numpy_env import NumpyMowerRoutingVectorEnv
from benchmarks.throughput.page import text as page
from benchmarks.throughput.sides.swath_faces import nearest_choices
from benchmarks.throughput.sides.worker import live_steps

import swath
from swath.cli import main
from swath.registration import ENV_ID
from swath.throughput import Run, drive, record, replay_env, replay_vec, share_inside

WEEDS = {"weeds": {"count": 60}}


@pytest.fixture(scope="module")
def tape():
    return record(WEEDS, pastures=3, steps=400)


def driven(replay):
    """Rewards of a lap, step by step."""
    reset, step, lap = replay
    reset()
    return np.array([step(action)[1] for action in lap])


def test_a_batch_and_a_single_environment_repeat_the_recorded_lap(tape):
    assert tape.actions.shape == (400, 3, 1)
    single = driven(replay_env(gym.make(ENV_ID, **WEEDS), tape))
    np.testing.assert_array_equal(single, tape.rewards[:, 0])
    batch = driven(replay_vec(gym.make_vec(ENV_ID, num_envs=5, **WEEDS), tape))
    np.testing.assert_array_equal(batch, tape.rewards[:, [0, 1, 2, 0, 1]])


def test_the_numpy_environment_sees_and_mows_what_swath_does(tape):
    scenario = swath.Scenario(None, **WEEDS)
    weeds_m = np.array([swath.run_episode("bcp", scenario=scenario, seed=seed).weeds_m for seed in tape.seeds])
    vec = NumpyMowerRoutingVectorEnv(3, weeds=60)
    envs = [gym.make(ENV_ID, **WEEDS) for _ in tape.seeds]
    observations = [vec.reset(options={"weeds": weeds_m})[0]]
    expected = [[env.reset(seed=seed)[0] for env, seed in zip(envs, tape.seeds, strict=True)]]
    for actions, rewards in zip(tape.actions, tape.rewards, strict=True):
        observation, reward, *_ = vec.step(actions)
        np.testing.assert_allclose(reward, rewards, atol=1e-12)
        observations.append(observation)
        expected.append([env.step(action)[0] for env, action in zip(envs, actions, strict=True)])
    assert tape.rewards.max() > 0
    # All but the share of seen ground and the rays.
    kept = [0, 1, 2, 3, 4, 6, *range(7, 31)]
    np.testing.assert_allclose(np.array(observations), np.array(expected)[..., kept], atol=1e-6)


def test_the_numpy_environment_begins_anew_after_the_budget():
    vec = NumpyMowerRoutingVectorEnv(2, weeds=5)
    vec.reset(seed=0)
    circle = np.ones((2, 1), np.float32)
    ends = [vec.step(circle)[3] for _ in range(4459)]
    assert [end.any() for end in ends].index(True) == 4458, "2229.236 m in steps of 0.5 m"
    observation, reward, terminated, truncated, _ = vec.step(circle)
    np.testing.assert_array_equal(reward, 0.0)
    assert not (terminated | truncated).any()
    np.testing.assert_array_equal(observation[:, 4], 1.0)


def test_straight_ahead_from_the_corner_the_second_half_of_200_m_lies_outside():
    scenario = swath.Scenario(None).to_dict()
    assert share_inside(np.zeros((400, 2)), scenario) == 0.5
    # A full circle to the right from (0, 1) with a radius of 2 m leaves the pasture at the bottom.
    assert share_inside(-np.ones((25, 1)), scenario) < 0.5


def test_the_snake_of_the_default_density_keeps_to_the_pasture():
    assert record({}, pastures=2, steps=300).share_inside > 0.9


@pytest.mark.parametrize(("lap", "num_envs"), [(1, 1), (50, 4), (120, 7)])
def test_every_step_of_every_environment_counts_once(lap, num_envs):
    taken = []
    run = drive((lambda: taken.append("reset"), taken.append, range(lap)), num_envs, enough_s=0.0)
    assert taken == ["reset", *range(lap)]
    assert run.steps == lap * num_envs


def test_a_lap_is_broken_off_when_its_time_is_up():
    taken = []
    run = drive((list, taken.append, range(1000)), enough_s=1e9, most_s=0.0)
    assert run.steps == len(taken) == 50


def test_a_lap_that_is_broken_off_bears_its_share_of_its_reset(monkeypatch):
    clock_s = [0.0]

    def takes(duration_s):
        clock_s[0] += duration_s

    monkeypatch.setattr(time, "process_time", lambda: clock_s[0])
    # A reset of 1 s and 1000 steps of 1 ms: 4.25 s are two laps of 2 s and a quarter.
    run = drive((lambda: takes(1.0), lambda _: takes(0.001), range(1000)), enough_s=4.9, most_s=5.22)
    assert run.steps == 2250
    assert run.cpu_s == pytest.approx(2 * 2.0 + 0.25 * 2.0)


def test_steps_that_only_reset_are_not_counted():
    flags = [np.array([True, False]), np.array([False, True]), np.array([True, True])]
    steps = iter(flags)

    def step(_):
        return None, None, next(steps), np.zeros(2, bool), {}

    # The ends of the last step have no reset behind them yet.
    assert live_steps(step, range(3), 2, enough_s=0.0).steps == 3 * 2 - 2


def test_rounded_to_five_curvatures_the_heading_stays_within_half_a_choice():
    steer = np.random.default_rng(3).uniform(-1, 1, (500, 4)).astype(np.float32)
    choices = nearest_choices(steer)
    assert set(np.unique(choices)) <= set(range(5))
    turned = np.cumsum(0.5 * choices - 1.0 - steer, axis=0)
    assert np.abs(turned).max() <= 0.25 + 1e-4


def test_the_page_says_what_is_met_what_is_missed_and_what_was_not_compared():
    wanted = cases()
    figures = Figures(missing={case: "no such thing" for case in wanted if case.side == "envpool"}, loads=[0.5])
    figures.runs = {case: [Run(3000, 0.01, 0.02)] for case in wanted if case.side != "envpool"}
    text = page(figures, "make bench", None)
    assert "| one environment, unwrapped: steps | 300 k | 300 k | met |" in text
    assert "| batch of 1024, `features`, `steer`, 160 weeds: steps | 2.00 M | 300 k | **missed** |" in text
    assert "| batch of 64: steps, EnvPool's CartPole | - | 300 k | not compared |" in text
    assert "- side envpool, face envpool, num_envs 64: no such thing" in text


def test_a_rollout_is_compared_with_an_environment_of_its_spaces_that_does_nothing():
    rates = {"null": 200_000, "swath.sb3": 150_000, "null of CartPole": 100_000, "CartPole": 60_000}
    figures = Figures(missing={}, loads=[0.5])
    figures.runs = {case: [Run(rates[case.face], 1.0, 1.0)] for case in cases() if case.side == "rollout"}
    text = page(figures, "make bench", None)
    assert "| 150 k (150 k to 150 k) | 200 k (200 k to 200 k) | 75.0 | 1.67 |" in text
    assert "| 60.0 k (60.0 k to 60.0 k) | 100 k (100 k to 100 k) | 60.0 | 6.67 |" in text
    assert "| SB3 rollout of 64, % of an environment that does nothing | 90 | 75 | **missed** |" in text


@pytest.mark.parametrize(
    ("face", "numbers"), [("null", 39), ("swath.sb3", 39), ("null of CartPole", 4), ("CartPole", 4)]
)
def test_the_environments_of_the_rollouts_have_the_spaces_that_they_are_compared_by(face, numbers):
    pytest.importorskip("stable_baselines3")
    vec = import_module("benchmarks.throughput.sides.sb3_rollout").vec_of({"face": face, "num_envs": 3, "weeds": 40})
    assert vec.reset().shape == (3, numbers)
    observations, rewards, dones, infos = vec.step(np.array([vec.action_space.sample() for _ in range(3)]))
    assert observations.shape == (3, numbers)
    assert (rewards.shape, dones.shape, len(infos)) == ((3,), (3,), 3)
    vec.close()


@pytest.mark.parametrize(("rate", "text"), [(999, "999"), (1234, "1.23 k"), (45_600, "45.6 k"), (2e6, "2.00 M")])
def test_a_rate_has_three_digits(rate, text):
    assert short(rate) == text


def test_swath_bench_prints_a_table_or_json(monkeypatch, capsys):
    # The package has a function of that name, which hides the module.
    module = sys.modules["swath.cli.bench"]
    monkeypatch.setattr(module, "ENOUGH_S", 0.0)
    monkeypatch.setattr(module, "MOST_S", 0.0)
    assert main(["bench", "--num-envs", "2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [(row["through"], row["num_envs"]) for row in told["results"]] == [
        ("unwrapped", 1),
        ("gym.make", 1),
        ("make_vec", 2),
    ]
    assert [run["steps"] for run in told["results"][2]["runs"]] == [100] * 5
    assert main(["bench", "--num-envs", "2"]) == 0
    assert "make_vec" in capsys.readouterr().out


@pytest.mark.parametrize("sizes", ["0", "8,8", "-1", "a", "1,"])
def test_swath_bench_refuses_sizes_that_are_none(sizes, capsys):
    assert main(["bench", "--num-envs", sizes]) == 2
    expected = f"swath: `num_envs` must be different whole numbers from 1 with commas between, got {sizes}\n"
    assert capsys.readouterr().err == expected
