"""How a command ends: its exit status, and errors as one message on standard error."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, ParamSpec

import typer

from robostiff.errors import DisagreementError, InputError, NoAnswerError, PlausibilityWarning

BAD_STATUS = 1
BAD_INPUT = 2
P = ParamSpec("P")


@contextmanager
def slips(show: Callable[[str], object]) -> Iterator[None]:
    """Hand every warning of a probable slip to a function, once, before it goes on its way."""
    seen: set[str] = set()
    with warnings.catch_warnings():
        warnings.simplefilter("always", PlausibilityWarning)
        elsewhere = warnings.showwarning
        own = elsewhere.__module__ == __name__

        def shown(message: Warning | str, category: type[Warning], *rest: Any, **more: Any) -> None:
            is_slip = issubclass(category, PlausibilityWarning)
            if is_slip and str(message) not in seen:
                seen.add(str(message))
                show(str(message))
            if own or not is_slip:
                elsewhere(message, category, *rest, **more)

        warnings.showwarning = shown
        yield


def reported(command: Callable[P, int]) -> Callable[P, None]:
    """Turn the status that a command returns into an exit status, and bad input into a message."""

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            with slips(lambda text: typer.echo(f"robostiff: warning: {text}", err=True)):
                status = command(*args, **kwargs)
        except InputError as error:
            typer.echo(f"robostiff: error: {error}", err=True)
            raise typer.Exit(BAD_INPUT) from None
        except (NoAnswerError, DisagreementError) as error:
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
