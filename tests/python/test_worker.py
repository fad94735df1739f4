"""Rollout workers, on real servers: what they keep is what the same policy does here, however often they are killed."""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import gymnasium as gym
import numpy as np
import pytest
from remote_server import SERVER, Server, free_port, same

import swath
from swath import _native
from swath.cli import main
from swath.registration import ENV_ID

if importlib.util.find_spec("minari") is None and (sys.version_info < (3, 11) or not os.environ.get("CI")):
    pytest.skip("Minari is not installed", allow_module_level=True)

import minari

from swath.datasets import record
from swath.datasets.drivers import ScriptedDriver
from swath.datasets.episodes import play
from swath.remote.batch import RemoteBatch
from swath.rollouts import work

pytestmark = pytest.mark.skipif(not SERVER.exists(), reason="needs the server: `make server` builds it")

FIELD: dict[str, object] = {"seed": 5}

SMALL = """
[pasture]
length_m = 30.0
width_m = 12.0
[weeds]
count = 8
[episode]
control_period_s = 0.5
"""


@pytest.fixture(scope="module", autouse=True)
def field(tmp_path_factory):
    """A pasture that is mowed within some hundred steps."""
    path = tmp_path_factory.mktemp("field") / "small.toml"
    path.write_text(SMALL)
    FIELD["scenario"] = str(path)


@pytest.fixture(scope="module")
def server():
    server = Server("--allow-snapshot")
    yield server
    server.end()


@pytest.fixture
def own_server():
    server = Server()
    yield server
    server.end(signal.SIGKILL)


def rows(folder):
    """The rows, but for the time that they took."""
    with (folder / "episodes.csv").open() as file:
        return [{name: value for name, value in row.items() if name != "wall_s"} for row in csv.DictReader(file)]


def load(root, name):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MINARI_DATASETS_PATH", str(root))
        return minari.load_dataset(name)


def episodes(root, name):
    """The episodes of a dataset, whole."""
    dataset = load(root, name)
    about = list(dataset.storage.get_episode_metadata(range(dataset.total_episodes)))
    return [
        (
            {name: entry[name] for name in ("seed", "outcome", "total_steps")},
            episode.observations,
            episode.actions,
            episode.rewards,
            episode.terminations,
            episode.truncations,
            episode.infos,
        )
        for episode, entry in zip(dataset, about, strict=True)
    ]


def kept(folder, name="swath/snake-v0"):
    """All that a finished sweep has kept."""
    return (
        rows(folder),
        (folder / "scenario.toml").read_text(),
        json.loads((folder / "summary.json").read_text()),
        episodes(folder / "dataset", name),
    )


@pytest.fixture(scope="module")
def whole(server, tmp_path_factory):
    """The folder of a sweep that nothing has disturbed."""
    folder = tmp_path_factory.mktemp("whole") / "sweep"
    done = work("snake", connect=server.endpoint, out=folder, episodes=24, **FIELD)
    assert (done.played, done.missing) == (24, 0)
    return folder


@pytest.mark.parametrize("action", ["steer", "drive"])
@pytest.mark.parametrize("agent", ["snake", "bcp:spacing=sensor"])
def test_rows_and_trajectories_are_those_of_the_same_agent_here(server, tmp_path, agent, action):
    name = f"swath/{agent.replace(':', '-').replace('=', '-')}-v0"
    blocks = {**FIELD, "action": {"kind": action}}
    work(agent, connect=[server.endpoint] * 2, out=tmp_path / "far", episodes=7, num_envs=3, **blocks)
    record(agent, episodes=7, dataset_id=name, root=tmp_path / "here", **blocks)
    assert same(episodes(tmp_path / "far" / "dataset", name), episodes(tmp_path / "here", name))
    scenario = _native.Scenario(FIELD["scenario"], action={"kind": action})
    batch = _native.Batch(scenario, 7, "SameStep", 1, copy=True)
    driver = ScriptedDriver(_native.AgentSpec(agent))
    # Here the numbers are those of the truth, not of what the mower perceives.
    truth = {episode.seed: episode for episode in play(batch, driver, range(5, 12))}
    for instance, row in enumerate(rows(tmp_path / "far")):
        assert (row["agent"], int(row["instance"]), int(row["seed"])) == (agent, instance, 5 + instance)
        assert row["outcome"] == truth[5 + instance].outcome
        assert {key: repr(value) for key, value in truth[5 + instance].numbers.items()} == {
            key: row[key] for key in truth[5 + instance].numbers
        }
    assert {episode.outcome for episode in truth.values()} & {"done", "goal"}


