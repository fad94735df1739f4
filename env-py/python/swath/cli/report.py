"""`swath report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swath.errors import ConfigError
from swath.files import write_whole
from swath.progress import Progress
from swath.report import Evaluated, page_of
from swath.report.page import steps_of

__all__ = ["report"]


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished `swath evaluate --out`.")],
    *,
    out: Annotated[Path | None, typer.Option(help="File to write.", show_default="report.html in DIR")] = None,
) -> None:
    """Make one page of an evaluation: tables, figures, comparisons, replays of best and worst; it needs no network."""
    evaluated = Evaluated.read(folder)
    out = folder / "report.html" if out is None else out
    if out.is_dir() or not out.parent.is_dir():
        text = f"`out` must be a file in a folder that exists, got {out}"
        raise ConfigError(text)
    with Progress("parts of the report", steps_of(evaluated), is_wanted=True) as bar:
        write_whole(out, page_of(evaluated, bar.advance))
    typer.echo(f"wrote {out}")
