"""Checks of what somebody wrote into a training file: one clear line for the first thing that cannot be used."""

from __future__ import annotations

import difflib
import math
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from swath.errors import ConfigError

__all__ = ["block", "choice", "did_you_mean", "fitting", "refuse_unknown", "text", "whole"]


def refuse_unknown(path: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Refuses a key that is not among the known ones, with the nearest known key.

    Args:
        path: Name of the block, or "" for the file itself.
        given: The keys that were written.
        known: The keys that may be written.
    """
    known = sorted(known)
    prefix = f"{path}." if path else ""
    for key in given:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
            hint = f"; did you mean `{prefix}{near[0]}`?" if near else f"; known: {', '.join(known)}"
            message = f"`{prefix}{key}` is not a known key{hint}"
            raise ConfigError(message)


def block(field: str, value: object) -> dict[str, object]:
    """Returns a block of keys."""
    if not isinstance(value, Mapping):
        raise _wrong(field, "a block of keys", value)
    return dict(value)


def text(field: str, value: object) -> str:
    """Returns a text."""
    if not isinstance(value, str):
        raise _wrong(field, "a text", value)
    return value


def whole(field: str, value: object, *, least: int, most: int) -> int:
    """Returns a whole number within bounds."""
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise _wrong(field, f"a whole number from {least} to {most}", value)
    return value


def choice(field: str, value: object, names: Iterable[str]) -> str:
    """Returns one of several names."""
    names = list(names)
    if not isinstance(value, str) or value not in names:
        expected = "one of " + ", ".join(f"`{name}`" for name in names)
        raise _wrong(field, expected, value, did_you_mean(str(value), names))
    return value


def did_you_mean(word: str, names: Iterable[str]) -> str:
    """Returns the end of a message, with the name that is spelt most like a word; nothing if none is close."""
    near = difflib.get_close_matches(word, list(names), n=1, cutoff=0.5)
    return f"; did you mean `{near[0]}`?" if near else ""


def fitting(field: str, value: object, hint: Any) -> object:  # noqa: ANN401 - a type hint has no type of its own
    """Returns a value as a parameter with a type hint wants it.

    Lists become tuples, whole numbers floats, and `"lin_x"` a linear schedule where the hint asks for it.

    Args:
        field: Name of the key.
        value: What TOML holds.
        hint: The parameter's type hint.
    """
    for option in _options(hint):
        found, fits = _as(value, option)
        if fits:
            return found
    raise _wrong(field, " or ".join(dict.fromkeys(_named(option) for option in _options(hint))), value)


def _options(hint: Any) -> list[Any]:  # noqa: ANN401
    """Returns what a value may be, without None, which TOML cannot say."""
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return [inner for option in typing.get_args(hint) for inner in _options(option)]
    return [] if hint is type(None) else [hint]


def _as(value: object, hint: Any) -> tuple[object, bool]:  # noqa: ANN401
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin is Callable:
        return _schedule(value)
    if origin is tuple and isinstance(value, list) and len(value) == len(inner):
        return _all(tuple, [_as(item, kind) for item, kind in zip(value, inner, strict=True)])
    if origin is list and isinstance(value, list):
        return _all(list, [_as(item, inner[0]) for item in value])
    if origin is dict and isinstance(value, dict):
        items, fit = _all(list, [_as(item, inner[1]) for item in value.values()])
        return dict(zip(value, typing.cast("list[object]", items), strict=True)), fit
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value), math.isfinite(value)
    if hint is Any:
        return value, True
    is_right = isinstance(hint, type) and isinstance(value, hint)
    return value, is_right and (hint is bool or not isinstance(value, bool))


def _all(kind: Callable[[list[object]], object], found: list[tuple[object, bool]]) -> tuple[object, bool]:
    return kind([item for item, _ in found]), all(fits for _, fits in found)


def _schedule(value: object) -> tuple[object, bool]:
    """Reads `lin_x`, which falls linearly from x to 0 over the training."""
    from stable_baselines3.common.utils import LinearSchedule

    if not isinstance(value, str) or not value.startswith("lin_"):
        return None, False
    try:
        start = float(value.removeprefix("lin_"))
    except ValueError:
        return None, False
    return LinearSchedule(start, 0.0, 1.0), math.isfinite(start) and start > 0


def _named(hint: Any) -> str:  # noqa: ANN401
    names = {int: "a whole number", float: "a finite number", bool: "true or false", str: "a text"}
    origin = typing.get_origin(hint)
    if origin is Callable:
        return 'a schedule such as "lin_3e-4"'
    return names.get(hint) or {list: "a list", tuple: "a list", dict: "a block of keys"}.get(origin, "a known value")


def _wrong(field: str, expected: str, value: object, hint: str = "") -> ConfigError:
    shown = f"`{value}`" if isinstance(value, str) else str(value)
    return ConfigError(f"`{field}` must be {expected}, got {shown}{hint}")
