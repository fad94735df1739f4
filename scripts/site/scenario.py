"""Every key of a scenario, from the JSON Schema that `swath config --schema` prints."""

from __future__ import annotations

import json
from typing import Any

from swath import _native

_ORDER = ("pasture", "weeds", "mower", "sensor", "reward", "episode", "observation", "action")


def reference() -> str:
    """Returns a table for each block; blocks that nobody has put in order come last."""
    schema = json.loads(_native.schema())
    blocks = {name: part for name, part in schema["properties"].items() if "$ref" in part and name != "id"}
    names = sorted(blocks, key=lambda name: _ORDER.index(name) if name in _ORDER else len(_ORDER))
    return "\n\n".join(_section(name, blocks[name], schema["$defs"]) for name in names)


def _section(name: str, block: dict[str, Any], definitions: dict[str, Any]) -> str:
    keys = _resolved(block, definitions)["properties"]
    rows = [
        f"| `{key}` | {_kind(value, definitions)} | {_default(value)} | {_line(value.get('description', ''))} |"
        for key, value in keys.items()
    ]
    head = ["| key | type | default | meaning |", "|---|---|---|---|"]
    return "\n".join([f"## `[{name}]`", "", block.get("description", ""), "", *head, *rows])


def _kind(value: dict[str, Any], definitions: dict[str, Any]) -> str:
    part = _resolved(value, definitions)
    choices = [choice for choice in part.get("oneOf", part.get("anyOf", [])) if choice.get("type") != "null"]
    if choices:
        return " or ".join(_kind(choice, definitions) for choice in choices)
    if "const" in part:
        return f"`{json.dumps(part['const'])}`"
    if "enum" in part:
        return " or ".join(f"`{json.dumps(choice)}`" for choice in part["enum"])
    kind = part["type"]
    kind = next(name for name in kind if name != "null") if isinstance(kind, list) else kind
    return f"array of {_kind(part['items'], definitions)}" if kind == "array" and "items" in part else str(kind)


def _default(value: dict[str, Any]) -> str:
    default = value.get("default")
    return "" if default is None else f"`{json.dumps(default)}`"


def _resolved(value: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    reference = value.get("$ref")
    resolved: dict[str, Any] = definitions[reference.removeprefix("#/$defs/")] if reference else value
    return resolved


def _line(text: str) -> str:
    return " ".join(text.split()).replace("|", r"\|")
