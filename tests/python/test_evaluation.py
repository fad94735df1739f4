"""An evaluation gives the same rows however it was run, and says what they mean."""

import json
import math
import os
import time
from pathlib import Path

import numpy as np
import pytest
from rows import csv_of, rows_of

import swath
from swath import _native

COLUMNS = [
    "scenario",
    "agent",
    "instance",
    "seed",
    "weeds_total",
    "weeds_detected",
    "weeds_mowed",
    "path_length_m",
    "bcp_length_m",
    "path_fraction",
    "seen_fraction",
    "outcome",
    "wall_s",
]
SWEEP = """
id = "swath/MowerRouting-v0"
[pasture]
length_m = 36.0
width_m = 26.0
[[sweep]]
name = "density"
"weeds.count" = [5, 10]
"weeds.distribution" = ["uniform", "gaussian"]
[[sweep]]
name = "turns"
"mower.turning_radius_m" = [1.0, 3.0]
"""


@pytest.fixture
def sweep(tmp_path):
    file = tmp_path / "farm.toml"
    file.write_text(SWEEP)
    return file


# Files


def test_the_columns_are_the_promised_ones(tmp_path):
    swath.evaluate("jump,snake", scenario="cowbot-field", instances=3, seed=5, out=tmp_path / "out")
    rows = rows_of(tmp_path / "out")
    assert list(rows[0]) == COLUMNS
    assert [(row["agent"], row["instance"], row["seed"]) for row in rows] == [
        (agent, str(i), str(5 + i)) for agent in ("jump", "snake") for i in range(3)
    ]
    assert sorted(entry.name for entry in (tmp_path / "out").iterdir()) == [
        "episodes.csv",
        "journal.jsonl",
        "scenario.toml",
        "summary.json",
    ]


def test_swept_keys_are_columns_and_cells_come_in_order(sweep, tmp_path):
    swath.evaluate(["bcp"], scenario=sweep, instances=2, out=tmp_path / "out")
    rows = rows_of(tmp_path / "out")
    keys = ["weeds.count", "weeds.distribution", "mower.turning_radius_m"]
    assert list(rows[0]) == COLUMNS[:4] + keys + COLUMNS[4:]
    cells = [(row["scenario"], *(row[key] for key in keys)) for row in rows[::2]]
    assert cells == [
        ("farm/density", "5", "uniform", "2.0"),
        ("farm/density", "5", "gaussian", "2.0"),
        ("farm/density", "10", "uniform", "2.0"),
        ("farm/density", "10", "gaussian", "2.0"),
        ("farm/turns", "40", "uniform", "1.0"),
        ("farm/turns", "40", "uniform", "3.0"),
    ]


def test_one_sweep_can_be_picked(sweep):
    results = swath.evaluate(["bcp"], scenario=sweep, instances=1, only="turns")
    assert [cell.name for cell in results.study.cells] == ["farm/turns", "farm/turns"]
    assert results.study.keys == ["mower.turning_radius_m"]


def test_sources_are_joined_and_each_key_has_its_value_everywhere(sweep, tmp_path):
    results = swath.evaluate(["bcp"], scenario=["cowbot-field", sweep], instances=1, out=tmp_path / "out")
    first = results.study.cells[0]
    assert first.name == "cowbot-field"
    assert first.values == {"weeds.count": 14, "weeds.distribution": "uniform", "mower.turning_radius_m": 1.5}
    assert (tmp_path / "out" / "scenario-2.toml").exists()


def test_every_row_is_the_episode_that_run_episode_gives():
    results = swath.evaluate(["snake", "bcp:spacing=sensor"], scenario="cowbot-field", instances=3, seed=30)
    for row in results.rows:
        episode = swath.run_episode(row.agent, scenario="cowbot-field", seed=row.seed)
        for name in COLUMNS[4:-1]:
            assert getattr(row, name) == getattr(episode, name)
        assert row.wall_s > 0


def test_the_written_scenario_runs_again_to_the_same_rows(sweep, tmp_path):
    swath.evaluate(["jump"], scenario=sweep, only="density", instances=2, out=tmp_path / "one")
    (tmp_path / "again").mkdir()
    scenario = tmp_path / "again" / "farm.toml"
    scenario.write_text((tmp_path / "one" / "scenario.toml").read_text())
    swath.evaluate(["jump"], scenario=scenario, instances=2, out=tmp_path / "two")
    assert csv_of(tmp_path / "one") == csv_of(tmp_path / "two")


