"""Fields of frozen objects that are written when they are first looked at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Unwritten:
    """A formula in exact arithmetic, and a function that writes it."""

    write: Callable[[], Any]  # returns the SymPy expression or matrix


class WrittenField:
    """A field of a frozen dataclass that may be given as `Unwritten`; it is written at first use.

    `default`: of the field.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Answer:
    ...     value: WrittenField = WrittenField()
    >>> Answer(Unwritten(lambda: 6 * 7)).value
    42
    >>> Answer(42) == Answer(Unwritten(lambda: 6 * 7))
    True
    """

    def __init__(self, *default: Any) -> None:
        self._default = default

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Any:
        if instance is None:
            if self._default:
                return self._default[0]
            # So that dataclass() sees a field without a default.
            raise AttributeError(self._name)
        value = instance.__dict__[self._name]
        if isinstance(value, Unwritten):
            value = instance.__dict__[self._name] = value.write()
        return value

    def __set__(self, instance: Any, value: Any) -> None:
        instance.__dict__[self._name] = value
