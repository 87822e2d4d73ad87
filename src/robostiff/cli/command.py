"""Commands as the shell has them: options, help, exit status, errors as one message."""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import click

from robostiff.cli.options import Answer, Command, ExplainedArgument, build
from robostiff.cli.output import running, show
from robostiff.errors import (
    DisagreementError,
    InputError,
    NoAnswerError,
    PlausibilityWarning,
    printable,
)
from robostiff.version import __version__

BAD_STATUS = 1
BAD_INPUT = 2
INTERRUPTED = 130
#: The exit status that a shell reports for a program ended by SIGPIPE.
NO_READER = 141


def as_click(name: str, command: type[Command]) -> click.Command:
    """As the parser has it; every command gets the options ``--quiet`` and ``--verbose``."""

    def answer(quiet: bool, verbose: bool, **arguments: Any) -> None:
        running.set(name)
        started = time.perf_counter()
        status = status_of(lambda: build(command, arguments).run(), quiet, verbose)
        if verbose:
            import platform
            from importlib.metadata import PackageNotFoundError, version

            seconds = time.perf_counter() - started
            packages = [f"{name} {version(name)}" for name in ("numpy", "scipy", "sympy")]
            with suppress(PackageNotFoundError):
                packages.append(f"llvmlite {version('llvmlite')}")
            python = f"Python {platform.python_version()}"
            words = ", ".join([f"robostiff {__version__}", python, *packages])
            spent = f"{seconds:.2f} s, processor {time.process_time():.2f} s since the start"
            click.echo(f"robostiff: {words}\nrobostiff: {spent}", err=True)
        raise click.exceptions.Exit(status)

    words = {
        "--quiet": "Print no warnings: results and errors alone.",
        "--verbose": "Print versions and times on standard error, and of an error where it arose.",
    }
    further = [click.Option([option], is_flag=True, help=text) for option, text in words.items()]
    paragraphs = command.words()
    return _Parsed(
        name,
        params=[*command.parameters(), *further],
        callback=answer,
        help="\n\n".join(paragraphs),
        short_help=" ".join(paragraphs[0].split()),
        context_settings={"show_default": True},
    )


class _Parsed(click.Command):
    """A command whose help explains what is given without a name, too."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """What is written, each option once; of an unknown option, its nearest name."""
        try:
            order = self.make_parser(ctx).parse_args(list(args))[2]
            for option in order:
                is_one = isinstance(option, click.Option) and not (
                    option.multiple or option.is_flag
                )
                if is_one and order.count(option) > 1:
                    raise click.UsageError(f"{option.opts[-1]} more than once: write it once", ctx)
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            first = list(error.possibilities or ())[:1]
            raise click.NoSuchOption(error.option_name, None, first, error.ctx) from None
        except click.UsageError as error:
            if "extra argument" not in error.message:
                raise
            words = f'{error.message}; write what belongs together in quotes: --at "0 0 0.1"'
            raise click.UsageError(words, error.ctx) from None

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Arguments before options."""
        explained = [p for p in self.params if isinstance(p, ExplainedArgument)]
        if explained:
            with formatter.section("Arguments"):
                formatter.write_dl([(str(p.metavar), p.text) for p in explained])
        super().format_options(ctx, formatter)


@contextmanager
def slips(show: Callable[[str], object]) -> Iterator[None]:
    """Pass every warning of a probable slip to a function, once."""
    seen: set[str] = set()
    with warnings.catch_warnings():
        warnings.simplefilter("always", PlausibilityWarning)
        before = warnings.showwarning
        is_inner = before.__module__ == __name__

        def shown(message: Warning | str, category: type[Warning], *rest: Any, **more: Any) -> None:
            is_slip = issubclass(category, PlausibilityWarning)
            if is_slip and str(message) not in seen:
                seen.add(str(message))
                show(str(message))
            if is_inner or not is_slip:
                before(message, category, *rest, **more)

        warnings.showwarning = shown
        yield


def print_answer(result: object, answer: Answer) -> int:
    """Print a result, or its page, as text or as JSON; 1 for a bad status, otherwise 0."""
    from robostiff.markup import Page, page_text
    from robostiff.page.of_result import page_data, page_of

    page = result if isinstance(result, Page) else page_of(result)
    show(page_data(page) if answer.as_json else page_text(page))
    return BAD_STATUS if getattr(page.status, "is_bad", False) else 0


def status_of(run: Callable[[], int], quiet: bool = False, verbose: bool = False) -> int:
    """The exit status of what runs; bad input and what else ends it become a message."""
    try:
        warn = (lambda _: 0) if quiet else partial(_complain, status=0, word="warning")
        with slips(warn):
            try:
                status = run()
            except Exception:
                if verbose:  # where an error arose
                    import traceback

                    click.echo(traceback.format_exc().rstrip(), err=True)
                raise
    except InputError as error:
        status = _complain(str(error), BAD_INPUT)
    except (NoAnswerError, DisagreementError) as error:
        status = _complain(str(error), BAD_STATUS)
    except KeyboardInterrupt:
        click.echo("robostiff: interrupted", err=True)
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
    return status


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


def _complain(message: str, status: int, word: str = "error") -> int:
    click.echo(f"robostiff: {word}: {printable(message, kept=chr(10))}", err=True)
    return status


def _write_no_more() -> None:
    """Discard buffered output when the program ends, without a second error message."""
    with suppress(OSError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