def test_the_written_scenario_of_a_sweep_over_given_weeds_runs_again(tmp_path):
    farm = tmp_path / "farm.toml"
    sweep = '[[sweep]]\nname = "given"\n"weeds.positions_m" = [[[3.0, 4.0]], [[5.0, 6.0], [30.0, 20.0]]]\n'
    farm.write_text(f"[weeds]\ncount = 7\n{sweep}")
    results = swath.evaluate(["jump"], scenario=farm, instances=1, out=tmp_path / "one")
    assert [row.weeds_total for row in results.rows] == [1, 2]
    farm.write_text((tmp_path / "one" / "scenario.toml").read_text())
    swath.evaluate(["jump"], scenario=farm, instances=1, out=tmp_path / "two")
    assert csv_of(tmp_path / "one") == csv_of(tmp_path / "two")


def test_floats_are_written_so_that_they_read_back_the_same(tmp_path):
    results = swath.evaluate(["jump"], scenario="cowbot-field", instances=4, out=tmp_path / "out")
    for row, line in zip(results.rows, rows_of(tmp_path / "out"), strict=True):
        assert float(line["path_length_m"]) == row.path_length_m
        assert line["path_length_m"] == repr(row.path_length_m)


def test_the_rows_can_be_written_on_their_own(tmp_path):
    results = swath.evaluate(["jump"], scenario="cowbot-field", instances=2)
    results.to_csv(tmp_path / "rows.csv")
    assert (tmp_path / "rows.csv").read_text() == results.csv()
    assert [entry.name for entry in tmp_path.iterdir()] == ["rows.csv"]


# Threads


def test_the_number_of_threads_changes_nothing_but_the_clock(sweep, tmp_path):
    for jobs in (1, 2, 4):
        swath.evaluate("jump,react", scenario=sweep, instances=3, jobs=jobs, out=tmp_path / str(jobs))
    for name in ("summary.json", "scenario.toml"):
        assert len({(tmp_path / str(jobs) / name).read_bytes() for jobs in (1, 2, 4)}) == 1
    assert csv_of(tmp_path / "1") == csv_of(tmp_path / "2") == csv_of(tmp_path / "4")


def test_a_stream_that_nobody_reads_any_more_stops_soon():
    scenario, agent = _native.Scenario("pasture", weeds={"count": 640}), _native.AgentSpec("snake")
    stream = _native.EpisodeStream([scenario], [agent], [(0, 0, i) for i in range(100_000)], 0, 1)
    next(stream)
    del stream
    time.sleep(0.2)
    before = time.process_time()
    time.sleep(0.3)
    assert time.process_time() - before < 0.2


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"agents": []}, "`agents` must name at least one, got none"),
        ({"agents": 5}, "`agents` must be names of agents, such as `snake`, got 5"),
        ({"agents": ["jump", 5]}, "`agent` must be a name such as `snake` or `bcp:spacing=sensor`, got 5"),
        ({"agents": "jump,jump"}, "`agents` must differ in their names, got `jump` twice"),
        (
            {"agents": "bcp, bcp:spacing=deck"},
            "`agents` must differ in their names, got `bcp` and `bcp:spacing=deck`, which are the same",
        ),
        ({"scenario": []}, "`scenario` must name at least one, got none"),
        ({"scenario": ["pasture", "pasture"]}, "`scenario` must differ in their names, got `pasture` twice"),
        ({"instances": 0}, "`instances` must be a whole number from 1 to 4294967296, got 0"),
        ({"instances": 1.5}, "`instances` must be a whole number from 1 to 4294967296, got 1.5"),
        ({"seed": -1}, "`seed` must be a whole number from 0 to 18446744073709551614, got -1"),
        (
            {"seed": (1 << 64) - 1},
            "`seed` must be a whole number from 0 to 18446744073709551614, got 18446744073709551615",
        ),
        ({"jobs": 0}, "`jobs` must be a whole number from 1 to 4096, got 0"),
        ({"versus": "bcp"}, "`versus` must be one of the agents jump, got `bcp`"),
        ({"only": "density"}, "`only` must be left out, since pasture declares no sweep, got density"),
    ],
)
def test_an_argument_that_cannot_be_used_is_refused_before_anything_is_written(tmp_path, change, text):
    arguments = {"agents": "jump", "scenario": "pasture", "instances": 2, "out": tmp_path / "out"}
    with pytest.raises(swath.ConfigError) as error:
        swath.evaluate(**(arguments | change))
    assert str(error.value) == text
    assert list(tmp_path.iterdir()) == []