@pytest.mark.parametrize("action", ["steer", "drive"])
@pytest.mark.parametrize("agent", [name for name, *_, is_online in _native.agents() if is_online])
def test_a_crew_decides_the_same_for_mowers_on_a_server(server, agent, action):
    scenario = _native.Scenario(FIELD["scenario"], action={"kind": action})
    here = _native.Batch(scenario, 3, "SameStep", 1, copy=True)
    far = RemoteBatch(scenario, 3, "SameStep", [server.endpoint] * 2, percept=True)
    live = np.ones(3, dtype=bool)
    here.reset([3, 4, 5])
    far.reset([3, 4, 5])
    spec = _native.AgentSpec(agent)
    stopped = 0
    for _ in range(2):
        crew, twins = _native.Crew(spec, [7, 8, 9]), _native.Crew(spec, [7, 8, 9])
        for _ in range(150):
            decided, twin = crew.act(here, live), twins.act(far, live)
            assert same(decided, twin)
            assert [here.summary(row) for row in range(3)] == [far.summary(row) for row in range(3)]
            stopped = sum(stop is not None for stop in decided[1])
            done = here.step(decided[0])
            assert all(map(same, done, far.step(twin[0])))
            if (done[2] | done[3]).any() or stopped == 3:
                break
        # Into another episode in the middle, both.
        here.reset([20, 21, 22])
        for _ in range(30):
            here.step(np.zeros((3, 1 if action == "steer" else 2), np.float32))
        far.restore(here.snapshot())
        # Its weeds were mowed where nobody counted them.
        with pytest.raises(swath.ConfigError, match=r"^`row` must be of an episode that began here"):
            far.summary(0)
        here.reset([30, 31, 32])
        far.reset([30, 31, 32])
    far.close()


def test_a_crew_goes_on_from_a_restored_state(server):
    scenario = _native.Scenario(FIELD["scenario"], action={"kind": "drive"})
    here = _native.Batch(scenario, 2, "SameStep", 1, copy=True)
    far = RemoteBatch(scenario, 2, "SameStep", server.endpoint, percept=True)
    here.reset([1, 2])
    far.reset([8, 9])
    for _ in range(24):
        here.step(np.float32([[0.0, 1.0], [0.1, 1.0]]))
    far.restore(here.snapshot(0), 0)
    far.restore(here.snapshot(1), 1)
    crew, twins = (_native.Crew(_native.AgentSpec("jump"), [0, 0]) for _ in range(2))
    for _ in range(60):
        decided = crew.act(here, np.ones(2, dtype=bool))
        assert same(decided, twins.act(far, np.ones(2, dtype=bool)))
        here.step(decided[0])
        far.step(decided[0])
    far.close()


def test_more_weeds_than_percepts_hold_are_refused_before_any_server_begins(server):
    scenario = _native.Scenario(FIELD["scenario"])
    far = RemoteBatch(scenario, 2, "SameStep", [server.endpoint] * 2, percept=True)
    far.reset([1, 2])
    before = far.snapshot()
    few, many = np.ones((8, 2)), np.ones((9, 2))
    most = "must be at most 8 weeds, as the scenario has, where percepts are told, got 9$"
    for weeds, field in (([few, many], "weeds[1]"), ([many], "weeds")):
        with pytest.raises(swath.ConfigError, match=rf"^`{re.escape(field)}` {most}"):
            far.reset([3, 4], None, weeds)
        assert far.snapshot() == before
    # It has more of them than this scenario has.
    here = _native.Batch(scenario, 2, "SameStep", 1, copy=True)
    here.reset([5, 6], None, [few, many])
    for snapshot, row in ((here.snapshot(), None), (here.snapshot(1), 1)):
        with pytest.raises(swath.ConfigError, match=rf"^`snapshot\[1\]` {most}"):
            far.restore(snapshot, row)
        assert far.snapshot() == before
    far.reset([3, 4], None, [few, few])
    assert far.snapshot() != before
    far.close()


