"""Packages that not everybody needs."""

from __future__ import annotations

import importlib.util
import sys

__all__ = ["need"]


_PYTHONS = {"minari": (3, 11), "rerun": (3, 11)}
"""Packages that the extras bring to newer versions of Python only."""


def need(what: str, extra: str, *packages: str) -> None:
    """Makes sure that optional packages are installed.

    Args:
        what: What needs them, as the message begins.
        extra: The extra of swath that brings them.
        *packages: Names under which they are imported.

    Raises:
        ModuleNotFoundError: For the first one that is not installed; the message names the extra.
    """
    for package in packages:
        if importlib.util.find_spec(package) is None:
            python = _PYTHONS.get(package, (3, 0))
            if sys.version_info[:2] < python:
                text = f"{what} needs {package}, which needs Python {python[0]}.{python[1]} or later"
            else:
                text = f"{what} needs {package}: pip install 'swath[{extra}]'"
            raise ModuleNotFoundError(text, name=package)