def test_seeds_reach_to_the_last_one():
    results = swath.evaluate("bcp", scenario="cowbot-field", instances=2, seed=(1 << 64) - 2)
    assert [row.seed for row in results.rows] == [(1 << 64) - 2, (1 << 64) - 1]


def test_the_summary_says_what_the_rows_say(tmp_path):
    results = swath.evaluate("jump,snake", scenario="cowbot-field", instances=6, versus="snake", out=tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary == results.summary()
    (cell,) = summary["cells"]
    assert cell["hash"] == swath.Scenario("cowbot-field").hash
    by_agent = {about["agent"]: about for about in cell["agents"]}
    paths = {
        agent: np.array([r.path_length_m / r.bcp_length_m * 100 for r in results.rows if r.agent == agent])
        for agent in by_agent
    }
    for agent, about in by_agent.items():
        assert about["path_percent"]["mean"] == pytest.approx(paths[agent].mean())
        assert about["path_percent"]["sd"] == pytest.approx(paths[agent].std(ddof=1))
        mowed = np.mean([100 * r.weeds_mowed / r.weeds_total for r in results.rows if r.agent == agent])
        assert about["mowed_percent"]["mean"] == pytest.approx(mowed)
        assert about["outcomes"] == {"done": 6}
    assert [(pair["agent"], pair["versus"]) for pair in cell["comparisons"]] == [("jump", "snake"), ("snake", "jump")]
    differences = paths["jump"] - paths["snake"]
    points = cell["comparisons"][0]["path_points"]
    assert points["mean"] == pytest.approx(differences.mean())
    # Student's t with 5 degrees of freedom: 2.5706.
    assert points["high"] - points["mean"] == pytest.approx(2.5706 * differences.std(ddof=1) / math.sqrt(6), rel=1e-4)


def test_the_table_names_agents_cells_and_the_paired_difference():
    results = swath.evaluate("bcp,bcp:spacing=sensor", scenario="cowbot-field", instances=4)
    lines = results.table().splitlines()
    assert "path - bcp" in lines[0]
    assert lines[2].split()[:6] == ["cowbot-field", "bcp", "4", "100.00", "±", "0.00"]
    # The search sweep: 3 passes of 36 m and 2 turns with R = 1.5 and 12 m between the passes, in % of 897.519 m.
    percent = 100 * (3 * 36 + 2 * (1.5 * math.pi + 9)) / 897.5189
    assert f"{percent:.2f} ± 0.00" in lines[3]
    assert f"{percent - 100:.2f} ± 0.00" in lines[3]


def test_nothing_to_mow_counts_as_all_mowed():
    results = swath.evaluate("bcp", scenario={"weeds": {"count": 0}}, instances=1)
    assert results.rows[0].mowed_percent == 100.0


def test_the_instances_of_the_environment_are_those_of_the_evaluation():
    rows = swath.evaluate("bcp", scenario="cowbot-field", instances=2, seed=8).rows
    weeds = [swath.run_episode("bcp", scenario="cowbot-field", seed=8 + i).weeds_m for i in range(2)]
    assert [row.weeds_total for row in rows] == [len(one) for one in weeds]
    assert not np.array_equal(*weeds)


def test_no_path_of_this_machine_is_in_the_results(tmp_path):
    file = tmp_path / "field.toml"
    file.write_text("[weeds]\ncount = 3\n")
    swath.evaluate("bcp", scenario=file, instances=1, out=tmp_path / "out")
    for entry in (tmp_path / "out").iterdir():
        assert os.fspath(tmp_path) not in entry.read_text()
        assert str(Path.home()) not in entry.read_text()
