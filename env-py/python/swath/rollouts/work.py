"""The work of one worker: episodes on servers, kept one by one."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from swath import _native
from swath.datasets.dataset import need_minari
from swath.datasets.drivers import RANDOM, ScriptedDriver, driver_of, scenario_of
from swath.datasets.episodes import play
from swath.errors import ConfigError, RemoteError
from swath.evaluation.row import Row
from swath.evaluation.study import whole
from swath.progress import Progress
from swath.remote.session import endpoints_of
from swath.rollouts.merge import merge
from swath.rollouts.store import Store
from swath.rollouts.sweep import Shard, Sweep
from swath.vector import MOST_ENVS

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from swath.datasets.drivers import Driver
    from swath.datasets.episodes import Recorded
    from swath.evaluation.results import Results
    from swath.remote.batch import RemoteBatch
    from swath.scenario import Blocks, ScenarioSource

__all__ = ["Work", "work"]


@dataclass(frozen=True)
class Work:
    """What a worker has done.

    Attributes:
        sweep: What was asked.
        shard: Which part of it.
        played: Number of episodes played this time.
        missing: Number of episodes of the whole sweep that other shards have still to play.
        results: The rows and statistics of the whole sweep; None while episodes are missing.
        dataset: The folder of the dataset; None while episodes are missing.
    """

    sweep: Sweep
    shard: Shard
    played: int
    missing: int
    results: Results | None
    dataset: Path | None


def work(
    policy: str,
    *,
    connect: str | Sequence[str],
    out: str | os.PathLike[str],
    scenario: ScenarioSource = None,
    episodes: int = 100,
    seed: int = 0,
    num_envs: int = 16,
    shard: str = "1/1",
    server: str = "default",
    deadline_s: float = 60.0,
    resume: bool = False,
    zenoh: dict[str, object] | None = None,
    progress: bool = False,
    **blocks: Unpack[Blocks],
) -> Work:
    """Plays episodes of a policy on servers, and keeps their numbers and trajectories.

    Episode i has the seed `seed + i`. It is kept once, as soon as it is over; one that was cut off is played again. But
    for `wall_s`, what is kept depends neither on the number of servers, environments and shards nor on how often the
    work was broken off.

    Several workers may share a sweep and its folder, each with a shard of its own. Folders of several machines are
    copied into one, and any of the calls, made there once more, joins them. Whoever finds all episodes there writes
    `episodes.csv`, `summary.json`, `scenario.toml` and a Minari dataset in the folder `dataset`.

    A scripted agent decides by what the server tells of its mower's view, through the action kind of the scenario
    (`steer` or `drive`); where it stops by itself, the outcome is `done`.

    Args:
        policy: A scripted agent with or without options, `random`, or the `.zip` of a trained model with its text file
            beside it.
        connect: The endpoint of a server, or a list of them.
        out: The folder.
        scenario: A shipped name, a file, a dictionary or a `Scenario`. None: what a model was trained on; for other
            policies `pasture`.
        episodes: Number of episodes of the whole sweep, at least 1.
        seed: Seed of episode 0.
        num_envs: Number of episodes that are played together, at least one a server.
        shard: Which part of the sweep to play, `I/N`: episodes I - 1, I - 1 + N, and so on.
        server: The name that the servers were started with.
        deadline_s: How long a server is asked the same before it counts as gone, seconds.
        resume: Whether to go on at once when a server was started anew, as `swath.remote.make_vec` does: the server has
            to run with `--allow-snapshot`. Otherwise the work ends there, and the same call goes on.
        zenoh: Further settings of Zenoh by their path, such as those of `transport/link/tls`.
        progress: Whether a bar on stderr tells how far it is.
        **blocks: Blocks of the scenario, laid over it key by key.

    Returns:
        What was done, with the results if the sweep is whole.

    Raises:
        ConfigError: If an argument cannot be used, or `out` holds something else.
        RemoteError: If a server cannot be reached or has lost its session; the same call goes on from there.
        ModuleNotFoundError: If Minari or `eclipse-zenoh` is not installed; the message names the extra.
        OSError: If `out` cannot be written to.
    """
    need_minari("a worker")
    _check_policy(policy)
    resolved = _native.Scenario(scenario_of(policy) if scenario is None else scenario, **blocks)
    endpoints = endpoints_of(connect)
    num_envs = whole("num_envs", num_envs, least=1, most=MOST_ENVS)
    if not 1 <= len(endpoints) <= num_envs:
        text = f"`connect` must name from 1 to {num_envs} servers, no more than `num_envs`, got {len(endpoints)}"
        raise ConfigError(text)
    part = Shard.parse(shard)
    driver, label = driver_of(policy, resolved, one_by_one=True)
    if isinstance(driver, ScriptedDriver):
        _refuse_worthless(resolved)
    sweep = Sweep.of(label, resolved, episodes=episodes, seed=seed, model=_model_of(policy), shards=part.count)
    store = Store(Path(out), sweep)
    store.check()

    def open_batch(rows: int) -> RemoteBatch:
        from swath.remote.batch import RemoteBatch

        return RemoteBatch(
            resolved,
            rows,
            "SameStep",
            endpoints[:rows],
            server=server,
            percept=isinstance(driver, ScriptedDriver),
            deadline_s=deadline_s,
            resume=resume,
            client=f"worker {label} {part}",
            zenoh=zenoh,
        )

    journal = store.journal(part)
    mine = sweep.instances_of(part)

    def left() -> list[int]:
        return [instance for instance in mine if (0, label, instance) not in journal.rows]

    pending = left()
    with closing(_Servers(open_batch)) as servers:
        if pending:
            # Before anything is written.
            servers.batch(len(pending[:num_envs]))
        try:
            with journal, Progress("episodes", len(mine), is_wanted=progress) as bar:
                # Opening takes a while, in which another worker may have played some of them.
                pending = left()
                bar.resume(len(mine) - len(pending))
                for first in range(0, len(pending), num_envs):
                    wave = pending[first : first + num_envs]
                    for row, episode in _played(servers.batch(len(wave)), driver, sweep, wave):
                        store.keep(journal, part, episode, row)
                        bar.advance(1)
        except RemoteError as error:
            text = f"{error}; the same command goes on from here"
            raise type(error)(text) from error
    merged = merge(store)
    results, dataset = (None, None) if merged is None else merged
    missing = len(sweep) - len(store.rows())
    return Work(sweep, part, len(pending), missing, results, dataset)


class _Servers:
    """Environments on servers, as many as episodes are played together."""

    def __init__(self, open_batch: Callable[[int], RemoteBatch]) -> None:
        self._open_batch = open_batch
        self._batch: RemoteBatch | None = None
        self._rows = 0

    def batch(self, rows: int) -> RemoteBatch:
        """Returns a batch of so many rows."""
        if self._batch is None or self._rows != rows:
            self.close()
            self._batch, self._rows = self._open_batch(rows), rows
        return self._batch

    def close(self) -> None:
        """Ends the sessions."""
        if self._batch is not None:
            self._batch.close()
            self._batch = None


def _played(batch: RemoteBatch, driver: Driver, sweep: Sweep, wave: Sequence[int]) -> Iterator[tuple[Row, Recorded]]:
    """Plays some episodes together, and yields each as soon as it is over."""
    since = time.perf_counter()
    for episode in play(batch, driver, [sweep.seed + instance for instance in wave]):
        wall_s = (time.perf_counter() - since) / len(wave)
        row = Row(
            cell=0,
            scenario=sweep.cells[0].name,
            agent=sweep.label,
            instance=episode.seed - sweep.seed,
            seed=episode.seed,
            outcome=episode.outcome,
            wall_s=wall_s,
            **episode.numbers,  # type: ignore[arg-type] # each number is of its kind
        )
        yield row, episode


def _check_policy(policy: str) -> None:
    """Refuses what is nobody who could play."""
    if policy.endswith(".zip"):
        model = Path(policy)
        beside = model.with_suffix(".toml")
        for file in (model, beside):
            if not file.is_file():
                text = (
                    f"`policy` must be a model with `{beside.name}` beside it, which `swath train` writes,"
                    f" but there is no file {file}"
                )
                raise ConfigError(text)
        return
    names = [*(name for name, *_, acts in _native.agents() if acts), RANDOM]
    if policy.partition(":")[0] not in names:
        text = f"`policy` must be one of {', '.join(names)}, or the .zip of a trained model, got `{policy}`"
        raise ConfigError(text)


def _model_of(policy: str) -> str | None:
    """Returns the hash of the text file beside a trained model, which holds those of the model's other files."""
    return sha256(Path(policy).with_suffix(".toml").read_bytes()).hexdigest() if policy.endswith(".zip") else None


def _refuse_worthless(scenario: _native.Scenario) -> None:
    """Refuses a scenario in which mowed weeds are worth nothing: they are counted by their reward."""
    reward = scenario.to_dict()["reward"]
    assert isinstance(reward, dict), "it is a block of keys"
    if reward["weed"] == 0:
        text = "`reward.weed` must not be 0 where a scripted agent acts on a server, for mowed weeds are counted by it"
        raise ConfigError(text)
