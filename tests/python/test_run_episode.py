"""Whole episodes, checked from outside: by their points alone, by the paper's lengths, by hand-drawn pastures."""

import math

import gymnasium as gym
import numpy as np
import oracle
import pytest

import swath

AGENTS = ["bcp", "bcp-tsp", "react", "jump", "snake", "r-snake", "greedy", "horizon", "learned"]
SCENARIOS = [
    "cowbot-field",
    "pasture",
    {"weeds": {"distribution": "gaussian", "count": 60}, "mower": {"turning_radius_m": 3}},
]


@pytest.fixture(params=AGENTS, scope="module")
def agent(request):
    return request.param


@pytest.fixture(params=SCENARIOS, ids=["field", "pasture", "clusters"], scope="module")
def episode(request, agent):
    return swath.run_episode(agent, scenario=request.param, seed=11)


def test_the_length_is_that_of_the_line_through_the_points(episode):
    assert episode.trajectory[0, 3] == 0
    assert episode.trajectory[-1, 3] == pytest.approx(episode.path_length_m, abs=1e-6)
    assert oracle.length(episode.trajectory) == pytest.approx(episode.path_length_m, rel=1e-3)
    assert episode.path_fraction == episode.path_length_m / episode.bcp_length_m


def test_points_are_at_most_a_tenth_of_a_metre_apart_and_lead_forwards(episode):
    steps = np.diff(episode.trajectory[:, 3])
    assert steps.max() <= 0.1 + 1e-9
    assert steps.min() >= 0
    gaps = np.hypot(*np.diff(episode.trajectory[:, :2], axis=0).T)
    assert gaps.max() <= 0.1 + 1e-9


def test_no_turn_is_tighter_than_the_turning_radius(episode):
    radius_m = episode.scenario.to_dict()["mower"]["turning_radius_m"]
    points = oracle.thinned(episode.trajectory, 0.05)
    assert oracle.curvatures(points).max() <= 1.01 / radius_m


@pytest.mark.parametrize("radius_m", [0.05, 0.3])
def test_chords_tell_length_and_curvature_of_tight_turns_too(radius_m):
    mower = {"turning_radius_m": radius_m, "deck_width_m": 1.0}
    scenario = {"pasture": {"length_m": 20, "width_m": 10}, "mower": mower}
    episode = swath.run_episode("snake", scenario=scenario, seed=1)
    chords_m = np.hypot(*np.diff(episode.trajectory[:, :2], axis=0).T)
    assert chords_m.sum() == pytest.approx(episode.path_length_m, rel=1e-3)
    turns = np.abs(wrapped(np.diff(episode.trajectory[:, 2])))
    is_long = chords_m > 1e-6
    assert (turns[is_long] / chords_m[is_long]).max() * radius_m < 1.01


def test_headings_point_along_the_path(episode):
    steps = np.diff(episode.trajectory[:, :2], axis=0)
    is_long = np.hypot(*steps.T) > 1e-3
    middle = episode.trajectory[:-1, 2] + 0.5 * wrapped(np.diff(episode.trajectory[:, 2]))
    off = wrapped(np.arctan2(steps[:, 1], steps[:, 0]) - middle)
    assert np.abs(off[is_long]).max() < 1e-6


def test_the_weeds_claimed_mowed_are_those_that_the_bar_has_crossed(episode):
    deck_width_m = episode.scenario.to_dict()["mower"]["deck_width_m"]
    surely, maybe = oracle.swept(episode.trajectory, episode.weeds_m, deck_width_m)
    assert not np.any(surely & ~episode.weed_mowed)
    assert not np.any(episode.weed_mowed & ~maybe)
    # What is not judged must stay a small part, or the test would promise nothing.
    # JUMP's equation (1) puts the lowest weed exactly on the end of its bar.
    assert np.mean(maybe & ~surely) <= (0.5 if episode.agent == "jump" else 0.1)


def poses_at(episode, path_m):
    """The poses of the points of the path nearest to these lengths, (n, 4)."""
    numbers = np.searchsorted(episode.trajectory[:, 3], path_m).clip(0, len(episode.trajectory) - 1)
    return episode.trajectory[numbers]


def is_in_sight(poses, points, sensor, slack_m):
    """Whether the triangle, made larger by `slack_m`, holds each point; poses and points are paired or broadcast."""
    ahead, left = oracle.in_frame(poses, *points.T)
    half = 0.5 * sensor["width_m"] / sensor["range_m"] * ahead
    return (ahead >= -slack_m) & (ahead <= sensor["range_m"] + slack_m) & (np.abs(left) <= half + slack_m)


