"""The whole weed-density figure against a second simulator of the same rules that shares no code with swath.

`second_simulator.csv` holds its means and standard deviations over 100 instances of each cell, path in % of `bcp`.
"""

import csv
from pathlib import Path

import pytest

import swath

AGENTS = ["bcp-tsp", "react", "jump", "snake", "r-snake"]
# REACT runs out of path before it runs out of weeds; its spread in these cells is wide: points of weeds mowed.
REACT_MOWED = {("uniform", 320): 2.5, ("uniform", 640): 2.0, ("gaussian", 320): 2.0, ("gaussian", 640): 2.5}


def cells():
    with Path(__file__).with_name("second_simulator.csv").open(newline="") as stream:
        return [{key: _number(value) for key, value in row.items()} for row in csv.DictReader(stream)]


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_density_figure_is_that_of_a_second_simulator():
    results = swath.evaluate(AGENTS, scenario="table1", only="density", instances=100)
    assert {row.outcome for row in results.rows} == {"done"}
    outside = []
    for cell in cells():
        agent, place = cell["agent"], (cell["distribution"], int(cell["weeds"]))
        swept = {"weeds.distribution": place[0], "weeds.count": place[1]}
        index = next(i for i, c in enumerate(results.study.cells) if c.values == swept)
        rows = results.of_cell(index, agent)
        path = sum(100 * row.path_fraction for row in rows) / len(rows)
        mowed = sum(100 * row.weeds_mowed / row.weeds_total for row in rows) / len(rows)
        # Two independent means of 100 differ by at most 3 sqrt(2) sd / 10 = 0.42 sd; half a point is for ties.
        is_path_right = (
            abs(path - cell["path_percent"]) <= 0.45 * cell["path_sd"] + (0.0 if agent == "react" else 0.5) + 0.01
        )
        if agent == "jump":
            is_mowed_right = mowed >= 99.9
        elif agent == "react":
            limit = REACT_MOWED.get(place)
            is_mowed_right = mowed >= 98.9 if limit is None else abs(mowed - cell["mowed_percent"]) <= limit
        else:
            is_mowed_right = abs(mowed - cell["mowed_percent"]) <= max(0.45 * cell["mowed_sd"], 0.5)
        if not (is_path_right and is_mowed_right):
            outside.append((agent, *place, path, mowed))
    assert not outside
