"""A budget of time for computations that may not end."""

from __future__ import annotations

import ctypes
import gc
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

from robostiff.analytic.exact.products import FormulaTooLargeError
from robostiff.errors import InputError

Found = TypeVar("Found")

#: Seconds of computing that a closed form may take.
BUDGET = 20.0

_HINTS = {
    "closed form": "use named steps, form=Steps(), or a larger budget=...",
    "record of a formula": "let its dimensions be symbols too, or give a larger budget=...",
}
_LARGEST = 1e6  # seconds
_INTERVAL = 0.1  # between two looks at the clock
_LATER = 0.5  # until it is stopped again, where something has swallowed that
_STEPS = 1000  # of a loop, in which what waits is raised
_SOON = 0.01  # until the next look, where an exception would be lost


class OutOfTimeError(FormulaTooLargeError):
    """A closed form did not end within its budget of time."""


class _Stop(BaseException):  # no Exception: handlers on the way must not take it for theirs
    """Raised inside the computation."""


def within(budget: float | None, work: Callable[[], Found], subject: str = "closed form") -> Found:
    """The result of a computation that ends within a budget.

    The time is that of the thread that computes, so that a busy machine gives the same answer. A
    single call into FLINT cannot be stopped; the computation ends after it.

    `budget`: seconds of computing; without a limit for None; `subject`: what is computed, in
    words.

    Raises
    ------
    OutOfTimeError
        When it does not end in time.

    Examples
    --------
    >>> within(5.0, lambda: 6 * 7)
    42
    >>> try:
    ...     within(0.2, lambda: all(x == 0 for x in iter(int, 1)))
    ... except OutOfTimeError as error:
    ...     print(error.hint)
    use named steps, form=Steps(), or a larger budget=...
    """
    if budget is None:
        return work()
    limit = checked_budget(budget)
    guard = _Guard(limit)
    try:
        try:
            return work()
        finally:
            guard.end()
    except _Stop:
        guard.end()
        raise OutOfTimeError(
            subject,
            got=f"none within {limit:g} s of computing",
            expected="one in time",
            hint=_HINTS.get(subject, "use fewer symbols, or a larger budget=..."),
        ) from None


def checked_budget(budget: Any) -> float:
    """A budget as a number of seconds.

    Raises
    ------
    InputError
        When it is no positive number.
    """
    is_number = isinstance(budget, int | float) and not isinstance(budget, bool)
    if not (is_number and 0 < budget <= _LARGEST):
        raise InputError(
            "budget of time",
            got=budget,
            expected="a positive number of seconds",
            hint="write budget=None for no limit",
        )
    return float(budget)


class _Guard:
    """Stops the thread that made it once it has computed for so long."""

    def __init__(self, limit: float) -> None:
        self._ident = threading.get_ident()
        self._clock = _clock_of(self._ident)
        self._until = self._clock() + limit
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._has_stopped = False
        threading.Thread(target=self._watch, daemon=True, name="budget of a formula").start()

    def _watch(self) -> None:
        wait = _INTERVAL
        while not self._ended.wait(wait):
            if self._clock() < self._until:
                continue
            with self._lock:
                if self._ended.is_set():
                    break
                if _loses_exceptions(self._ident):
                    wait = _SOON
                    continue
                self._has_stopped = True
                _raise_in(self._ident, _Stop)
            wait = _LATER

    def end(self) -> None:
        """No stop comes after this."""
        with self._lock:
            self._ended.set()
        if self._has_stopped:
            _take_what_waits()


def _clock_of(ident: int) -> Callable[[], float]:
    """Seconds that a thread has computed; seconds that have passed where no such clock is."""
    if hasattr(time, "pthread_getcpuclockid"):
        clock = time.pthread_getcpuclockid(ident)
        return lambda: time.clock_gettime(clock)
    return time.monotonic


def _loses_exceptions(ident: int) -> bool:
    """Whether a thread runs code out of which the interpreter takes no exception.

    It prints those of finalizers and of callbacks of the garbage collector, and goes on.
    """
    frame = sys._current_frames().get(ident)  # pyright: ignore[reportPrivateUsage]
    callbacks = {getattr(callback, "__code__", None) for callback in gc.callbacks}
    while frame is not None:
        code = frame.f_code
        in_weakref = frame.f_globals.get("__name__") == "weakref"
        if code in callbacks or code.co_name == "__del__" or in_weakref:
            return True
        frame = frame.f_back
    return False


def _raise_in(ident: int, exception: type[BaseException]) -> None:
    """Raise an exception in a thread between two of its steps."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(ident), ctypes.py_object(exception))


def _take_what_waits() -> None:
    """Take a stop that has not been raised yet in this thread.

    It could be called back, but then CPython 3.11 looks for one ever after: it runs slower, and not
    at all under a profiler or a debugger.
    """
    try:
        for _ in range(_STEPS):
            pass
    except _Stop:
        return
