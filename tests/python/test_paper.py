"""The page of the paper says what its episodes say, and its episodes are those of this build."""

from pathlib import Path

import pytest

pytest.importorskip("benchmarks.paper.page", reason="run from the repository")

from benchmarks.paper import claims, effects, instances, page
from benchmarks.paper.effects import Effect
from benchmarks.paper.instances import Episode
from benchmarks.paper.runs import EXPERIMENTS, Mean, Runs

import swath

REPRODUCE = Path(__file__).parents[2] / "docs" / "reproduce"
DATA = REPRODUCE / page.DATA


@pytest.fixture(scope="module")
def episodes():
    return {one.name: list(instances.read(DATA / f"{one.name}-instances.csv")) for one in EXPERIMENTS}


@pytest.fixture(scope="module")
def runs(episodes):
    return {name: Runs(some) for name, some in episodes.items()}


def episode(agent, instance, *, path_m=500.0, mowed=20, **swept):
    keys = {key.replace("__", "."): str(value) for key, value in swept.items()}
    return Episode(agent, keys, instance, 20, 1000.0, path_m, 20, mowed, "done")


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


@pytest.mark.parametrize(
    ("points", "verdict"),
    [
        # A mean beyond 5 points does not tell.
        ([Mean(5.1, 0.8)], None),
        ([Mean(-4.6, 0.5)], None),
        ([Mean(4.1, 0.8)], True),
        ([Mean(0.0, 0.0), Mean(8.8, 1.1)], False),
        ([Mean(5.1, 0.8), Mean(-8.8, 1.1)], False),
        ([Mean(4.1, 0.8), Mean(-5.1, 0.8)], None),
    ],
)
def test_an_effect_is_judged_by_its_whole_interval(points, verdict):
    assert effects.are_absent({str(n): Effect(mean, "") for n, mean in enumerate(points)}) is verdict


def test_depths_are_compared_instance_by_instance():
    # Instances differ by hundreds of metres, depths by 10 m on each: 1 point, with no doubt about it.
    ways = {4: 0.0, 8: -10.0, 12: -3.0}
    some = [
        episode("jump", n, path_m=500.0 + 300.0 * n + more_m, sensor__range_m=depth_m)
        for depth_m, more_m in ways.items()
        for n in range(3)
    ]
    effect = effects.of_depth(Runs(some), "jump", list(ways))
    assert effect.points == pytest.approx((1.0, 0.0))
    assert effect.between == "S_d = 4 m less 8 m"


def test_distributions_are_compared_where_they_differ_most():
    mowed = {
        ("uniform", 20): (20, 20),
        ("gaussian", 20): (20, 19),
        ("uniform", 40): (20, 19),
        ("gaussian", 40): (14, 13),
    }
    some = [
        episode("react", n, mowed=weeds, weeds__distribution=distribution, weeds__count=count)
        for (distribution, count), two in mowed.items()
        for n, weeds in enumerate(two)
    ]
    effect = effects.of_distribution(Runs(some), "react", "mowed", [20, 40])
    assert str(effect) == "-30.0 ± 0.0 (97.5 -> 67.5 % at 40 weeds)"


@pytest.mark.parametrize(("mowed", "verdict"), [((20, 20, 20), True), ((20, 19, 20), None), ((19, 20, 19), False)])
def test_weeds_left_in_the_field_count_whatever_the_length(mowed, verdict):
    # All lengths around those that the paper prints.
    ways_m = {"bcp": [897.0] * 3, "jump": [400.0, 410.0, 420.0], "snake": [330.0, 338.0, 345.0]}
    ways_m["r-snake"] = ways_m["snake"]
    some = [
        episode(agent, n, path_m=way_m, mowed=mowed[n] if agent == "snake" else 20)
        for agent, ways in ways_m.items()
        for n, way_m in enumerate(ways)
    ]
    found = {claim.text: claim.holds for claim in claims.field_claims(Runs(some))}
    assert found["SNAKE drove 338 m on one draw of 14 weeds"] is True
    assert found["SNAKE mowed all 14 weeds of that draw"] is verdict
    assert found["JUMP mowed all 14 weeds of that draw"] is True
