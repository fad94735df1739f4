"""What `make bench-remote` says is what was measured, and what was not is said too."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from benchmarks.remote.blocks import Pair, drive, interval
from benchmarks.remote.figures import BATCHES, FULL, SHORT, Figures
from benchmarks.remote.local import LocalEnv, LocalVecEnv
from benchmarks.remote.page import targets
from benchmarks.remote.page import text as page
from remote_server import Server, needs_server, same

import swath
from swath.registration import ENV_ID


def figures():
    pairs = {
        (kind, num_envs): Pair([100.0] * 4, [100.0 + 0.4 * num_envs] * 4)
        for kind in (SHORT, FULL)
        for num_envs in BATCHES
    }
    return Figures(
        one=Pair([3.0, 4.0], [100.0, 200.0]),
        usual_us=[150.0, 300.0],
        batches=pairs,
        others={"echo": [140.0, 140.0], "dm_env_rpc": [400.0, 500.0]},
        missing={"openenv": "its environment could not be made"},
        rounds=2,
    )


def test_each_target_is_judged_by_the_median_of_pairs_and_what_did_not_run_is_not_compared():
    lines = targets(figures()).splitlines()[2:]
    assert [line.split(" | ")[-3:] for line in lines] == [
        ["0.325", "0.250 to 0.400", "met |"],
        ["-", "-", "not compared |"],
        ["0.487", "0.375 to 0.600", "met, not beyond doubt |"],
        ["-", "-", "not compared |"],
        ["0.400 us", "0.400 to 0.400", "met |"],
        ["0.400 us", "0.400 to 0.400", "**missed** |"],
    ]
    assert "- openenv: its environment could not be made" in page(figures(), "make bench-remote")


def test_the_interval_of_a_median_is_as_wide_as_rounds_differ_and_none_of_one_round():
    rng = np.random.default_rng(1)
    rounds, blocks = 100, 9
    of_rounds = rng.normal(5.0, 1.0, rounds)
    low, high = interval(np.repeat(of_rounds, blocks).tolist(), rounds)
    # The median of a hundred normal numbers strays by 1.253 / 10 of their deviation, however many blocks a round has.
    assert high - low == pytest.approx(2 * 1.96 * 0.1253, rel=0.35)
    assert low < np.median(of_rounds) < high
    assert interval([1.0, 2.0], 1) is None
    assert interval([1.0, 2.0, 3.0], 2) is None


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


@needs_server
@pytest.mark.parametrize("kind", [SHORT, FULL], ids=["short", "full"])
def test_a_pair_tells_the_same_here_and_on_a_server_to_the_last_info(kind):
    server = Server()
    far = swath.remote.make_vec(ENV_ID, 3, connect=server.endpoint, infos=kind.infos, **kind.blocks)
    alone = swath.remote.make(ENV_ID, connect=server.endpoint, infos=kind.infos, **kind.blocks)
    here = [LocalVecEnv(3, kind), LocalEnv(kind)]
    usual = gym.make_vec(ENV_ID, num_envs=3, **kind.blocks)
    for env in (far, alone, usual, *here):
        env.reset(seed=4)
    action = np.full((3, 1), 0.1, np.float32)
    told = far.step(action)
    assert same(told, here[0].step(action))
    assert same(alone.step(action[0]), here[1].step(action[0]))
    assert same(told[:4], usual.step(action)[:4])
    assert bool(told[4]) == kind.infos
    twin = pickle.loads(pickle.dumps(here[0]._batch))
    assert same(twin.step(action), here[0].step(action))
    for env in (far, alone):
        env.close()
    server.end()
