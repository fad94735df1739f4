"""How agents are told apart: each shipped one by a style of its own, the same everywhere."""

import itertools
import re
from importlib.resources import files

import pytest

import swath
from swath import _native
from swath.replay import data_of
from swath.report.chart import marker, swatch
from swath.styles import is_yardstick, style, styles_of

SHIPPED = [name for name, *_ in _native.agents()]


def test_shipped_agents_differ_in_colour_dash_and_mark():
    looks = [style(number) for number in styles_of(SHIPPED)]
    for one, other in itertools.combinations(looks, 2):
        assert one.colour != other.colour
        assert one.dash != other.dash
        assert one.mark != other.mark
    assert len({swatch(number) for number in styles_of(SHIPPED)}) == len(SHIPPED)


def test_at_least_twelve_styles_differ_in_all_and_144_in_something():
    looks = [style(number) for number in range(144)]
    # Whoever sees no colours tells them by dash and mark.
    assert len({(look.dash, look.mark) for look in looks}) == 144
    for what in ("colour", "dash", "mark"):
        assert len({getattr(look, what) for look in looks[:12]}) == 12
    shapes = [re.sub(r"c\d+", "", marker(number, 0, 0)) for number in range(12)]
    assert len(set(shapes)) == 12


@pytest.mark.parametrize("scheme", [0, 1])
def test_the_style_sheet_has_a_colour_for_each_style(scheme):
    sheet = files("swath.replay").joinpath("player.css").read_text("utf-8").split("@media (prefers")[scheme]
    colours = dict(re.findall(r"--line-(\d+): (#[0-9a-f]{6})", sheet))
    assert sorted(map(int, colours)) == list(range(12))
    assert len(set(colours.values())) == 12


def test_a_shipped_agent_has_the_same_style_whoever_stands_beside_it():
    for pair in itertools.permutations(SHIPPED, 2):
        assert [SHIPPED[number] for number in styles_of(pair)] == list(pair)
    labels = ["model.zip", "bcp:spacing=sensor", "bcp", "other.zip", "clairvoyant"]
    numbers = styles_of(labels)
    assert numbers[labels.index("bcp")] == SHIPPED.index("bcp")
    assert numbers[labels.index("clairvoyant")] == SHIPPED.index("clairvoyant")
    assert len(set(numbers)) == len(labels)
    assert min(numbers[0], numbers[1], numbers[3]) == len(SHIPPED)


def test_a_replay_shows_an_agent_in_its_own_style():
    data = data_of([swath.run_episode(agent, scenario="cowbot-field") for agent in ("jump", "clairvoyant")])
    for agent in data["agents"]:
        look = style(SHIPPED.index(agent["label"]))
        assert (agent["colour"], agent["dash"]) == (look.colour, look.dash)
    assert [bool(agent["yardstick"]) for agent in data["agents"]] == [False, True]


def test_a_yardstick_is_what_acts_in_no_environment():
    assert [name for name in SHIPPED if is_yardstick(name)] == ["clairvoyant"]
    assert is_yardstick("clairvoyant:iterations=5")
    assert not is_yardstick("model.zip")
