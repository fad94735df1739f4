"""Files that are either there as a whole or not at all, and the folders for them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from swath.errors import ConfigError

__all__ = ["check_folder", "unfinished", "write_whole"]


@contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """Gives another name beside a file, under which it is written, and renames it when the block ends well.

    Where the path is a link, the file that it leads to is replaced; a device or a pipe is written as it is.

    Args:
        path: The file; an existing one is replaced.

    Raises:
        OSError: If it cannot be written; nothing is left behind then, nor after any other error of the block.
    """
    is_stream = path.exists() and not path.is_file() and not path.is_dir()
    whole = path.resolve() if path.is_symlink() and not is_stream else path
    beside = path if is_stream else whole.with_name(f".{whole.name}.unfinished")
    try:
        yield beside
        if not is_stream:
            # Or the name could outlive a power cut, and the bytes not.
            with beside.open("rb+") as file:
                os.fsync(file.fileno())
            beside.replace(whole)
    except BaseException as error:
        if not is_stream:
            with suppress(OSError):
                beside.unlink()
        if isinstance(error, OSError) and error.errno is not None:
            # The name that the caller knows.
            raise type(error)(error.errno, error.strerror, str(path)) from error
        raise


def write_whole(path: Path, content: str | bytes) -> None:
    """Writes a file under another name beside it, and renames it when it is complete.

    Args:
        path: The file, as for `unfinished`.
        content: Its bytes, or its text in UTF-8.

    Raises:
        OSError: If it cannot be written; nothing is left behind then.
    """
    with unfinished(path) as beside:
        beside.write_bytes(content.encode() if isinstance(content, str) else content)


def check_folder(field: str, folder: Path) -> None:
    """Makes sure that a folder can be made or is there.

    Raises:
        ConfigError: If a file has its name; the message names `field`.
    """
    if folder.exists() and not folder.is_dir():
        text = f"`{field}` must be a folder, got the file {folder}"
        raise ConfigError(text)
