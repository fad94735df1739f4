"""Datasets: what is recorded is what the environment would say again, and Minari loads it."""

import importlib.util
import json
import os
import sys
import types

import gymnasium as gym
import numpy as np
import pytest

import swath
from swath.cli import main

if importlib.util.find_spec("minari") is None and (sys.version_info < (3, 11) or not os.environ.get("CI")):
    pytest.skip("Minari is not installed", allow_module_level=True)

import minari

from swath.datasets import record

ID = "swath/MowerRouting-v0"
EPISODES = 18  # more than one batch


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    return tmp_path_factory.mktemp("datasets")


@pytest.fixture(scope="module", params=["steer", "drive"])
def recorded(request, root):
    """A dataset of SNAKE, through one action kind."""
    name = f"swath/snake-{request.param}-v0"
    record(
        "snake",
        episodes=EPISODES,
        seed=5,
        scenario="cowbot-field",
        dataset_id=name,
        root=root,
        action={"kind": request.param},
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MINARI_DATASETS_PATH", str(root))
        yield minari.load_dataset(name)


def test_every_episode_replays_to_the_same_observations_and_rewards(recorded):
    env = recorded.recover_environment()
    metadata = list(recorded.storage.get_episode_metadata(range(EPISODES)))
    assert [entry["seed"] for entry in metadata] == list(range(5, 5 + EPISODES))
    for episode, entry in zip(recorded, metadata, strict=True):
        observation, info = env.reset(seed=entry["seed"])
        assert np.array_equal(episode.observations[0], observation)
        for step, action in enumerate(episode.actions):
            observation, reward, terminated, _, info = env.step(action)
            assert np.array_equal(episode.observations[step + 1], observation)
            assert episode.rewards[step] == reward
            assert episode.terminations[step] == terminated
            assert episode.infos["reward_terms"]["path"][step + 1] == info["reward_terms"]["path"]


def test_an_episode_holds_what_the_agent_does_step_by_step_in_the_environment(recorded):
    env = recorded.recover_environment()
    for index, episode in enumerate(recorded):
        agent = swath.make_agent("snake", seed=5 + index)
        env.reset(seed=5 + index)
        over, actions = False, []
        while not over and (action := agent.act(env)) is not None:
            actions.append(action)
            *_, terminated, truncated, _ = env.step(action)
            over = terminated or truncated
        assert np.array_equal(episode.actions, actions)


def test_where_an_agent_stops_the_last_step_counts_as_truncated_and_the_outcome_is_done(recorded):
    outcomes = [entry["outcome"] for entry in recorded.storage.get_episode_metadata(range(EPISODES))]
    assert "done" in outcomes
    for episode, outcome in zip(recorded, outcomes, strict=True):
        ends = episode.terminations | episode.truncations
        assert np.flatnonzero(ends).tolist() == [len(ends) - 1]
        assert episode.truncations[-1] == (outcome != "goal")


def test_the_dataset_says_who_drove_where(recorded):
    metadata = recorded.storage.metadata
    assert metadata["agent"] == metadata["algorithm_name"] == "snake"
    assert metadata["swath_version"] == swath.__version__
    env = gym.make(
        ID,
        scenario="cowbot-field",
        action={"kind": json.loads(metadata["env_spec"])["kwargs"]["scenario"]["action"]["kind"]},
    )
    assert metadata["scenario"] == env.unwrapped.scenario.to_toml()
    assert metadata["jpeg_encoding"] is False


def test_a_folder_may_be_named_from_where_one_stands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = record("snake", episodes=1, scenario="cowbot-field", dataset_id="swath/near-v0", root="data/sets")
    assert folder.is_dir()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data/sets"))
    assert len(minari.load_dataset("swath/near-v0")) == 1


def test_chance_drives_until_the_episode_ends(root, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(root))
    short = {"budget": 0.02}
    record(
        "random",
        episodes=2,
        scenario="cowbot-field",
        dataset_id="chance-v0",
        episode=short,
        action={"kind": "discrete"},
    )
    dataset = minari.load_dataset("chance-v0")
    assert [entry["outcome"] for entry in dataset.storage.get_episode_metadata([0, 1])] == ["budget", "budget"]
    assert dataset.action_space == gym.spaces.Discrete(5)
    assert all(episode.truncations[-1] and len(set(episode.actions)) > 1 for episode in dataset)


def train(out, kind):
    """Trains for a few steps on a scenario that is not the default one."""
    pytest.importorskip("stable_baselines3")
    from swath import training

    config = training.TrainingConfig.check(
        {
            "algorithm": "ppo",
            "total_steps": 64,
            "num_envs": 2,
            "scenario": {"base": "cowbot-field", "episode": {"budget": 0.02}, "action": {"kind": kind}},
            "hyperparameters": {"n_steps": 32, "batch_size": 32},
        }
    )
    training.train(config, out=out)
    return training.load_policy(out)


@pytest.mark.parametrize("kind", ["steer", "discrete", "target"])
def test_a_trained_policy_is_recorded_as_it_plays(kind, root, tmp_path, monkeypatch):
    policy = train(tmp_path / "out", kind)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(root))
    record(str(tmp_path / "out" / "model.zip"), episodes=2, dataset_id=f"policy-{kind}-v0")
    for episode in minari.load_dataset(f"policy-{kind}-v0"):
        assert np.allclose(policy.predict(episode.observations[:-1]), episode.actions, atol=1e-6)


