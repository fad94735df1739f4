"""An evaluation that was stopped goes on where it stopped, loses no row, and mixes no two studies."""

import json
import signal
import subprocess
import sys
import time

import pytest
from rows import csv_of, rows_of

import swath
from swath.evaluation.journal import Journal
from swath.evaluation.study import Study


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


def assert_refused_with(folder, altered):
    """Evaluates, alters the first row of the journal, and goes on: refused, and nothing is written."""
    arguments = {"scenario": "cowbot-field", "instances": 2, "out": folder}
    swath.evaluate("jump", **arguments)
    journal = folder / "journal.jsonl"
    header, first, last = journal.read_text().splitlines(keepends=True)
    journal.write_text(f"{header}{altered(first)}\n{last}")
    (folder / "episodes.csv").unlink()
    before = journal.read_bytes()
    with pytest.raises(swath.ConfigError) as error:
        swath.evaluate("jump", **arguments)
    assert str(error.value) == f"`out` must hold the journal as it was written, got a damaged line 2 in {journal}"
    assert journal.read_bytes() == before
    assert not (folder / "episodes.csv").exists()


@pytest.mark.parametrize("damage", ["nonsense", "[]", '{"cell": 0}'])
def test_a_journal_that_is_damaged_elsewhere_is_refused(tmp_path, damage):
    assert_refused_with(tmp_path / "out", lambda _: damage)


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
    assert_refused_with(tmp_path / "out", lambda row: json.dumps(json.loads(row) | change))


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
