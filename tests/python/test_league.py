"""The page of the league says what its episodes say."""

from pathlib import Path

import pytest

pytest.importorskip("benchmarks.league.page", reason="run from the repository")

from benchmarks.league import page
from benchmarks.league.parts import PARTS, Played, agents, read, write

import swath

FOLDER = Path(__file__).parents[2] / "benchmarks"


def played(agent, instance, path_m, *, mowed=20, cell="20 weeds", outcome="done"):
    return Played("density", cell, agent, instance, 20, mowed, path_m, 1000.0, 1.0, outcome)


LEAGUE = [
    *(played("horizon", instance, path_m) for instance, path_m in enumerate([200.0, 300.0, 400.0])),
    *(played("jump", instance, path_m) for instance, path_m in enumerate([300.0, 400.0, 390.0])),
    # The shortest of all on instance 1, where it left a weed.
    *(played("snake", n, path_m, mowed=mowed) for n, (path_m, mowed) in enumerate([(250, 20), (100, 19), (500, 20)])),
    *(played("oracle", instance, 100.0) for instance in range(3)),
]
ONLINE = {"horizon": True, "jump": True, "snake": True, "oracle": False}


def test_differences_are_taken_instance_by_instance():
    jump = page.longer(LEAGUE, "jump")
    assert jump["n"] == 3
    assert jump["mean"] == pytest.approx((10 + 10 - 1) / 3)
    # 10, 10 and -1 points: a standard deviation of 6.351, and Student's t of 4.303 for two degrees of freedom.
    assert jump["high"] - jump["mean"] == pytest.approx(4.303 * 6.351 / 3**0.5, abs=1e-2)


def test_a_planner_that_left_a_weed_is_not_the_best_one():
    # Against 250, 400 and 390 m.
    assert "shorter than the best of `jump`, `snake`, `r-snake` that mowed every weed in 2 of 3 instances (66.7 %)" in (
        page.contest(LEAGUE)
    )


def test_the_headline_counts_what_was_not_done():
    lines = page.headline(LEAGUE, ONLINE).splitlines()
    assert lines[2] == "| `horizon` | 3 | 30.0 | 100.00 | 100.0 | 100.0 |  | 100.0 |"
    assert lines[4].startswith("| `snake` | 3 | 28.3 | 98.33 | 66.7 | 100.0 | -1.7 | ")
    assert lines[5].startswith("| *`oracle`* | 3 | 10.0 |")


def test_a_part_shows_every_agent_that_played_and_only_those():
    text = page.section(PARTS[0], LEAGUE, {**ONLINE, "newcomer": True})
    assert "| | `horizon` | `jump` | `snake` | `oracle` |" in text
    assert "| 20 weeds | 30.0 ± 24.8 | 36.3 ± 13.7 | 28.3 ± 50.2 / 98.3 | *10.0 ± 0.0* |" in text
    assert "newcomer" not in text


@pytest.mark.parametrize(("percent", "text"), [(98.34, "98.3"), (99.94, "99.9"), (99.96, "99.96")])
def test_a_share_below_all_never_reads_as_all(percent, text):
    assert page.not_all(percent) == text


def test_every_agent_of_the_registry_is_invited():
    listed = agents()
    assert {"horizon", "jump", "bcp"} <= set(listed)
    assert [swath.make_agent(name).label for name, is_online in listed.items() if is_online]


def test_episodes_survive_their_file(tmp_path):
    write(tmp_path / "LEAGUE.csv", LEAGUE)
    assert list(read(tmp_path / "LEAGUE.csv")) == LEAGUE


@pytest.mark.skipif(not (FOLDER / "LEAGUE.csv").exists(), reason="`make league` has not been run")
def test_the_tables_of_the_page_are_what_the_data_gives():
    rows = list(read(FOLDER / "LEAGUE.csv"))
    named = dict.fromkeys((one.agent for one in rows), True)
    online = {name: agents().get(name, is_online) for name, is_online in named.items()}
    text = (FOLDER / "LEAGUE.md").read_text(encoding="utf-8")
    assert page.headline(rows, online) in text
    for part in PARTS:
        if any(one.part == part.name for one in rows):
            assert page.section(part, rows, online) in text