def test_a_crew_needs_percepts(server):
    scenario = _native.Scenario("cowbot-field")
    far = RemoteBatch(scenario, 1, "SameStep", server.endpoint)
    far.reset([1])
    with pytest.raises(swath.ConfigError, match=r"^`percept` must be true where a scripted agent acts, got false$"):
        _native.Crew(_native.AgentSpec("snake"), [0]).act(far, np.ones(1, dtype=bool))
    far.close()


def start(server, out, *flags, policy="snake"):
    command = [sys.executable, "-m", "swath", "worker", "--connect", server.endpoint, "--policy", str(policy)]
    command += ["--scenario", str(FIELD["scenario"]), "--episodes", "24", "--seed", "5", "--out", str(out), *flags]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finished(process):
    out, error = process.communicate(timeout=28)
    assert process.returncode == 0, error
    return out


def journal(out, shard="shard-1-of-1"):
    try:
        return (out / shard / "journal.jsonl").read_bytes().split(b"\n")[1:-1]
    except FileNotFoundError:
        return []


def test_a_worker_that_is_killed_goes_on_and_keeps_every_episode_once(server, whole, tmp_path):
    out = tmp_path / "sweep"
    last = -1
    for _ in range(2):
        process = start(server, out, "--num-envs", "3")
        while process.poll() is None and len(journal(out)) <= last + 2:
            time.sleep(0.002)
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL, "it was killed in the middle"
        last = len(journal(out))
    assert last < 24
    assert work("snake", connect=server.endpoint, out=out, episodes=24, **FIELD).played == 24 - last
    assert same(kept(out), kept(whole))
    instances = [json.loads(line)["instance"] for line in journal(out)]
    assert sorted(instances) == list(range(24))
    assert sorted(entry.name for entry in (out / "shard-1-of-1").iterdir()) == ["journal.jsonl"]


def test_ctrl_c_says_how_to_go_on(server, tmp_path):
    out = tmp_path / "sweep"
    process = start(server, out, "--num-envs", "2")
    while not journal(out):
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=28)
    # A job that takes long has shown a bar before.
    assert error.splitlines()[-1] == "swath: stopped: the same command goes on from here"
    assert process.returncode == 130
    assert not (out / "episodes.csv").exists()


def test_ctrl_c_stays_ctrl_c_where_a_crew_looks_into_a_batch():
    class Held:
        @property
        def native(self):
            raise KeyboardInterrupt

    driver = ScriptedDriver(_native.AgentSpec("snake"))
    with pytest.raises(KeyboardInterrupt):
        driver.act(Held(), None, None, np.zeros(0, dtype=bool))
    with pytest.raises(TypeError, match="must be a `Batch` or a `RemoteBatch`"):
        driver.act(7, None, None, np.zeros(0, dtype=bool))


def test_a_worker_that_has_nothing_left_to_do_needs_no_server(whole, capsys):
    before = (whole / "episodes.csv").read_bytes()
    command = ["worker", "--connect", f"tcp/127.0.0.1:{free_port()}", "--policy", "snake", "--json"]
    command += ["--scenario", str(FIELD["scenario"]), "--episodes", "24", "--seed", "5", "--out", str(whole)]
    assert main(command) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["played"], told["missing"], told["shard"]) == (0, 0, "1/1")
    assert told["summary"] == json.loads((whole / "summary.json").read_text())
    assert told["dataset"] == str(whole / "dataset" / "swath" / "snake-v0")
    assert (whole / "episodes.csv").read_bytes() == before
    # It need not be there, but it must be a server.
    command[2] = "here"
    assert main(command) == 2
    assert capsys.readouterr().err.startswith("swath: `connect` must be an endpoint such as 'tcp/127.0.0.1:7447', got")


