"""Means and intervals are what the hand gets, and none is claimed where chance decides nothing."""

import math

import numpy as np
import pytest

import swath
from swath import _native
from swath.evaluation.statistics import spread


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
    distributions = '"weeds.distribution" = ["uniform", "gaussian"]'
    file.write_text(f'[[sweep]]\nname = "density"\n"weeds.count" = [0, 5]\n{distributions}\n')
    results = swath.evaluate("jump", scenario=file, only="density", instances=3)
    cells = results.summary()["cells"]
    assert [cell["same_weeds"] for cell in cells] == ["the scenario has none"] * 2 + [None] * 2
    assert [cell["agents"][0]["path_percent"]["n"] for cell in cells] == [1, 1, 3, 3]


def test_one_instance_of_given_weeds_needs_no_note():
    text = swath.evaluate("bcp", scenario=GIVEN, instances=1).table()
    assert text.splitlines()[-1] == "mean ± half the 95 % interval of the mean, by Student's t"
