"""How a command ends: its exit status, and errors as one message on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

import typer

from robostiff.errors import InputError, NoAnswerError

BAD_STATUS = 1
BAD_INPUT = 2
P = ParamSpec("P")


def reported(command: Callable[P, int]) -> Callable[P, None]:
    """Turn the status that a command returns into an exit status, and bad input into a message."""

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            status = command(*args, **kwargs)
        except InputError as error:
            typer.echo(f"robostiff: error: {error}", err=True)
            raise typer.Exit(BAD_INPUT) from None
        except NoAnswerError as error:
            typer.echo(f"robostiff: error: {error}", err=True)
            raise typer.Exit(BAD_STATUS) from None
        except BrokenPipeError:  # the reader of a pipe has left
            sys.stderr.close()
            raise typer.Exit(BAD_STATUS) from None
        except OSError as error:
            typer.echo(f"robostiff: error: the answer could not be written: {error}", err=True)
            raise typer.Exit(BAD_INPUT) from None
        raise typer.Exit(status)

    return run
