"""Checks the licence, the source and the name of every crate in the dependency graph.

Prints one line for each crate that breaks a rule and exits with 1; `make lint` runs it.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import TypedDict

ROOT = Path(__file__).resolve().parent.parent

ALLOWED_LICENCES = frozenset(
    {
        "0BSD",
        "Apache-2.0",
        "Apache-2.0 WITH LLVM-exception",
        "BSD-2-Clause",
        "BSD-3-Clause",
        "BSL-1.0",
        "CC0-1.0",
        "ISC",
        "MIT",
        "Unicode-3.0",
        "Unlicense",
        "Zlib",
    }
)

# Crates with a licence that no other may have, and why they may.
EXCEPTIONS = {
    "option-ext": ("MPL-2.0", "asks for its own files to stay open, and they are used as published"),
    "webpki-roots": ("CDLA-Permissive-2.0", "is a list of certificates: a licence for data, with no duty but its text"),
}

BANNED_CRATES = {
    "native-tls": "TLS goes through rustls",
    "openssl": "TLS goes through rustls",
    "openssl-sys": "TLS goes through rustls",
    "openssl-src": "TLS goes through rustls",
}

# How Cargo itself names crates.io, whatever mirror it downloads from.
CRATES_IO = "registry+https://github.com/rust-lang/crates.io-index"


class Package(TypedDict):
    """The part of a `cargo metadata` package that is read here."""

    name: str
    version: str
    license: str | None
    source: str | None


def main() -> int:
    """Checks every crate and returns the exit status."""
    packages = read_packages()
    problems = [f"{p['name']} {p['version']}: {text}" for p in packages for text in check(p)]
    for problem in problems:
        print(problem)
    if not problems:
        print(f"licences: {len(packages)} crates")
    return 1 if problems else 0


def read_packages() -> list[Package]:
    """Returns every package that Cargo.lock names."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked"]
    run = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=False)
    if run.returncode:
        sys.exit(f"`{' '.join(command)}` failed")
    packages: list[Package] = json.loads(run.stdout)["packages"]
    return packages


def check(package: Package) -> list[str]:
    """Returns what is wrong with one package."""
    problems = []
    if package["name"] in BANNED_CRATES:
        problems.append(f"banned: {BANNED_CRATES[package['name']]}")
    if package["source"] not in (None, CRATES_IO):
        problems.append(f"comes from {package['source']}, expected crates.io or this workspace")
    licence = package["license"]
    if licence is None:
        problems.append("states no licence")
    elif not is_allowed(licence) and EXCEPTIONS.get(package["name"], ("",))[0] != licence:
        problems.append(f"licence {licence} is not in the list of allowed ones")
    return problems


def is_allowed(expression: str) -> bool:
    """Whether the allowed licences satisfy an SPDX expression.

    The old `MIT/Apache-2.0` means `OR`; `AND` binds tighter than `OR`.
    """
    words = re.findall(r"[()]|[^\s()]+", expression.replace("/", " OR "))
    value, rest = parse_or(words)
    return value and not rest


def parse_or(words: list[str]) -> tuple[bool, list[str]]:
    """Reads `a OR b …` and returns its value and the words that are left."""
    value, words = parse_and(words)
    while words and words[0] == "OR":
        right, words = parse_and(words[1:])
        value = value or right
    return value, words


def parse_and(words: list[str]) -> tuple[bool, list[str]]:
    """Reads `a AND b …` and returns its value and the words that are left."""
    value, words = parse_one(words)
    while words and words[0] == "AND":
        right, words = parse_one(words[1:])
        value = value and right
    return value, words


def parse_one(words: list[str]) -> tuple[bool, list[str]]:
    """Reads one licence, with its exception, or one expression in parentheses."""
    if not words:
        return False, []
    if words[0] == "(":
        value, rest = parse_or(words[1:])
        return (value, rest[1:]) if rest[:1] == [")"] else (False, rest)
    if words[1:2] == ["WITH"]:
        return " ".join(words[:3]) in ALLOWED_LICENCES, words[3:]
    return words[0] in ALLOWED_LICENCES, words[1:]


if __name__ == "__main__":
    sys.exit(main())
