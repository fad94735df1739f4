"""Packages that not everybody needs."""

from __future__ import annotations

import importlib.util

__all__ = ["need"]


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
            text = f"{what} needs {package}: pip install 'swath[{extra}]'"
            raise ModuleNotFoundError(text, name=package)
