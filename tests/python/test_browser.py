"""Replays and reports in a real browser: they play, they scrub, they log no error, and they ask nobody for anything.

Chromium comes from the system's packages (`make browser`); screenshots are left in `out/browser`.
"""

import hashlib
import itertools
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from chromium import needs_chromium

import swath
from swath.cli import main
from swath.evaluation import Results, Row
from swath.evaluation.study import Study
from swath.report import Evaluated, page_of

PICTURES = Path(__file__).resolve().parents[2] / "out/browser"

pytestmark = [
    needs_chromium,
    pytest.mark.timeout(120),
]


@pytest.fixture
def page(browser):
    """A page without a network; at its end nothing was asked for from elsewhere, and nothing was complained about."""
    context = browser.new_context(viewport={"width": 1280, "height": 800}, offline=True)
    page = context.new_page()
    asked, troubles = [], []
    context.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda socket: asked.append(socket.url))
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("console", lambda message: troubles.append(message.text) if message.type in ("error", "warning") else None)
    page.on("requestfailed", lambda request: troubles.append(request.url))
    yield page
    context.close()
    assert troubles == []
    assert asked, "the page itself was asked for"
    assert {urlsplit(url).scheme for url in asked} <= {"file", "data", "blob"}
    assert len({url for url in asked if url.startswith("file:")}) == 1


