"""Training: what a configuration may say, that a killed training goes on, and that a model is what its file says."""

import errno
import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from swath import ConfigError, _native
from swath.cli import main
from swath.training import Curve, TrainingConfig

if importlib.util.find_spec("stable_baselines3") is None and not os.environ.get("CI"):
    pytest.skip("stable-baselines3 is not installed", allow_module_level=True)

from swath import training

SHIPPED = dict(_native.shipped_trainings())

SCENARIO = {"base": "cowbot-field", "episode": {"budget": 0.05}}
PPO = {
    "algorithm": "ppo",
    "total_steps": 768,
    "num_envs": 4,
    "checkpoint_every": 256,
    "scenario": SCENARIO,
    "policy": {"net_arch": [16]},
    "hyperparameters": {"n_steps": 32, "batch_size": 64, "n_epochs": 2, "learning_rate": "lin_1e-3"},
    "normalize": {},
    "evaluation": {"every": 256, "instances": 2, "agents": ["random", "snake"]},
}
SAC = PPO | {
    "algorithm": "sac",
    "total_steps": 160,
    "checkpoint_every": 48,
    "hyperparameters": {"buffer_size": 500, "learning_starts": 64, "batch_size": 16, "gradient_steps": 2},
    "evaluation": {"every": 80, "instances": 2, "agents": ["snake"]},
}
MASKABLE = PPO | {
    "algorithm": "maskable-ppo",
    "total_steps": 192,
    "checkpoint_every": 64,
    "scenario": SCENARIO | {"observation": {"kind": "candidates"}, "action": {"kind": "target"}},
    "policy": {"class": "CandidatePolicy", "width": 8},
    "hyperparameters": {"n_steps": 8, "batch_size": 32, "n_epochs": 2},
    "normalize": {"norm_obs": False},
    "evaluation": {"every": 96, "instances": 2, "agents": ["random", "snake"]},
}
UNMASKED = MASKABLE | {"algorithm": "ppo", "policy": {}, "scenario": SCENARIO | {"action": {"kind": "target"}}}
SMALL = {
    "ppo": PPO,
    "ppo on discrete": PPO | {"scenario": SCENARIO | {"action": {"kind": "discrete"}}},
    "ppo on target": UNMASKED,
    "sac": SAC,
    "maskable-ppo": MASKABLE,
    "maskable-ppo on several counts": MASKABLE | {"weed_counts": [3, 9]},
}


def check(**changes):
    return TrainingConfig.check(PPO | changes)


def weights(model):
    return [tensor.detach().numpy().copy() for tensor in model.policy.parameters()]


class Killed(Exception):  # noqa: N818 - nothing went wrong
    """Stands in for a signal: it comes from outside the training, at a moment that is not of its choosing."""


# What a configuration may say


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_configuration_is_the_file_of_that_name_and_passes_every_check(name):
    assert (Path(__file__).parents[2] / "configs" / "train" / f"{name}.toml").read_text() == SHIPPED[name]
    config = TrainingConfig.read(name)
    training.algorithms.check_parameters(config)
    assert config.evaluation.seed >= 1_000_000
    assert config.seed + config.num_envs <= 1_000_000


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_the_settings_for_the_zoo_are_those_of_the_shipped_training(algorithm):
    lines = (Path(__file__).parents[2] / "configs" / "zoo" / f"{algorithm}.yml").read_text().splitlines()
    zoo = {}
    for line in lines:
        if found := re.fullmatch(r"  (\w+): (?:!!float )?(.+)", line):
            name, text = found.groups()
            zoo[name] = float(text) if re.fullmatch(r"[\d.e-]+", text) else text
    config = TrainingConfig.read(f"{algorithm}-features")
    assert zoo.pop("n_timesteps") == config.total_steps
    assert zoo.pop("policy") == config.policy["class"]
    assert str(config.policy["net_arch"]) in zoo.pop("policy_kwargs")
    assert zoo.pop("normalize") == f'"{dict(config.normalize)}"'
    # The zoo has fewer environments, each with more steps.
    num_envs, hyperparameters = zoo.pop("n_envs"), dict(config.hyperparameters)
    if "n_steps" in zoo:
        assert num_envs * zoo.pop("n_steps") == config.num_envs * hyperparameters.pop("n_steps")
    assert zoo == hyperparameters


