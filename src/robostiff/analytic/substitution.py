"""Values in place of the symbols of formulas: numbers, quantities or other formulas."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.definition import Definition, Unwritten
from robostiff.errors import InputError, Words
from robostiff.spatial.formula import exact_number, is_formula
from robostiff.spatial.quantities import is_pint, si_number

_GUARD_DIGITS = 15
_CONDITION_DIGITS = 30
_LONGEST = 3000  # terms of an exact number
_UNDEFINED = (sp.zoo, sp.nan, sp.oo, -sp.oo)


def values_of_symbols(
    symbols: Iterable[sp.Symbol], values: Mapping[Any, Any], subject: str
) -> dict[sp.Symbol, sp.Expr]:
    """Values by symbol, from values by name or by symbol.

    `symbols`: those of the formula. A key stands for the symbols of its name, whatever their
    assumptions. `values`: mapping of str or Symbol to numbers, quantities or formulas: numbers
    are in SI units; quantities of pint are converted. Floats stay floats. `subject`: what the
    symbols are those of, in words.

    Raises
    ------
    InputError
        When a name is none of theirs, or a value is no finite real number or formula, or has the
        wrong sign for its symbol.
    """
    by_name: dict[str, list[sp.Symbol]] = {}
    for symbol in symbols:
        by_name.setdefault(symbol.name, []).append(symbol)
    first = {name: same[0] for name, same in by_name.items()}
    chosen = {}
    for key, given in values.items():
        if str(key) not in by_name:
            raise InputError(
                f"symbol of {subject}",
                got=str(key),
                expected=", ".join(by_name) or "none, as it has no symbols",
            )
        for symbol in by_name[str(key)]:
            value = si_number(f"value of {symbol}", given) if is_pint(given) else given
            try:
                found: Any = exact_number(value)
            except InputError as error:
                raise InputError(
                    f"value of {symbol}", got=value, expected="a finite real number or a formula"
                ) from error
            if isinstance(value, sp.Float):
                found = value
            elif not (is_formula(value) or isinstance(value, int | np.integer)):
                found = sp.Float(float(value))
            if found.has(*_UNDEFINED) or found.is_real is False:
                raise InputError(
                    f"value of {symbol}", got=str(value), expected="a finite real number"
                )
            for sign, word in ((1, "positive"), (-1, "negative")):
                if (sign * symbol).is_nonnegative and (sign * found).is_negative:
                    raise InputError(
                        f"value of {symbol}",
                        got=str(value),
                        expected=f"a {word} number",
                        hint=f"the formula was made for a {word} symbol",
                    )
            chosen[symbol] = found.xreplace({s: first.get(s.name, s) for s in found.free_symbols})
    return chosen


def refuse_names_of_steps(values: Mapping[Any, Any], definitions: Iterable[Any]) -> None:
    """Raise where a formula that is put in has a symbol with the name of a step."""
    names = {d.symbol.name for d in definitions}
    for symbol, formula in values.items():
        taken = names & {str(s) for s in formula.free_symbols}
        if taken:
            raise InputError(
                f"value of {symbol}",
                got=str(formula),
                expected=f"a formula without {', '.join(sorted(taken))}, which name steps",
            )


class Substitution:
    """Puts values into expressions, from the leaves to the root.

    Every number on the way becomes one float as soon as a float takes part in it. SymPy's own
    ``subs`` keeps products such as 0.3 sqrt(3) as they are, and its tests for signs then evaluate
    ever larger expressions again and again. Floats are computed with more digits than they have.
    Without floats, numbers are exact, or have `digits`, 0 for all.
    """

    def __init__(self, values: Mapping[sp.Symbol, Any], digits: int = 0) -> None:
        floats = [x for value in values.values() for x in sp.sympify(value).atoms(sp.Float)]
        self.values = values
        self._digits = min((_digits(x) for x in floats), default=digits)
        self._sizes: dict[Any, int] = {}
        self._known: dict[Any, Any] = {s: self._longer(sp.sympify(v)) for s, v in values.items()}

    def definitions(
        self, definitions: Iterable[Any], *, with_numbers: bool = False, are_put_in: bool = False
    ) -> dict[sp.Symbol, Any]:
        """Named steps with the values in them, by symbol; those that become numbers are put in.

        `with_numbers`: whether those stay that were numbers before, such as E I of a beam;
        `are_put_in`: whether all of them are put in.

        Raises
        ------
        InputError
            When the exact value of one that is put in grows too long.
        """
        kept = {}
        for definition in definitions:
            value = self._put_in(definition.expression)
            if self._digits and not (value.is_Atom or value.free_symbols):
                value = value.evalf(self._working)  # beside floats: it would grow from step to step
            size = self._size(definition.expression) if are_put_in else 0
            self._sizes[definition.symbol] = size
            if size > _LONGEST and not value.is_Atom:
                raise InputError(
                    "exact values of named steps",
                    got=Words(f"{size} terms for {definition.symbol}"),
                    expected="values of all symbols, as floats or numbers without nested roots",
                    hint="write floats, or evalf(50) for more digits; subs(...) keeps steps",
                )
            stays = with_numbers and not definition.expression.free_symbols
            if are_put_in or ((value.is_Atom or value.is_Rational) and not stays):
                self._known[definition.symbol] = value
            else:
                kept[definition.symbol] = replace(definition, expression=self._shorter(value))
        return kept

    def _size(self, expression: Any) -> int:
        """Terms of a step with the steps before it written out."""
        if not expression.args:
            known = self._known.get(expression)
            return 1 if known is None or known.is_Atom else self._sizes.get(expression, 1)
        return 1 + sum(map(self._size, expression.args))

    def __call__(self, expression: Any) -> Any:
        """The expression with the values in it."""
        return self._shorter(self._put_in(expression))

    def matrix(self, matrix: Any) -> sp.ImmutableMatrix:
        """The same for every entry of a matrix."""
        return sp.ImmutableMatrix(matrix.rows, matrix.cols, [self(x) for x in matrix.flat()])

    def _put_in(self, expression: Any) -> Any:
        found = self._known.get(expression)
        if found is not None:
            return found
        if not expression.args:
            return self._longer(expression)
        parts = [self._put_in(part) for part in expression.args]
        changed = any(new is not old for new, old in zip(parts, expression.args, strict=True))
        value: Any = expression.func(*parts) if changed else expression
        is_number = isinstance(value, sp.Expr) and not value.free_symbols
        if is_number and any(part.is_Float for part in value.args):
            value = value.evalf(self._working)
        self._known[expression] = value
        return value

    @property
    def _working(self) -> int:
        return self._digits + _GUARD_DIGITS

    def _longer(self, value: Any) -> Any:
        if not self._digits:
            return value
        longer = {x: sp.Float(x, self._working) for x in value.atoms(sp.Float)}
        return value.xreplace(longer) if longer else value

    def _shorter(self, value: Any) -> Any:
        if not self._digits:
            return value
        if value.is_Float:
            return sp.Float(value, self._digits)
        return value.xreplace({x: sp.Float(x, self._digits) for x in value.atoms(sp.Float)})


def at_values(part: Any, put_in: Substitution, *, with_numbers: bool = False) -> Any:
    """A formula with values put in, its named steps first; what is not yet written stays so.

    `with_numbers`: whether names stay that were those of numbers before.
    """

    def change(x: Any) -> Any:
        # A module's formula has names of its own.
        own = Substitution(put_in.values) if hasattr(x, "is_of_legs") else put_in
        return at_values(x, own, with_numbers=with_numbers)

    if isinstance(part, sp.Basic | sp.MatrixBase):
        return put_in.matrix(part) if isinstance(part, sp.MatrixBase) else put_in(part)
    if isinstance(part, dict):
        return {name: change(x) for name, x in part.items()}
    if isinstance(part, tuple):
        is_steps = bool(part) and isinstance(part[0], Definition)
        steps = put_in.definitions(part, with_numbers=with_numbers) if is_steps else {}
        return tuple(steps.values() if is_steps else map(change, part))
    if not is_dataclass(part) or isinstance(part, type):
        return part
    names = sorted((f.name for f in fields(part)), key=lambda x: x not in ("definitions", "names"))
    lazy = {name for name in names if isinstance(part.__dict__.get(name), Unwritten)}
    found = {x: change(getattr(part, x)) for x in names if x not in lazy}
    later = {x: Unwritten(lambda x=x: change(getattr(part, x))) for x in lazy}
    return replace(part, **found, **later)


def _digits(number: Any) -> int:
    return max(1, round(number._prec * 0.30103 - 0.9))


def refuse_undefined(expressions: Iterable[Any], subject: str) -> None:
    """Raise where a value is infinite, undefined or not real."""
    for expression in expressions:
        if expression.has(*_UNDEFINED) or (
            not expression.free_symbols and expression.has(sp.I) and expression.is_real is False
        ):
            raise InputError(
                f"{subject} at these values",
                got=str(expression),
                expected="a real finite number: a denominator vanishes, or a radicand is negative",
                hint="choose other values; the questions of rank and free motions say which are "
                "singular",
            )


def refuse_negative(K: Any, subject: str) -> None:
    """Raise where K has a negative diagonal: a leg does not reach, and its root cancels in K."""
    for entry in K.diagonal():
        if not entry.free_symbols and entry.is_negative:
            raise InputError(
                f"{subject} at these values",
                got=Words(f"a negative stiffness {entry.evalf(6)}"),
                expected="values at which the legs reach the platform",
            )


def refuse_failing(conditions: Iterable[Any], put_in: Substitution, subject: str) -> None:
    """Raise where a condition of a formula does not hold; those that keep symbols are left open."""
    for condition in conditions:
        value = put_in(condition.expression)
        if value.free_symbols:
            continue
        number = value.evalf(_CONDITION_DIGITS)
        if not number.is_real or number <= 0:
            raise InputError(
                f"{subject} at these values",
                got=Words(f"a condition that fails: {number.evalf(6)} is not positive"),
                expected=f"values at which {condition.words}",
            )