# Points of the path are up to 0.1 m apart, and in a turn of 1.5 m the far end of the triangle moves 0.9 m in between.
SLACK_M = 1.0


def test_weeds_are_detected_when_the_triangle_first_holds_them(episode):
    sensor, at_m = episode.scenario.to_dict()["sensor"], episode.weed_detected_path_m
    assert np.array_equal(np.isfinite(at_m), episode.weed_detected)
    found = np.flatnonzero(episode.weed_detected)
    assert is_in_sight(poses_at(episode, at_m[found]), episode.weeds_m[found], sensor, SLACK_M).all()
    for weed in found:
        before = episode.trajectory[episode.trajectory[:, 3] < at_m[weed] - 0.3]
        assert not is_in_sight(before, episode.weeds_m[weed], sensor, -SLACK_M).any()


def test_weeds_are_mowed_when_the_bar_passes_over_them(episode):
    half_m = 0.5 * episode.scenario.to_dict()["mower"]["deck_width_m"]
    at_m = episode.weed_mowed_path_m
    assert np.array_equal(np.isfinite(at_m), episode.weed_mowed)
    mowed = np.flatnonzero(episode.weed_mowed)
    ahead, left = oracle.in_frame(poses_at(episode, at_m[mowed]), *episode.weeds_m[mowed].T)
    # A stretch is 0.2 m long, and behind its end in a turn the bar's outer end has come further.
    assert np.abs(ahead).max(initial=0) <= 0.45
    assert np.abs(left).max(initial=0) <= half_m + 0.05


def test_cells_are_seen_when_the_triangle_or_the_bar_first_holds_them(episode):
    blocks, at_m = episode.scenario.to_dict(), episode.cell_seen_path_m
    rows, columns = at_m.shape
    assert np.isfinite(at_m).mean() == pytest.approx(episode.seen_fraction)
    x = (np.arange(columns) + 0.5) * blocks["pasture"]["length_m"] / columns
    y = (np.arange(rows) + 0.5) * blocks["pasture"]["width_m"] / rows
    centres = np.stack(np.meshgrid(x, y), axis=-1)[np.isfinite(at_m)]
    poses = poses_at(episode, at_m[np.isfinite(at_m)])
    ahead, left = oracle.in_frame(poses, *centres.T)
    is_under_bar = (np.abs(ahead) <= 0.45) & (np.abs(left) <= 0.5 * blocks["mower"]["deck_width_m"] + 0.05)
    assert (is_in_sight(poses, centres, blocks["sensor"], SLACK_M) | is_under_bar).all()


def test_the_arcs_are_the_path(episode):
    x_m, y_m, heading_rad, curvature_per_m, length_m = episode.arcs.T
    starts_m = np.concatenate([[0.0], np.cumsum(length_m)])
    assert starts_m[-1] == pytest.approx(episode.path_length_m, abs=1e-6)
    path_m = episode.trajectory[:, 3]
    arc = (np.searchsorted(starts_m, path_m - 1e-9, side="right") - 1).clip(0, len(length_m) - 1)
    along_m, curvature = path_m - starts_m[arc], curvature_per_m[arc]
    # The middle of the chord of an arc looks along the mean heading.
    chord_m = along_m * np.sinc(0.5 * curvature * along_m / np.pi)
    middle_rad = heading_rad[arc] + 0.5 * curvature * along_m
    assert np.allclose(x_m[arc] + chord_m * np.cos(middle_rad), episode.trajectory[:, 0], atol=1e-6)
    assert np.allclose(y_m[arc] + chord_m * np.sin(middle_rad), episode.trajectory[:, 1], atol=1e-6)


def test_the_numbers_count_the_flags(episode):
    assert episode.weeds_total == len(episode.weeds_m)
    assert episode.weeds_detected == episode.weed_detected.sum()
    assert episode.weeds_mowed == episode.weed_mowed.sum()


def test_arrays_have_the_promised_shapes_and_types(episode):
    count = episode.weeds_total
    assert (episode.trajectory.shape[1], episode.trajectory.dtype) == (4, np.float64)
    assert (episode.weeds_m.shape, episode.weeds_m.dtype) == ((count, 2), np.float64)
    assert (episode.weed_detected.shape, episode.weed_detected.dtype) == ((count,), np.bool_)
    assert (episode.weed_mowed.shape, episode.weed_mowed.dtype) == ((count,), np.bool_)