def test_a_merge_that_is_cut_off_is_made_again(whole, server, tmp_path, monkeypatch):
    out = tmp_path / "sweep"
    arguments = {"connect": server.endpoint, "out": out, "episodes": 24, **FIELD}

    def fail(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(swath.rollouts.merge.Results, "write", fail)
        with pytest.raises(KeyboardInterrupt):
            work("snake", **arguments)
    assert not (out / "episodes.csv").exists()
    (out / "dataset" / ".unfinished-of-another").mkdir()
    assert work("snake", **arguments).played == 0
    assert same(kept(out), kept(whole))


def test_two_shards_make_the_sweep_of_one(server, whole, tmp_path):
    out = tmp_path / "sweep"
    process = start(server, out, "--shard", "1/2")
    here = work("snake", connect=server.endpoint, out=out, episodes=24, shard="2/2", **FIELD)
    told = finished(process)
    assert here.played == 12
    assert (here.results is not None) or "wrote" in told
    assert same(kept(out), kept(whole))


def test_shards_of_two_machines_are_copied_together(server, whole, tmp_path, capsys):
    out, elsewhere = tmp_path / "sweep", tmp_path / "elsewhere"
    first = work("snake", connect=server.endpoint, out=out, episodes=24, shard="1/3", **FIELD)
    assert (first.played, first.missing, first.results) == (8, 16, None)
    assert finished(start(server, elsewhere, "--shard", "2/3")).startswith(
        "shard 2/3 is done; 16 of 24 episodes are left"
    )
    work("snake", connect=server.endpoint, out=elsewhere, episodes=24, shard="3/3", **FIELD)
    shutil.copytree(elsewhere, out, dirs_exist_ok=True)
    joined = work("snake", connect=server.endpoint, out=out, episodes=24, shard="1/3", **FIELD)
    assert (joined.played, joined.missing) == (0, 0)
    assert same(kept(out), kept(whole))


def test_a_shard_is_played_by_one_worker_at_a_time(server, tmp_path):
    out = tmp_path / "sweep"
    process = start(server, out, "--num-envs", "1")
    while not journal(out):
        time.sleep(0.002)
    process.send_signal(signal.SIGSTOP)
    with pytest.raises(swath.ConfigError, match=r"^`out` must not be in use by another run, got .*shard-1-of-1$"):
        work("snake", connect=server.endpoint, out=out, episodes=24, **FIELD)
    process.kill()
    process.communicate()


def test_episodes_that_another_worker_plays_while_this_one_opens_are_kept_and_not_played_again(
    server, whole, tmp_path, monkeypatch
):
    out, arguments = tmp_path / "sweep", {"connect": server.endpoint, "episodes": 24, **FIELD}
    opens, played = RemoteBatch.__init__, []

    def open_late(*given, **named):
        monkeypatch.setattr(RemoteBatch, "__init__", opens)
        played.append(work("snake", out=out, **arguments).played)
        opens(*given, **named)

    monkeypatch.setattr(RemoteBatch, "__init__", open_late)
    played.append(work("snake", out=out, **arguments).played)
    assert played == [24, 0]
    assert same(kept(out), kept(whole))


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_a_server_that_starts_anew_ends_the_work_by_name_and_it_goes_on(own_server, whole, tmp_path, how):
    out = tmp_path / "sweep"
    process = start(own_server, out, "--num-envs", "2")
    while not journal(out):
        time.sleep(0.002)
    own_server.end(how)
    own_server.start()
    _, error = process.communicate(timeout=28)
    assert process.returncode == 2
    last = error.splitlines()[-1]
    assert last.startswith("swath: ")
    assert last.endswith("; the same command goes on from here")
    before = len(journal(out))
    assert 0 < before < 24
    assert work("snake", connect=own_server.endpoint, out=out, episodes=24, **FIELD).played == 24 - before
    assert same(kept(out), kept(whole))


def test_with_resume_the_work_goes_on_when_a_server_starts_anew(whole, tmp_path):
    server, out = Server("--allow-snapshot"), tmp_path / "sweep"
    try:
        process = start(server, out, "--num-envs", "2", "--resume")
        for count in (1, 5):
            while process.poll() is None and len(journal(out)) < count:
                time.sleep(0.002)
            server.end(signal.SIGKILL)
            server.start()
        finished(process)
    finally:
        server.end(signal.SIGKILL)
    assert same(kept(out), kept(whole))


def train(out, observation, action):
    pytest.importorskip("stable_baselines3")
    from swath import training

    config = training.TrainingConfig.check(
        {
            "algorithm": "maskable-ppo" if action == "target" else "ppo",
            "total_steps": 64,
            "num_envs": 4,
            "scenario": {
                "pasture": {"length_m": 30.0, "width_m": 20.0},
                "episode": {"budget": 0.1},
                "observation": {"kind": observation},
                "action": {"kind": action},
            },
            "hyperparameters": {"n_steps": 16, "batch_size": 32},
        }
    )
    training.train(config, out=out)
    return out / "model.zip"


@pytest.mark.parametrize(("observation", "action"), [("features", "steer"), ("candidates", "target")])
def test_a_trained_model_does_what_it_does_here_however_many_play_together(server, tmp_path, observation, action):
    model = train(tmp_path / "out", observation, action)
    for name, num_envs in [("one", 3), ("other", 2)]:
        work(str(model), connect=server.endpoint, out=tmp_path / name, episodes=3, seed=1, num_envs=num_envs)
    policy = swath.training.load_policy(model)
    name = f"swath/{policy.card.algorithm}-model-v0"
    assert same(kept(tmp_path / "one", name), kept(tmp_path / "other", name))
    env = gym.make(ENV_ID, scenario=policy.card.scenario).unwrapped
    recorded = episodes(tmp_path / "one" / "dataset", name)
    for row, (about, observations, actions, rewards, *_) in zip(rows(tmp_path / "one"), recorded, strict=True):
        observation, info = env.reset(seed=about["seed"])
        over, step = False, 0
        while not over:
            assert same(observation, observations[step])
            masks = info["action_mask"][None] if action == "target" else None
            chosen = policy.predict(observation[None], masks)[0]
            assert same(chosen, actions[step])
            observation, reward, terminated, truncated, info = env.step(chosen)
            assert reward == rewards[step]
            over, step = terminated or truncated, step + 1
        assert {key: str(info[key]) for key in swath.Summary.__annotations__} == {
            key: row[key] for key in swath.Summary.__annotations__
        }


def test_chance_plays_an_episode_as_its_seed_says_in_any_company(server, tmp_path):
    short = {**FIELD, "episode": {"budget": 0.02}, "action": {"kind": "discrete"}}
    for name, num_envs in [("one", 4), ("other", 3)]:
        work("random", connect=server.endpoint, out=tmp_path / name, episodes=4, num_envs=num_envs, **short)
    assert same(kept(tmp_path / "one", "swath/random-v0"), kept(tmp_path / "other", "swath/random-v0"))


REFUSED = [
    ({"policy": "snail"}, "`policy` must be one of bcp, bcp-tsp, "),
    ({"policy": "snake:bend=1"}, "`snake.bend` is not a known key"),
    ({"policy": "no/model.zip"}, "`policy` must be a model with `model.toml` beside it, which `swath train` writes, "),
    ({"episodes": 0}, "`episodes` must be a whole number from 1 to 4294967296, got 0"),
    ({"seed": -1}, "`seed` must be a whole number from 0 to "),
    ({"num_envs": 0}, "`num_envs` must be a whole number from 1 to "),
    ({"connect": []}, "`connect` must name from 1 to 16 servers, no more than `num_envs`, got 0"),
    ({"connect": "here"}, "`connect` must be an endpoint such as 'tcp/127.0.0.1:7447', got 'here'"),
    ({"connect": 5}, "`connect` must be an endpoint such as 'tcp/127.0.0.1:7447', got 5"),
    ({"shard": "0/2"}, "`shard` must be `I/N` with I from 1 to N and N at most 4096, got `0/2`"),
    ({"shard": "3/2"}, "`shard` must be `I/N` with I from 1 to N and N at most 4096, got `3/2`"),
    ({"shard": "one"}, "`shard` must be `I/N` with I from 1 to N and N at most 4096, got `one`"),
    ({"deadline_s": 0}, "`deadline_s` must be from 0.001 to 86400 seconds, got 0"),
    ({"action": {"kind": "target"}}, "`action.kind` must be `steer` or `drive` for a scripted agent, got `target`"),
    ({"reward": {"weed": 0.0}}, "`reward.weed` must not be 0 where a scripted agent acts on a server"),
    ({"policy": "random", "episode": {"budget": float("inf")}}, "`episode.budget` must be finite"),
]


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_what_cannot_be_worked_on_is_refused_in_one_line_and_leaves_nothing(server, changes, message, tmp_path):
    arguments = {"policy": "snake", "connect": server.endpoint, "episodes": 1, "out": tmp_path / "new"} | changes
    with pytest.raises(swath.ConfigError) as error:
        work(**arguments)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_a_server_that_is_not_there_is_named_and_leaves_nothing(tmp_path, capsys):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    command = ["worker", "--connect", endpoint, "--policy", "snake", "--out", str(tmp_path / "new")]
    assert main(command) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"swath: no server at {endpoint}: ")
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"seed": 6}, "seed 5 instead of 6"),
        ({"episodes": 25}, "instances 24 instead of 25"),
        ({"policy": "jump"}, "agents ['snake'] instead of ['jump']"),
        ({"scenario": "pasture"}, "scenario small instead of pasture"),
    ],
)
def test_the_folder_of_another_sweep_is_refused_and_left_alone(server, whole, changes, what):
    before = sorted(path for path in whole.rglob("*"))
    arguments = {"policy": "snake", "connect": server.endpoint, "out": whole, "episodes": 24, **FIELD} | changes
    with pytest.raises(swath.ConfigError) as error:
        work(**arguments)
    assert str(error.value).startswith("`out` must be empty or hold this study, got ")
    assert what.replace("['", "").replace("']", "") in str(error.value).replace("['", "").replace("']", "")
    assert sorted(path for path in whole.rglob("*")) == before


