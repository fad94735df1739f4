"""A training's whole state on disk, so that a killed one goes on as if nothing had happened."""

from __future__ import annotations

import pickle
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swath.errors import ConfigError, SnapshotError
from swath.training import environments
from swath.training.algorithms import algorithm_class
from swath.training.card import Card, versions, write_model
from swath.training.generators import Generators

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.vec_env import VecEnv

    from swath.training.config import TrainingConfig

__all__ = ["Checkpoints"]

_MODEL, _REPLAY, _STATE = "model.zip", "replay_buffer.pkl", "state.pkl"


@dataclass(frozen=True)
class Checkpoints:
    """The checkpoints of one training: a folder each, named after the number of steps; the newest one is kept.

    A checkpoint is taken where a rollout begins. It holds the model with its optimisers, the replay buffer, the
    statistics of the normalisation, every environment's snapshot and all generators of random numbers.

    Attributes:
        folder: The folder of all.
        config: The training.
    """

    folder: Path
    config: TrainingConfig

    def newest(self) -> Path | None:
        """Returns the checkpoint to go on from, if there is any."""
        found = [entry for entry in self.folder.glob("*") if entry.name.isdecimal()]
        return max(found, key=lambda entry: int(entry.name), default=None)

    def check_room(self, model: BaseAlgorithm) -> None:
        """Refuses a replay buffer that the disk cannot hold twice, the newest checkpoint and the one being written.

        Args:
            model: The model before it learns.

        Raises:
            ConfigError: If there is not enough room.
        """
        size_b = _buffer_bytes(getattr(model, "replay_buffer", None))
        place = next(folder for folder in (self.folder, *self.folder.parents) if folder.exists())
        free_b = shutil.disk_usage(place).free
        if 2 * size_b > free_b:
            capacity = int(model.buffer_size * free_b / (2 * size_b))
            text = (
                f"`hyperparameters.buffer_size` must be at most {capacity} here, got {model.buffer_size}: "
                f"a checkpoint holds {size_b / 1e9:.1f} GB, and {place} has {free_b / 1e9:.1f} GB left for two"
            )
            raise ConfigError(text)

    def write(self, model: BaseAlgorithm, wall_s: float) -> None:
        """Writes a checkpoint under another name, renames it when it is complete, and removes older ones.

        Args:
            model: The model in training.
            wall_s: Seconds that the training has taken.

        Raises:
            ConfigError: If it cannot be written; older checkpoints are as they were.
        """
        unfinished = self.folder / ".unfinished"
        shutil.rmtree(unfinished, ignore_errors=True)
        try:
            unfinished.mkdir(parents=True)
            write_model(unfinished / _MODEL, model, self.config)
            if getattr(model, "replay_buffer", None) is not None:
                model.save_replay_buffer(unfinished / _REPLAY)
            (unfinished / _STATE).write_bytes(pickle.dumps({"wall_s": wall_s, **_state(model)}))
            finished = unfinished.rename(self.folder / str(model.num_timesteps))
            for older in self.folder.glob("*"):
                if older != finished:
                    shutil.rmtree(older)
        except OSError as error:
            shutil.rmtree(unfinished, ignore_errors=True)
            text = f"`out` must take a checkpoint, got {error.strerror or error} in {self.folder}"
            raise ConfigError(text) from error

    def load(self, checkpoint: Path, venv: VecEnv) -> tuple[BaseAlgorithm, float]:
        """Makes the model of a checkpoint, and puts environments and generators into the state they were in.

        Args:
            checkpoint: Its folder.
            venv: The training's environments, bare.

        Returns:
            The model, and the seconds that the training had taken.

        Raises:
            ConfigError: If its model is not the one that was written, or was written by other versions than run now.
            SnapshotError: If another file of it is damaged; the message names the file.
        """
        card = Card.read(checkpoint / _MODEL)
        _check_versions(card)
        with _reading(checkpoint / _STATE):
            state = pickle.loads((checkpoint / _STATE).read_bytes())
        # They must have begun before they can take over another state.
        venv.seed(self.config.seed)
        venv.reset()
        normalization = card.load_normalization()
        if normalization is not None:
            normalization.set_venv(venv)
            normalization.training = True
            venv = normalization
        device = self.config.hyperparameters.get("device", "cpu")
        model = algorithm_class(self.config.algorithm).load(card.path, env=venv, device=device, force_reset=False)
        if (checkpoint / _REPLAY).exists():
            with _reading(checkpoint / _REPLAY), (checkpoint / _REPLAY).open("rb") as file:
                model.load_replay_buffer(file)
        with _reading(checkpoint / _STATE):
            _put_back(state, model)
            wall_s = float(state["wall_s"])
        return model, wall_s


@contextmanager
def _reading(file: Path) -> Iterator[None]:
    """Turns whatever is raised while a file is read into one line: of damaged bytes, `pickle` may raise anything."""
    try:
        yield
    except Exception as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        text = f"cannot go on from {file} ({reason}): remove the folder {file.parent}, and the training begins anew"
        raise SnapshotError(text) from error


def _buffer_bytes(buffer: object) -> int:
    """Returns the size of a replay buffer's arrays, which may be tables of arrays."""
    tables = [] if buffer is None else list(vars(buffer).values())
    arrays = [array for table in tables for array in (table.values() if isinstance(table, dict) else [table])]
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def _check_versions(card: Card) -> None:
    """Refuses another swath, torch and so on, with which the training would not end as if it had not been killed."""
    now = versions()
    for name in {**now, **card.versions}:
        written, running = card.versions.get(name, "missing"), now.get(name, "missing")
        if written != running:
            text = f"`out` must go on with {name} {written}, which wrote {card.path.parent}, got {name} {running}"
            raise ConfigError(text)


def _state(model: BaseAlgorithm) -> dict[str, object]:
    venv, normalization = model.get_env(), model.get_vec_normalize_env()
    assert venv is not None, "a model in training has environments"
    return {
        "environments": environments.snapshots(venv),
        # What VecNormalize leaves out of its own state.
        "returns": None if normalization is None else normalization.returns,
        "actions": model.action_space,
        "generators": tuple(Generators.now()),
    }


def _put_back(state: Mapping[str, Any], model: BaseAlgorithm) -> None:
    venv, normalization = model.get_env(), model.get_vec_normalize_env()
    assert venv is not None, "it was loaded with environments"
    environments.restore(venv, state["environments"])
    if normalization is not None:
        normalization.returns = state["returns"]
    model.action_space = state["actions"]
    Generators(*state["generators"]).put_back()
