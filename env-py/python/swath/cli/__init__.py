"""The command `swath`.

Bad input gets one line on stderr and exit status 2; Ctrl-C gets one line and 130, where it cuts something off.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from swath import __version__
from swath.cli.agents import agents
from swath.cli.bench import bench
from swath.cli.config import config
from swath.cli.demo import demo
from swath.cli.evaluate import evaluate
from swath.cli.record import record
from swath.cli.replay import replay
from swath.cli.report import report
from swath.cli.run import run
from swath.cli.stop import Stopped
from swath.cli.top import top
from swath.cli.train import train
from swath.cli.worker import worker
from swath.errors import SwathError

__all__ = ["app", "main"]

_BAD_INPUT, _STOPPED = 2, 130
# By the names of their errors.
_NUMBERS = {"int_parsing": "a whole number", "float_parsing": "a number"}

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
for command in (evaluate, report, run, replay, train, record, worker, bench, config, agents, demo, top):
    app.command()(command)


@app.callback(invoke_without_command=True)
def swath(
    context: typer.Context,
    *,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    """Autonomous pasture mowing: planners, their evaluation, and the scenarios they run on."""
    if version:
        typer.echo(__version__)
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main(args: Sequence[str] | None = None) -> int:
    """Runs a command.

    Args:
        args: What stands behind `swath`; None: the arguments of this process.

    Returns:
        The exit status.
    """
    try:
        status = app(args=args, prog_name="swath", standalone_mode=False)
        sys.stdout.flush()
    except Stopped as stop:
        return _say(str(stop), _STOPPED)
    except (SwathError, ModuleNotFoundError) as error:
        return _say(str(error), _BAD_INPUT)
    except typer.TyperException as error:
        return _say(_refusal(error), _BAD_INPUT)
    except BrokenPipeError:
        # Who read our output has gone; Python must not try to flush it once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        text = f"cannot use {error.filename}: {error.strerror}"
        if error.filename is None:
            text = str(error) or type(error).__name__
        return _say(text, _BAD_INPUT)
    # The command line library turns Ctrl-C into this status.
    return _say("stopped", _STOPPED) if status == _STOPPED else int(status or 0)


def _refusal(error: typer.TyperException) -> str:
    """Returns what is wrong with an argument, with its value, which the command line library may leave out."""
    text, errors = error.format_message().rstrip("."), getattr(error.__cause__, "errors", None)
    if errors is None:
        return text
    first = errors()[0]
    if isinstance(error, typer.BadParameter) and error.param is not None and first["type"] in _NUMBERS:
        text = f"`{error.param.opts[0]}` must be {_NUMBERS[first['type']]}"
    return f"{text}, got {first['input']!r}"


def _say(text: str, status: int) -> int:
    sys.stderr.write(f"swath: {' '.join(text.split())}\n")
    return status
