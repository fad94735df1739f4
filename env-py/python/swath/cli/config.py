"""`swath config`."""

from __future__ import annotations

from typing import Annotated

import typer

from swath import _native

__all__ = ["config"]


def config(
    scenario: Annotated[
        str, typer.Argument(metavar="SCENARIO", help=f"A file or a shipped scenario: {', '.join(_native.shipped())}.")
    ] = "default",
    *,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of scenario files instead.")] = False,
) -> None:
    """Check a scenario and print it as TOML, every key written out."""
    # Every cell of a sweep is checked too.
    _native.cells(scenario)
    typer.echo(_native.schema() + "\n" if schema else _native.resolved(scenario), nl=False)
