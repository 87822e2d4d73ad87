"""A budget of time for computations that may not end: loops spend it, and the last round raises."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, TypeVar

from robostiff.errors import InputError, Words

Found = TypeVar("Found")

#: Seconds of computing that a closed form may take.
BUDGET = 20.0

_HINTS = {
    "closed form": "use named steps, form=Steps(), or a larger budget=...",
    "record of a formula": "let its dimensions be symbols too, or give a larger budget=...",
}
_LARGEST = 1e6  # seconds
_ROUNDS = 16  # between two looks at the clock


class FormulaTooLargeError(InputError):
    """A closed form would exceed the allowed number of terms."""

    @classmethod
    def beyond(cls, limit: int) -> FormulaTooLargeError:
        """The error of an entry with more terms than the limit."""
        return cls(
            "closed form",
            got=Words(f"an entry of more than {limit} terms on the way"),
            expected=f"at most {limit}",
            hint="use named steps, form=Steps(), or raise Closed(limit=...)",
        )


class OutOfTimeError(FormulaTooLargeError):
    """A closed form did not end within its budget of time."""


@dataclass
class _Budget:
    until: float  # by the clock of the thread
    rounds: int = 0


class _Stop(BaseException):  # no Exception: handlers on the way must not take it for theirs
    """Raised inside the computation, with the budget that is spent."""


_OPEN: ContextVar[_Budget | None] = ContextVar("budget of a formula", default=None)


def spend() -> None:
    """A round of a loop that may be long: `within` ends where its budget is spent."""
    budget = _OPEN.get()
    if budget is not None:
        budget.rounds += 1
        if budget.rounds % _ROUNDS == 0 and time.thread_time() > budget.until:
            raise _Stop(budget)


def within(budget: float | None, work: Callable[[], Found], subject: str = "closed form") -> Found:
    """The result of a computation whose loops call `spend` and that ends within a budget.

    The time is that of the thread that computes, so that a busy machine gives the same answer. A
    single call into FLINT cannot be stopped; the computation ends after it.

    `budget`: seconds of computing; without a limit for None; `subject`: what is computed, in
    words.

    Raises
    ------
    OutOfTimeError
        When it does not end in time.
    """
    if budget is None:
        return work()
    limit, around = checked_budget(budget), _OPEN.get()
    budgeted = _Budget(time.thread_time() + limit)
    token = _OPEN.set(around if around is not None and around.until < budgeted.until else budgeted)
    try:
        return work()
    except _Stop as stop:
        if stop.args[0] is not budgeted:
            raise
        raise OutOfTimeError(
            subject,
            got=Words(f"none within {limit:g} s of computing"),
            expected="one in time",
            hint=_HINTS.get(subject, "use fewer symbols, or a larger budget=..."),
        ) from None
    finally:
        _OPEN.reset(token)


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
            expected="a positive number of seconds, or None for no limit",
        )
    return float(budget)