def test_a_trained_policy_is_recorded_where_it_was_trained_unless_another_scenario_is_named(tmp_path, monkeypatch):
    scenario = train(tmp_path / "out", "steer").card.scenario
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    command = ["record", "--agent", str(tmp_path / "out" / "model.zip"), "--episodes", "1", "--dataset"]
    assert main([*command, "own-v0"]) == 0
    assert minari.load_dataset("own-v0").storage.metadata["scenario"] == scenario.to_toml()
    (tmp_path / "other.toml").write_text(scenario.to_toml().replace("budget = 0.02", "budget = 0.01"))
    assert main([*command, "other-v0", "--scenario", str(tmp_path / "other.toml")]) == 0
    assert "budget = 0.01" in minari.load_dataset("other-v0").storage.metadata["scenario"]


def test_a_scripted_agent_is_recorded_on_the_shipped_pasture_unless_another_scenario_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    assert main(["record", "--agent", "bcp", "--episodes", "1"]) == 0
    assert minari.load_dataset("swath/bcp-v0").storage.metadata["scenario"] == swath.Scenario("pasture").to_toml()


REFUSED = [
    ({"agent": "snail"}, "`agent` must be "),
    ({"episodes": 0}, "`episodes` must be a whole number from 1 to 4294967296, got 0"),
    ({"dataset_id": "no version/"}, "`dataset_id` must be like `namespace/name-v0`, got `no version/`"),
    ({"action": {"kind": "discrete"}}, "`action.kind` must be `steer` or `drive` for a scripted agent, got `discrete`"),
    ({"action": {"kind": "target"}}, "`action.kind` must be `steer` or `drive` for a scripted agent, got `target`"),
    ({"agent": "random", "episode": {"budget": float("inf")}}, "`episode.budget` must be finite, for nothing else "),
]


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_what_cannot_be_recorded_is_refused_in_one_line_and_leaves_nothing(changes, message, tmp_path):
    with pytest.raises(swath.ConfigError) as error:
        record(**{"agent": "snake", "episodes": 1, "scenario": "cowbot-field", "root": tmp_path / "new"} | changes)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_a_dataset_that_comes_while_another_is_recorded_stays_as_it_is(monkeypatch, tmp_path):
    def play_while_another_is_written(*arguments):
        (tmp_path / "swath" / "snake-v0").mkdir(parents=True)
        (tmp_path / "swath" / "snake-v0" / "diary.txt").write_text("dear diary")
        return play(*arguments)

    play = swath.datasets.dataset.play
    monkeypatch.setattr(swath.datasets.dataset, "play", play_while_another_is_written)
    with pytest.raises(swath.ConfigError, match=r"^`dataset_id` must be new, but there is now a dataset "):
        record("snake", episodes=1, scenario="cowbot-field", root=tmp_path)
    assert [entry.name for entry in (tmp_path / "swath" / "snake-v0").iterdir()] == ["diary.txt"]


def test_an_episode_of_chance_is_determined_by_its_seed(monkeypatch, tmp_path):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    for name, seed, episodes in [("many-v0", 3, 3), ("last-v0", 5, 1)]:
        record(
            "random", episodes=episodes, seed=seed, scenario="cowbot-field", dataset_id=name, episode={"budget": 0.02}
        )
    many, last = minari.load_dataset("many-v0"), minari.load_dataset("last-v0")
    assert np.array_equal(many[2].actions, last[0].actions)
    assert np.array_equal(many[2].observations, last[0].observations)
    assert not np.array_equal(many[1].actions[:8], last[0].actions[:8])


def test_a_dataset_is_never_overwritten(recorded, root, capsys):
    status = main(["record", "--agent", "snake", "--episodes", "1", "--dataset", recorded.id, "--root", str(root)])
    assert status == 2
    assert capsys.readouterr().err == f"swath: `dataset_id` must be new, but there is a dataset {root / recorded.id}\n"


def test_a_python_that_is_too_old_for_minari_is_answered_with_the_one_that_is_needed(monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(swath.extras, "sys", types.SimpleNamespace(version_info=(3, 10, 12)))
    assert main(["record", "--agent", "snake"]) == 2
    assert capsys.readouterr().err == "swath: recording needs minari, which needs Python 3.11 or later\n"


def test_a_missing_minari_is_answered_with_the_extra_that_brings_it(monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert main(["record", "--agent", "snake"]) == 2
    assert capsys.readouterr().err == "swath: recording needs minari: pip install 'swath[data]'\n"
