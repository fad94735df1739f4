"""Checks that every repository path named in the documentation exists.

Read are the links, and the code in backticks outside fenced blocks.
A word in backticks counts as a path when it contains a slash and either starts with the name of something at the top of
the repository, or ends with a slash or a file extension and does not start with a placeholder such as `DIR`.
Prints one line for each path that does not exist and exits with 1; `make lint` runs it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = (
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "docs/**/*.md",
    "examples/**/*.md",
    "agents/learned/*.md",
)
GENERATED = {"out", "target", "site", ".venv", ".venv-oldest", ".venv-rllib", ".venv-zoo"}

LINK = re.compile(r"\]\(\s*<?([^)\s>]+)[^)]*\)")
CODE = re.compile(r"(`+)(.+?)\1")
PATH = re.compile(r"[\w.*-]+(?:/[\w.*-]+)*/?")
EXTENSION = re.compile(r"\.[a-z]{1,5}$")
LINE_NUMBER = re.compile(r":\d+(?:-\d+)?$")


def main() -> int:
    """Checks every page and returns the exit status."""
    pages = sorted({page for pattern in PAGES for page in ROOT.glob(pattern)})
    problems = [problem for page in pages for problem in check_page(page)]
    for problem in problems:
        print(problem)
    if not problems:
        print(f"paths: {len(pages)} pages")
    return 1 if problems else 0


def check_page(page: Path) -> Iterator[str]:
    """Yields one line for each path of a page that does not exist."""
    for number, line in prose_lines(page.read_text(encoding="utf-8")):
        where = f"{page.relative_to(ROOT)}:{number}"
        without_code = CODE.sub("", line)
        for target in LINK.findall(without_code):
            if is_local(target) and not link_exists(page, target):
                yield f"{where}: the link {target} leads nowhere"
        for _, code in CODE.findall(line):
            for word in code.split():
                if names_a_path(word) and not path_exists(page, word):
                    yield f"{where}: `{word}` does not exist"


def prose_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yields the numbered lines outside fenced code blocks."""
    fence = None
    for number, line in enumerate(text.splitlines(), start=1):
        mark = line.strip()[:3]
        if mark in ("```", "~~~") and fence in (None, mark):
            fence = mark if fence is None else None
        elif fence is None:
            yield number, line


def is_local(target: str) -> bool:
    """Whether a link points into this repository."""
    return not re.match(r"[a-z][a-z0-9+.-]*:|//|#", target)


def link_exists(page: Path, target: str) -> bool:
    """Whether the file behind a link exists; a leading slash means the top of the repository."""
    path = target.partition("#")[0]
    start = ROOT if path.startswith("/") else page.parent
    return is_generated(path) or (start / path.lstrip("/")).exists()


def names_a_path(word: str) -> bool:
    """Whether a word in backticks is meant as a path of this repository."""
    word = LINE_NUMBER.sub("", word).removeprefix("./")
    if "/" not in word or not PATH.fullmatch(word):
        return False
    first = word.partition("/")[0]
    looks_like_one = word.endswith("/") or EXTENSION.search(word) is not None
    return (ROOT / first).exists() or (looks_like_one and not first.isupper())


def path_exists(page: Path, word: str) -> bool:
    """Whether a path in backticks exists, seen from the top of the repository or from its page."""
    path = LINE_NUMBER.sub("", word).removeprefix("./").rstrip("/")
    return is_generated(path) or any(any(top.glob(path)) for top in (ROOT, page.parent))


def is_generated(path: str) -> bool:
    """Whether a path lies in a folder that a command writes."""
    return path.partition("/")[0] in GENERATED


if __name__ == "__main__":
    sys.exit(main())
