"""The one way into the commands: errors become one sentence and an exit status, Ctrl-C stops without a trace."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Final

BAD_INPUT: Final = 2
STOPPED: Final = 130  # what shells report of a program that Ctrl-C ended


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit status: 0 done, 2 an input cannot be used, 130 stopped by Ctrl-C."""
    try:
        return _run(arguments)
    except KeyboardInterrupt:
        return _complain("stopped", STOPPED)
    except BrokenPipeError:
        # The reader went away; what Python would still flush at its end must not complain either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _run(arguments: Sequence[str] | None) -> int:
    import typer

    from truefield.cli.app import app

    # The base of every usage error; Typer brings its own Click or another's, depending on its version.
    usage_error: type[Exception] = typer.BadParameter.__bases__[0]
    try:
        status = app(arguments, prog_name="truefield", standalone_mode=False)
    except usage_error as error:
        context = getattr(error, "ctx", None)
        message = getattr(error, "format_message", error.__str__)()
        command = "truefield" if context is None else context.command_path
        return _complain(f"{message.rstrip('.')}; see {command} --help", BAD_INPUT)
    except typer.Abort:
        return _complain("stopped", STOPPED)
    except BrokenPipeError:
        raise
    except MemoryError as error:
        scarce = "there is not enough memory; choose a coarser resolution or a larger tolerance"
        return _complain(str(error) or scarce, BAD_INPUT)
    except (ValueError, OSError) as error:
        return _complain(str(error), BAD_INPUT)
    return _complain("stopped", STOPPED) if status == STOPPED else int(status or 0)


def _complain(sentence: str, status: int) -> int:
    print(f"truefield: {' '.join(sentence.split())}", file=sys.stderr)
    return status
