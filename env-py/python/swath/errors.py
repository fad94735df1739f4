"""Everything that swath refuses, as one tree.

The text names the field, what was expected and what was found, in one line.
All of them can be pickled, so they cross process boundaries whole.
"""

from __future__ import annotations

from gymnasium.error import ClosedEnvironmentError

__all__ = [
    "ActionError",
    "ClosedError",
    "ConfigError",
    "RemoteError",
    "RemoteTimeout",
    "RenderModeError",
    "ResumeError",
    "SnapshotError",
    "SwathError",
]


class SwathError(Exception):
    """The root of the tree."""


class ConfigError(SwathError, ValueError):
    """A scenario, a seed, an agent, an option or an argument that cannot be used."""


class RenderModeError(ConfigError, TypeError):
    """A render mode that the environment does not have.

    A `TypeError` too: after one, stable-baselines3 makes the environment again without a render mode.
    """


class ActionError(SwathError, ValueError):
    """An action that cannot be carried out; the environment is as it was."""


class SnapshotError(SwathError, ValueError):
    """Bytes that cannot be restored; the environment is as it was."""


class ClosedError(SwathError, ClosedEnvironmentError):
    """A call after `close`."""


class RemoteError(SwathError):
    """A server that cannot be reached, is not what it should be, or has lost the session."""


class RemoteTimeout(RemoteError):  # noqa: N818 - as Python's own `TimeoutError` is a kind of error by name
    """A server that has not answered in time: whether it did what was asked is not known until `retry` settles it."""


class ResumeError(RemoteError):
    """A session that was lost with its server and is not resumed.

    It cannot be, or it went on otherwise than it had, or the next server does not take it: the message says which, and
    whether `retry` may help.
    """
