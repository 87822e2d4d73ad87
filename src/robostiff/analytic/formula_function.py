"""A formula as a function of numbers and arrays, with a guard where it does not hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.definition import WrittenWhole
from robostiff.analytic.export.languages_of_code import source_of_values
from robostiff.analytic.export.program import program
from robostiff.errors import InputError, NoAnswerError
from robostiff.frozen import frozen
from robostiff.spatial.quantities import as_floats, is_pint, si_number

_NOT_FINITE = "a denominator vanishes, or a radicand is negative"
_CANCELLED = "no denominator vanishes up to rounding"


@frozen
class FormulaFunction(WrittenWhole):
    """K, or K and dK, at numbers or at arrays that broadcast.

    It is called with its arguments in order or by name, and returns arrays (..., n, n). Where the
    formula does not hold it raises; `holds` says where that is.

    Attributes
    ----------
    name : str
        Of the formula.
    arguments : tuple of str
        Names in order, in SI units; quantities of pint are converted.
    source : str
        What it computes, as Python.
    conditions : tuple of (str, str)
        Words, and ">" or ">=", of what must be positive, or not negative, where it holds.
    count : int
        How many matrices it returns.
    positive : frozenset of str
        Arguments for which the formula was made as positive symbols.
    """

    name: str
    arguments: tuple[str, ...]
    source: str
    conditions: tuple[tuple[str, str], ...]
    count: int
    positive: frozenset[str] = frozenset()

    def __call__(self, *values: Any, **named: Any) -> Any:
        """K (..., n, n), or the pair K, dK of a derivative.

        Raises
        ------
        NoAnswerError
            Where a denominator vanishes up to rounding, a radicand is negative, or a condition of
            the formula fails.
        InputError
            When an argument is missing, or is no array of finite numbers, or is negative where the
            formula was made for a positive symbol.
        """
        given = self._numbers(values, named)
        for name, array in zip(self.arguments, given, strict=True):
            if name in self.positive and np.any(array < 0):
                raise InputError(
                    f"value of {name}",
                    got=float(array.min()),
                    expected="a positive number",
                    hint="the formula was made for a positive symbol",
                )
        *found, finite, margins = self._run(*given)
        holds = self._holds(finite, margins)
        if not np.all(holds):
            place = tuple(int(i) for i in np.argwhere(~holds)[0])
            at = [np.broadcast_to(array, holds.shape)[place] for array in given]
            listed = ", ".join(f"{n} = {x:.6g}" for n, x in zip(self.arguments, at, strict=True))
            where = f", first at {list(place)}" if place else ""
            words = (
                f"the formula {self.name} does not hold at {np.sum(~holds)} of {holds.size} points"
            )
            reason = _NOT_FINITE
            for (condition, sign), margin in zip(self.conditions, margins, strict=True):
                value = np.broadcast_to(margin, holds.shape)[place]
                if value < 0 or (value == 0 and sign == ">"):
                    reason = f"it holds where {condition}, and {value:.3g} should be {sign} 0 there"
            advice = "; holds(...) says where" if place else ""
            raise NoAnswerError(
                f"{words}{where}{f': {listed}' if listed else ''}; {reason}{advice}"
            )
        return found[0] if self.count == 1 else tuple(found)

    def holds(self, *values: Any, **named: Any) -> np.ndarray:
        """Where the formula holds: True or False for each of the points."""
        return self._holds(*self._run(*self._numbers(values, named))[-2:])

    def _holds(self, finite: Any, margins: Sequence[Any]) -> np.ndarray:
        holds = np.asarray(finite)
        for (_, sign), margin in zip(self.conditions, margins, strict=True):
            holds = holds & ((margin > 0) if sign == ">" else (margin >= 0))
        return holds

    @cached_property
    def _run(self) -> Callable[..., tuple[Any, ...]]:
        module: dict[str, Any] = {}
        # Its writer admits only functions of the vocabulary, and identifiers that it made.
        exec(compile(self.source, f"<formula {self.name}>", "exec"), module)  # noqa: S102
        return module["formula"]

    def _numbers(self, values: Sequence[Any], named: dict[str, Any]) -> list[np.ndarray]:
        count, given = len(values), dict(zip(self.arguments, values, strict=False))
        twice = [name for name in named if name in given]
        unknown = [name for name in named if name not in self.arguments]
        missing = [name for name in self.arguments if name not in given and name not in named]
        if count > len(self.arguments) or twice or unknown or missing:
            got = f"{count} values" + f" and {', '.join(named)}" * bool(named)
            raise InputError(
                f"arguments of the formula {self.name}",
                got=got,
                expected=", ".join(self.arguments) or "none",
            )
        given |= named
        arrays = [
            as_floats(
                f"value of {name}",
                si_number(f"value of {name}", value) if is_pint(value) else value,
                "a number, or an array of numbers",
            )
            for name, value in ((name, given[name]) for name in self.arguments)
        ]
        try:
            np.broadcast_shapes(*(array.shape for array in arrays))
        except ValueError:
            shapes = [f"{n} {a.shape}" for n, a in zip(self.arguments, arrays, strict=True)]
            raise InputError(
                f"arguments of the formula {self.name}",
                got=", ".join(shapes),
                expected="shapes that broadcast",
            ) from None
        return arrays


def formula_function(derivation: Formula, *arguments: Any) -> FormulaFunction:
    """The matrix of a formula as a function of numbers and of arrays that broadcast, quickly.

    Parameters
    ----------
    derivation : Formula
    *arguments : str or Symbol
        The symbols in the order of the function's arguments; alphabetical when left out.

    Returns
    -------
    FormulaFunction
        It raises where the formula does not hold.

    Raises
    ------
    InputError
        When a symbol of the formula is not among them, or another name is.
    """
    compute = program(derivation, plain=True)
    names = [symbol.name for symbol in compute.arguments]
    order = [x.name if isinstance(x, sp.Symbol) else str(x) for x in arguments] or names
    if sorted(order) != sorted(names):
        raise InputError(
            f"arguments of the formula {derivation.name!r}",
            got=", ".join(order),
            expected=f"each of {', '.join(names)} once" if names else "none",
        )
    source = source_of_values(compute, [names.index(name) for name in order])
    positive = frozenset(x.name for x in compute.arguments if x.is_nonnegative)
    conditions = [(_CANCELLED, ">") for _ in compute.guards]
    conditions += [(words, sign) for words, _, sign in compute.conditions]
    count = len(compute.results)
    return FormulaFunction(
        derivation.name, tuple(order), source, tuple(conditions), count, positive
    )