def test_a_folder_with_other_files_or_other_shards_is_refused(server, whole, tmp_path):
    (tmp_path / "diary.txt").write_text("dear diary")
    for out, shard, other in [(tmp_path, "1/1", "diary.txt"), (whole, "1/2", "shard-1-of-1")]:
        with pytest.raises(swath.ConfigError, match=f"with other files, such as {other}$"):
            work("snake", connect=server.endpoint, out=out, episodes=24, shard=shard, **FIELD)


def test_a_trajectory_that_is_gone_is_missed_by_name(server, tmp_path):
    arguments = {"connect": server.endpoint, "out": tmp_path / "sweep", "episodes": 4, **FIELD}
    work("snake", shard="1/2", **arguments)
    (tmp_path / "sweep" / "shard-1-of-2" / "episode-2.npz").write_bytes(b"torn")
    with pytest.raises(swath.ConfigError, match=r"^`out` must hold every episode as it was written, got .*episode-2"):
        work("snake", shard="2/2", **arguments)
    assert not (tmp_path / "sweep" / "episodes.csv").exists()


def test_a_dataset_that_is_damaged_or_gone_is_missed_by_name_and_nothing_is_written(server, whole, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    file = out / "dataset" / "swath" / "snake-v0" / "data" / "main_data.hdf5"
    file.write_bytes(file.read_bytes()[:300])
    again = {"connect": server.endpoint, "out": out, "episodes": 24, **FIELD}
    with pytest.raises(swath.ConfigError, match=r"must hold the dataset as it was written, got a damaged .*main_data"):
        work("snake", **again)
    shutil.rmtree(out / "dataset")
    with pytest.raises(
        swath.ConfigError, match=r"must hold the dataset of its results, got none in .*dataset: play the"
    ):
        work("snake", **again)
    assert not (out / "dataset").exists()


def test_help_tells_every_default(capsys):
    assert main(["worker", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for default in ["[default: 100]", "[default: 0]", "[default: 16]", "[default: 1/1]", "[default: 60.0]"]:
        assert default in text


def test_a_missing_minari_is_answered_with_the_extra_that_brings_it(server, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    command = ["worker", "--connect", server.endpoint, "--policy", "snake", "--out", str(tmp_path / "new")]
    assert main(command) == 2
    assert capsys.readouterr().err == "swath: a worker needs minari: pip install 'swath[data]'\n"
