"""Formulas that are written in SymPy only when somebody looks at them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Unwritten:
    """A formula in exact arithmetic, and how to write it.

    Attributes
    ----------
    write : callable
        Returns the SymPy expression or matrix.
    """

    write: Callable[[], Any]


class Written:
    """A field of a frozen dataclass that may be given as `Unwritten`; it is written once.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Answer:
    ...     value: Written = Written()
    >>> Answer(Unwritten(lambda: 6 * 7)).value
    42
    >>> Answer(42) == Answer(Unwritten(lambda: 6 * 7))
    True
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Any:
        if instance is None:
            # So that dataclass() sees a field without a default.
            raise AttributeError(self._name)
        value = instance.__dict__[self._name]
        if isinstance(value, Unwritten):
            value = instance.__dict__[self._name] = value.write()
        return value

    def __set__(self, instance: Any, value: Any) -> None:
        instance.__dict__[self._name] = value
