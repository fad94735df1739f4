"""What `make bench-remote` says is what was measured, and what was not is said too."""

import pytest
from benchmarks.remote.blocks import Pair, drive
from benchmarks.remote.figures import BATCHES, FULL, SHORT, Figures
from benchmarks.remote.page import targets
from benchmarks.remote.page import text as page


def figures():
    pairs = {
        (kind, num_envs): Pair([100.0] * 4, [100.0 + 0.4 * num_envs] * 4)
        for kind in (SHORT, FULL)
        for num_envs in BATCHES
    }
    return Figures(
        one=Pair([3.0, 4.0], [150.0, 300.0]),
        batches=pairs,
        others={"echo": [140.0, 140.0], "dm_env_rpc": [400.0, 500.0]},
        missing={"openenv": "its environment could not be made"},
    )


def test_each_target_is_judged_by_the_median_of_pairs_and_what_did_not_run_is_not_compared():
    lines = targets(figures()).splitlines()[2:]
    assert [line.split(" | ")[-2:] for line in lines] == [
        ["0.487", "met |"],
        ["-", "not compared |"],
        ["0.400 us", "met |"],
        ["0.400 us", "**missed** |"],
    ]
    assert "- openenv: its environment could not be made" in page(figures(), "make bench-remote")


def test_both_sides_drive_the_same_tape_and_take_turns_in_beginning():
    order = []
    pair = drive(
        lambda step: order.append(("here", step)), lambda step: order.append(("far", step)), [0, 1, 2, 3, 4], 2
    )
    assert order == [
        (side, step)
        for side, steps in [("here", [0, 1]), ("far", [0, 1]), ("far", [2, 3]), ("here", [2, 3])]
        for step in steps
    ]
    assert len(pair.local_us) == len(pair.remote_us) == 2
    assert pair.differences() == pytest.approx([pair.remote_us[i] - pair.local_us[i] for i in range(2)])
