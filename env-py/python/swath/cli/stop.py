"""Ctrl-C with something to say."""

__all__ = ["Stopped"]


class Stopped(Exception):  # noqa: N818 - it is no error
    """The user has stopped a command; the text says how to go on."""
