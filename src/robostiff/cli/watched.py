"""A long computation in a child process, while this one shows progress and reacts to Ctrl-C.

Python reacts to Ctrl-C between two of its steps, and a call into a library for polynomials is one
step that may take minutes. The child goes on as the program; its parent waits, ends it on Ctrl-C,
and ends with its exit status.
"""

from __future__ import annotations

import os
import signal
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import suppress

import click

from robostiff.cli.command import INTERRUPTED

_INTERVAL = 0.05
_PATIENCE = 0.4  # seconds that the child has to end by itself
_FIRST = 1.0  # seconds before anything is shown
_DEATH_OF_PARENT = 1  # PR_SET_PDEATHSIG: the child ends when its parent is killed


def go_on_in_child(progress: Callable[[float], str]) -> None:
    """Return in a child process; this one waits for it and ends with its exit status.

    `progress` gives a line about the seconds that have passed, shown on standard error where that
    is a terminal. Without processes that fork, or where standard output is none of the program's
    own, as in a test, nothing happens and the computation goes on here.
    """
    try:
        own_streams = sys.stdout.fileno() == 1 and sys.stderr.fileno() == 2
    except (OSError, ValueError, AttributeError):
        return
    if not (hasattr(os, "fork") and own_streams):
        return
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads that wait
        child = os.fork()
    if child == 0:
        if sys.platform == "linux":
            import ctypes

            with suppress(OSError, AttributeError):
                ctypes.CDLL(None).prctl(_DEATH_OF_PARENT, signal.SIGKILL)
        return
    shown = _Progress(progress)
    before = signal.signal(signal.SIGTERM, lambda *_: os.kill(child, signal.SIGTERM))
    begun = time.monotonic()
    try:
        while True:
            pid, status = os.waitpid(child, os.WNOHANG)
            if pid:
                break
            passed = time.monotonic() - begun
            shown.at(passed)
            # A short computation is not held up, and a long one is looked at now and then.
            time.sleep(min(_INTERVAL, 0.002 + passed / 50))
        shown.clear()
        code = _exit_status(status)
    except KeyboardInterrupt:
        shown.clear()
        code = _ended(child)
    finally:
        signal.signal(signal.SIGTERM, before)
    raise click.exceptions.Exit(code)


def _ended(child: int) -> int:
    """The status of an interrupted child; one that does not end by itself is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for is_told in (False, True):  # a terminal has sent the signal to the child as well
        if is_told:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGINT)
        until = time.monotonic() + _PATIENCE
        while time.monotonic() < until:
            pid, status = os.waitpid(child, os.WNOHANG)
            if pid:
                return _exit_status(status)
            time.sleep(_INTERVAL)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    click.echo("robostiff: interrupted", err=True)
    return INTERRUPTED


def _exit_status(status: int) -> int:
    code = os.waitstatus_to_exitcode(status)
    if code >= 0:
        return code
    if -code == signal.SIGINT:
        click.echo("robostiff: interrupted", err=True)
    return 128 - code


class _Progress:
    """One line on a terminal, written over itself each second."""

    def __init__(self, words: Callable[[float], str]) -> None:
        self._words = words
        self._is_shown = sys.stderr.isatty()
        self._next = _FIRST
        self._width = 0

    def at(self, passed: float) -> None:
        """Show how long it has taken."""
        if self._is_shown and passed >= self._next:
            line = self._words(passed)
            self._width = max(self._width, len(line))
            sys.stderr.write(f"\r{line:{self._width}}")
            sys.stderr.flush()
            self._next = passed + 1.0

    def clear(self) -> None:
        """Leave an empty line for what follows."""
        if self._width:
            sys.stderr.write("\r" + " " * self._width + "\r")
            sys.stderr.flush()
