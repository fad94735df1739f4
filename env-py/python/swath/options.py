"""What callers may say, checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from swath.errors import ConfigError, SnapshotError

__all__ = ["bytes_of", "flag", "mask_of", "weeds_of", "weeds_of_one"]


def weeds_of(options: Mapping[str, object] | None, num_envs: int, *, others: Sequence[str] = ()) -> list[object]:
    """Reads `options["weeds"]`.

    Args:
        options: What a caller of `reset` has given.
        num_envs: Number of environments.
        others: Other options that may be given.

    Returns:
        Nothing, one array for all environments, or one array or None for each.

    Raises:
        ConfigError: If there are other options, or arrays for another number of environments.
    """
    checked = _checked(options, ("weeds", *others))
    weeds = checked.get("weeds")
    if weeds is None:
        return []
    if isinstance(weeds, np.ndarray):
        is_by_row = weeds.ndim == 3
    else:
        is_by_row = isinstance(weeds, list | tuple) and any(map(_is_table, weeds))
    if not is_by_row:
        return [weeds]
    assert isinstance(weeds, np.ndarray | list | tuple), "only those are by row"
    rows: list[object] = list(weeds)
    if len(rows) != num_envs:
        text = f"`weeds` must be one array, or one for each of {num_envs} environments, got {len(rows)}"
        raise ConfigError(text)
    return rows


def _is_table(entry: object) -> bool:
    """Tells an array of weeds, an empty one, or none, from a weed."""
    if entry is None or isinstance(entry, np.ndarray):
        return entry is None or entry.ndim == 2 or entry.size == 0
    return isinstance(entry, list | tuple) and (
        not entry or any(isinstance(weed, list | tuple | np.ndarray) for weed in entry)
    )


def weeds_of_one(options: Mapping[str, object] | None) -> object:
    """Reads `options["weeds"]` of one environment: its array, or None.

    Raises:
        ConfigError: If there are other options.
    """
    return _checked(options, ("weeds",)).get("weeds")


def mask_of(options: Mapping[str, object] | None, num_envs: int) -> npt.NDArray[np.bool_] | None:
    """Reads `options["reset_mask"]`: which environments begin; None for all.

    Raises:
        ConfigError: If it is no array of flags, one for each environment, or nobody begins.
    """
    mask = options.get("reset_mask") if options else None
    if mask is None:
        return None
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (num_envs,) or not mask.any():
        what = f"{mask.dtype} of the shape {mask.shape}" if isinstance(mask, np.ndarray) else repr(mask)
        if isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (num_envs,):
            what = "no True"
        text = f'`options["reset_mask"]` must be a bool array of the shape ({num_envs},) with a True, got {what}'
        raise ConfigError(text)
    return mask


def _checked(options: Mapping[str, object] | None, known: Sequence[str]) -> Mapping[str, object]:
    """Returns options, none of which is unknown."""
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        text = f"`options` must be a mapping such as {{'weeds': [[3.0, 4.0]]}}, got {options!r}"
        raise ConfigError(text)
    for name in options:
        if name not in known:
            text = f"`options` must hold nothing but {' and '.join(f'`{one}`' for one in known)}, got `{name}`"
            raise ConfigError(text)
    return options


def flag(field: str, value: object) -> bool:
    """Reads a switch.

    Raises:
        ConfigError: If it is neither True nor False.
    """
    if not isinstance(value, bool | np.bool_):
        text = f"`{field}` must be True or False, got {value!r}"
        raise ConfigError(text)
    return bool(value)


def bytes_of(snapshot: object) -> bytes:
    """Reads a snapshot.

    Raises:
        SnapshotError: If it is not bytes.
    """
    if not isinstance(snapshot, bytes):
        text = f"`snapshot` must be the bytes that `snapshot` returned, got {snapshot!r}"
        raise SnapshotError(text)
    return snapshot
