"""The page of the paper says what its episodes say, and its episodes are those of this build."""

from pathlib import Path

import pytest

pytest.importorskip("benchmarks.paper.page", reason="run from the repository")

from benchmarks.paper import instances, page
from benchmarks.paper.runs import EXPERIMENTS, Runs

import swath

REPRODUCE = Path(__file__).parents[2] / "docs" / "reproduce"
DATA = REPRODUCE / page.DATA


@pytest.fixture(scope="module")
def episodes():
    return {one.name: list(instances.read(DATA / f"{one.name}-instances.csv")) for one in EXPERIMENTS}


@pytest.fixture(scope="module")
def runs(episodes):
    return {name: Runs(some) for name, some in episodes.items()}


def test_the_page_is_what_its_data_gives(runs):
    assert page.text(runs, "make paper") == (REPRODUCE / "cowbot-2022.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda one: one.name)
def test_the_means_beside_the_page_are_those_of_its_instances(experiment, runs):
    assert page.means(experiment, runs[experiment.name]) == (DATA / f"{experiment.name}.csv").read_text("utf-8")


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda one: one.name)
def test_this_build_drives_the_episodes_of_the_page(experiment, episodes, tmp_path):
    results = swath.evaluate(experiment.agents, scenario=experiment.scenario, only=experiment.only, instances=1, jobs=2)
    file = tmp_path / "instances.csv"
    file.write_text(instances.text(results), encoding="utf-8")
    driven = list(instances.read(file))
    assert driven == [one for one in episodes[experiment.name] if one.instance == 0]
    assert len(driven) == len(results.rows)