@pytest.fixture(scope="module")
def replay(tmp_path_factory):
    path = tmp_path_factory.mktemp("replay") / "replay.html"
    assert main(["replay", "jump", "snake", "--seed", "7", "--out", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("evaluation") / "out"
    command = ["evaluate", "table1", "--only", "density", "--agents", "bcp,jump,snake", "--instances", "5"]
    assert main([*command, "--out", str(folder)]) == 0
    assert main(["report", str(folder)]) == 0
    return folder / "report.html"


def keep(page, name, *, full_page=True):
    PICTURES.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=PICTURES / f"{name}.png", full_page=full_page)


def pictures(page):
    """A hash of the pixels of every canvas that shows a pasture or the curves."""
    script = "() => [...document.querySelectorAll('canvas.scene, canvas.race')].map((canvas) => canvas.toDataURL())"
    return [hashlib.sha256(data.encode()).hexdigest() for data in page.evaluate(script)]


def scrub(page, share):
    page.locator(".scrub").evaluate(
        "(slider, share) => { slider.value = share * slider.max; slider.dispatchEvent(new Event('input')); }", share
    )


def path_m(page):
    return float(page.locator(".scrub").input_value())


def differ(before, after):
    return all(one != other for one, other in zip(before, after, strict=True))


def test_a_replay_plays_when_play_is_pressed_and_stops_when_pause_is(page, replay):
    page.goto(replay.as_uri())
    before = pictures(page)
    assert len(before) == 3
    button = page.get_by_role("button", name="Play")
    button.click()
    page.wait_for_function("() => document.querySelector('.scrub').value > 30")
    page.get_by_role("button", name="Pause").click()
    assert differ(before, pictures(page))
    where, still = path_m(page), pictures(page)
    page.wait_for_timeout(200)
    assert (path_m(page), pictures(page)) == (where, still)


def test_a_replay_shows_each_place_it_is_scrubbed_to(page, replay):
    page.goto(replay.as_uri())
    shown = []
    for share, name in ((0, "start"), (0.5, "middle"), (1, "end")):
        scrub(page, share)
        shown.append(pictures(page))
        keep(page, f"replay-{name}")
    for before, after in itertools.combinations(shown, 2):
        assert differ(before, after)
    scrub(page, 0.5)
    assert pictures(page) == shown[1], "back at the same place the picture is the same"


def test_the_numbers_at_the_end_are_those_of_the_episodes(page, replay):
    page.goto(replay.as_uri())
    scrub(page, 1)
    for agent, panel in zip(("jump", "snake"), page.locator(".panel").all(), strict=True):
        episode = swath.run_episode(agent, scenario="pasture", seed=7)
        known = int((episode.weed_detected & ~episode.weed_mowed).sum())
        unknown = episode.weeds_total - episode.weeds_mowed - known
        words = panel.locator(".status span").all_inner_texts()
        assert words[0].startswith(f"path {episode.path_length_m:.1f} m (")
        assert words[1:] == [
            f"weeds: {episode.weeds_mowed} mowed, {known} detected, {unknown} undetected",
            f"ground seen {np.floor(1000 * episode.seen_fraction + 1e-9) / 10:.1f} %",
            "done",
        ]
        assert panel.locator("canvas.scene").get_attribute("aria-label").startswith(f"{agent}: path ")


def test_the_picture_of_a_place_is_that_of_the_trajectory(page, replay):
    page.goto(replay.as_uri())
    episode = swath.run_episode("jump", scenario="pasture", seed=7)
    data = "JSON.parse(document.getElementById('replay').textContent).agents[0]"
    for x_m, y_m, _, path in episode.trajectory[:: len(episode.trajectory) // 50]:
        pose = page.evaluate(f"(path) => new Episode({data}).poseAt(path)", path)
        assert (pose["x"], pose["y"]) == pytest.approx((x_m, y_m), abs=1e-3)


def test_a_replay_is_played_by_keys(page, replay):
    page.goto(replay.as_uri())
    page.keyboard.press("ArrowRight")
    one = path_m(page)
    page.keyboard.press("Shift+ArrowRight")
    assert one > 0
    assert path_m(page) == pytest.approx(11 * one)
    page.keyboard.press("ArrowLeft")
    assert path_m(page) == pytest.approx(10 * one)
    page.keyboard.press("End")
    assert path_m(page) == pytest.approx(100 * one)
    page.keyboard.press("Home")
    assert path_m(page) == 0
    speed = page.locator(".speed")
    before = speed.input_value()
    page.keyboard.press("ArrowUp")
    assert float(speed.input_value()) > float(before)
    page.keyboard.press(" ")
    page.wait_for_function("() => document.querySelector('.scrub').value > 1")
    page.keyboard.press(" ")
    assert page.get_by_role("button", name="Play").is_visible()


def test_speed_is_metres_a_second(page, replay):
    page.clock.install(time=0)
    page.goto(replay.as_uri())
    page.locator(".speed").select_option("20")
    page.clock.pause_at(60)  # from now on time passes when it is told to
    page.get_by_role("button", name="Play").click()
    page.clock.run_for(5000)
    assert path_m(page) == pytest.approx(100, abs=1)


def open_race(page, folder, agents, size_m, size_px):
    """Opens a replay of agents on a pasture of that length and width in a window of that width and height, half-way."""
    Path(folder, "pasture.toml").write_text(f"[pasture]\nlength_m = {size_m[0]}\nwidth_m = {size_m[1]}\n")
    path = folder / "race.html"
    assert main(["replay", *agents, "--scenario", str(folder / "pasture.toml"), "--out", str(path)]) == 0
    page.set_viewport_size({"width": size_px[0], "height": size_px[1]})
    page.goto(path.as_uri())
    scrub(page, 0.5)
    # Pictures are fitted a frame after the page has its size, which may change that again.
    page.wait_for_function(
        "() => { const boxes = JSON.stringify([...document.querySelectorAll('.panel, canvas.scene, .legend')]"
        ".map((part) => part.getBoundingClientRect())); "
        "window.still = boxes === window.boxes ? window.still + 1 : 0; window.boxes = boxes; "
        "return window.still > 9; }",
        polling="raf",
    )


@pytest.mark.parametrize(("width", "height"), [(640, 360), (1280, 720)])
@pytest.mark.parametrize("agents", [["snake"], ["snake", "horizon"], ["snake", "horizon", "clairvoyant"]], ids=len)
@pytest.mark.parametrize(("length_m", "width_m"), [(100, 40), (12, 60)])
def test_agents_stand_side_by_side_and_nothing_is_covered(page, tmp_path, length_m, width_m, agents, width, height):
    open_race(page, tmp_path, agents, (length_m, width_m), (width, height))
    scenes, panels, (controls,), (legend,) = (
        [part.bounding_box() for part in page.locator(name).all()]
        for name in ("canvas.scene", ".panel", ".controls", ".legend")
    )
    assert len(scenes) == len(agents)
    for scene, panel in zip(scenes, panels, strict=True):
        assert (scene["y"], scene["height"]) == (scenes[0]["y"], scenes[0]["height"])
        assert panel["y"] <= scene["y"]
        assert scene["y"] + scene["height"] < panel["y"] + panel["height"] <= controls["y"]
        assert 0 <= scene["x"] < scene["x"] + scene["width"] <= width
    for left, right in itertools.pairwise(scenes):
        assert left["x"] + left["width"] <= right["x"]
    assert controls["y"] + controls["height"] <= legend["y"]
    assert legend["y"] + legend["height"] <= height
    # One scale for both axes and the whole pasture: without the margins a picture has the form of what it shows.
    shown = page.evaluate(
        "() => { const { left, right, bottom, top } = "
        "boundsOf(JSON.parse(document.getElementById('replay').textContent)); return [left, right, bottom, top]; }"
    )
    assert shown[0] < 0 < length_m < shown[1]
    assert shown[2] < 0 < width_m < shown[3]
    px_per_m = (scenes[0]["height"] - 40) / (shown[3] - shown[2])
    assert scenes[0]["width"] == pytest.approx(max(68 + px_per_m * (shown[1] - shown[0]), 140), abs=3)
    keep(page, f"race-{len(agents)}-{length_m}x{width_m}-{width}", full_page=False)


@pytest.mark.parametrize(("width", "height", "rows"), [(700, 500, 2), (1280, 720, 1)])
def test_many_agents_with_long_names_stand_in_rows_and_none_covers_another(page, tmp_path, width, height, rows):
    agents = ["bcp", "bcp:spacing=sensor", "snake", "jump", "r-snake", "react", "horizon:iterations=300", "clairvoyant"]
    open_race(page, tmp_path, agents, (10, 100), (width, height))
    scenes, words = (
        [part.bounding_box() for part in page.locator(name).all()] for name in ("canvas.scene", ".status span")
    )
    # Names may be wider than what they stand in.
    names = page.locator(".panel h3").evaluate_all(
        "(headings) => headings.map((heading) => { const range = new Range(); range.selectNodeContents(heading); "
        "return range.getBoundingClientRect().toJSON(); })"
    )
    assert len(scenes) == len(names) == len(agents)
    shown = [*scenes, *names, *words]
    for part in shown:
        assert 0 <= part["x"] < part["x"] + part["width"] <= width
    for one, other in itertools.combinations(shown, 2):
        assert not covers(one, other)
    assert len({scene["y"] for scene in scenes}) == rows
    assert page.evaluate("document.documentElement.scrollWidth") == width
    keep(page, f"race-{len(agents)}-10x100-{width}")


def covers(one, other):
    return all(
        one[start] < other[start] + other[size] and other[start] < one[start] + one[size]
        for start, size in (("x", "width"), ("y", "height"))
    )


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1280, "dark")])
def test_nothing_is_wider_than_the_window(page, replay, report, width, scheme):
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": 800})
    page.goto(replay.as_uri())
    scrub(page, 0.4)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    keep(page, f"replay-{width}-{scheme}")


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1280, "dark"), (1280, "light")])
def test_a_report_fits_its_window(page, report, width, scheme):
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": 800})
    page.goto(report.as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") == width
    keep(page, f"report-{width}-{scheme}")


def test_a_table_that_is_too_wide_moves_beneath_its_first_column(page, tmp_path):
    agents = "bcp,bcp-tsp,react,jump,snake,r-snake,greedy,horizon,learned,clairvoyant"
    out = tmp_path / "out"
    command = ["evaluate", "cowbot-field", "--agents", agents, "--instances", "2", "--out", str(out)]
    assert main(command) == 0
    assert main(["report", str(out)]) == 0
    page.set_viewport_size({"width": 1280, "height": 720})
    page.goto((out / "report.html").as_uri())
    table = page.locator(".wide").nth(1)
    heads, cells = table.locator("tbody th"), table.locator("tbody td:nth-child(2)")
    table.scroll_into_view_if_needed()
    before = heads.first.bounding_box(), cells.first.bounding_box()
    assert table.evaluate("table => table.scrollWidth > table.clientWidth")
    table.evaluate("table => { table.scrollLeft = 300; }")
    after = heads.first.bounding_box(), cells.first.bounding_box()
    assert after[0] == before[0]
    assert after[1]["x"] == before[1]["x"] - 300
    # What moves beneath the first column is hidden there.
    middle = after[0]["x"] + after[0]["width"] / 2, after[0]["y"] + after[0]["height"] / 2
    assert page.evaluate("at => document.elementFromPoint(...at).closest('th, td').tagName", middle) == "TH"
    keep(page, "report-ten-agents")


def test_a_report_plays_the_replay_that_is_opened(page, report):
    page.goto(report.as_uri())
    assert page.locator("canvas").count() == 0, "nothing is decoded before it is asked for"
    replays = page.locator("details.replay")
    replays.filter(has_text="snake, worst").locator("summary").click()
    page.wait_for_selector("canvas.scene")
    before = pictures(page)
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("() => document.querySelector('.scrub').value > 30")
    page.get_by_role("button", name="Pause").click()
    after = pictures(page)
    assert differ(before, after)
    scrub(page, 0.8)
    assert differ(after, pictures(page))
    keep(page, "report-replay")


def test_a_report_of_100000_episodes_is_small_and_opens_quickly(page, tmp_path):
    agents = ["bcp", "bcp-tsp", "jump", "snake", "r-snake"]
    study = Study.plan(agents, scenario="table1", instances=105, seed=0, only=None)
    rows = {task: made_up(study, *task) for task in study.tasks()}
    assert len(rows) >= 100_000
    Results.of(study, rows, "bcp").write(tmp_path)
    path = tmp_path / "report.html"
    path.write_text(page_of(Evaluated.read(tmp_path)))
    assert path.stat().st_size < 15_000_000
    took_s = []
    # The first time the browser itself is cold.
    for _ in range(2):
        since = time.perf_counter()
        page.goto("about:blank")
        page.goto(path.as_uri())
        page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        took_s.append(time.perf_counter() - since)
    print(f"{len(rows)} episodes: {path.stat().st_size / 1e6:.2f} MB, open after {min(took_s):.2f} s")
    assert min(took_s) < 3


def made_up(study, cell, agent, instance):
    """A row in the form of the run's, of an episode that nobody drove."""
    fraction = 0.3 + 0.1 * study.labels.index(agent) + (17 * cell + 31 * instance) % 101 / 200
    return Row(
        cell=cell,
        scenario=study.cells[cell].name,
        agent=agent,
        instance=instance,
        seed=study.seed + instance,
        path_length_m=2229.0 * fraction,
        bcp_length_m=2229.0,
        path_fraction=fraction,
        weeds_total=40,
        weeds_detected=40,
        weeds_mowed=40 - instance % 3,
        seen_fraction=1.0,
        outcome="done",
        wall_s=0.001,
    )