REFUSED = [
    ({"algoritm": "ppo"}, "`algoritm` is not a known key; did you mean `algorithm`?"),
    ({"algorithm": "dqn"}, "`algorithm` must be one of `ppo`, `sac`, `maskable-ppo`, got `dqn`"),
    ({"algorithm": "ppo2"}, "`algorithm` must be one of `ppo`, `sac`, `maskable-ppo`, got `ppo2`; did you mean `ppo`?"),
    ({"total_steps": 0}, "`total_steps` must be a whole number from 1 to 1000000000000, got 0"),
    ({"total_steps": 1e6}, "`total_steps` must be a whole number from 1 to 1000000000000, got 1000000.0"),
    ({"num_envs": True}, "`num_envs` must be a whole number from 1 to 65536, got True"),
    ({"seed": 1_000_000}, "`seed` must be a whole number from 0 to 999996, got 1000000"),
    ({"weed_counts": [5, 6, 7]}, "`weed_counts` must be a list whose length divides `num_envs`, 4, got [5, 6, 7]"),
    ({"weed_counts": [-1]}, "`weed_counts` must be a whole number from 0 to 10000000, got -1"),
    ({"scenario": {"base": "nowhere"}}, "cannot read nowhere: no such file, and no shipped scenario"),
    ({"scenario": {"weeds": {"cuont": 3}}}, "`weeds.cuont` is not a known key; did you mean `weeds.count`?"),
    ({"policy": {"class": "MlpPolcy"}}, "`policy.class` must be one of `MlpPolicy`, `CnnPolicy`, `MultiInputPolicy`"),
    ({"policy": {"net_arc": [16]}}, "`policy.net_arc` is not a known key; did you mean `policy.net_arch`?"),
    ({"policy": {"net_arch": ["wide"]}}, "`policy.net_arch` must be a list or a block of keys, got ['wide']"),
    ({"policy": {"activation_fn": "Tan"}}, "`policy.activation_fn` must be one of "),
    ({"hyperparameters": {"n_step": 8}}, "`hyperparameters.n_step` is not a known key; did you mean"),
    ({"hyperparameters": {"gamma": "high"}}, "`hyperparameters.gamma` must be a finite number, got `high`"),
    ({"hyperparameters": {"gamma": 1.5}}, "`hyperparameters.gamma` must be from 0 to 1, got 1.5"),
    ({"hyperparameters": {"gamma": float("nan")}}, "`hyperparameters.gamma` must be a finite number, got nan"),
    ({"hyperparameters": {"n_steps": 8.0}}, "`hyperparameters.n_steps` must be a whole number, got 8.0"),
    ({"hyperparameters": {"n_steps": -8}}, "`hyperparameters.n_steps` must be > 0, got -8"),
    ({"hyperparameters": {"learning_rate": "lin_x"}}, "`hyperparameters.learning_rate` must be a finite number or "),
    ({"hyperparameters": {"seed": 3}}, "`hyperparameters.seed` is not a known key"),
    ({"normalize": {"norm_rewards": True}}, "`normalize.norm_rewards` is not a known key; did you mean"),
    ({"normalize": True}, "`normalize` must be a block of keys, got True"),
    ({"evaluation": {"instances": 3}}, "`evaluation.every` must be given"),
    ({"evaluation": {"every": 1, "seed": 999_999}}, "`evaluation.seed` must be a whole number from 1000000 to "),
    ({"evaluation": {"every": 1, "agents": ["snail"]}}, "`agent` must be "),
    ({"evaluation": {"every": 1, "agents": ["jump", "jump"]}}, "`evaluation.agents` must differ in their names"),
    (
        {"scenario": {"episode": {"budget": float("inf")}}},
        "`scenario.episode.budget` must be finite, for nothing else ",
    ),
    ({"num_threads": 2000}, "`num_threads` must be a whole number from 1 to 1024, got 2000"),
    ({"algorithm": "maskable-ppo"}, "`scenario.action.kind` must be `target` for `maskable-ppo`, got `steer`"),
]


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_what_cannot_be_used_is_refused_in_one_line_and_nothing_is_written(changes, message, tmp_path):
    with pytest.raises(ConfigError) as error:
        training.train(check(**changes), out=tmp_path / "out")
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(message)
    assert not (tmp_path / "out").exists()


