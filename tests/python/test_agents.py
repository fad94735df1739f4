"""Agents that act through Gymnasium do what the same agents do natively."""

import gymnasium as gym
import numpy as np
import pytest

import swath
from swath import _native

ID = "swath/MowerRouting-v0"
NAMES = [name for name, *_ in _native.agents()]
AGENTS = ["bcp", "bcp-tsp", "react", "jump", "snake", "r-snake", "greedy", "horizon", "learned"]
# Where rounding moves the mower by a hair, these may choose otherwise, and the rest of the way is another.
CHOOSING = ["greedy", "horizon", "learned"]
UNLIMITED = {"budget": float("inf")}


@pytest.fixture(params=AGENTS)
def name(request):
    return request.param


def made_for(episode, kind, **blocks):
    """An environment in which an agent can repeat an episode: same weeds by seed, same start, no budget."""
    start = episode.trajectory[0, :3]
    env = gym.make(
        ID, scenario=episode.scenario, action={"kind": kind}, mower={"start": start}, episode=UNLIMITED, **blocks
    )
    env.reset(seed=episode.seed)
    return env


def driven(env, agent):
    """Lets an agent act to its end: x, y and path after every step, metres, weeds mowed, and the last info."""
    length_m, width_m = (env.unwrapped.scenario.to_dict()["pasture"][key] for key in ("length_m", "width_m"))
    points, path_m, mowed, info = [], 0.0, 0.0, {}
    while (action := agent.act(env)) is not None:
        observation, _, _, _, info = env.step(action)
        path_m -= info["reward_terms"]["path"]
        mowed += info["reward_terms"]["weed"]
        # The first two numbers of an observation are the position, scaled over the pasture and 10 m around it.
        x_m, y_m = (observation[:2] + 1) / 2 * (np.array([length_m, width_m]) + 20) - 10
        points.append((x_m, y_m, path_m))
    return np.array(points), mowed, info


