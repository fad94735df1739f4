"""Checks a wheel: its size, and that no file in it names a folder of the machine that built it.

Prints one line for each broken rule and exits with 1; `make wheel` and `make wheel-server` run it.
"""

from __future__ import annotations

import os
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LARGEST_BYTES = {"swath": 5_000_000, "swath_server": 8_000_000}
"""By the name of what the wheel installs."""


def main(paths: list[str]) -> int:
    """Checks every wheel and returns the exit status."""
    wheels = [Path(path) for path in paths]
    problems = [problem for wheel in wheels for problem in check(wheel)]
    for problem in problems:
        print(problem)
    if not problems:
        for wheel in wheels:
            print(f"wheel: {wheel.name}, {wheel.stat().st_size / 1e6:.1f} MB")
    return 1 if problems or not wheels else 0


def check(wheel: Path) -> Iterator[str]:
    """Yields one line for each rule that a wheel breaks."""
    size, most = wheel.stat().st_size, LARGEST_BYTES.get(wheel.name.partition("-")[0], 0)
    if size > most:
        yield f"{wheel.name}: {size} bytes, expected at most {most}"
    cargo_home = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    private = [str(Path.home()), str(ROOT), str(cargo_home), "registry/src/"]
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            data = archive.read(name)
            for path in private:
                if path != "/" and path.encode() in data:
                    yield f"{wheel.name}: {name} names {path}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
