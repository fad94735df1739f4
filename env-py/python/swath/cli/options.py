"""Arguments that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["AsJson", "Jobs", "Seed"]

Seed = Annotated[int, typer.Option(help="Seed of instance 0; instance i has the seed plus i.")]
Jobs = Annotated[int | None, typer.Option(help="Number of threads.", show_default="all cores")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]
