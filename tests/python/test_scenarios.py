"""How scenarios are named and refused, and the tree of errors."""

import copy
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from contract import (
    make,
)

import swath

# Scenarios


def test_every_way_to_name_a_scenario_gives_the_same_one(tmp_path):
    file = tmp_path / "field.toml"
    file.write_text(swath.Scenario("cowbot-field").to_toml())
    blocks = swath.Scenario("cowbot-field").to_dict()
    del blocks["id"]
    ways = [
        make(scenario="cowbot-field"),
        make(scenario=str(file)),
        make(scenario=file),
        make(scenario=blocks),
        make(scenario=swath.Scenario("cowbot-field")),
        swath.MowerRoutingEnv(**blocks),
    ]
    assert {env.scenario.hash for env in ways} == {swath.Scenario("cowbot-field").hash}


def test_blocks_are_laid_over_the_scenario_key_by_key():
    blocks = make(scenario="cowbot-field", weeds={"count": 3}, mower=None).scenario.to_dict()
    assert blocks["weeds"]["count"] == 3
    assert blocks["weeds"]["distribution"] == "uniform"
    assert blocks["mower"]["deck_width_m"] == 1.3


def test_numpy_numbers_and_arrays_are_numbers():
    weeds = np.array([[1.0, 2.0], [3.0, 4.0]])
    one = swath.Scenario(
        weeds={"positions_m": weeds}, mower={"deck_width_m": np.float32(1.5), "speed_mps": np.int64(2)}
    )
    other = swath.Scenario(weeds={"positions_m": weeds.tolist()}, mower={"deck_width_m": 1.5, "speed_mps": 2.0})
    assert one == other
    assert one.to_dict()["weeds"]["count"] == 2


def test_a_weed_file_among_keywords_lies_where_python_runs(tmp_path, monkeypatch):
    (tmp_path / "farm").mkdir()
    (tmp_path / "farm" / "field.toml").write_text('[weeds]\nfile = "weeds.csv"\n')
    (tmp_path / "farm" / "weeds.csv").write_text("1,2\n")
    (tmp_path / "mine.csv").write_text("x_m,y_m\n3,4\n5,6\n")
    monkeypatch.chdir(tmp_path)
    field = Path("farm") / "field.toml"
    assert swath.Scenario(field).to_dict()["weeds"]["positions_m"] == [[1.0, 2.0]]
    mine = swath.Scenario(field, weeds={"file": "mine.csv"})
    assert mine.to_dict()["weeds"]["positions_m"] == [[3.0, 4.0], [5.0, 6.0]]


def test_a_scenario_can_be_pickled():
    scenario = swath.Scenario("pasture", pasture={"headland_m": math.inf}, name="mine")
    twin = pickle.loads(pickle.dumps(scenario))
    assert (twin, twin.name, twin.hash) == (scenario, "mine", scenario.hash)
    assert copy.deepcopy(scenario) == scenario


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"wedes": {"count": 3}}, "`wedes` is not a known key; did you mean `weeds`?"),
        ({"weeds": {"cuont": 3}}, "`weeds.cuont` is not a known key; did you mean `weeds.count`?"),
        ({"weeds": {"count": -3}}, "`weeds.count` must be a whole number >= 0, got integer `-3`"),
        ({"weeds": {"count": None}}, "`weeds.count` must be a number, a text, a list or a block of keys, got None"),
        ({"weeds": {"count": 1 << 70}}, f"`weeds.count` must be a whole number of at most 63 bits, got {1 << 70}"),
        ({"weeds": 3}, "`weeds` must be a block of keys, got 3"),
        ({"mower": {"deck_width_m": math.nan}}, "`mower.deck_width_m` must be finite and > 0, got NaN"),
        ({"scenario": "table1"}, "table1 declares the sweep `density`: it is for `swath evaluate`, "),
        ({"scenario": "nowhere"}, "cannot read nowhere: no such file, and no shipped scenario"),
        ({"scenario": 3}, "`scenario` must be a name, a path, a dictionary or a Scenario, got 3"),
        ({"scenario": {1: {}}}, "`scenario` must be a block with text keys, got 1"),
    ],
)
def test_a_scenario_that_cannot_be_used_is_refused_by_name(arguments, text):
    with pytest.raises(swath.ConfigError) as error:
        swath.MowerRoutingEnv(**arguments)
    assert str(error.value).startswith(text)


def test_a_file_is_blamed_for_what_stands_in_it_and_not_for_keywords_laid_over_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text("[weeds]\ncount = -3\n")
    with pytest.raises(swath.ConfigError, match=r"^mine\.toml: `weeds\.count` must be"):
        swath.Scenario("mine.toml")
    Path("mine.toml").write_text("[weeds]\ncount = 3\n")
    with pytest.raises(swath.ConfigError, match=r"^`weeds\.count` must be"):
        swath.Scenario("mine.toml", weeds={"count": -3})


# Errors


@pytest.mark.parametrize("kind_of_error", [swath.ConfigError, swath.ActionError, swath.SnapshotError])
def test_errors_form_one_tree_and_survive_pickling(kind_of_error):
    error = kind_of_error("`field` must be this, got that")
    twin = pickle.loads(pickle.dumps(error))
    assert (type(twin), str(twin)) == (kind_of_error, str(error))
    assert isinstance(twin, swath.SwathError)
    assert isinstance(twin, ValueError)
