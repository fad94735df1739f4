"""The page of the learned agents says what the data beside it says."""

from pathlib import Path

import pytest

pytest.importorskip("benchmarks.learned.page", reason="run from the repository")

from benchmarks.learned import page
from benchmarks.learned.results import COLUMNS, CURVE_COLUMNS, write_rows

FOLDER = Path(__file__).parents[2] / "agents" / "learned"


def test_every_table_of_the_page_is_what_the_data_gives(tmp_path):
    copy = tmp_path / "README.md"
    copy.write_text((FOLDER / "README.md").read_text())
    page.write(copy, FOLDER)
    assert copy.read_text() == (FOLDER / "README.md").read_text()


def test_differences_are_taken_instance_by_instance(tmp_path):
    paths = {"trained": [100.0, 200.0, 330.0], "random": [150.0, 250.0, 380.0]}
    rows = [
        [agent, instance, 1_000_000 + instance, 20, 20, path, 1.0, "goal"]
        for agent, column in paths.items()
        for instance, path in enumerate(column)
    ]
    write_rows(tmp_path / "episodes.csv", COLUMNS, rows)
    # Each path is 50 m shorter, however much the instances differ: a difference without any spread.
    assert "| 100.0 ± 0.0 | -50 ± 0 | -19.2 | +0.00 ± 0.00 | 3 goal |" in page.table("contest", tmp_path)


def test_a_curve_has_a_row_for_each_evaluation(tmp_path):
    (tmp_path / "machine.txt").write_text("a machine\n")
    write_rows(tmp_path / "episodes.csv", COLUMNS, [])
    write_rows(tmp_path / "curve.csv", CURVE_COLUMNS, [[0, 0, 5, 900, 9, 20, 0], [50_000, 90, 5, 500.4, 9, 19.5, 0.1]])
    table = page.table("curve", tmp_path)
    assert "| 0 | 0.0 | 900 ± 9 | 20.00 ± 0.00 |\n| 50,000 | 1.5 | 500 ± 9 | 19.50 ± 0.10 |" in table
