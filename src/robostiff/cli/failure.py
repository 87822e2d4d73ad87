"""Commands as the shell has them: help, exit status, errors as one message."""

from __future__ import annotations

import inspect
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import wraps
from typing import Annotated, Any

import typer

from robostiff.cli.output import running
from robostiff.errors import (
    DisagreementError,
    InputError,
    NoAnswerError,
    PlausibilityWarning,
    printable,
)

_HEADS = ("Example:", "Examples\n--------", "Examples:")


def laid_out(doc: str | None) -> str:
    r"""A docstring with each example in one line.

    Examples
    --------
    >>> laid_out("Do it.\n\nExample: robostiff do hexapod\n\nExit status: 0.")
    'Do it.\n\n\x08\nExample:\n  robostiff do hexapod\n\nExit status: 0.'
    """
    found: list[str] = []
    for paragraph in inspect.cleandoc(doc or "").split("\n\n"):
        head = next((head for head in _HEADS if paragraph.startswith(head)), None)
        words = " ".join(paragraph.removeprefix(head or "").split())
        if head is not None:
            line = "\b\nExamples:" if head.startswith("Examples") else "\b\nExample:"
            found.append(f"{line}\n  {words}" if words else line)
        elif words.startswith("robostiff ") and found and found[-1].startswith("\b\nExample"):
            found[-1] += f"\n  {words}"
        else:
            found.append(paragraph)
    return "\n\n".join(found)


BAD_STATUS = 1
BAD_INPUT = 2
INTERRUPTED = 130
#: The exit status that a shell reports for a program ended by SIGPIPE.
NO_READER = 141

QuietOption = Annotated[
    bool, typer.Option("--quiet", help="Print no warnings: results and errors alone.")
]


@contextmanager
def slips(show: Callable[[str], object]) -> Iterator[None]:
    """Pass every warning of a probable slip to a function, once."""
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


def reported(command: Callable[..., int]) -> Callable[..., None]:
    """Turn the status that a command returns into an exit status, and bad input into a message.

    Every command gets the option ``--quiet``.
    """

    @wraps(command)
    def run(*args: Any, quiet: bool = False, **kwargs: Any) -> None:
        running.set(command.__name__.strip("_"))
        try:
            with slips(_ignore if quiet else _warn):
                status = command(*args, **kwargs)
        except InputError as error:
            status = _complain(str(error), BAD_INPUT)
        except (NoAnswerError, DisagreementError) as error:
            status = _complain(str(error), BAD_STATUS)
        except KeyboardInterrupt:
            typer.echo("robostiff: interrupted", err=True)
            status = INTERRUPTED
        except BrokenPipeError:  # the reader of the pipe has closed it
            _write_no_more()
            status = NO_READER
        except UnicodeEncodeError as error:
            letters = ascii(error.object[error.start : error.end][:20])
            status = _complain(
                f"standard output: its encoding, {error.encoding}, has no {letters}; "
                "write to a file with -o, or set PYTHONIOENCODING=utf-8",
                BAD_INPUT,
            )
        except MemoryError:
            status = _complain("there is not enough memory; compute less at a time", BAD_INPUT)
        except OSError as error:
            _write_no_more()
            where = f" {str(error.filename)!r}" if error.filename else ""
            reason = error.strerror or str(error)
            status = _complain(f"could not read or write{where}: {reason}", BAD_INPUT)
        raise typer.Exit(status)

    own = inspect.signature(command, eval_str=True)
    option = inspect.Parameter(
        "quiet", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=QuietOption
    )
    described: Any = run
    described.__signature__ = own.replace(parameters=[*own.parameters.values(), option])
    described.__annotations__ = {**command.__annotations__, "quiet": QuietOption}
    described.__doc__ = laid_out(command.__doc__)
    return described


def ready_streams() -> None:
    """Make standard streams usable that were closed when the program began; exit without output."""
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115
    if sys.stdout is None:
        # Otherwise the first opened file would take this descriptor.
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        if sys.stderr is not None:
            _complain("standard output is closed", BAD_INPUT)
        raise SystemExit(BAD_INPUT)
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115


def _complain(message: str, status: int) -> int:
    typer.echo(f"robostiff: error: {printable(message, kept=chr(10))}", err=True)
    return status


def _warn(message: str) -> None:
    typer.echo(f"robostiff: warning: {printable(message, kept=chr(10))}", err=True)


def _ignore(_: str) -> None:
    """Show nothing."""


def _write_no_more() -> None:
    """Discard buffered output when the program ends, without a second error message."""
    with suppress(OSError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