def test_the_same_seed_gives_the_same_bytes(agent):
    first, again, other = (swath.run_episode(agent, scenario="cowbot-field", seed=seed) for seed in (5, 5, 6))
    assert first.trajectory.tobytes() == again.trajectory.tobytes()
    assert first.weeds_m.tobytes() == again.weeds_m.tobytes()
    assert first.weeds_m.tobytes() != other.weeds_m.tobytes()


def test_every_agent_meets_the_same_weeds():
    weeds = {swath.run_episode(agent, seed=3).weeds_m.tobytes() for agent in AGENTS}
    assert len(weeds) == 1


def test_a_reset_with_the_seed_plants_the_same_weeds_as_run_episode():
    env = gym.make("swath/MowerRouting-v0", scenario="cowbot-field", action={"kind": "drive"}).unwrapped
    env.reset(seed=9)
    placed = gym.make("swath/MowerRouting-v0", scenario="cowbot-field", action={"kind": "drive"}).unwrapped
    placed.reset(seed=9, options={"weeds": swath.run_episode("bcp", scenario="cowbot-field", seed=9).weeds_m})
    assert env.snapshot() == placed.snapshot()


@pytest.mark.parametrize(
    ("scenario", "passes", "length_m", "deck_m", "radius_m"),
    [("cowbot-field", 20, 36, 1.3, 1.5), ("pasture", 20, 100, 2, 2)],
)
def test_the_boustrophedon_path_has_the_length_of_the_closed_form(scenario, passes, length_m, deck_m, radius_m):
    turn_m = radius_m * (math.pi + 4 * math.acos((2 * radius_m + deck_m) / (4 * radius_m)))
    episode = swath.run_episode("bcp", scenario=scenario)
    assert episode.path_length_m == pytest.approx(passes * length_m + (passes - 1) * turn_m, abs=1e-6)
    assert episode.weeds_mowed == episode.weeds_total
    assert episode.outcome == "done"


def test_the_field_experiment_of_the_paper_took_897_m_of_boustrophedon_path():
    assert int(swath.run_episode("bcp", scenario="cowbot-field").path_length_m) == 897


def test_placed_weeds_are_mowed_where_they_stand():
    # The first pass goes along y = 1 with a bar from 0 to 2, the second one back along y = 3 with a bar from 2 to 4.
    weeds = np.array([[50.0, 0.5], [10.0, 1.9], [70.0, 3.0]])
    episode = swath.run_episode("bcp", weeds=weeds)
    assert np.array_equal(episode.weeds_m, weeds)
    assert episode.weed_mowed.all()


def test_a_pasture_without_weeds_is_no_trouble(agent):
    episode = swath.run_episode(agent, scenario="cowbot-field", weeds=np.empty((0, 2)))
    assert episode.weeds_m.shape == (0, 2)
    assert episode.weeds_total == episode.weeds_mowed == 0


@pytest.mark.parametrize(
    ("weeds", "text"),
    [
        ([[1.0, 40.5]], "`weeds[0]` must be on the pasture, 0..=100 by 0..=40 m, got [1, 40.5]"),
        ([[1.0, 1.0], [math.nan, 1.0]], "`weeds[1]` must be on the pasture, 0..=100 by 0..=40 m, got [NaN, 1]"),
        (np.zeros((2, 3)), "`weeds` must be an array (n, 2) of numbers, metres, got the shape (2, 3)"),
        ("weeds.csv", "`weeds` must be an array (n, 2) of numbers, metres, got `str`"),
    ],
)
def test_weeds_that_cannot_be_placed_are_refused_by_number(weeds, text):
    with pytest.raises(swath.ConfigError) as error:
        swath.run_episode("bcp", weeds=weeds)
    assert str(error.value) == text


def test_options_say_the_same_as_the_text_form():
    text = swath.run_episode("bcp:spacing=sensor")
    options = swath.run_episode("bcp", agent_options={"spacing": "sensor"})
    assert text.agent == options.agent == "bcp:spacing=sensor"
    # The search sweep: 4 passes, and 3 turns of a half circle with 8 m between its arcs.
    assert text.path_length_m == options.path_length_m == pytest.approx(400 + 3 * (2 * math.pi + 8), abs=1e-6)


def test_a_sweep_is_refused():
    with pytest.raises(swath.ConfigError, match="table1 declares the sweep `density`"):
        swath.run_episode("bcp", scenario="table1")


def wrapped(angles):
    return np.mod(angles + math.pi, 2 * math.pi) - math.pi
