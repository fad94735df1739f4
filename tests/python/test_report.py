"""`swath report`: what it says is what the evaluation has found; and refusals in one line."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

import swath
from swath.evaluation.statistics import spread
from swath.report import Evaluated, page_of
from swath.report.extremes import extremes_of
from swath.report.groups import groups_of
from swath.report.tables import of_group, of_places

SWEPT = """
[[sweep]]
name = "radius"
"mower.turning_radius_m" = [1.0, 3.0]
"weeds.count" = [5, 10]

[[sweep]]
name = "count"
"weeds.distribution" = ["uniform", "gaussian"]
"weeds.count" = [5, 10, 20]
"""


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("swept.toml").write_text(SWEPT)


def evaluated(*scenario, agents=("jump", "snake"), instances=4, seed=30):
    swath.evaluate(agents, scenario=list(scenario), instances=instances, seed=seed, out="out")
    return Evaluated.read(Path("out"))


def text_of(page):
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", page))


def test_the_page_says_what_the_evaluation_has_found(call):
    command = ["evaluate", "pasture", "--agents", "jump,snake", "--instances", 5, "--seed", 4, "--out", "out"]
    assert call(*command)[0] == 0
    status, out, err = call("report", "out")
    assert (status, out, err) == (0, "wrote out/report.html\n", "")
    page = Path("out/report.html").read_text()
    summary = json.loads(Path("out/summary.json").read_text())["cells"][0]
    for about in summary["agents"]:
        for measure in ("path_percent", "mowed_percent"):
            one = about[measure]
            high = min(one["high"], 100) if measure == "mowed_percent" else one["high"]
            assert f"{one['mean']:.2f} [{one['low']:.2f}, {high:.2f}]" in text_of(page).replace("[ ", "[")
    one = next(pair for pair in summary["comparisons"] if (pair["agent"], pair["versus"]) == ("snake", "jump"))[
        "path_points"
    ]
    assert f"{one['mean']:+.2f} [{one['low']:+.2f}, {one['high']:+.2f}]" in text_of(page)
    assert "swath evaluate pasture --agents jump,snake --instances 5 --seed 4 --out out --backend local" in page
    assert "turning_radius_m = 2.0" in page


def test_the_page_names_no_other_file_and_no_address(call):
    evaluated("pasture")
    assert call("report", "out", "--out", "page.html")[0] == 0
    page = Path("page.html").read_text()
    assert "http:" not in page
    assert "https:" not in page
    assert {link for link in re.findall(r'(?:src|href)="([^"]*)"', page) if not link.startswith("#")} == {"data:,"}


def test_a_sweep_over_the_mower_averages_over_weeds_and_one_over_weeds_is_split():
    radius, count = groups_of(evaluated("swept.toml"))
    assert (radius.key, radius.averaged) == ("mower.turning_radius_m", ["weeds.count"])
    assert [[value for value, _ in panel.points] for panel in radius.panels] == [[1.0, 3.0]]
    assert [len(numbers) for _, numbers in radius.panels[0].points] == [2, 2]
    assert (count.key, count.averaged) == ("weeds.count", [])
    assert [panel.title for panel in count.panels] == ["weeds.distribution = uniform", "weeds.distribution = gaussian"]
    assert [value for value, _ in count.panels[0].points] == [5, 10, 20]


def test_a_mean_over_scenarios_is_taken_instance_by_instance():
    radius, _ = groups_of(evaluated("swept.toml"))
    with Path("out/episodes.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["scenario"] == "swept/radius" and row["agent"] == "jump"]
    means = [
        sum(100 * float(row["path_fraction"]) for row in rows if int(row["instance"]) == instance) / 4
        for instance in range(4)
    ]
    found = radius.mean(radius.evaluated.path_percent, 0)
    assert found["n"] == 4
    assert found["mean"] == pytest.approx(sum(means) / 4)
    assert found["sd"] ** 2 == pytest.approx(sum((one - sum(means) / 4) ** 2 for one in means) / 3)


def test_best_and_worst_are_so_by_the_agents_own_mean_in_each_scenario_and_are_driven_again():
    study = evaluated("pasture", "cowbot-field", "swept.toml")
    groups = groups_of(study)
    page = page_of(study)
    assert "another build" not in page
    assert len(groups) == 4
    found = list(extremes_of(groups))
    assert len(re.findall('class="replay" data-replay=', page)) == len(found) == 2 * 2 * 4
    for group, extremes in zip(groups, (found[at : at + 4] for at in range(0, 16, 4)), strict=True):
        assert [(one.agent, one.kind) for one in extremes] == [(0, "best"), (0, "worst"), (1, "best"), (1, "worst")]
        for extreme in extremes:
            ratios = {
                (place, instance): study.path_m[place, extreme.agent, instance]
                / study.path_m[place, extreme.agent].mean()
                for place in group.numbers
                for instance in range(study.instances)
            }
            limit = min(ratios.values()) if extreme.kind == "best" else max(ratios.values())
            assert ratios[extreme.place, extreme.instance] == pytest.approx(limit, abs=1e-12)


def test_a_failure_is_the_worst_episode_however_short():
    study = evaluated("pasture")
    study.outcomes[0, 0, 2] = "left_headland"
    best, worst, *_ = extremes_of(groups_of(study))
    assert (worst.kind, worst.instance) == ("worst", 2)
    assert best.instance != 2


def test_of_failures_the_one_that_mowed_least_is_the_worst_and_the_page_says_how_it_ended():
    study = evaluated("pasture")
    study = replace(study, outcomes=study.outcomes.astype("U20"))
    study.outcomes[0, 0] = "left_headland"
    study.mowed_percent[0, 0] = [50, 90, 10, 50]
    study.path_m[0, 0] = [900, 800, 100, 300]
    best, worst, *_ = extremes_of(groups_of(study))
    assert (best.instance, worst.instance) == (1, 2)
    assert "10.0 % mowed, left_headland (" in text_of(page_of(study))


def test_an_interval_holds_nothing_that_cannot_be():
    study = evaluated("pasture")
    # One weed of 1000 was missed once: the interval of Student's t would go beyond 100 %.
    study.mowed_percent[0, 0] = [100, 100, 100, 99.9]
    assert spread([100, 100, 100, 99.9])["high"] > 100
    assert "99.97 [99.90, 100.00]" in text_of(page_of(study)).replace("[ ", "[")
    study.mowed_percent[0, 0] = [100, 100, 100, 99.999]
    text = text_of(page_of(study))
    assert "99.99 [99.99, 100.00]" in text


def test_copies_of_one_instance_have_no_interval_and_the_page_says_why():
    given = {"weeds": {"positions_m": [[5.0, 4.0], [21.0, 16.0]]}}
    read = evaluated(given, agents=("bcp", "jump", "react"))
    (group,) = groups_of(read)
    bcp, jump, react = range(3)
    assert group.mean(read.path_percent, jump)["high"] is None
    assert group.difference(read.path_percent, jump, bcp)["high"] is None
    assert group.mean(read.path_percent, react)["n"] == 4
    assert group.difference(read.path_percent, react, bcp)["n"] == 4
    for table in (of_group(group), of_places(group)):
        assert [name for name in read.agents for line in table.splitlines() if name in line and "<small>" in line] == [
            "react"
        ]
    page = text_of(page_of(read))
    assert (
        "All 4 instances have the same weeds, since the scenario gives them: they count as one, without an interval, "
        "but for react, whose choices are drawn anew in each." in page
    )


def test_a_sweep_of_drawn_and_of_no_weeds_has_intervals_where_weeds_are_drawn():
    Path("swept.toml").write_text('[[sweep]]\nname = "count"\n"weeds.count" = [0, 5]\n')
    read = evaluated("swept.toml")
    (group,) = groups_of(read)
    assert [group.mean(read.path_percent, 0, numbers)["n"] for numbers in ([0], [1], [0, 1])] == [1, 4, 4]
    page = text_of(page_of(read))
    assert "In 1 of 2 scenarios all 4 instances have the same weeds, since the scenario has none: they count" in page


def test_a_yardstick_is_called_one_wherever_it_stands():
    evaluated("cowbot-field", agents=["clairvoyant", "jump"], instances=2)
    page = page_of(Evaluated.read(Path("out")))
    visible = text_of(re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL))
    assert "clairvoyant : a yardstick, not an online agent: it is told where the weeds stand" in visible
    for kind in ("best", "worst"):
        assert f"clairvoyant (yardstick), {kind}: " in visible
    assert "jump (yardstick)" not in page
    # In its tables, in the rows of its figures and in its legends.
    assert page.count("clairvoyant (yardstick)") >= 8


def test_every_histogram_has_an_axis_that_counts_episodes():
    page = page_of(evaluated("pasture"))
    pictures = re.findall(r'<svg viewBox[^>]*aria-label="[^"]*one episode each[^"]*">.*?</svg>', page)
    assert len(pictures) == 2
    for picture in pictures:
        assert "\u2191 episodes per" in picture
        counts = [int(count) for count in re.findall(r'class="end small">(\d+)<', picture)]
        assert counts[::2] == [0, 0]
        assert all(1 <= count <= 4 for count in counts[1::2])


def test_one_agent_on_one_instance_has_a_report_too(call):
    evaluated("pasture", agents=["bcp"], instances=1)
    assert call("report", "out")[0] == 0
    page = Path("out/report.html").read_text()
    assert "bcp, all alike" in page
    assert "nan" not in re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


def test_agents_that_had_nothing_to_do_have_a_report_too(call):
    Path("bare.toml").write_text("[weeds]\ncount = 0\n")
    evaluated("bare.toml", agents=["clairvoyant", "snake"], instances=3)
    assert call("report", "out")[0] == 0
    page = Path("out/report.html").read_text()
    assert "clairvoyant (yardstick), all alike: 0.0 % path" in page
    assert "nan" not in re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


def test_the_same_folder_gives_the_same_bytes():
    study = evaluated("swept.toml", agents=["r-snake", "jump"], instances=2)
    assert page_of(study) == page_of(Evaluated.read(Path("out")))


def test_the_folder_of_a_trained_policy_has_a_report_without_replays(call):
    evaluated("pasture")
    for name in ("summary.json", "episodes.csv"):
        path = Path("out", name)
        path.write_text(path.read_text().replace("snake", "model.zip"))
    assert call("report", "out")[0] == 0
    page = Path("out/report.html").read_text()
    assert "model.zip" in page
    assert page.count("It cannot be driven again from this folder") == 2


def spoil(kind):
    evaluated("pasture")
    rows, summary = Path("out/episodes.csv"), Path("out/summary.json")
    if kind == "unfinished":
        summary.unlink()
        journal = Path("out/journal.jsonl")
        journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:4]))
    elif kind == "foreign":
        for entry in Path("out").iterdir():
            entry.unlink()
    elif kind == "other json":
        summary.write_text("{}")
    elif kind == "no json":
        summary.write_text("{")
    elif kind == "damaged":
        rows.write_text(rows.read_text().replace("snake,1,", "snake,2,", 1))
    elif kind == "cut":
        rows.write_text("".join(rows.read_text().splitlines(keepends=True)[:-1]))
    elif kind == "longer":
        rows.write_text(rows.read_text() + rows.read_text().splitlines(keepends=True)[-1])
    elif kind == "mixed":
        summary.write_text(re.sub(r'"mean": [0-9.]+', '"mean": 1.5', summary.read_text(), count=1))
    elif kind == "worker":
        Path("out/dataset").mkdir()
    elif kind == "no origin":
        Path("out/origin.json").write_text("[1]")
    elif kind == "no rows":
        rows.unlink()


@pytest.mark.parametrize(
    ("kind", "line"),
    [
        (
            "unfinished",
            "`DIR` must be the folder of a finished evaluation, got out with 3 of 8 episodes: the command that",
        ),
        ("foreign", "`DIR` must be the folder of a finished evaluation, got out with no summary.json"),
        ("other json", "`DIR` must hold the summary.json of an evaluation, got another one in out"),
        ("no json", "`DIR` must be the folder of a finished evaluation, got out/summary.json, which is not JSON"),
        ("damaged", "`DIR` must hold the rows as they were written, got a damaged line 7 in out/episodes.csv"),
        ("cut", "`DIR` must hold all rows of the evaluation, got out/episodes.csv, which ends at line 8"),
        (
            "longer",
            "`DIR` must hold the rows of one evaluation, got out/episodes.csv with more lines than summary.json",
        ),
        ("mixed", "`DIR` must hold the rows and the statistics of one evaluation, got those of two in out"),
        ("worker", "`DIR` must be a folder of `swath evaluate`, got one of `swath worker`: out"),
        ("no origin", "`DIR` must hold origin.json as it was written, got a damaged one in out"),
        ("no rows", "cannot use out/episodes.csv: No such file or directory"),
    ],
)
def test_a_folder_that_cannot_be_reported_is_refused_in_one_line(call, kind, line):
    spoil(kind)
    before = sorted(Path("out").iterdir())
    status, out, err = call("report", "out")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.removeprefix("swath: ").startswith(line)
    assert sorted(Path("out").iterdir()) == before


def test_a_folder_that_is_none_is_refused(call):
    Path("file").write_text("mine")
    for name, what in (("nowhere", "not there"), ("file", "a file")):
        assert call("report", name)[2] == (
            f"swath: `DIR` must be the folder of a finished evaluation, got {name}, which is {what}\n"
        )
