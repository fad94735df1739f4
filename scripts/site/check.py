"""Checks the built site: it asks for nothing from the network, and nothing of the pages' own marks is left.

`make docs` runs it on `out/site`; it prints one line for each problem and exits with 1.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

REQUESTS = {
    ".html": re.compile(r"<(?:script|img|iframe|source|link)\b[^>]*\b(?:src|href)=\"?((?:https?:)?//[^\s\">]+)"),
    ".css": re.compile(r"(?:url\(|@import)\s*[\"']?((?:https?:)?//[^\s\"')]+)"),
}
LEFT = ("<!-- swath:", "language-math", "```math", "$`")


def main(folder: str) -> int:
    """Checks every page and style sheet of a folder, and returns the exit status."""
    files = [file for file in sorted(Path(folder).rglob("*")) if file.suffix in REQUESTS]
    problems = [f"{file}: {problem}" for file in files for problem in problems_of(file)]
    for problem in problems:
        print(problem)
    if not problems:
        print(f"site: {len(files)} pages and style sheets")
    return 1 if problems or not files else 0


def problems_of(file: Path) -> Iterator[str]:
    """Yields what is wrong with a page or a style sheet."""
    text = file.read_text(encoding="utf-8")
    for address in REQUESTS[file.suffix].findall(text):
        yield f"asks for {address}"
    for mark in LEFT:
        if file.suffix == ".html" and mark in text:
            yield f"still holds {mark}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
