"""An evaluation gives the same rows however it was run, loses none, runs none twice, and says what they mean."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import swath
from swath import _native
from swath.evaluation.journal import Journal
from swath.evaluation.statistics import spread
from swath.evaluation.study import Study

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


def rows_of(folder):
    with (folder / "episodes.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def without_wall_s(text):
    """The CSV without its last column, which is the only one that a clock has written."""
    header, *lines = text.splitlines()
    assert header.endswith(",wall_s")
    return [line.rpartition(",")[0] for line in (header, *lines)]


def csv_of(folder):
    return without_wall_s((folder / "episodes.csv").read_text())


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


# Resuming


def command(folder, *more):
    arguments = ["table1", "--only", "density", "--agents", "jump,snake", "--instances", "120", "--out", str(folder)]
    return [sys.executable, "-m", "swath", "evaluate", *arguments, *more]


def interrupted(folder, sign, at_least):
    """Starts an evaluation, and sends it a signal once it has kept some rows. Returns the process, which has ended."""
    process = subprocess.Popen(
        command(folder, "--jobs", "2"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell that runs the tests in the background has them ignore Ctrl-C, and with them all that they start.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    journal = folder / "journal.jsonl"
    while not (journal.exists() and journal.read_bytes().count(b"\n") > at_least):
        assert process.poll() is None, "it was over before it could be stopped"
        time.sleep(0.005)
    process.send_signal(sign)
    process.stdout_text, process.stderr_text = process.communicate()
    return process


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "out"
    swath.evaluate("jump,snake", scenario="table1", only="density", instances=120, out=folder)
    return folder


def test_a_killed_evaluation_goes_on_where_it_was_and_runs_nothing_twice(tmp_path, undisturbed):
    folder = tmp_path / "out"
    interrupted(folder, signal.SIGKILL, at_least=100)
    kept = (folder / "journal.jsonl").read_bytes()
    kept = kept[: kept.rindex(b"\n") + 1]
    assert 100 < kept.count(b"\n") < 2881
    assert not (folder / "episodes.csv").exists()
    subprocess.run(command(folder, "--jobs", "1"), check=True, capture_output=True)
    journal = (folder / "journal.jsonl").read_bytes()
    assert journal.startswith(kept)
    rows = [json.loads(line) for line in journal.splitlines()[1:]]
    assert len({(row["cell"], row["agent"], row["instance"]) for row in rows}) == len(rows) == 2880
    assert csv_of(folder) == csv_of(undisturbed)
    assert (folder / "summary.json").read_bytes() == (undisturbed / "summary.json").read_bytes()


def test_ctrl_c_says_how_to_go_on(tmp_path, undisturbed):
    folder = tmp_path / "out"
    process = interrupted(folder, signal.SIGINT, at_least=10)
    assert process.returncode == 130
    assert process.stderr_text.splitlines()[-1] == "swath: stopped: the same command goes on from here"
    assert "Traceback" not in process.stderr_text
    subprocess.run(command(folder), check=True, capture_output=True)
    assert csv_of(folder) == csv_of(undisturbed)


def test_a_finished_evaluation_is_not_run_again(undisturbed):
    before = (undisturbed / "journal.jsonl").read_bytes()
    text = (undisturbed / "episodes.csv").read_text()
    swath.evaluate("jump,snake", scenario="table1", only="density", instances=120, out=undisturbed)
    assert (undisturbed / "journal.jsonl").read_bytes() == before
    assert (undisturbed / "episodes.csv").read_text() == text


@pytest.mark.parametrize("torn", [b'{"cell": 0, "scena', b"\x00\x00", b"{"])
def test_a_torn_last_line_is_dropped_and_its_episode_runs_again(tmp_path, torn):
    arguments = {"scenario": "cowbot-field", "instances": 4, "out": tmp_path / "out"}
    swath.evaluate("jump", **arguments)
    journal = tmp_path / "out" / "journal.jsonl"
    whole = journal.read_bytes()
    lines = whole.splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:-1]) + torn)
    text = csv_of(tmp_path / "out")
    swath.evaluate("jump", **arguments)
    assert csv_of(tmp_path / "out") == text
    assert journal.read_bytes().startswith(b"".join(lines[:-1]))
    assert len(journal.read_bytes().splitlines()) == 5


def test_rows_that_another_run_writes_between_reading_and_entering_are_kept(tmp_path, undisturbed):
    study = Study.plan("jump,snake", scenario="table1", instances=120, seed=0, only="density")
    rows = list(Journal(undisturbed, study).rows.values())
    early = Journal(tmp_path / "out", study)
    assert early.rows == {}
    with Journal(tmp_path / "out", study) as other:
        for row in rows[:2]:
            other.write(row)
    with (tmp_path / "out" / "journal.jsonl").open("ab") as file:
        file.write(b'{"cell": 0, "ag')
    with early:
        assert list(early.rows.values()) == rows[:2]
        early.write(rows[2])
    assert list(Journal(tmp_path / "out", study).rows.values()) == rows[:3]


def test_a_journal_without_a_whole_first_line_is_begun_again(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "journal.jsonl").write_bytes(b'{"swath": "0.')
    swath.evaluate("jump", scenario="cowbot-field", instances=1, out=tmp_path / "out")
    assert len(rows_of(tmp_path / "out")) == 1


def test_an_episode_that_is_there_twice_is_compared_and_counted_once(tmp_path):
    arguments = {"scenario": "cowbot-field", "instances": 2, "out": tmp_path / "out"}
    once = swath.evaluate("jump", **arguments)
    journal = tmp_path / "out" / "journal.jsonl"
    whole = journal.read_text()
    row = json.loads(whole.splitlines()[1])
    journal.write_text(whole + json.dumps(row | {"wall_s": 9.0}) + "\n")
    assert swath.evaluate("jump", **arguments).rows == once.rows
    journal.write_text(whole + json.dumps(row | {"weeds_mowed": 0}) + "\n")
    with pytest.raises(swath.SwathError, match=r"instance \d of jump on cowbot-field must end one way, got .* and .*"):
        swath.evaluate("jump", **arguments)


@pytest.mark.parametrize("damage", ["nonsense", "[]", '{"cell": 0}'])
def test_a_journal_that_is_damaged_elsewhere_is_refused(tmp_path, damage):
    arguments = {"scenario": "cowbot-field", "instances": 2, "out": tmp_path / "out"}
    swath.evaluate("jump", **arguments)
    journal = tmp_path / "out" / "journal.jsonl"
    header, _, last = journal.read_text().splitlines(keepends=True)
    journal.write_text(f"{header}{damage}\n{last}")
    before = journal.read_bytes()
    with pytest.raises(swath.ConfigError, match="got a damaged line 2 in"):
        swath.evaluate("jump", **arguments)
    assert journal.read_bytes() == before


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 999999},
        {"seed": 1.0},
        {"cell": -1},
        {"cell": 1},
        {"cell": False},
        {"instance": 2},
        {"instance": -1},
        {"scenario": "pasture"},
        {"agent": "snake"},
        {"weeds_total": 3},
        {"weeds_total": "14"},
        {"weeds_mowed": 15},
        {"weeds_mowed": -1},
        {"weeds_detected": 15},
        {"path_length_m": 1.0},
        {"path_length_m": float("nan")},
        {"path_length_m": -1.0, "path_fraction": -1.0, "bcp_length_m": 1.0},
        {"seen_fraction": 1.01},
        {"outcome": None},
        {"wall_s": -1.0},
    ],
)
def test_a_row_that_the_study_cannot_have_brought_about_is_a_damaged_line(tmp_path, change):
    arguments = {"scenario": "cowbot-field", "instances": 2, "out": tmp_path / "out"}
    swath.evaluate("jump", **arguments)
    journal = tmp_path / "out" / "journal.jsonl"
    header, first, last = journal.read_text().splitlines(keepends=True)
    journal.write_text(f"{header}{json.dumps(json.loads(first) | change)}\n{last}")
    (tmp_path / "out" / "episodes.csv").unlink()
    with pytest.raises(swath.ConfigError) as error:
        swath.evaluate("jump", **arguments)
    expected = f"`out` must hold the journal as it was written, got a damaged line 2 in {journal}"
    assert str(error.value) == expected
    assert not (tmp_path / "out" / "episodes.csv").exists()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"seed": 1}, "seed 0 instead of 1"),
        ({"instances": 3}, "instances 2 instead of 3"),
        ({"agents": "snake"}, "agents jump instead of snake"),
        ({"agents": "jump,snake"}, "1 agents instead of 2"),
        ({"scenario": "pasture"}, "scenario cowbot-field instead of pasture"),
        ({"scenario": {"weeds": {"count": 3}}}, "scenario cowbot-field instead of scenario"),
    ],
)
def test_a_folder_of_another_study_is_refused_and_left_alone(tmp_path, change, text):
    arguments = {"agents": "jump", "scenario": "cowbot-field", "instances": 2, "out": tmp_path}
    swath.evaluate(**arguments)
    before = {entry.name: entry.read_bytes() for entry in tmp_path.iterdir()}
    with pytest.raises(swath.ConfigError) as error:
        swath.evaluate(**(arguments | change))
    assert str(error.value) == f"`out` must be empty or hold this study, got {tmp_path} with {text}"
    assert {entry.name: entry.read_bytes() for entry in tmp_path.iterdir()} == before


def test_a_scenario_of_the_same_name_with_other_values_is_another_study(tmp_path):
    file = tmp_path / "field.toml"
    for count, is_refused in ((3, False), (4, True)):
        file.write_text(f"[weeds]\ncount = {count}\n")
        if is_refused:
            with pytest.raises(swath.ConfigError, match=r"with another field \(hash [0-9a-f]{12} instead of"):
                swath.evaluate("bcp", scenario=file, instances=1, out=tmp_path / "out")
        else:
            swath.evaluate("bcp", scenario=file, instances=1, out=tmp_path / "out")


def test_a_folder_with_other_files_is_refused_and_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(swath.ConfigError, match=r"with other files, such as thesis\.tex"):
        swath.evaluate("jump", scenario="cowbot-field", instances=1, out=tmp_path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["thesis.tex"]


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


# Statistics


@pytest.mark.parametrize(
    ("degrees", "quantile"),
    # Two-sided 95 % points, as printed in every table of Student's t.
    [
        (1, 12.706),
        (2, 4.303),
        (4, 2.776),
        (9, 2.262),
        (19, 2.093),
        (29, 2.045),
        (99, 1.984),
        (1000, 1.962),
        (1e9, 1.960),
    ],
)
def test_quantiles_are_those_of_the_printed_tables(degrees, quantile):
    assert _native.student_t(0.975, degrees) == pytest.approx(quantile, abs=5e-4)
    assert _native.student_t(0.025, degrees) == pytest.approx(-quantile, abs=5e-4)


def test_the_quantile_of_two_degrees_has_a_closed_form():
    for p in (0.6, 0.9, 0.975, 0.999):
        assert _native.student_t(p, 2) == pytest.approx((2 * p - 1) * math.sqrt(2 / (4 * p * (1 - p))), rel=1e-9)


def test_the_two_ways_to_a_quantile_meet():
    for p in (0.9, 0.975, 0.995):
        # A thousandth of a degree moves the quantile by some 1e-8 itself.
        assert _native.student_t(p, 1000) == pytest.approx(_native.student_t(p, 1000.001), abs=5e-8)


def test_the_spread_of_three_numbers_is_what_the_hand_gets():
    # 1, 2, 6: mean 3, sum of squares 4 + 1 + 9 = 14, sd sqrt(7), half width 4.302653 x sqrt(7 / 3).
    found = spread([1.0, 2.0, 6.0])
    assert (found["n"], found["mean"]) == (3, 3.0)
    assert found["sd"] == pytest.approx(math.sqrt(7))
    assert found["high"] - 3 == pytest.approx(4.302653 * math.sqrt(7 / 3), rel=1e-6)
    assert 3 - found["low"] == pytest.approx(found["high"] - 3)


def test_a_single_value_has_no_interval():
    assert spread([4.0]) == {"n": 1, "mean": 4.0, "sd": None, "low": None, "high": None}


def test_the_interval_holds_the_true_mean_in_19_of_20_studies():
    rng = np.random.default_rng(1)
    studies = [spread(values) for values in rng.normal(3.0, 2.0, (4000, 5)).tolist()]
    share = np.mean([study["low"] <= 3.0 <= study["high"] for study in studies])
    assert share == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / 4000))


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


GIVEN = {"pasture": {"length_m": 30.0, "width_m": 20.0}, "weeds": {"positions_m": [[5.0, 4.0], [21.0, 16.0]]}}
NONE = {"pasture": {"length_m": 30.0, "width_m": 20.0}, "weeds": {"count": 0}}


@pytest.mark.parametrize(("scenario", "why"), [(GIVEN, "the scenario gives them"), (NONE, "the scenario has none")])
def test_copies_of_one_instance_count_as_one_and_are_told_of(scenario, why):
    results = swath.evaluate("bcp,jump", scenario=scenario, instances=3)
    (cell,) = results.summary()["cells"]
    assert cell["same_weeds"] == why
    for about in cell["agents"]:
        for measure in ("path_percent", "mowed_percent"):
            one = about[measure]
            assert (one["n"], one["sd"], one["low"], one["high"]) == (1, None, None, None)
    for pair in cell["comparisons"]:
        assert (pair["path_points"]["n"], pair["path_points"]["low"], pair["mowed_points"]["high"]) == (1, None, None)
    lines = results.table().splitlines()
    assert lines[2].split()[:4] == ["scenario", "bcp", "1", "100.00"]
    assert "±" not in lines[2] + lines[3]
    assert lines[-1] == (
        f"scenario: all 3 instances have the same weeds, since {why}: they count as one, without an interval"
    )


def test_an_agent_that_chooses_at_random_has_an_interval_on_the_same_weeds_too():
    grid = [[5.0 + 10.0 * x, 2.5 + 5.0 * y] for x in range(10) for y in range(8)]
    # A mower that sees no farther than this searches, and misses others each time.
    scenario = {"sensor": {"range_m": 3.0, "width_m": 3.0}, "weeds": {"positions_m": grid}}
    results = swath.evaluate("bcp,react,jump", scenario=scenario, instances=4)
    (cell,) = results.summary()["cells"]
    mowed = np.array([100 * row.weeds_mowed / 80 for row in results.rows if row.agent == "react"])
    react = cell["agents"][1]["mowed_percent"]
    # Student's t with 3 degrees of freedom: 3.1824.
    half = 3.1824 * mowed.std(ddof=1) / math.sqrt(4)
    assert half > 0
    assert (react["n"], react["high"] - react["mean"]) == (4, pytest.approx(half, rel=1e-4))
    n = {(pair["agent"], pair["versus"]): pair["mowed_points"]["n"] for pair in cell["comparisons"]}
    assert (n["react", "bcp"], n["jump", "react"], n["jump", "bcp"]) == (4, 4, 1)
    assert (
        results.table()
        .splitlines()[-1]
        .endswith(": they count as one, without an interval, but for react, whose choices are drawn anew in each")
    )


def test_cells_whose_weeds_are_drawn_keep_their_intervals_beside_one_whose_are_not(tmp_path):
    file = tmp_path / "farm.toml"
    file.write_text(SWEEP.replace("[5, 10]", "[0, 5]"))
    results = swath.evaluate("jump", scenario=file, only="density", instances=3)
    cells = results.summary()["cells"]
    assert [cell["same_weeds"] for cell in cells] == ["the scenario has none"] * 2 + [None] * 2
    assert [cell["agents"][0]["path_percent"]["n"] for cell in cells] == [1, 1, 3, 3]


def test_one_instance_of_given_weeds_needs_no_note():
    text = swath.evaluate("bcp", scenario=GIVEN, instances=1).table()
    assert text.splitlines()[-1] == "mean ± half the 95 % interval of the mean, by Student's t"


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


def test_a_folder_that_another_run_writes_to_is_refused(tmp_path):
    fcntl = pytest.importorskip("fcntl")
    swath.evaluate("bcp", scenario="cowbot-field", instances=2, out=tmp_path)
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().splitlines(keepends=True)[0])
    with journal.open("ab") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(swath.ConfigError, match="`out` must not be in use by another run"):
            swath.evaluate("bcp", scenario="cowbot-field", instances=2, out=tmp_path)
    assert len(journal.read_bytes().splitlines()) == 1
    swath.evaluate("bcp", scenario="cowbot-field", instances=2, out=tmp_path)
    assert len(journal.read_bytes().splitlines()) == 3
