"""The rows and trajectories of all shards as result files and one dataset."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

from swath.datasets.dataset import BATCH, name_of, write
from swath.errors import ConfigError
from swath.evaluation.results import Results
from swath.rollouts.store import DATASET, ELSEWHERE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from swath.datasets.episodes import Recorded
    from swath.rollouts.store import Store

__all__ = ["merge"]


def merge(store: Store) -> tuple[Results, Path] | None:
    """Writes `episodes.csv`, `summary.json`, the scenario and the dataset, once every episode is there.

    It may be broken off and called again, and by several workers at once: the files are the same.

    Args:
        store: The sweep.

    Returns:
        The results and the folder of the dataset; None while episodes are missing.

    Raises:
        ConfigError: If a trajectory is missing or damaged, or the dataset is.
        OSError: If a file cannot be written.
    """
    sweep = store.sweep
    rows = store.rows()
    if len(rows) < len(sweep):
        return None
    results = Results.of(sweep, rows, sweep.label)
    datasets = store.folder / DATASET
    dataset = datasets / name_of(sweep.label)
    with store.alone():
        if dataset.exists():
            _check(dataset)
        else:
            store.check_trajectories()
            for unfinished in datasets.glob(".unfinished-*"):
                shutil.rmtree(unfinished)
            write(datasets, name_of(sweep.label), sweep.scenario, sweep.label, _batches(store))
        results.write(store.folder)
        store.drop_trajectories()
    return results, dataset


def _check(dataset: Path) -> None:
    """Refuses a dataset that can no longer be read: its trajectories stand nowhere else."""
    import h5py

    file = dataset / "data" / "main_data.hdf5"
    try:
        with h5py.File(file):
            return
    except OSError:
        text = f"`out` must hold the dataset as it was written, got a damaged or missing {file}: {ELSEWHERE}"
    raise ConfigError(text)


def _batches(store: Store) -> Iterator[Sequence[Recorded]]:
    instances = range(store.sweep.instances)
    for first in instances[::BATCH]:
        yield [store.trajectory(instance) for instance in instances[first : first + BATCH]]
