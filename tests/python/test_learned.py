"""The learned agent acts as its torch original does, and its page says what the data beside it says."""

import csv
import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("benchmarks.learned.page", reason="run from the repository")

from benchmarks.learned import page
from benchmarks.learned.results import AGAIN, COLUMNS, COUNTS, CURVE_COLUMNS, play_again, write_rows

import swath
from swath import _native

FOLDER = Path(__file__).parents[2] / "agents" / "learned"
needs_torch = pytest.mark.skipif(
    importlib.util.find_spec("sb3_contrib") is None and not os.environ.get("CI"), reason="sb3-contrib is not installed"
)


@pytest.fixture(scope="module")
def policy():
    from swath.training import load_policy

    return load_policy(FOLDER / "maskable-routing")


@needs_torch
@pytest.mark.parametrize("weeds", [20, 40, 80])
def test_the_learned_agent_takes_the_places_that_its_torch_original_takes(policy, weeds):
    from swath.training.environments import make_venv

    venv = make_venv(_native.Scenario(policy.card.scenario, weeds={"count": weeds}), 32)
    venv.seed(2_000_000)
    tables = venv.reset()
    alike = []
    for _ in range(50):
        places = policy.predict(tables, np.stack(venv.env_method("action_masks")))
        alike.extend(places == _native.learned_places(tables))
        tables = venv.step(places)[0]
    assert len(alike) == 1600
    # Sums in another order differ in their last bits: of two places all but equally good either may come first.
    assert np.mean(alike) >= 0.999


@needs_torch
def test_an_episode_of_the_learned_agent_is_that_of_its_torch_original(policy):
    from swath.training import evaluate_policy

    rows = evaluate_policy(policy, scenario=policy.card.scenario, instances=8, seed=2_000_000)
    own = swath.evaluate(["learned"], scenario=policy.card.scenario, instances=8, seed=2_000_000).rows
    # The native runner ends its pieces elsewhere, which moves the mower by rounding: one episode may part ways.
    alike = [abs(row.path_length_m - other.path_length_m) < 1e-6 for row, other in zip(rows, own, strict=True)]
    assert sum(alike) >= 7


@needs_torch
def test_the_weights_are_those_of_the_model(policy, tmp_path):
    from swath.training import export_policy

    export_policy(policy, tmp_path / "policy.bin")
    assert (tmp_path / "policy.bin").read_bytes() == (FOLDER / "maskable-routing" / "policy.bin").read_bytes()


def test_tables_of_another_size_are_refused_by_name():
    with pytest.raises(swath.ConfigError, match="`tables` must be"):
        _native.learned_places(np.zeros((2, 7), np.float32))


def test_every_table_of_the_page_is_what_the_data_gives(tmp_path):
    copy = tmp_path / "README.md"
    copy.write_text((FOLDER / "README.md").read_text())
    page.write(copy, FOLDER)
    assert copy.read_text() == (FOLDER / "README.md").read_text()


@pytest.mark.parametrize("agent", ["learned", "snake", "greedy", "horizon", "clairvoyant"])
def test_the_contest_was_played_by_the_agents_as_they_are(agent):
    with (FOLDER / "contest" / f"{agent}.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["instance"] == "0"]
    assert len(rows) == 3
    for row in rows:
        episode = swath.run_episode(
            agent, scenario={"weeds": {"count": int(row["weeds_total"])}}, seed=int(row["seed"])
        )
        assert episode.path_length_m == pytest.approx(float(row["path_length_m"]), abs=1e-6)
        assert episode.weeds_mowed == int(row["weeds_mowed"])


def test_differences_are_taken_instance_by_instance(tmp_path):
    paths = {"learned": [100.0, 200.0, 330.0], "snake": [150.0, 250.0, 380.0]}
    for agent, column in paths.items():
        rows = [[20, i, 1_000_000 + i, 20, path, 1000.0, 1.0, "done", 0.5] for i, path in enumerate(column)]
        write_rows(tmp_path / f"{agent}.csv", COLUMNS, rows)
    # Each path is 50 m shorter, however much the instances differ: a difference without any spread.
    assert "| 100.00 | 100.0 | -50.0 ± 0.0 | -19.2 | 3 | 500 |" in page.contest(tmp_path, "20")


def test_a_second_training_is_compared_instance_by_instance_with_the_shipped_one(tmp_path):
    (tmp_path / "contest").mkdir()
    for file, more_m in (("contest/learned.csv", 0), (AGAIN, 6)):
        paths = [(count, i, 100.0 * (i + 1) + more_m) for count in COUNTS for i in range(3)]
        rows = [[count, i, 1_000_000 + i, count, path, 1000.0, 1.0, "done", 0.5] for count, i, path in paths]
        write_rows(tmp_path / file, COLUMNS, rows)
    # Each path is 6 m longer, of 200 m in the mean.
    assert page.again(tmp_path).count("| +6.0 ± 0.0 | +3.0 | 100.00 |") == len(COUNTS)


@needs_torch
def test_the_shipped_policy_trained_again_would_be_judged_as_no_different(tmp_path):
    play_again(FOLDER / "maskable-routing", tmp_path / AGAIN, 4)
    with (tmp_path / AGAIN).open(newline="") as file:
        rows = {(row["weeds_total"], row["instance"]): float(row["path_length_m"]) for row in csv.DictReader(file)}
    with (FOLDER / "contest" / "learned.csv").open(newline="") as file:
        shipped = {(row["weeds_total"], row["instance"]): float(row["path_length_m"]) for row in csv.DictReader(file)}
    assert len(rows) == 4 * len(COUNTS)
    # As above, rounding may part ways in an episode.
    assert sum(abs(shipped[key] - path_m) < 1e-6 for key, path_m in rows.items()) >= len(rows) - 1


def test_a_curve_has_a_row_for_each_evaluation(tmp_path):
    (tmp_path / "machine.txt").write_text("a machine\n")
    write_rows(tmp_path / "curve.csv", CURVE_COLUMNS, [[0, 0, 5, 900, 9, 20, 0], [50_000, 90, 5, 500.4, 9, 19.5, 0.1]])
    table = page.curve(tmp_path)
    assert "| 0 | 0.0 | 900 ± 9 | 20.00 ± 0.00 |\n| 50,000 | 1.5 | 500 ± 9 | 19.50 ± 0.10 |" in table
