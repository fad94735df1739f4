"""Checks the one direction of dependency.

Between crates: each knows only the crates below it, and neither Python, nor the network, nor test tools leak inwards.
Within `env-core`: a module uses only modules that stand above it in `lib.rs`.
Prints one line for each broken rule and exits with 1; `make lint` runs it.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, TypedDict

ROOT = Path(__file__).resolve().parent.parent

# The crates of this workspace that each crate may name, in its tests too.
ARROWS: dict[str, set[str]] = {
    "swath-core": set(),
    "swath-agents": {"swath-core"},
    "swath-wire": {"swath-core"},
    "swath-render": {"swath-core"},
    "swath-server": {"swath-core", "swath-wire"},
    "swath-py": {"swath-core", "swath-agents", "swath-wire", "swath-render"},
    "swath-tests": {"swath-core", "swath-agents", "swath-wire"},
    "swath-benchmarks": {"swath-core", "swath-agents", "swath-wire", "swath-render"},
}

# Crates that may be reached, through whatever dependency, only from these crates of the workspace.
REACHED_FROM = {
    "pyo3": {"swath-py"},
    "zenoh": {"swath-server"},
    "tokio": {"swath-server"},
    "bincode": {"swath-wire", "swath-server", "swath-py", "swath-tests", "swath-benchmarks"},
    "criterion": {"swath-benchmarks"},
    "proptest": {"swath-tests"},
    "allocation-counter": {"swath-tests"},
}


class Kind(TypedDict):
    """One of the ways in which a crate depends on another."""

    kind: str | None


class Dependency(TypedDict):
    """An edge of the resolved graph."""

    pkg: str
    dep_kinds: list[Kind]


class Node(TypedDict):
    """A crate of the resolved graph."""

    id: str
    deps: list[Dependency]


class Graph(NamedTuple):
    """The graph with every feature on: our crates with the names they declare, all names, and the resolved edges."""

    declared: dict[str, list[str]]
    names: dict[str, str]
    nodes: dict[str, Node]


class Use(NamedTuple):
    """A path from the root of the crate, as one file uses it."""

    line: int
    name: str


def main() -> int:
    """Checks both kinds of layer and returns the exit status."""
    graph = read_graph()
    problems = [*check_arrows(graph), *check_reach(graph)]
    library = ROOT / "env-core/src/lib.rs"
    problems += check_modules(library) if library.exists() else []
    for problem in problems:
        print(problem)
    if not problems:
        print(f"layers: {len(graph.declared)} crates, {len(modules(library))} modules of env-core")
    return 1 if problems else 0


# Crates


def read_graph() -> Graph:
    """Returns the graph that Cargo.lock describes."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--all-features"]
    run = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=False)
    if run.returncode:
        sys.exit(f"`{' '.join(command)}` failed")
    metadata = json.loads(run.stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    return Graph(
        declared={i: [d["name"] for d in packages[i]["dependencies"]] for i in metadata["workspace_members"]},
        names={i: package["name"] for i, package in packages.items()},
        nodes={node["id"]: node for node in metadata["resolve"]["nodes"]},
    )


def check_arrows(graph: Graph) -> Iterator[str]:
    """Yields one line for each crate of the workspace that knows another it must not know."""
    ours = {graph.names[member] for member in graph.declared}
    for member, dependencies in graph.declared.items():
        name = graph.names[member]
        if name not in ARROWS:
            yield f"{name}: not in the list of crates in scripts/check_layers.py"
            continue
        for other in sorted(ours.intersection(dependencies) - ARROWS[name]):
            yield f"{name}: must not know {other}"


def check_reach(graph: Graph) -> Iterator[str]:
    """Yields one line for each crate of the workspace whose product reaches a crate it must not."""
    for member in graph.declared:
        name = graph.names[member]
        for other in sorted(reached(graph, member)):
            if name not in REACHED_FROM.get(other, {name}):
                yield f"{name}: its product reaches {other}, which only {', '.join(sorted(REACHED_FROM[other]))} may"


def reached(graph: Graph, start: str) -> set[str]:
    """Returns the names of the crates that end up in a crate's product: tests are left out."""
    found, waiting = {start}, [start]
    while waiting:
        for dependency in graph.nodes[waiting.pop()]["deps"]:
            in_product = any(kind["kind"] != "dev" for kind in dependency["dep_kinds"])
            if in_product and dependency["pkg"] not in found:
                found.add(dependency["pkg"])
                waiting.append(dependency["pkg"])
    return {graph.names[i] for i in found}


# Modules

MODULE = re.compile(r"^(?:pub(?:\([^)]*\))?\s+)?mod\s+(\w+)\s*[;{]", re.MULTILINE)
REEXPORT = re.compile(r"^pub(?:\([^)]*\))?\s+use\s+([^;]+);", re.MULTILINE)
TOKEN = re.compile(r"\w+|::|[{}(),;*]|\S")
NOT_CODE = re.compile(
    r"""//[^\n]*                            # line comment
    | /\*.*?\*/                             # block comment
    | b?r(\#*)".*?"\1                       # raw string
    | b?"(?:\\.|[^"\\])*"                   # string
    | b?'(?:\\.[^'\n]*|[^'\\\n])'           # character, but no lifetime
    """,
    re.VERBOSE | re.DOTALL,
)


def check_modules(library: Path) -> Iterator[str]:
    """Yields one line for each use of a module that stands below the user in `lib.rs`."""
    order = modules(library)
    homes = {name: name for name in order} | reexports(library, order)
    for place, module in enumerate(order):
        for file in files(library.parent, module):
            depth = len(file.relative_to(library.parent).with_suffix("").parts)
            depth -= file.stem == "mod"
            for use in root_uses(code_of(file), depth):
                where = f"{file.relative_to(ROOT)}:{use.line}"
                if use.name == "*":
                    yield f"{where}: a glob of the whole crate hides which modules it uses"
                elif use.name in homes and order.index(homes[use.name]) > place:
                    yield f"{where}: {module} uses {homes[use.name]}, below it in lib.rs"


def modules(library: Path) -> list[str]:
    """Returns the modules of a library in the order of its text."""
    return MODULE.findall(code_of(library)) if library.exists() else []


def reexports(library: Path, order: list[str]) -> dict[str, str]:
    """Maps the names that a library re-exports at its root to their modules."""
    homes: dict[str, str] = {}
    for text in REEXPORT.findall(code_of(library)):
        words = [word for word in re.findall(r"\w+", text) if word not in ("crate", "self")]
        if words and words[0] in order:
            homes |= dict.fromkeys(words[1:], words[0])
    return {name: module for name, module in homes.items() if name not in order}


def files(source: Path, module: str) -> list[Path]:
    """Returns the files of one module: `name.rs` and everything in the folder `name`."""
    own = source / f"{module}.rs"
    return ([own] if own.exists() else []) + sorted((source / module).rglob("*.rs"))


def code_of(file: Path) -> str:
    """Returns a file's code without comments, strings and characters, on the same lines."""
    text = file.read_text(encoding="utf-8")
    return NOT_CODE.sub(lambda match: " " + "\n" * match[0].count("\n"), text)


def root_uses(code: str, depth: int) -> Iterator[Use]:
    """Yields the first name of every path that starts at the crate's root.

    Such a path starts with `crate::`, or with one `super::` for each module around it, of which the file is `depth`.
    """
    words = [Use(code.count("\n", 0, m.start()) + 1, m[0]) for m in TOKEN.finditer(code)]
    texts = [word.name for word in words]
    braces: list[bool] = []
    for i, text in enumerate(texts):
        if text == "{":
            braces.append(i >= 2 and texts[i - 2] == "mod")
        elif text == "}" and braces:
            braces.pop()
        elif text in ("crate", "super") and texts[i - 1 : i] != ["::"]:
            level, after = depth + sum(braces), i + 1
            while texts[after : after + 2] == ["::", "super"]:
                level, after = level - 1, after + 2
            at_root = text == "crate" or level == 1
            if at_root and texts[after : after + 1] == ["::"]:
                yield from first_names(words, after + 1)


def first_names(words: list[Use], at: int) -> Iterator[Use]:
    """Yields the name at a place, or the first name of each member of the group in braces there."""
    if words[at].name != "{":
        yield words[at]
        return
    nesting = 1
    for before, word in zip(words[at:], words[at + 1 :], strict=False):
        nesting += (word.name == "{") - (word.name == "}")
        if nesting == 0:
            return
        if nesting == 1 and before.name in ("{", ",") and word.name != "}":
            yield word


if __name__ == "__main__":
    sys.exit(main())
