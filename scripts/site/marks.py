"""What stands in a page for something that the code says: `<!-- swath: WHAT -->` on a line of its own.

| mark | what it becomes |
|---|---|
| `environment MODULE:CLASS` | the docstring of the class |
| `agents` | a table of the registry, with links to the pages of the agents |
| `agent NAME` | what the registry says of an agent, and the picture of its path |
| `path NAME` | the picture alone |
| `replay NAME ...` | their race, to be played in the page |
| `scenario` | every key of a scenario, from the JSON Schema |
| `commands` | the help of every command |
| `toml PATH` | a file of the repository as code |
| `rust PATH` | the same, in Rust |
| `file PATH` | another page of the repository |
"""

from __future__ import annotations

import importlib
import inspect
import posixpath
import re
from collections.abc import Callable
from pathlib import Path

from scripts.site import commands, scenario

from swath import _native

__all__ = ["DATA_FILES", "ENVIRONMENT_PAGES", "FILE_PAGES", "MarkError", "address_of", "agents", "expand", "races_in"]

ROOT = Path(__file__).parents[2]

FILE_PAGES = {
    "agents/learned/README.md": "agents/trained.md",
    "benchmarks/FAULTS.md": "figures/faults.md",
    "benchmarks/LEAGUE.md": "figures/league.md",
    "benchmarks/REMOTE.md": "figures/remote.md",
    "benchmarks/RESULTS.md": "figures/speed.md",
    "examples/two_machines/README.md": "remote/two-machines.md",
}
"""Pages of the repository that lie elsewhere, and where on the site they are."""

DATA_FILES = {"benchmarks/LEAGUE.csv": "figures/LEAGUE.csv"}
"""Data of the repository that pages link to, and where on the site it is."""

ENVIRONMENT_PAGES = {"swath/MowerRouting-v0": "environments/mower-routing.md"}
"""The page of every environment."""

_MARK = re.compile(r"^<!-- swath: (\S+)(?: (.+))? -->$", re.MULTILINE)


class MarkError(Exception):
    """A mark that stands for nothing, or a page that is missing."""


def agents() -> list[tuple[str, str, bool, bool]]:
    """Returns of every agent its name, its line, whether it draws numbers, and whether it is online."""
    return _native.agents()


def races_in(markdown: str) -> list[tuple[str, ...]]:
    """Returns the names of the agents of every replay that a page shows."""
    return [tuple(names.split()) for kind, names in _MARK.findall(markdown) if kind == "replay"]


def address_of(race: tuple[str, ...]) -> str:
    """Returns where on the site the replay of these agents lies."""
    return f"replays/{'-'.join(race)}.html"


def expand(markdown: str, page: str) -> str:
    """Returns a page with what its marks stand for.

    Args:
        markdown: The page.
        page: Its path in `docs/`.

    Raises:
        MarkError: If there is no such mark, or not what it names.
    """

    def replace(mark: re.Match[str]) -> str:
        kind, name = mark.groups()
        if kind not in _KINDS:
            text = f"`{mark[0]}` must name one of {', '.join(_KINDS)}"
            raise MarkError(text)
        return _KINDS[kind](name or "", page)

    return _MARK.sub(replace, markdown)


def _environment(name: str, _: str) -> str:
    module, _, attribute = name.partition(":")
    return inspect.getdoc(getattr(importlib.import_module(module), attribute)) or ""


def _agents(_: str, page: str) -> str:
    rows = []
    for name, about, is_random, is_online in agents():
        link = posixpath.relpath(f"agents/{name}.md", posixpath.dirname(page))
        rows.append(f"| [`{name}`]({link}) | {_cell(about)} | {_yes(is_random)} | {_yes(is_online)} |")
    return "\n".join(["| agent | what it does | draws numbers | online |", "|---|---|---|---|", *rows])


def _yes(is_so: bool) -> str:  # noqa: FBT001 - a cell of the table
    return "yes" if is_so else "no"


def _cell(text: str) -> str:
    return text.replace("|", r"\|")


def _agent(name: str, page: str) -> str:
    lines = {agent: about for agent, about, *_ in agents()}
    if name not in lines:
        text = f"there is no agent `{name}`"
        raise MarkError(text)
    return f"> {lines[name]}\n\n{_path(name, page)}"


def _path(name: str, page: str) -> str:
    picture = posixpath.relpath(f"agents/paths/{name}.png", posixpath.dirname(page) or ".")
    return f"![The path of {name}]({picture})\n\n`swath run {name} --scenario pasture --seed 7` drives it."


def _replay(names: str, page: str) -> str:
    address = posixpath.relpath(address_of(tuple(names.split())), posixpath.dirname(page) or ".")
    return f'<iframe class="replay" src="{address}" title="{names}"></iframe>\n\n[On a page of its own]({address})'


def _toml(name: str, _: str) -> str:
    return f"```toml\n{_text(name)}```"


def _rust(name: str, _: str) -> str:
    return f"```rust\n{_text(name)}```"


def _file(name: str, page: str) -> str:
    if FILE_PAGES.get(name) != page:
        text = f"`{name}` must be listed in scripts/site/marks.py with the page docs/{page}"
        raise MarkError(text)
    return _text(name)


def _text(name: str) -> str:
    file = ROOT / name
    if not file.is_file():
        text = f"there is no file {name}"
        raise MarkError(text)
    return file.read_text(encoding="utf-8")


_KINDS: dict[str, Callable[[str, str], str]] = {
    "environment": _environment,
    "agents": _agents,
    "agent": _agent,
    "path": _path,
    "scenario": lambda _name, _page: scenario.reference(),
    "commands": lambda _name, _page: commands.reference(),
    "replay": _replay,
    "toml": _toml,
    "rust": _rust,
    "file": _file,
}
