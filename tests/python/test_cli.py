"""The command line: what it prints, and one clear line with status 2 for whatever cannot be used."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import swath
from swath import _native
from swath.share import share

NAMES = [name for name, *_ in _native.agents()]
AGENTS = [name for name in NAMES if name != "clairvoyant"]


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def refused(result):
    """The one line of a refusal, without what every such line begins with."""
    status, out, err = result
    assert (status, out) == (2, "")
    assert err.startswith("swath: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1
    return err.removeprefix("swath: ").removesuffix("\n")


def names(folder="."):
    return sorted(entry.name for entry in Path(folder).iterdir())


def scenario(text, name="mine.toml"):
    Path(name).write_text(text)
    return name


BAD_SCENARIOS = [
    ("[mower]\ndeck_widht_m = 2", "`mower.deck_widht_m` is not a known key; did you mean `mower.deck_width_m`?"),
    ("[mowr]\ndeck_width_m = 2", "`mowr` is not a known key; did you mean `mower`?"),
    ("[mower]\ndeck_width_m = nan", "`mower.deck_width_m` must be finite and > 0, got NaN"),
    ("[pasture]\nheadland_m = nan", "`pasture.headland_m` must be >= 0 or inf, got NaN"),
    ("[pasture]\nlength_m = -100", "`pasture.length_m` must be finite and > 0, got -100"),
    ("[pasture]\nwidth_m = 0", "`pasture.width_m` must be finite and > 0, got 0"),
    ("[sensor]\nrange_m = -1.5", "`sensor.range_m` must be finite and > 0, got -1.5"),
    ("[weeds]\ncount = -1", "`weeds.count` must be a whole number >= 0, got integer `-1`"),
    ("[mower]\nturning_radius_m = 0", "`mower.turning_radius_m` must be finite and > 0, got 0"),
    ("[mower]\ndeck_width_m = 0", "`mower.deck_width_m` must be finite and > 0, got 0"),
    ("[pasture]\nwidth_m = 1.0", "`mower.deck_width_m` must be at most the pasture's smaller side, 1 m, got 2"),
    ("[weeds]\nfile = 'none.csv'", "cannot read `weeds.file` none.csv: No such file or directory (os error 2)"),
    (
        "[weeds]\nfile = 'weeds.csv'",
        "`weeds.file` weeds.csv, line 2: expected two finite numbers, x and y in metres, got `3,many`",
    ),
    (
        "[weeds]\npositions_m = [[1.0, 1.0], [1.0, 41.0]]",
        "`weeds.positions_m[1]` must be on the pasture, 0..=100 by 0..=40 m, got [1, 41]",
    ),
    ("[weeds]\ndistribution = 'even'", "`weeds.distribution` must be `uniform` or `gaussian`, got `even`"),
    ("weeds = ", "line 1: "),
    ("id = 'swath/Nothing-v0'", "`id` must be `swath/MowerRouting-v0`, got `swath/Nothing-v0`"),
    ("[[sweep]]\nname = 'a'\n'weeds.cuont' = [1]", "`weeds.cuont` is not a known key; did you mean `weeds.count`?"),
]


@pytest.mark.parametrize("command", [["run", "jump", "--scenario"], ["evaluate", "--agents", "jump"], ["config"]])
def test_the_file_of_a_training_is_no_scenario_and_one_line_says_where_it_has_one(call, command):
    file = scenario("algorithm = 'ppo'\ntotal_steps = 64\n[scenario.weeds]\ncount = 3")
    assert refused(call(*command, file)) == (
        "`scenario` must be the file of a scenario, got mine.toml, the file of a training, "
        "whose own is its block `scenario`"
    )


@pytest.mark.parametrize(("text", "line"), BAD_SCENARIOS, ids=[text.split("\n")[-1] for text, _ in BAD_SCENARIOS])
@pytest.mark.parametrize("command", ["evaluate", "run", "config"])
def test_a_bad_scenario_is_refused_in_one_line_and_nothing_is_written(call, command, text, line):
    Path("weeds.csv").write_text("1,2\n3,many\n")
    file = scenario(text)
    arguments = {
        "evaluate": ["evaluate", file, "--agents", "jump", "--instances", 2, "--out", "out"],
        "run": ["run", "jump", "--scenario", file, "--trajectory", "path.csv"],
        "config": ["config", file],
    }[command]
    named = "mine.toml, " if line.startswith("line ") else "mine.toml: "
    assert refused(call(*arguments)).startswith(named + line)
    assert names() == ["mine.toml", "weeds.csv"]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["evaluate", "nowhere", "--agents", "jump"], "cannot read nowhere: no such file, and no shipped scenario"),
        (
            ["evaluate", "pastrue", "--agents", "jump"],
            "cannot read pastrue: no such file, and no shipped scenario (default, pasture, cowbot-field, table1); "
            "did you mean `pasture`?",
        ),
        (
            ["evaluate", "pasture", "--agents", "jmup"],
            f"`agent` must be one of {', '.join(NAMES)}, got `jmup`; did you mean `jump`?",
        ),
        (
            ["evaluate", "pasture", "--agents", "bcp:spacng=deck"],
            "`bcp.spacng` is not a known key; did you mean `bcp.spacing`?",
        ),
        (
            ["evaluate", "pasture", "--agents", "bcp:spacing=wide"],
            "`bcp.spacing` must be `deck` or `sensor`, got `wide`",
        ),
        (
            ["evaluate", "pasture", "--agents", "bcp:spacing"],
            "`agent` must be written `name` or `name:option=value`, got",
        ),
        (["evaluate", "pasture", "--agents", "jump,jump"], "`agents` must differ in their names, got `jump` twice"),
        (["evaluate", "pasture", "--agents", ""], "`agent` must be one of"),
        (
            ["evaluate", "table1", "--agents", "jump", "--only", "densty"],
            "`only` must be one of density, turning-radius, ",
        ),
        (
            ["evaluate", "pasture", "--agents", "jump", "--only", "density"],
            "`only` must be left out, since pasture declares no",
        ),
        (
            ["evaluate", "pasture", "--agents", "jump", "--versus", "snake"],
            "`versus` must be one of the agents jump, got `snake`",
        ),
        (["evaluate", "pasture", "--agents", "jump", "--instances", "0"], "`instances` must be a whole number from 1"),
        (
            ["evaluate", "pasture", "--agents", "jump", "--instances", "many"],
            "`--instances` must be a whole number, got 'many'",
        ),
        (["top", "--connect", "x", "--every", "1s"], "`--every` must be a number, got '1s'"),
        (["evaluate", "pasture", "--agents", "jump", "--seed", "-1"], "`seed` must be a whole number from 0"),
        (["evaluate", "pasture", "--agents", "jump", "--seed", str(1 << 64)], "`seed` must be a whole number from 0"),
        (
            ["evaluate", "pasture", "--agents", "jump", "--jobs", "0"],
            "`jobs` must be a whole number from 1 to 4096, got 0",
        ),
        (["evaluate", "--agents", "jump"], "Missing argument 'SCENARIO...'"),
        (["evaluate", "pasture", "--agents", "jump", "--agnets", "x"], "No such option: --agnets"),
        (
            ["evaluate", "pasture", "--agents", "jump", "--instances", "1", "--out", "/dev/null/out"],
            "cannot use /dev/null/out: Not a",
        ),
        (["run", "jump", "--scenario", "table1"], "table1 declares the sweep `density`: it is for `swath evaluate`"),
        (["run", "jmup"], "`agent` must be one of"),
        (["run", "jump", "--seed", "-1"], "`seed` must be a whole number from 0"),
        (["run", "jump", "--trajectory", "nowhere/path.csv"], "cannot use nowhere/path.csv: No such file or directory"),
        (["run", "jump", "--trajectory", "."], "`trajectory` must be a file, got the folder ."),
        (["run"], "Missing argument 'AGENT'"),
        (["config", "nowhere"], "cannot read nowhere: no such file"),
        (["demo", "--instances", "0"], "`instances` must be a whole number from 1"),
        (["fly"], "No such command 'fly'"),
        (["--wings"], "No such option: --wings"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_arguments_are_refused_in_one_line_and_nothing_is_written(call, arguments, line):
    out = [] if "--out" in arguments or arguments[0] != "evaluate" else ["--out", "out"]
    assert refused(call(*arguments, *out)).startswith(line)
    assert names() == []


def test_a_file_cannot_be_the_folder_of_results(call):
    Path("out").write_text("mine")
    for command in (["evaluate", "pasture", "--agents", "jump"], ["demo"]):
        assert refused(call(*command, "--out", "out")) == "`out` must be a folder, got the file out"
    assert Path("out").read_text() == "mine"


def test_a_folder_of_something_else_is_refused(call):
    Path("out").mkdir()
    Path("out/notes.txt").write_text("mine")
    line = refused(call("evaluate", "pasture", "--agents", "jump", "--out", "out"))
    assert line == "`out` must be empty or hold this study, got out with other files, such as notes.txt"
    assert names("out") == ["notes.txt"]


def test_gym_make_refuses_a_file_with_sweeps():
    file = scenario("[[sweep]]\nname = 'density'\n'weeds.count' = [1, 2]")
    with pytest.raises(swath.ConfigError, match=r"mine\.toml declares the sweep `density`: it is for `swath evaluate`"):
        gym.make("swath/MowerRouting-v0", scenario=file)


def test_a_reader_that_goes_away_is_no_trouble():
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "swath", "agents"]
    process = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (process.returncode, process.stderr) == (1, "")


# What commands print


def test_evaluate_prints_a_table_and_writes_rows(call):
    status, out, err = call(
        "evaluate", "cowbot-field", "--agents", "jump,snake", "--instances", 3, "--out", "out", "--jobs", 1
    )
    assert (status, err) == (0, "")
    assert "path - jump" in out
    assert out.splitlines()[-1] == "wrote out/episodes.csv and out/summary.json"
    assert len(Path("out/episodes.csv").read_text().splitlines()) == 1 + 2 * 3


def test_evaluate_without_agents_races_the_six_planners_of_the_paper(call):
    _, out, _ = call("evaluate", "pasture", "--instances", 1, "--json")
    agents = [row["agent"] for row in json.loads(out)["cells"][0]["agents"]]
    assert agents == ["bcp", "bcp-tsp", "react", "jump", "snake", "r-snake"]


def test_evaluate_prints_its_summary_as_json(call):
    status, out, _ = call(
        "evaluate", "cowbot-field", "--agents", "jump,snake", "--instances", 3, "--out", "out", "--json"
    )
    assert status == 0
    assert json.loads(out) == json.loads(Path("out/summary.json").read_text())


def test_evaluate_takes_several_scenarios(call):
    status, out, _ = call("evaluate", "cowbot-field", "pasture", "--agents", "bcp", "--instances", 1)
    assert status == 0
    assert [line.split()[0] for line in out.splitlines() if " done" in line] == ["cowbot-field", "pasture"]


def test_run_prints_the_numbers_of_an_episode(call):
    episode = swath.run_episode("jump", scenario="cowbot-field", seed=7)
    status, out, _ = call(
        "run", "jump", "--scenario", "cowbot-field", "--seed", 7, "--json", "--trajectory", "path.csv"
    )
    assert status == 0
    numbers = json.loads(out)
    assert (numbers["agent"], numbers["scenario"], numbers["seed"]) == ("jump", "cowbot-field", 7)
    for name in swath.Summary.__annotations__:
        assert numbers[name] == getattr(episode, name)
    with Path("path.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["x_m", "y_m", "heading_rad", "path_m"]
    assert np.array_equal(np.array(rows, dtype=float), episode.trajectory)


def test_run_prints_lines_for_people(call):
    status, out, _ = call("run", "bcp", "--scenario", "cowbot-field")
    assert status == 0
    assert "outcome          done" in out.splitlines()
    told = dict(line.split() for line in out.splitlines())
    assert (told["path_length_m"], told["path_fraction"], told["seen_fraction"]) == ("897.519", "1.0000", "1.0000")


def test_a_share_that_is_not_whole_is_not_called_whole():
    assert [share(value, 1, whole=100) for value in (99.96, 99.94, 100, 130.06, 0)] == [
        "99.9",
        "99.9",
        "100.0",
        "130.1",
        "0.0",
    ]
    assert share(0.99999, 4) == "0.9999"


def test_config_prints_every_key_so_that_it_reads_back_the_same(call):
    status, out, _ = call("config", "cowbot-field")
    assert status == 0
    assert swath.Scenario(scenario(out)) == swath.Scenario("cowbot-field")


def test_config_keeps_the_sweeps(call):
    _, out, _ = call("config", "table1")
    _, again, _ = call("config", scenario(out, "table1.toml"))
    assert out == again
    assert [line for line in out.splitlines() if line.startswith("name = ")] == [
        f'name = "{name}"' for name in ("density", "turning-radius", "sensor-width", "sensor-range")
    ]


def test_config_prints_the_schema(call):
    _, out, _ = call("config", "--schema")
    assert "weeds" in json.loads(out)["properties"]


def test_agents_are_listed_one_a_line(call):
    _, out, _ = call("agents")
    assert [line.split()[0] for line in out.splitlines()] == NAMES
    _, out, _ = call("agents", "--json")
    assert [row["agent"] for row in json.loads(out)] == NAMES


@pytest.mark.parametrize(
    "command", [[], ["evaluate"], ["run"], ["config"], ["agents"], ["demo"], ["replay"], ["report"]]
)
def test_every_command_explains_itself(call, command):
    status, out, err = call(*command, "--help")
    assert (status, err) == (0, "")
    assert out.startswith(" ".join(["Usage: swath", *command]))


def test_defaults_are_shown(call):
    _, out, _ = call("evaluate", "--help")
    assert "[default: 100]" in out
    assert "[default: (all cores)]" in out


def test_without_a_command_there_is_help(call):
    status, out, _ = call()
    assert status == 0
    assert "evaluate" in out


def test_the_version_is_printed(call):
    assert call("--version") == (0, f"{swath.__version__}\n", "")


def test_python_dash_m_is_the_same_command():
    process = subprocess.run([sys.executable, "-m", "swath", "--version"], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == swath.__version__


# The demo


def test_the_demo_leaves_a_table_rows_and_pictures(call):
    status, out, _ = call("demo", "--out", "demo", "--instances", 2)
    assert status == 0
    for pasture in ("cowbot-field", "pasture"):
        for agent in AGENTS:
            assert any(line.split()[:2] == [pasture, agent] for line in out.splitlines())
            assert Path(f"demo/{pasture}-{agent}.png").read_bytes().startswith(b"\x89PNG")
    assert {"episodes.csv", "summary.json", "snake.html"} <= set(names("demo"))
    assert out.splitlines()[-1].startswith("wrote demo/snake.html: open it in a browser to watch snake")
    assert Path("demo/snake.html").read_text().startswith("<!doctype html>")
    with Path("demo/episodes.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * len(AGENTS) * 2
    assert not [name for name in names("demo") if name.startswith(".")]
    # Again, over its own files.
    assert call("demo", "--out", "demo", "--instances", 2)[0] == 0


def test_the_demo_leaves_the_folders_of_others_alone(call):
    Path("mine").mkdir()
    Path("mine/notes.txt").write_text("notes")
    status, _, err = call("demo", "--out", "mine", "--instances", 1)
    assert status == 2
    assert "`out` must be empty or hold an earlier demo, got mine with other files, such as notes.txt" in err
    assert names("mine") == ["notes.txt"]
