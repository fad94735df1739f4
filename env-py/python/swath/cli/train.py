"""`swath train`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swath import _native
from swath.cli.stop import Stopped

__all__ = ["train"]

_SHIPPED = ", ".join(name for name, _ in _native.shipped_trainings())


def train(
    config: Annotated[str, typer.Argument(metavar="CONFIG", help=f"A file or a shipped training: {_SHIPPED}.")],
    *,
    out: Annotated[Path, typer.Option(help="Folder for the training.")],
    seed: Annotated[int | None, typer.Option(help="Takes the place of the configuration's seed.")] = None,
) -> None:
    """Train a policy with stable-baselines3, and compare it with scripted agents on held-out instances.

    The folder gets training.toml (every key written out), tensorboard/, checkpoints/, evaluations.csv, untrained.zip
    and model.zip with the text files beside them. The same command goes on where a stopped training has its last
    checkpoint.
    """
    from swath import training
    from swath.training.table import table_of

    try:
        settings = training.TrainingConfig.read(config, seed=seed)
        curve = training.train(settings, out=out, progress=True, say=typer.echo)
    except KeyboardInterrupt:
        raise Stopped("stopped: the same command goes on from the last checkpoint") from None  # noqa: TRY003
    typer.echo(table_of(curve), nl=False)
    typer.echo(f"wrote {out / 'model.zip'}" + (f" and {out / 'evaluations.csv'}" if curve.steps else ""))
