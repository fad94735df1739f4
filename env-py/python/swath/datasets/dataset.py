"""Recorded episodes as a dataset that Minari loads."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from swath import _native
from swath.datasets.drivers import driver_of, scenario_of
from swath.datasets.episodes import Recorded, play
from swath.errors import ConfigError
from swath.evaluation.study import whole
from swath.extras import need
from swath.files import check_folder
from swath.progress import Progress
from swath.registration import ENV_ID
from swath.seeds import LARGEST_SEED

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from swath.scenario import Blocks, ScenarioSource

__all__ = ["BATCH", "name_of", "need_minari", "record", "write"]

_ROOT = "MINARI_DATASETS_PATH"
"""The variable that tells Minari where its datasets are."""

_MOST_EPISODES = 1 << 32
BATCH = 16
"""Number of episodes that are played together, and held in memory."""


def record(
    agent: str,
    *,
    episodes: int = 100,
    seed: int = 0,
    scenario: ScenarioSource = None,
    dataset_id: str | None = None,
    root: str | os.PathLike[str] | None = None,
    num_threads: int = 1,
    progress: bool = False,
    **blocks: Unpack[Blocks],
) -> Path:
    """Records episodes of an agent as a Minari dataset.

    Episode i has the seed `seed + i`. Observations and actions are those of the Gymnasium environment; a scripted
    agent drives through the action kind of the scenario (`steer` or `drive`), and where it stops by itself the last
    step counts as truncated and the outcome is `done`. Nothing is compressed with loss.
    The metadata of an episode holds its `seed` and `outcome`, that of the dataset `scenario` (TOML), `agent` and
    `swath_version`.

    ```python
    swath.datasets.record("snake", episodes=100, dataset_id="swath/snake-v0")
    dataset = minari.load_dataset("swath/snake-v0")
    ```

    Args:
        agent: A scripted agent with or without options, `random`, or the `.zip` of a trained model.
        episodes: Number of episodes, at least 1.
        seed: Seed of episode 0.
        scenario: A shipped name, a file, a dictionary or a `Scenario`. None: what a model was trained on; for other
            agents `pasture`.
        dataset_id: Name in Minari, `namespace/name-v0`; None: `swath/AGENT-v0`.
        root: Folder of Minari's datasets; None: Minari's own.
        num_threads: Threads that step the environments; they change no result.
        progress: Whether a bar on stderr tells how far it is.
        **blocks: Blocks of the scenario, laid over it key by key.

    Returns:
        The folder of the dataset, which is there as a whole or not at all.

    Raises:
        ConfigError: If an argument cannot be used, or there is a dataset of that name.
        ModuleNotFoundError: If Minari is not installed; the message names the extra.
    """
    need_minari("recording")
    from minari.dataset.minari_dataset import parse_dataset_id

    resolved = _native.Scenario(scenario_of(agent) if scenario is None else scenario, **blocks)
    episodes = whole("episodes", episodes, least=1, most=_MOST_EPISODES)
    seed = whole("seed", seed, least=0, most=LARGEST_SEED - (episodes - 1))
    driver, label = driver_of(agent, resolved)
    name = dataset_id if dataset_id is not None else name_of(label)
    try:
        parse_dataset_id(name)
    except ValueError as error:
        text = f"`dataset_id` must be like `namespace/name-v0`, got `{name}`"
        raise ConfigError(text) from error
    folder = _root(root)
    check_folder("root", folder)
    if (folder / name).exists():
        text = f"`dataset_id` must be new, but there is a dataset {folder / name}"
        raise ConfigError(text)
    with Progress("episodes", episodes, is_wanted=progress) as bar:

        def batches() -> Iterator[Sequence[Recorded]]:
            for first in range(0, episodes, BATCH):
                seeds = range(seed + first, seed + min(first + BATCH, episodes))
                batch = _native.Batch(resolved, len(seeds), "SameStep", num_threads, copy=True)
                played = sorted(play(batch, driver, seeds), key=lambda episode: episode.seed)
                yield played
                bar.advance(len(played))

        return write(folder, name, resolved, label, batches())


def need_minari(what: str) -> None:
    """Makes sure that Minari is there.

    Args:
        what: What needs it, for the message.

    Raises:
        ModuleNotFoundError: If it is not; the message names the extra.
    """
    need(what, "data", "minari", "h5py", "PIL")


def name_of(label: str) -> str:
    """Returns the name in Minari that the dataset of an agent has unless somebody gives it another one."""
    return f"swath/{label.replace(':', '-').replace('=', '-')}-v0"


def write(
    folder: Path, name: str, scenario: _native.Scenario, label: str, batches: Iterable[Sequence[Recorded]]
) -> Path:
    """Writes episodes as a dataset that is there as a whole or not at all.

    Args:
        folder: Folder of Minari's datasets; it may be missing.
        name: Name of the dataset in it.
        scenario: What was driven on.
        label: Who drove.
        batches: The episodes in order, some at a time: no more of them are held in memory.

    Returns:
        The folder of the dataset.

    Raises:
        ConfigError: If there is such a dataset by then.
    """
    folder.mkdir(parents=True, exist_ok=True)
    about = {"scenario": scenario.to_toml(), "agent": label, "swath_version": _native.VERSION}
    with tempfile.TemporaryDirectory(prefix=".unfinished-", dir=folder) as unfinished:
        dataset = None
        for played in batches:
            with _minari_in(Path(unfinished)):
                dataset = _add(dataset, played, name, scenario, about)
        with _minari_in(folder):
            _namespaces(name)
        try:
            # It moves onto nothing but an empty folder, so that a dataset that has come meanwhile stays as it is.
            (Path(unfinished) / name).rename(folder / name)
        except OSError as error:
            text = f"`dataset_id` must be new, but there is now a dataset {folder / name}"
            raise ConfigError(text) from error
    return folder / name


def _add(dataset: Any, played: Sequence[Recorded], name: str, scenario: _native.Scenario, about: dict[str, str]) -> Any:  # noqa: ANN401 - Minari is read as untyped
    """Adds episodes to a dataset, which begins with the first ones."""
    import minari
    from minari.data_collector.episode_buffer import EpisodeBuffer

    buffers = [
        EpisodeBuffer(
            seed=episode.seed,
            observations=_columns(episode.observations),
            actions=_columns(episode.actions),
            rewards=episode.rewards,
            terminations=episode.terminations,
            truncations=episode.truncations,
            infos=_columns(episode.infos),
        )
        for episode in played
    ]
    if dataset is None:
        env = gym.make(ENV_ID, scenario=scenario.to_dict())
        with warnings.catch_warnings():
            # It wants an author and a link, which only whoever publishes the dataset can give.
            warnings.simplefilter("ignore", UserWarning)
            dataset = minari.create_dataset_from_buffers(
                name,
                buffers,
                env=env.spec,
                algorithm_name=about["agent"],
                description=f"{about['agent']} on the scenario {scenario.name} of swath {about['swath_version']}",
                jpeg_encoding=False,
            )
        dataset.storage.update_metadata(about)
    else:
        dataset.update_dataset_from_buffer(buffers)
    ids = range(dataset.total_episodes - len(played), dataset.total_episodes)
    dataset.storage.update_episode_metadata([{"outcome": episode.outcome} for episode in played], ids)
    return dataset


def _columns(rows: Sequence[Any]) -> Any:  # noqa: ANN401 - arrays, or dictionaries of them
    """Returns one array, with a row a step; a dictionary of such arrays where every row is a dictionary."""
    if isinstance(rows[0], dict):
        return {key: _columns([row[key] for row in rows]) for key in rows[0]}
    return np.stack(rows)


def _namespaces(name: str) -> None:
    """Makes the namespace of a dataset known to Minari."""
    from minari.dataset.minari_dataset import parse_dataset_id
    from minari.namespace import create_namespace, list_local_namespaces

    namespace = parse_dataset_id(name)[0]
    if namespace is not None and namespace not in list_local_namespaces():
        create_namespace(namespace)


def _root(root: str | os.PathLike[str] | None) -> Path:
    if root is not None:
        return Path(root)
    return Path(os.environ.get(_ROOT, Path.home() / ".minari" / "datasets"))


@contextmanager
def _minari_in(folder: Path) -> Iterator[None]:
    """Has Minari keep its datasets in a folder."""
    before = os.environ.get(_ROOT)
    # Minari hangs a relative folder below itself.
    os.environ[_ROOT] = str(folder.absolute())
    try:
        yield
    finally:
        if before is None:
            del os.environ[_ROOT]
        else:
            os.environ[_ROOT] = before
