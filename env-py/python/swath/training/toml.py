"""Plain data as TOML text; Python reads TOML but does not write it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

__all__ = ["to_toml"]


def to_toml(table: Mapping[str, object]) -> str:
    """Returns a dictionary of texts, numbers, flags, lists and dictionaries as TOML; None is left out."""
    return "\n".join(_lines(table, "")).strip("\n") + "\n"


def _lines(table: Mapping[str, object], path: str) -> Iterator[str]:
    blocks = {key: value for key, value in table.items() if isinstance(value, Mapping)}
    for key, value in table.items():
        if key not in blocks and value is not None:
            yield f"{_key(key)} = {_value(value)}"
    for key, inner in blocks.items():
        yield f"\n[{path}{_key(key)}]"
        yield from _lines(inner, f"{path}{_key(key)}.")


def _key(key: str) -> str:
    is_bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if is_bare else json.dumps(key)


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(item) for item in value)}]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    # The escapes of JSON are those of TOML, and `repr` of a float is one in TOML, `inf` and `nan` included.
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)
