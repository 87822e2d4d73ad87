"""Names for intermediates of a formula, and the conditions under which it holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import sympy as sp


@dataclass(frozen=True)
class Definition:
    """A named intermediate: ``symbol = expression`` of symbols given or defined before.

    Attributes
    ----------
    symbol : sympy.Symbol
    expression : sympy.Expr
    parts : tuple of str
        Beams or drives of which it is a stiffness, or materials of which it is a modulus.
    unit : str
        Of the stiffness of a drive.
    """

    symbol: sp.Symbol
    expression: sp.Expr
    parts: tuple[str, ...] = field(default=(), compare=False, repr=False)
    unit: str = field(default="", compare=False, repr=False)


def used_definitions(
    definitions: Sequence[Definition], results: Iterable[Any]
) -> tuple[Definition, ...]:
    """The definitions that results need, directly or through others, in order.

    Examples
    --------
    >>> x, a, b = sp.symbols("x a b")
    >>> [d.symbol for d in used_definitions([Definition(a, x + 1), Definition(b, x)], [2 * a])]
    [a]
    """
    wanted = {symbol for result in results for symbol in result.free_symbols}
    kept = []
    for definition in reversed(definitions):
        if definition.symbol in wanted:
            kept.append(definition)
            wanted |= definition.expression.free_symbols
    return tuple(reversed(kept))


def in_given_symbols(definitions: Iterable[Definition]) -> dict[Any, Any]:
    """What names stand for, by symbol, without the other names among them.

    Examples
    --------
    >>> x, a, b = sp.symbols("x a b")
    >>> in_given_symbols([Definition(a, x + 1), Definition(b, 2 * a)])
    {a: x + 1, b: 2*x + 2}
    """
    found: dict[Any, Any] = {}
    for d in definitions:
        found[d.symbol] = d.expression.xreplace(found)
    return found


@dataclass(frozen=True)
class Condition:
    """A condition under which a formula holds.

    Attributes
    ----------
    words : str
        Such as "leg 'ram' meets the platform".
    expression : sympy.Expr
        In given symbols; positive where it holds.
    equations : tuple of sympy.Expr
        Differences that vanish there, of legs in their joint coordinates.
    leg : str
        The leg of which the words speak; empty where they speak of none.
    """

    words: str
    expression: sp.Expr
    equations: tuple[sp.Expr, ...] = ()
    leg: str = ""


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


class WrittenWhole:
    """A frozen dataclass that is pickled with all of its fields written."""

    def __getstate__(self) -> dict[str, Any]:
        own: Any = self
        return {x.name: getattr(own, x.name) for x in fields(own)}
