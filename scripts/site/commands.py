"""The help of every command, as a page."""

from __future__ import annotations

import typer

from swath.cli import app

_WIDTH = 100


def reference() -> str:
    """Returns a section for each command, in the order of `swath --help`."""
    root = typer.main.get_group(app)
    context = typer.Context(root, info_name="swath", terminal_width=_WIDTH, max_content_width=_WIDTH)
    sections = []
    for name, command in root.commands.items():
        inner = typer.Context(command, info_name=name, parent=context, terminal_width=_WIDTH, max_content_width=_WIDTH)
        sections.append(f"## swath {name}\n\n```text\n{command.get_help(inner).strip()}\n```")
    return "\n\n".join(sections)
