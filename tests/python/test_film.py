"""Films of recorded episodes."""

import dataclasses
import os
import re
import subprocess
import sys

import numpy as np
import pytest

import swath
from swath import _native
from swath.film import SUFFIXES, write_film

SIZE = (320, 180)
QUICK = {"size": SIZE, "fps": 5, "seconds": 1.0}


@pytest.fixture(scope="module")
def episodes():
    return [swath.run_episode(agent, scenario="cowbot-field", seed=7) for agent in ("snake", "jump", "horizon")]


@pytest.mark.parametrize("scenario", ["cowbot-field", "pasture"])
@pytest.mark.parametrize("agent", ["bcp", "bcp-tsp", "react", "jump", "snake", "r-snake", "horizon"])
def test_a_film_meets_what_the_episode_met(agent, scenario):
    for seed in range(3):
        episode = swath.run_episode(agent, scenario=scenario, seed=seed)
        film = _native.Film(episode.scenario, episode.weeds_m, [("", episode.trajectory)], SIZE, 1)
        # In pieces that end between the points.
        for path_m in np.linspace(0, film.length_m, 50):
            film.drive_to(path_m)
        detected, mowed, seen_fraction = film.state(0)
        assert np.array_equal(detected, episode.weed_detected)
        assert np.array_equal(mowed, episode.weed_mowed)
        assert seen_fraction == pytest.approx(episode.seen_fraction, abs=1e-12)


