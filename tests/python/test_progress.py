"""The time that is left is reckoned from what this run has done."""

import re

import pytest

from swath import progress
from swath.progress import Progress


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands until it is set, in seconds."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_the_time_left_is_that_of_the_steps_left_at_the_pace_so_far(clock):
    with Progress("steps", 1000, is_wanted=False) as bar:
        assert bar.left() == ""
        clock[0] = 10
        bar.advance(200)
        assert bar.left() == "about 40 s left"
        clock[0] = 600
        assert bar.left() == "about 40 min left"
        bar.advance(800)
        assert bar.left() == ""


def test_what_an_earlier_run_has_done_makes_this_one_no_faster(clock):
    with Progress("steps", 1000, is_wanted=False) as bar:
        bar.resume(500)
        assert bar.left() == ""
        clock[0] = 10
        bar.advance(100)
        assert bar.left() == "about 40 s left"


def test_the_bar_tells_the_time_left_and_at_the_end_the_time_taken(clock, capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # as on a terminal
    with Progress("steps", 1000, is_wanted=True) as bar:
        clock[0] = 20
        bar.advance(100)
        bar._bar.refresh()
        assert "100/1000 about 3 min left" in plain(capsys.readouterr().err)
        bar.advance(900)
    assert "1000/1000 in 20 s" in plain(capsys.readouterr().err)


def plain(text):
    """Returns what a terminal shows, without its codes."""
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text)
