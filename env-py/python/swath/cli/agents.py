"""`swath agents`."""

from __future__ import annotations

import json

import typer

from swath import _native
from swath.cli.options import AsJson

__all__ = ["agents"]


def agents(*, as_json: AsJson = False) -> None:
    """List the agents, one line each."""
    listed = _native.agents()
    if as_json:
        rows = [dict(zip(("agent", "about", "is_random", "is_online"), row, strict=True)) for row in listed]
        typer.echo(json.dumps(rows, indent=2))
        return
    width = max(len(name) for name, *_ in listed)
    for name, about, *_ in listed:
        typer.echo(f"{name:{width}}  {about}")
