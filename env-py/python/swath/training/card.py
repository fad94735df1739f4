"""The small text file beside each model that says what the model is."""

from __future__ import annotations

import importlib.metadata
import pickle
import platform
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from swath import _native
from swath.errors import ConfigError
from swath.evaluation.study import build
from swath.files import write_whole
from swath.training import keys
from swath.training.config import ALGORITHMS, kind_of
from swath.training.toml import to_toml

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.vec_env import VecNormalize

    from swath.scenario import Scenario
    from swath.training.config import TrainingConfig

__all__ = ["Card", "versions", "write_model"]

_PACKAGES = ("stable-baselines3", "sb3-contrib", "torch", "gymnasium", "numpy")


@dataclass(frozen=True)
class Card:
    """What is known about a model.

    Attributes:
        path: The model's file.
        algorithm: `ppo`, `sac` or `maskable-ppo`.
        steps: Environment steps that it was trained for.
        scenario: The scenario that it was trained on, every key resolved.
        normalization: File with the statistics of VecNormalize; None: observations are not normalised.
        versions: By which versions of what it was written.
    """

    path: Path
    algorithm: str
    steps: int
    scenario: Scenario
    normalization: Path | None
    versions: dict[str, str] = field(default_factory=dict)

    @property
    def observation_kind(self) -> str:
        """The scenario's `observation.kind`."""
        return kind_of(self.scenario, "observation")

    @property
    def action_kind(self) -> str:
        """The scenario's `action.kind`."""
        return kind_of(self.scenario, "action")

    @classmethod
    def read(cls, path: Path) -> Card:
        """Reads the file beside a model, and checks that it speaks of this model.

        Raises:
            ConfigError: If the model or the file is missing, the file cannot be read, or a hash is another.
        """
        beside = path.with_suffix(".toml")
        for file in (path, beside):
            if not file.is_file():
                text = f"`path` must be a model with `{beside.name}` beside it, but there is no file {file}"
                raise ConfigError(text)
        try:
            card = _native.parse_toml(beside.read_text(encoding="utf-8"), beside.name)
        except UnicodeDecodeError as error:
            text = f"cannot read {beside}: {error}"
            raise ConfigError(text) from error
        needed = {"algorithm", "steps", "model", "sha256", "scenario"}
        if not needed <= card.keys():
            text = f"{beside} must say what the model is, but lacks `{min(needed - card.keys())}`"
            raise ConfigError(text)
        _check_hash(path, card["sha256"], beside)
        normalization = None
        if "normalization" in card:
            normalization = path.with_name(keys.text("normalization", card["normalization"]))
            _check_hash(normalization, card.get("normalization_sha256"), beside)
        return cls(
            path=path,
            algorithm=keys.choice("algorithm", card["algorithm"], ALGORITHMS),
            steps=keys.whole("steps", card["steps"], least=0, most=1 << 62),
            scenario=_native.Scenario(
                keys.block("scenario", card["scenario"]), name=str(card.get("trained_on", path.stem))
            ),
            normalization=normalization,
            versions={name: str(value) for name, value in keys.block("versions", card.get("versions", {})).items()},
        )

    def load_normalization(self) -> VecNormalize | None:
        """Returns how observations are normalised."""
        if self.normalization is None:
            return None
        from stable_baselines3.common.vec_env import VecNormalize

        loaded = pickle.loads(self.normalization.read_bytes())
        assert isinstance(loaded, VecNormalize), "its hash was right"
        loaded.training = False
        return loaded


def write_model(path: Path, model: BaseAlgorithm, config: TrainingConfig) -> None:
    """Writes a model, the statistics of its normalisation and, last, the file that says what they are.

    Args:
        path: The model's file, ending in `.zip`.
        model: The model.
        config: What it was trained by.
    """
    unfinished = path.with_name(f".{path.name}.unfinished")
    with unfinished.open("wb") as file:
        model.save(file)
    unfinished.replace(path)
    card: dict[str, object] = {
        "algorithm": config.algorithm,
        "steps": model.num_timesteps,
        "training": config.name,
        "model": path.name,
        "sha256": _hash(path),
    }
    normalization = model.get_vec_normalize_env()
    if normalization is not None:
        statistics = path.with_name(f"{path.stem}-vecnormalize.pkl")
        write_whole(statistics, pickle.dumps(normalization))
        card |= {"normalization": statistics.name, "normalization_sha256": _hash(statistics)}
    card |= {
        "observation_kind": config.observation_kind,
        "action_kind": config.action_kind,
        "trained_on": config.scenario.name,
        "scenario_hash": config.scenario.hash,
        "versions": versions(),
        "scenario": config.scenario.to_dict(),
    }
    write_whole(path.with_suffix(".toml"), "# What the model beside this file is.\n" + to_toml(card))


def versions() -> dict[str, str]:
    """Returns the versions of all that training depends on, and the compiled module's build."""
    found = {"swath": _native.VERSION, "swath-build": build(), "python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def _hash(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()


def _check_hash(path: Path, expected: object, beside: Path) -> None:
    found = _hash(path) if path.is_file() else "no file"
    if found != expected:
        text = (
            f"{path.name} must be the file that {beside.name} speaks of (sha256 {str(expected)[:12]}), got {found[:12]}"
        )
        raise ConfigError(text)