def test_the_last_picture_is_a_png_with_the_episodes_side_by_side(episodes, tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    write_film(episodes, tmp_path / "race.png", size=SIZE)
    with pillow.open(tmp_path / "race.png") as picture:
        assert picture.size == (3 * SIZE[0], SIZE[1])
        picture.load()
    write_film([*episodes, episodes[0]], tmp_path / "four.png", size=SIZE)
    with pillow.open(tmp_path / "four.png") as picture:
        assert picture.size == (2 * SIZE[0], 2 * SIZE[1])


def test_a_gif_moves_repeats_and_ends_with_the_last_picture(episodes, tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    write_film(episodes[:2], tmp_path / "race.gif", **QUICK)
    write_film(episodes[:2], tmp_path / "race.png", size=SIZE)
    with pillow.open(tmp_path / "race.gif") as film, pillow.open(tmp_path / "race.png") as last:
        assert (film.n_frames, film.size, film.info["loop"]) == (6, (640, 180), 0)
        shown = []
        for number in range(film.n_frames):
            film.seek(number)
            shown.append((np.asarray(film.convert("RGB"), np.int16), film.info["duration"]))
        assert [duration for _, duration in shown] == [200] * 5 + [1500]
        assert np.abs(shown[0][0] - shown[-1][0]).max() > 100
        # A palette of 256 colours is close to the truth.
        assert np.abs(shown[-1][0] - np.asarray(last.convert("RGB"), np.int16)).mean() < 2


@pytest.mark.parametrize(("fps", "each_ms"), [(30, 30), (24, 40), (100, 20)])
def test_a_gif_takes_as_long_as_was_asked_for_in_even_steps(episodes, tmp_path, fps, each_ms):
    pillow = pytest.importorskip("PIL.Image")
    write_film(episodes[:1], tmp_path / "snake.gif", size=(160, 90), fps=fps, seconds=2.0)
    with pillow.open(tmp_path / "snake.gif") as film:
        times_ms = []
        for number in range(film.n_frames):
            film.seek(number)
            times_ms.append(film.info["duration"])
    # The last picture stands for a second and a half.
    assert sum(times_ms) == 2000 + 1500
    assert times_ms[-1] == 1500
    assert sum(time_ms != each_ms for time_ms in times_ms[:-1]) <= 1


def test_an_mp4_holds_every_picture(episodes, tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    write_film(episodes[:1], tmp_path / "snake.mp4", size=(321, 181), fps=5, seconds=1.0)
    # The start, a second, and the last picture for a second and a half.
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "snake.mp4"))
    assert (frames, seconds) == (1 + 5 + 7, pytest.approx(13 / 5, abs=0.01))


def test_a_recording_for_rerun_can_be_read(episodes, tmp_path):
    pytest.importorskip("rerun")
    write_film(episodes[:2], tmp_path / "race.rrd", **QUICK)
    rerun = [sys.executable, "-m", "rerun", "rrd"]
    # The command keeps notes on its use at home.
    elsewhere = {**os.environ, "HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
    subprocess.run([*rerun, "verify", tmp_path / "race.rrd"], check=True, env=elsewhere)
    command = [*rerun, "print", "-vvv", tmp_path / "race.rrd"]
    printed = subprocess.run(command, check=True, env=elsewhere, capture_output=True, text=True).stdout
    for name in ["snake", "jump", "weeds/mowed", "path_m"]:
        assert name in printed


@pytest.mark.parametrize("suffix", [".gif", ".mp4", ".png"])
def test_the_same_episodes_give_the_same_bytes(episodes, tmp_path, suffix):
    files = [tmp_path / f"{name}{suffix}" for name in ("one", "two")]
    for file in files:
        write_film(episodes[:1], file, size=SIZE, fps=4, seconds=0.5)
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_pause_without_a_path_is_filmed_too(episodes, tmp_path):
    still = dataclasses.replace(episodes[0], trajectory=episodes[0].trajectory[:1], path_length_m=0.0)
    write_film([still], tmp_path / "still.gif", **QUICK)
    assert (tmp_path / "still.gif").stat().st_size > 0


def test_what_cannot_be_filmed_is_refused_and_leaves_nothing(episodes, tmp_path):
    other = swath.run_episode("snake", scenario="cowbot-field", seed=8)
    elsewhere = swath.run_episode("snake", scenario="pasture", seed=7)
    lost = dataclasses.replace(episodes[0], trajectory=episodes[0].trajectory[:0])
    for given, name, arguments, expected in [
        (episodes, "race.avi", {}, f"`path` must end in {', '.join(SUFFIXES)}, got "),
        ([], "race.gif", {}, "`episodes` must hold from 1 to 64 episodes, got 0"),
        ([episodes[0], other], "race.gif", {}, "`episodes` must have the same weeds, got another one in `episodes[1]`"),
        ([episodes[0], elsewhere], "race.gif", {}, "`episodes` must have the same scenario, got another one in "),
        ([lost], "race.gif", {}, "`trajectory` must be at least one row, got none"),
        (episodes, "race.gif", {"fps": 0}, "`fps` must be a whole number from 1 to 100, got 0"),
        (episodes, "race.gif", {"seconds": float("nan")}, "`seconds` must be above 0 and at most 3600, got nan"),
        (episodes, "race.gif", {"seconds": 4000}, "`seconds` must be above 0 and at most 3600, got 4000"),
        (episodes, "race.png", {"size": (10, 10)}, "`size` must be (width, height) in pixels, from (160, 90) to "),
    ]:
        with pytest.raises(swath.ConfigError, match=re.escape(expected)):
            write_film(given, tmp_path / name, **arguments)
    with pytest.raises(FileNotFoundError, match=r"missing/race\.png"):
        write_film(episodes, tmp_path / "missing" / "race.png", size=SIZE)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("package", "suffix", "extra"),
    [("PIL", ".gif", "film"), ("imageio_ffmpeg", ".mp4", "film"), ("rerun", ".rrd", "rerun")],
)
def test_a_film_names_the_extra_when_a_package_is_absent(episodes, tmp_path, monkeypatch, package, suffix, extra):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ModuleNotFoundError, match=rf"`{suffix}` needs {package}: pip install 'swath\[{extra}\]'"):
        write_film(episodes, tmp_path / f"race{suffix}")
    assert list(tmp_path.iterdir()) == []


def test_a_film_that_ffmpeg_did_not_finish_is_an_error_and_leaves_nothing(episodes, tmp_path, monkeypatch):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    whole = ffmpeg.count_frames_and_secs

    def short(path):
        frames, seconds = whole(path)
        return frames - 1, seconds

    monkeypatch.setattr(ffmpeg, "count_frames_and_secs", short)
    with pytest.raises(OSError, match=r"snake\.mp4 was not written whole: \d+ of \d+ pictures"):
        write_film(episodes[:1], tmp_path / "snake.mp4", **QUICK)
    assert list(tmp_path.iterdir()) == []
