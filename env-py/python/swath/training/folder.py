"""The folder of one training."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from swath import _native
from swath.errors import ConfigError
from swath.files import check_folder, write_whole
from swath.training.toml import to_toml

if TYPE_CHECKING:
    from typing import BinaryIO

    from typing_extensions import Self

    from swath.training.config import TrainingConfig

__all__ = ["Folder"]

_CONFIG = "training.toml"

# It changes no result, so a training may go on with another number.
_FREE = "num_threads"


class Folder:
    """A folder that holds one training and no other; while it is entered, no other run may use it."""

    def __init__(self, path: Path, config: TrainingConfig) -> None:
        """Looks at what an earlier run has left.

        Args:
            path: The folder, which may be missing.
            config: The training that is to be run.

        Raises:
            ConfigError: If the folder holds another training or other files.
        """
        self.path = path
        self._config = config
        self._lock: BinaryIO | None = None
        check_folder("out", path)
        if (path / _CONFIG).exists():
            self._refuse_another()
        elif path.is_dir() and (others := sorted(entry.name for entry in path.iterdir())):
            text = f"`out` must be empty or hold this training, got {path} with other files, such as {others[0]}"
            raise ConfigError(text)

    @property
    def checkpoints(self) -> Path:
        """Folder of the checkpoints."""
        return self.path / "checkpoints"

    @property
    def evaluations(self) -> Path:
        """The episodes played for evaluation."""
        return self.path / "evaluations.csv"

    @property
    def times(self) -> Path:
        """How long the training took up to each evaluation."""
        return self.path / "times.csv"

    @property
    def model(self) -> Path:
        """The trained model; it is there when the training is over."""
        return self.path / "model.zip"

    @property
    def untrained(self) -> Path:
        """The model before its first step."""
        return self.path / "untrained.zip"

    def __enter__(self) -> Self:
        """Keeps other runs out of a training that has begun."""
        if (self.path / _CONFIG).exists():
            self._keep_others_out()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Lets others in."""
        if self._lock is not None:
            self._lock.close()

    def begin(self) -> None:
        """Writes the configuration of a new training, and keeps other runs out.

        Raises:
            ConfigError: If another run has begun here meanwhile.
        """
        if self._lock is not None:
            return
        if (self.path / _CONFIG).exists():
            raise self._in_use()
        self.path.mkdir(parents=True, exist_ok=True)
        head = "# The training in this folder, every key written out.\n"
        write_whole(self.path / _CONFIG, head + to_toml(self._config.to_dict()))
        self._keep_others_out()

    def _keep_others_out(self) -> None:
        """Locks the configuration, where the system can."""
        file = self._lock = (self.path / _CONFIG).open("rb")
        try:
            import fcntl
        except ImportError:
            return
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            file.close()
            raise self._in_use() from error

    def _in_use(self) -> ConfigError:
        return ConfigError(f"`out` must not be in use by another run, got {self.path}")

    def _refuse_another(self) -> None:
        try:
            found = _native.parse_toml((self.path / _CONFIG).read_text(encoding="utf-8"), _CONFIG)
        except UnicodeDecodeError as error:
            text = f"cannot read {self.path / _CONFIG}: {error}"
            raise ConfigError(text) from error
        # Through the same text, so that numbers compare as they were written.
        wanted = _native.parse_toml(to_toml(self._config.to_dict()), _CONFIG)
        there, here = dict(_leaves(found, "")), dict(_leaves(wanted, ""))
        for key in [*here, *there]:
            if key != _FREE and there.get(key) != here.get(key):
                text = (
                    f"`out` must be empty or hold this training, got {self.path} with "
                    f"{key} {there.get(key, 'missing')} instead of {here.get(key, 'missing')}"
                )
                raise ConfigError(text)


def _leaves(table: dict[str, object], path: str) -> list[tuple[str, object]]:
    """Returns every value of a table with its dotted key."""
    found: list[tuple[str, object]] = []
    for key, value in table.items():
        found += _leaves(value, f"{path}{key}.") if isinstance(value, dict) else [(f"{path}{key}", value)]
    return found