@pytest.mark.parametrize("name", [name for name in AGENTS if name not in CHOOSING])
@pytest.mark.parametrize("scenario", ["cowbot-field", "pasture"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_drive_follows_the_native_path_to_a_centimetre(name, scenario, seed):
    native = swath.run_episode(name, scenario=scenario, seed=seed)
    agent = swath.make_agent(name, seed=seed)
    points, mowed, info = driven(made_for(native, "drive"), agent)
    path_m = native.trajectory[:, 3]
    for axis in (0, 1):
        there = np.interp(points[:, 2], path_m, native.trajectory[:, axis])
        assert np.abs(points[:, axis] - there).max() < 0.01
    if agent.outcome is None:
        # The Gymnasium episode is won with the last weed, before the agent would have stopped.
        assert info["outcome"] == "goal"
        assert points[-1, 2] <= native.path_length_m
    else:
        assert agent.outcome == native.outcome == "done"
        assert points[-1, 2] == pytest.approx(native.path_length_m, abs=0.01)
        assert mowed == native.weeds_mowed


@pytest.mark.parametrize("name", CHOOSING)
def test_a_choosing_agent_does_its_job_through_drive_where_rounding_makes_it_decide_otherwise(name):
    native = swath.run_episode(name, scenario="cowbot-field", seed=0)
    agent = swath.make_agent(name)
    points, mowed, _ = driven(made_for(native, "drive"), agent)
    assert mowed == native.weeds_mowed == native.weeds_total
    # Both are far below the boustrophedon path, and a search that went another way is not much longer.
    assert points[-1, 2] < 0.25 * native.bcp_length_m
    assert native.path_length_m < 0.25 * native.bcp_length_m


@pytest.mark.parametrize("name", ["jump", "bcp"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_steer_mows_all_that_drive_mows(name, seed):
    native = swath.run_episode(name, scenario="cowbot-field", seed=seed)
    _, mowed, _ = driven(made_for(native, "steer"), swath.make_agent(name))
    assert mowed == native.weeds_mowed == 14


def test_an_agent_starts_afresh_with_every_episode(name):
    native = swath.run_episode(name, scenario="cowbot-field", seed=4)
    env, agent = made_for(native, "drive"), swath.make_agent(name)
    first = driven(env, agent)[0]
    env.reset(seed=4)
    assert np.array_equal(driven(env, agent)[0], first)
    for _ in range(100):
        agent.act(made_for(native, "drive"))
    env.reset(seed=4)
    assert np.array_equal(driven(env, agent)[0], first)


def test_an_agent_of_the_same_seed_repeats_itself(name):
    native = swath.run_episode(name, scenario="cowbot-field", seed=4)
    first, again = (driven(made_for(native, "drive"), swath.make_agent(name, seed=9))[0] for _ in range(2))
    assert np.array_equal(first, again)


def test_an_agent_never_changes_the_weeds():
    native = swath.run_episode("react", scenario="cowbot-field", seed=4)
    env = made_for(native, "drive")
    before = env.unwrapped.snapshot()
    swath.make_agent("react", seed=4).act(env)
    assert env.unwrapped.snapshot() == before


def test_what_the_mower_has_not_seen_does_not_change_a_decision():
    env = gym.make(ID, scenario="pasture", action={"kind": "drive"})
    shown = []
    for far in ([90.0, 39.0], [60.0, 20.0]):
        env.reset(seed=0, options={"weeds": [[8.0, 2.0], far]})
        agent = swath.make_agent("jump")
        decisions = []
        for _ in range(10):
            decisions.append(agent.act(env).tobytes())
            env.step(np.frombuffer(decisions[-1], np.float32))
        shown.append(decisions)
    assert shown[0] == shown[1]


def test_an_agent_has_nothing_to_do_once_the_episode_is_over():
    env = gym.make(ID, action={"kind": "drive"}, episode={"budget": 1e-6})
    env.reset(seed=0)
    agent = swath.make_agent("jump")
    env.step(agent.act(env))
    assert agent.act(env) is None
    assert agent.outcome is None


def test_actions_fit_the_action_space(name):
    for kind in ("steer", "drive"):
        env = gym.make(ID, action={"kind": kind})
        env.reset(seed=0)
        action = swath.make_agent(name).act(env)
        assert action in env.action_space


@pytest.mark.parametrize("name", ["clairvoyant", "clairvoyant:iterations=5"])
def test_a_yardstick_that_is_told_the_weeds_acts_in_no_environment(name):
    with pytest.raises(swath.ConfigError, match=r"`agent` must be an online agent .*, got `clairvoyant"):
        swath.make_agent(name)
    with pytest.raises(swath.ConfigError, match=r"`agent` must be an online agent .*, got `clairvoyant"):
        _native.Crew(_native.AgentSpec(name), [])
    # It runs where whole episodes do.
    assert swath.run_episode(name, scenario="cowbot-field", seed=1).weeds_mowed == 14


def test_options_are_keywords_or_part_of_the_name():
    assert swath.make_agent("bcp", spacing="sensor").label == swath.make_agent("bcp:spacing=sensor").label


@pytest.mark.parametrize(
    ("arguments", "options", "text"),
    [
        (
            "jmup",
            {},
            f"`agent` must be one of {', '.join(NAMES)}, got `jmup`; did you mean `jump`?",
        ),
        (None, {}, "`agent` must be a name such as `snake` or `bcp:spacing=sensor`, got None"),
        ("bcp", {"spacng": "deck"}, "`bcp.spacng` is not a known key; did you mean `bcp.spacing`?"),
        ("bcp", {"spacing": "wide"}, "`bcp.spacing` must be `deck` or `sensor`, got `wide`"),
        ("jump", {"spacing": "deck"}, "`jump.spacing` is not a known key"),
        ("greedy", {"detour_m": -1}, "`greedy.detour_m` must be at least 0, got -1"),
        ("jump", {"seed": -1}, "`seed` must be a whole number from 0 to 18446744073709551615, got -1"),
    ],
)
def test_an_agent_that_cannot_be_made_is_refused_by_name(arguments, options, text):
    with pytest.raises(swath.ConfigError) as error:
        swath.make_agent(arguments, **options)
    assert str(error.value) == text


def test_an_agent_refuses_other_environments():
    with pytest.raises(swath.ConfigError, match="`env` must be a swath environment, got CartPoleEnv"):
        swath.make_agent("jump").act(gym.make("CartPole-v1"))


def test_an_agent_waits_for_the_reset():
    with pytest.raises(swath.ActionError, match="`reset` must come before the first step"):
        swath.make_agent("jump").act(gym.make(ID, action={"kind": "drive"}))


@pytest.mark.parametrize("kind", ["discrete", "target"])
def test_an_agent_refuses_to_act_by_choices(kind):
    env = gym.make("swath/MowerRouting-v0", action={"kind": kind})
    env.reset(seed=0)
    with pytest.raises(swath.ConfigError) as error:
        swath.make_agent("bcp").act(env)
    assert str(error.value) == f"`action.kind` must be `steer` or `drive` where a scripted agent acts, got {kind}"
