"""`swath replay`: pages that need nothing else, of what was driven; and refusals in one line."""

import json
import re
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest

import swath
from swath.replay import data_of, page_of


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def data_in(page):
    return json.loads(re.search(r'<script type="application/json" id="replay">(.*?)</script>', page, re.DOTALL)[1])


def numbers(text, kind):
    return np.frombuffer(b64decode(text), kind)


def test_the_page_holds_the_episodes_on_the_same_weeds(call):
    status, out, err = call(
        "replay", "jump", "bcp:spacing=sensor", "--scenario", "cowbot-field", "--seed", 7, "--out", "a.html"
    )
    assert (status, err) == (0, "")
    assert out.splitlines()[-1] == "wrote a.html"
    data = data_in(Path("a.html").read_text())
    assert [agent["label"] for agent in data["agents"]] == ["jump", "bcp:spacing=sensor"]
    for agent in data["agents"]:
        episode = swath.run_episode(agent["label"], scenario="cowbot-field", seed=7)
        assert agent["length_m"] == episode.path_length_m
        assert np.allclose(numbers(data["weeds_m"], "<f4").reshape(-1, 2), episode.weeds_m, atol=1e-4)
        assert np.allclose(numbers(agent["mowed_m"], "<f4"), episode.weed_mowed_path_m, rtol=1e-6)
        assert np.isfinite(numbers(agent["detected_m"], "<f4")).sum() == episode.weeds_detected
        steps = numbers(agent["seen_step"], "<u2").reshape(data["rows"], data["columns"])
        assert (steps < 65535).mean() == pytest.approx(episode.seen_fraction)
        seen_m = np.where(steps < 65535, steps * (episode.path_length_m / 65534), np.inf)
        assert np.allclose(seen_m, episode.cell_seen_path_m, atol=0.05)


def test_the_page_names_no_other_file_and_no_address(call):
    assert call("replay", "jump", "--out", "a.html")[0] == 0
    page = Path("a.html").read_text()
    assert "http:" not in page
    assert "https:" not in page
    assert re.findall(r'(?:src|href)="([^"]*)"', page) == ["data:,"]


def test_the_same_replay_has_the_same_bytes(call):
    for name in ("a.html", "b.html"):
        assert call("replay", "r-snake", "--seed", 3, "--out", name)[0] == 0
    assert Path("a.html").read_bytes() == Path("b.html").read_bytes()


def test_weeds_of_a_file_stand_where_it_says(call):
    Path("weeds.csv").write_text("x_m,y_m\n10,5\n50,20\n")
    assert call("replay", "jump", "--weeds", "weeds.csv", "--out", "a.html")[0] == 0
    data = data_in(Path("a.html").read_text())
    assert numbers(data["weeds_m"], "<f4").tolist() == [10, 5, 50, 20]


def test_a_pasture_without_weeds_is_shown_too(call):
    Path("bare.toml").write_text("[weeds]\ncount = 0\n")
    assert call("replay", "jump", "--scenario", "bare.toml", "--out", "a.html")[0] == 0
    assert numbers(data_in(Path("a.html").read_text())["agents"][0]["mowed_m"], "<f4").size == 0


@pytest.mark.parametrize("name", ["a.html", "a.png", "a.gif"])
def test_an_agent_that_has_nothing_to_do_is_shown_standing_at_its_start(call, name):
    Path("bare.toml").write_text("[weeds]\ncount = 0\n")
    short = ["--seconds", 1, "--fps", 5] if name == "a.gif" else []
    status, out, err = call("replay", "clairvoyant", "--scenario", "bare.toml", *short, "--out", name)
    assert (status, err) == (0, "")
    assert out.startswith("clairvoyant: 0.0 m, 0.0 % of the boustrophedon path, 0 of 0 weeds mowed")
    assert Path(name).stat().st_size > 0
    episode = swath.run_episode("clairvoyant", scenario="bare.toml")
    assert (episode.path_length_m, len(episode.arcs)) == (0, 0)
    # In the corner, with half a deck of 2 m to the fence.
    assert episode.trajectory.tolist() == [[0.0, 1.0, 0.0, 0.0]]
    assert data_of([episode])["agents"][0]["start"] == [0.0, 1.0, 0.0]


def test_a_large_pasture_shows_blocks_of_cells():
    scenario = {"pasture": {"length_m": 330, "width_m": 170}, "weeds": {"count": 10}}
    episode = swath.run_episode("jump", scenario=scenario)
    data = data_of([episode])
    assert data["rows"] * data["columns"] <= 20_000
    steps = numbers(data["agents"][0]["seen_step"], "<u2").reshape(data["rows"], data["columns"])
    block_m = np.where(steps < 65535, steps * (episode.path_length_m / 65534), np.inf)
    side = round(170 / data["rows"])
    # A block is seen when the last of its cells is.
    assert block_m[0, 0] == pytest.approx(episode.cell_seen_path_m[:side, :side].max(), abs=0.2)
    assert block_m[-1, -1] == pytest.approx(
        episode.cell_seen_path_m[-(170 % side or side) :, -(330 % side or side) :].max(), abs=0.2
    )


def test_text_of_a_scenario_cannot_end_its_place_in_the_page():
    scenario = swath.Scenario({}, name="</script><b>")
    assert "<b>" not in page_of([swath.run_episode("jump", scenario=scenario)])


def test_episodes_of_other_weeds_are_refused():
    pair = [swath.run_episode("jump", seed=seed) for seed in (1, 2)]
    with pytest.raises(swath.ConfigError, match="`episodes` must be of one scenario on the same weeds"):
        page_of(pair)


@pytest.mark.parametrize(("name", "begins"), [("a.png", b"\x89PNG"), ("a.gif", b"GIF89a")])
def test_the_suffix_says_what_is_written(call, name, begins):
    film = ["--seconds", 1, "--fps", 5] if name.endswith(".gif") else []
    status, out, _ = call("replay", "jump", "--scenario", "cowbot-field", *film, "--out", name)
    assert (status, out.splitlines()[-1]) == (0, f"wrote {name}")
    assert Path(name).read_bytes().startswith(begins)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["jump", "--out", "a.avi"], "`out` must end with .html, .gif, .mp4, .png, .rrd, got a.avi"),
        (["jump", "--out", "nowhere/a.html"], "`out` must be a file in a folder that exists, got nowhere/a.html"),
        (["jump", "jump", "--out", "a.html"], "`AGENT` must differ from the others, got `jump` twice"),
        (["hop", "--out", "a.html"], "`agent` must be one of"),
        (["jump", "--weeds", "none.csv", "--out", "a.html"], "cannot read `weeds.file` "),
        (["jump", "--scenario", "nowhere", "--out", "a.html"], "cannot read nowhere: no such file"),
        (["jump"], "Missing option '--out'"),
        (["jump", "--fps", 0, "--out", "a.gif"], "`fps` must be a whole number from 1 to 100, got 0"),
        (
            ["jump", "--seconds", 3, "--out", "a.html"],
            "`seconds` is for films, which end with .gif, .mp4, .rrd, ",
        ),
    ],
    ids=lambda value: " ".join(map(str, value)) if isinstance(value, list) else "",
)
def test_bad_arguments_are_refused_in_one_line_and_nothing_is_written(call, arguments, line):
    status, out, err = call("replay", *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.removeprefix("swath: ").startswith(line)
    assert list(Path().iterdir()) == []