DICT = {"base": "cowbot-field", "observation": {"kind": "dict"}, "action": {"kind": "target"}}
REFUSED_TOGETHER = [
    ({"policy": {"class": "CnnPolicy"}}, "`policy` and `hyperparameters` must suit ppo: "),
    ({"hyperparameters": {"n_steps": 32, "batch_size": 1}}, "`hyperparameters.batch_size` must be > 1, since"),
    (
        {"policy": {"class": "MultiInputPolicy"}},
        "`policy.class` must be `MlpPolicy` or `CnnPolicy` for the observation kind `features`, got `MultiInputPolicy`",
    ),
    (
        {
            "algorithm": "maskable-ppo",
            "scenario": SCENARIO | {"action": {"kind": "target"}},
            "policy": {"class": "CandidatePolicy"},
        },
        "`policy.class` must be `MlpPolicy` or `CnnPolicy` for the observation kind `features`, got `CandidatePolicy`",
    ),
    (
        {"scenario": DICT, "policy": {"class": "MlpPolicy"}, "normalize": {"norm_obs": False}},
        "`policy.class` must be `MultiInputPolicy` for the observation kind `dict`, got `MlpPolicy`",
    ),
    (
        {"scenario": DICT, "policy": {"class": "CnnPolicy"}, "normalize": {"norm_obs": False}},
        "`policy.class` must be `MultiInputPolicy` for the observation kind `dict`, got `CnnPolicy`",
    ),
    (
        {"scenario": DICT, "normalize": {"norm_obs": True}},
        "`normalize` must suit the observation kind `dict`: `norm_obs` = false, or `norm_obs_keys` among ",
    ),
]


@pytest.mark.parametrize(("changes", "message"), REFUSED_TOGETHER)
def test_what_does_not_fit_together_is_refused_in_one_line_and_the_corrected_training_may_begin(
    changes, message, tmp_path
):
    with pytest.raises(ConfigError) as error:
        training.train(check(**changes), out=tmp_path / "out")
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(message)
    assert not (tmp_path / "out").exists()
    training.train(check(total_steps=64, evaluation={"every": 64, "instances": 1, "agents": []}), out=tmp_path / "out")


def test_a_dictionary_of_observations_needs_no_policy_by_name(tmp_path):
    changes = {"scenario": DICT | {"episode": {"budget": 0.05}}, "policy": {}, "normalize": {"norm_obs": False}}
    evaluation = {"every": 64, "instances": 1, "agents": []}
    curve = training.train(check(**changes, total_steps=64, evaluation=evaluation), out=tmp_path / "out")
    assert curve.steps == [0, 128]


def test_a_seed_of_the_command_takes_the_place_of_that_of_the_file():
    assert training.TrainingConfig.read("ppo-features").seed == 0
    assert training.TrainingConfig.read("ppo-features", seed=7).seed == 7


