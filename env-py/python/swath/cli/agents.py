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
        rows = [{"agent": name, "about": about, "is_random": is_random} for name, about, is_random in listed]
        typer.echo(json.dumps(rows, indent=2))
        return
    width = max(len(name) for name, _, _ in listed)
    for name, about, _ in listed:
        typer.echo(f"{name:{width}}  {about}")