def test_a_seed_of_the_command_that_cannot_be_is_not_blamed_on_the_file(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text('algorithm = "ppo"\ntotal_steps = 100\n')
    assert training.TrainingConfig.read(file, seed=7).seed == 7
    with pytest.raises(ConfigError, match=r"^`seed` must be"):
        training.TrainingConfig.read(file, seed=1_000_000)


def test_a_seed_of_the_command_that_is_held_out_is_refused(capsys, tmp_path):
    assert main(["train", "ppo-features", "--seed", "1000000", "--out", str(tmp_path / "out")]) == 2
    assert "`seed` must be" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_file_is_named_by_what_is_said_about_it(tmp_path):
    (tmp_path / "mine.toml").write_text("algorithm = 'ppo'\ntotal_steps = 0\n")
    with pytest.raises(ConfigError, match=r"mine\.toml: `total_steps` must be a whole number from 1"):
        TrainingConfig.read(tmp_path / "mine.toml")


def test_a_misspelt_name_is_answered_with_the_shipped_trainings(capsys, tmp_path):
    assert main(["train", "ppo-feature", "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == (
        f"swath: cannot read ppo-feature: no such file, and no shipped training ({', '.join(SHIPPED)}); "
        "did you mean `ppo-features`?\n"
    )


@pytest.mark.parametrize("package", ["stable_baselines3", "torch", "tensorboard"])
def test_a_missing_package_is_answered_with_the_extra_that_brings_it(package, monkeypatch, capsys, tmp_path):
    # This is how Python marks a module that cannot be imported.
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == package else object())
    assert main(["train", "ppo-features", "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == f"swath: training needs {package}: pip install 'swath[train]'\n"
    assert not (tmp_path / "out").exists()


# The training itself


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_the_quick_training_is_worth_its_minutes(tmp_path):
    curve = training.train("quick", out=tmp_path / "out")
    first, last = curve.steps[0], curve.steps[-1]
    assert curve.path_m("policy", last)["mean"] < 0.8 * curve.path_m("policy", first)["mean"]
    assert curve.longer_m(last, "snake")["high"] < 0
    assert curve.weeds_mowed("policy", last)["mean"] > 19.5


@pytest.mark.parametrize("small", SMALL)
def test_a_killed_training_goes_on_from_its_last_checkpoint_and_ends_as_if_it_had_not_been_killed(small, tmp_path):
    config = TrainingConfig.check(SMALL[small])
    training.train(config, out=tmp_path / "whole")

    def kill_at_the_third_evaluation(line):
        evaluations.append(line)
        if len(evaluations) == 3:
            raise Killed

    evaluations = []
    with pytest.raises(Killed):
        training.train(config, out=tmp_path / "killed", say=kill_at_the_third_evaluation)
    checkpoints = [int(entry.name) for entry in (tmp_path / "killed" / "checkpoints").iterdir()]
    assert len(checkpoints) == 1
    assert 0 < checkpoints[0] < config.total_steps
    said = []
    training.train(config, out=tmp_path / "killed", say=said.append)
    assert said[0] == f"goes on from step {checkpoints[0]}"

    whole, killed = (training.load_policy(tmp_path / name) for name in ("whole", "killed"))
    assert all(np.array_equal(*pair) for pair in zip(weights(whole.model), weights(killed.model), strict=True))
    files = [(tmp_path / name / "evaluations.csv").read_bytes() for name in ("whole", "killed")]
    assert files[0] == files[1]


def test_a_training_killed_by_the_system_goes_on_to_the_same_bytes(tmp_path):
    config = {**SMALL["sac"], "checkpoint_every": 64}
    training.train(TrainingConfig.check(config), out=tmp_path / "whole")
    program = """
import os, signal, sys
from swath import training
write = training.checkpoint.Checkpoints.write
def write_and_die(*arguments):
    write(*arguments)
    os.kill(os.getpid(), signal.SIGKILL)
training.checkpoint.Checkpoints.write = write_and_die
training.train(sys.argv[1], out=sys.argv[2])
"""
    command = [sys.executable, "-c", program, tmp_path / "whole" / "training.toml", tmp_path / "killed"]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    said = []
    training.train(tmp_path / "whole" / "training.toml", out=tmp_path / "killed", say=said.append)
    assert said[0].startswith("goes on from step ")
    whole, resumed = (training.load_policy(tmp_path / name) for name in ("whole", "killed"))
    assert all(np.array_equal(*pair) for pair in zip(weights(whole.model), weights(resumed.model), strict=True))


def test_a_checkpoint_that_the_disk_cannot_take_leaves_the_older_one_and_one_line(tmp_path, monkeypatch):
    config = TrainingConfig.check({**SMALL["sac"], "checkpoint_every": 64})

    def fill_the_disk(path, *_):
        if len(list(path.parent.parent.glob("[0-9]*"))) == 1:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write_model(path, *_)

    write_model = training.checkpoint.write_model
    monkeypatch.setattr(training.checkpoint, "write_model", fill_the_disk)
    with pytest.raises(ConfigError, match="`out` must take a checkpoint, got No space left on device in "):
        training.train(config, out=tmp_path / "out")
    (left,) = (tmp_path / "out" / "checkpoints").iterdir()
    assert left.name == "64"
    monkeypatch.undo()
    said = []
    training.train(config, out=tmp_path / "out", say=said.append)
    assert said[0] == "goes on from step 64"


@pytest.mark.parametrize("name", ["state.pkl", "replay_buffer.pkl"])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_a_damaged_checkpoint_is_answered_with_one_line_that_names_the_file(name, share, tmp_path, capsys):
    config = TrainingConfig.check({**SMALL["sac"], "checkpoint_every": 64})

    def kill(line):
        if not line.startswith("step 0:"):
            raise Killed

    with pytest.raises(Killed):
        training.train(config, out=tmp_path / "out", say=kill)
    (checkpoint,) = (tmp_path / "out" / "checkpoints").iterdir()
    damaged = checkpoint / name
    damaged.write_bytes(damaged.read_bytes()[: int(share * damaged.stat().st_size)])
    before = sorted(tmp_path.rglob("*"))
    assert main(["train", str(tmp_path / "out" / "training.toml"), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert re.fullmatch(
        rf"swath: cannot go on from {re.escape(str(damaged))} \(.+\): "
        rf"remove the folder {re.escape(str(checkpoint))}, and the training begins anew\n",
        said,
    )
    assert sorted(tmp_path.rglob("*")) == before
    shutil.rmtree(checkpoint)
    assert training.train(config, out=tmp_path / "out").steps == [0, 80, 160]


def test_a_replay_buffer_that_the_disk_cannot_hold_is_refused_before_anything_is_written(tmp_path, monkeypatch):
    usage = shutil.disk_usage(tmp_path)._replace(free=100_000)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    with pytest.raises(ConfigError, match=r"`hyperparameters.buffer_size` must be at most [0-9]+ here, got "):
        training.train(TrainingConfig.check(SMALL["sac"]), out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_time_up_to_the_last_checkpoint_is_counted_and_no_other(tmp_path):
    times = training.run.Times(tmp_path / "times.csv", 0, 0.0)
    times.write(0)
    times.write(300)
    # A checkpoint at step 200 was written after an hour, later than any evaluation that is kept.
    later = training.run.Times(tmp_path / "times.csv", 200, 3600.0)
    later.write(400)
    rows = (tmp_path / "times.csv").read_text().splitlines()
    assert [row.split(",")[0] for row in rows] == ["steps", "0", "400"]
    assert 3600.0 <= float(rows[-1].split(",")[1]) < 4000.0


def test_environments_with_several_counts_of_weeds_are_those_of_one_count_side_by_side():
    config = TrainingConfig.check(MASKABLE | {"weed_counts": [3, 9], "normalize": {"norm_reward": False}})
    abreast = training.environments.make_bare_venv(config)
    alone = [
        training.environments.make_venv(_native.Scenario(config.scenario, weeds={"count": count}), 2)
        for count in (3, 9)
    ]
    abreast.seed(5)
    for venv, seed in zip(alone, (5, 7), strict=True):
        venv.seed(seed)
    assert np.array_equal(abreast.reset(), np.concatenate([venv.reset() for venv in alone]))
    totals = set()
    for _ in range(80):
        masks = abreast.env_method("action_masks")
        assert np.array_equal(masks, [mask for venv in alone for mask in venv.env_method("action_masks")])
        places = np.array([np.flatnonzero(mask)[0] for mask in masks])
        got, apart = (
            abreast.step(places),
            [venv.step(part) for venv, part in zip(alone, places.reshape(2, 2), strict=True)],
        )
        for what in range(3):
            assert np.array_equal(got[what], np.concatenate([step[what] for step in apart]))
        totals |= {(row, info["weeds_total"]) for row, info in enumerate(got[3]) if "weeds_total" in info}
    assert totals == {(0, 3), (1, 3), (2, 9), (3, 9)}


@pytest.mark.parametrize("package", ["swath", "swath-build", "torch", "stable-baselines3"])
def test_a_training_goes_on_with_the_versions_that_began_it_and_no_others(package, monkeypatch, tmp_path):
    def kill(line):
        if not line.startswith("step 0:"):
            raise Killed

    with pytest.raises(Killed):
        training.train(check(checkpoint_every=128), out=tmp_path / "out", say=kill)
    versions = training.checkpoint.versions()
    monkeypatch.setattr(training.checkpoint, "versions", lambda: versions | {package: "9.9"})
    before = sorted(tmp_path.rglob("*"))
    message = rf"^`out` must go on with {package} {re.escape(versions[package])}, which wrote .*, got {package} 9\.9$"
    with pytest.raises(ConfigError, match=message):
        training.train(check(checkpoint_every=128), out=tmp_path / "out")
    assert sorted(tmp_path.rglob("*")) == before


def test_training_changes_the_weights_and_leaves_them_finite(tmp_path):
    training.train(check(), out=tmp_path / "out")
    before, after = (weights(training.load_policy(tmp_path / "out" / f"{n}.zip").model) for n in ("untrained", "model"))
    assert all(np.isfinite(values).all() for values in after)
    assert not any(np.array_equal(*pair) for pair in zip(before, after, strict=True))


def test_evaluations_hold_every_agent_on_the_same_held_out_instances(tmp_path):
    curve = training.train(check(), out=tmp_path / "out")
    assert curve.steps == [0, 256, 512, 768]
    for agent in ("random", "snake"):
        assert [row.seed for row in curve.of(agent)] == [1_000_000, 1_000_001]
    for row in curve.of("snake"):
        episode = training.run.evaluation.evaluate(
            ["snake"], scenario=check().scenario, instances=1, seed=row.seed
        ).rows[0]
        assert row.path_length_m == episode.path_length_m
    written = Curve.read(tmp_path / "out" / "evaluations.csv")
    assert written.longer_m(768, "snake") == curve.longer_m(768, "snake")


def test_flat_maps_are_refused_with_the_key_that_gives_them_their_shape(tmp_path):
    maps = {"scenario": {"observation": {"kind": "maps"}}, "normalize": {"norm_obs": False}}
    policy = {"policy": {"class": "CnnPolicy", "features_extractor_class": "MapsExtractor"}}
    with pytest.raises(
        ConfigError, match=r"^`policy` and `hyperparameters` must suit ppo: maps must have three axes"
    ) as error:
        training.train(check(**maps, **policy), out=tmp_path / "out")
    assert "`observation.flat` = false" in str(error.value)


def test_a_folder_with_another_training_is_refused_by_the_first_key_that_differs(tmp_path):
    training.train(check(), out=tmp_path / "out")
    with pytest.raises(ConfigError, match=r"with total_steps 768 instead of 1536$"):
        training.train(check(total_steps=1536), out=tmp_path / "out")
    with pytest.raises(ConfigError, match=r"with scenario.episode.budget 0.05 instead of 0.06$"):
        training.train(check(scenario=SCENARIO | {"episode": {"budget": 0.06}}), out=tmp_path / "out")
    said = []
    training.train(check(num_threads=2), out=tmp_path / "out", say=said.append)
    assert said == [f"{tmp_path / 'out'} holds this training, finished"]


def test_a_folder_with_other_files_is_refused(tmp_path):
    (tmp_path / "diary.txt").write_text("dear diary")
    with pytest.raises(ConfigError, match=r"with other files, such as diary\.txt$"):
        training.train(check(), out=tmp_path)


# A model and the file beside it


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trained")
    training.train(check(evaluation={"every": 10_000, "instances": 2, "agents": []}), out=folder / "out")
    return folder / "out"


def test_a_policy_plays_the_instances_that_the_gymnasium_environment_draws(trained):
    import gymnasium as gym

    policy = training.load_policy(trained)
    assert (policy.card.algorithm, policy.card.steps) == ("ppo", 768)
    assert (policy.card.observation_kind, policy.card.action_kind) == ("features", "steer")
    rows = training.evaluate_policy(policy, scenario=policy.card.scenario, instances=2, seed=1_000_007)
    for row in rows:
        env = gym.make("swath/MowerRouting-v0", scenario=policy.card.scenario)
        observation, _ = env.reset(seed=row.seed)
        over = False
        while not over:
            action = policy.predict(observation[None])[0]
            observation, _, terminated, truncated, info = env.step(action)
            over = terminated or truncated
        assert (row.path_length_m, row.weeds_mowed, row.outcome) == (
            info["path_length_m"],
            info["weeds_mowed"],
            info["outcome"],
        )


def test_an_evaluation_that_need_not_end_is_refused(trained):
    policy = training.load_policy(trained)
    scenario = _native.Scenario(policy.card.scenario, episode={"budget": float("inf")})
    with pytest.raises(ConfigError, match=r"^`episode\.budget` must be finite"):
        training.evaluate_policy(policy, scenario=scenario, instances=1)


def without_time(row):
    return {name: value for name, value in vars(row).items() if name not in ("instance", "wall_s")}


@pytest.mark.parametrize("name", ["random", "policy"])
def test_a_player_that_draws_plays_an_instance_by_its_seed_whatever_is_played_beside_it(name, trained):
    player = training.load_policy(trained, deterministic=False)
    scenario = player.card.scenario
    if name == "random":
        player = training.RandomPlayer(player.model.action_space)
    together = training.evaluate_policy(player, scenario=scenario, instances=3, seed=1_000_000)
    again = training.evaluate_policy(player, scenario=scenario, instances=3, seed=1_000_000)
    alone = training.evaluate_policy(player, scenario=scenario.to_dict(), instances=1, seed=1_000_002)
    assert [without_time(row) for row in again] == [without_time(row) for row in together]
    # Blocks have no name of their own.
    assert without_time(alone[0]) | {"scenario": scenario.name} == without_time(together[2])
    assert len({row.path_length_m for row in together} | {row.weeds_detected for row in together}) > 2


def test_a_policy_draws_for_each_row_and_leaves_the_generators_of_the_process_alone(trained):
    import torch

    policy = training.load_policy(trained, deterministic=False)
    observations = np.zeros((3, *policy.model.observation_space.shape), np.float32)
    policy.begin([7, 8, 7])
    before = torch.get_rng_state()
    first, second = policy.predict(observations), policy.predict(observations)
    assert torch.equal(torch.get_rng_state(), before)
    assert np.array_equal(first[0], first[2])
    assert not np.array_equal(first[0], first[1])
    assert not np.array_equal(first, second)


@pytest.mark.parametrize("name", ["model.zip", "model-vecnormalize.pkl"])
def test_a_file_that_is_not_the_one_that_was_written_is_refused(name, trained, tmp_path):
    for file in trained.glob("model*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / name).write_bytes(b"another" + (tmp_path / name).read_bytes())
    with pytest.raises(ConfigError, match=rf"^{re.escape(name)} must be the file that model\.toml speaks of"):
        training.load_policy(tmp_path / "model.zip")


def test_a_model_without_its_text_file_is_refused(trained, tmp_path):
    (tmp_path / "model.zip").write_bytes((trained / "model.zip").read_bytes())
    with pytest.raises(ConfigError, match=r"^`path` must be a model with `model\.toml` beside it"):
        training.load_policy(tmp_path / "model.zip")
