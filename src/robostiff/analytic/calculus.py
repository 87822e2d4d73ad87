"""Derivatives of formulas by lengths, angles and stiffnesses, and their inverses."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Self

import sympy as sp

from robostiff.analytic.budget import BUDGET, within
from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.closed import canonical
from robostiff.analytic.exact.definition import (
    Definition,
    NamedSteps,
    Unwritten,
    WrittenField,
    in_given_symbols,
    matrix_of,
    used_definitions,
)
from robostiff.analytic.exact.factors import echelon
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.rank import closed_matrix
from robostiff.analytic.substitution import Substitution, at_values
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen


@frozen
class FormulaDerivative(Formula):
    """A derivation together with its derivative with respect to a given symbol.

    Attributes
    ----------
    derivation : Formula
        What was differentiated.
    symbol : sympy.Symbol
    dK : sympy.ImmutableMatrix
        dK / dsymbol (n x n) [unit of K by unit of the symbol], in symbols given or defined.
    definitions : tuple of Definition
        Named intermediates of K and of dK in the order in which they can be computed; empty in
        closed form.
    """

    derivation: Formula
    symbol: sp.Symbol
    dK: WrittenField = WrittenField()
    definitions: tuple[Definition, ...] = ()  # pyright: ignore[reportIncompatibleMethodOverride]

    @classmethod
    def of(
        cls, whole: Formula, symbol: sp.Symbol, dK: Any, definitions: tuple[Definition, ...] = ()
    ) -> Self:
        """Of a formula, under its conditions."""
        name, conditions = derivative_name(whole.name, symbol), Unwritten(lambda: whole.conditions)
        about: Any = {"name": name, "conditions": conditions, "meanings": whole.meanings}
        return cls(whole, symbol, dK, definitions, **about)

    @property
    def K(self) -> sp.ImmutableMatrix:
        """The matrix that was differentiated (n x n)."""
        return self.derivation.matrices[0]

    @property
    def matrices(self) -> tuple[Any, ...]:
        """K and dK."""
        return self.K, self.dK

    @property
    def as_printed(self) -> tuple[tuple[Any, ...], tuple[Definition, ...]]:
        """Both in the names of a robot."""
        return self.in_names.matrices, self.in_names.definitions

    @property
    def is_of_legs(self) -> bool:  # pyright: ignore
        """Whether a negative stiffness says that the legs do not reach."""
        return self.derivation.is_of_legs

    def _at_values(self, put_in: Substitution) -> Self:
        derivation = self.derivation._at_values(put_in)
        definitions, dK = at_values((self.definitions, self.dK), put_in)
        return self.of(derivation, self.symbol, dK, definitions)

    @cached_property
    def in_names(self) -> FormulaDerivative:
        """The same in the names of a robot's formula, by the chain rule; itself without names."""
        named = self.derivation.named
        return self if named is None else _by_steps(named, self.symbol)


def differentiate(derivation: Formula, symbol: sp.Symbol | str) -> FormulaDerivative:
    """Derivative of a stiffness formula with respect to one of its given symbols.

    A closed form gives canonical fractions. Named steps are differentiated one by one, in forward
    mode: a step x of which the derivative is not a number or a symbol gets one further definition,
    dx_dR for the symbol R, right after its own. So are the names of a robot's formula, which are
    written out then: like K, its derivative is not multiplied out.

    Parameters
    ----------
    derivation : Formula
        A derivation, or one of its levels: `named`, `vectors`, `in_series`.
    symbol : str or sympy.Symbol
        Stands for the given symbol of its name, whatever its assumptions.

    Raises
    ------
    InputError
        When the symbol is not given but defined by a step, a closed form is not of exact
        arithmetic, or the legs decide some of the symbols.
    """
    known = {s.name: s for s in derivation.symbols}
    symbol = known.get(str(symbol), symbol)
    defined = {d.symbol.name for d in derivation.definitions}
    if not isinstance(symbol, sp.Symbol) or symbol.name in defined:
        raise InputError(
            "symbol to differentiate by",
            got=str(symbol),
            expected="one of " + ", ".join(map(str, derivation.symbols)),
        )
    if derivation.following:
        raise InputError(
            f"derivative of {derivation.name!r} by {symbol}",
            got=Words(
                f"a formula in {', '.join(derivation.following)}, which change with it as the legs "
                "close"
            ),
            expected="a formula in symbols that can be chosen freely",
            hint="name fewer symbols, such as the stiffnesses alone, so that these are numbers",
        )
    if not derivation.is_closed:
        return _by_steps(derivation, symbol)
    if derivation.named is None:
        dK = derivative_formula(derivation.matrices[0], symbol)
        return FormulaDerivative.of(derivation, symbol, dK)

    def write() -> Any:
        names = in_given_symbols(found.in_names.definitions)
        return found.in_names.dK.xreplace(names)

    found = FormulaDerivative.of(derivation, symbol, Unwritten(write))
    return found


def derivative_formula(K: Any, symbol: sp.Symbol) -> sp.ImmutableMatrix:
    """Derivative of a matrix of formulas, every entry a canonical fraction."""
    return canonical(matrix_of(sp.Matrix(K), lambda x: _rate(x, {symbol: sp.Integer(1)})))


def derivative_name(name: str, symbol: sp.Symbol) -> str:
    """Name of a derivative, such as dK_1_11_dR of K_1_11."""
    return f"d{name}_d{symbol.name}"


def _by_steps(derivation: Formula, symbol: sp.Symbol) -> FormulaDerivative:
    """Forward mode: the chain rule, one step after the other."""
    names = (*derivation.symbols, *(d.symbol for d in derivation.definitions))
    steps, rates = NamedSteps(map(str, names)), {symbol: sp.Integer(1)}
    for definition in derivation.definitions:
        steps.definitions.append(definition)
        expression: Any = definition.expression
        if expression.is_Pow and expression.exp == sp.S.Half:
            change = sp.S.Half * _rate(expression.base, rates) / definition.symbol
        else:
            change = _rate(expression, rates)
        if change != 0:
            name = derivative_name(definition.symbol.name, symbol)
            rates[definition.symbol] = steps.named(name, change)
    dK = matrix_of(derivation.matrices[0], lambda x: _rate(x, rates))
    return FormulaDerivative.of(derivation, symbol, dK, tuple(steps.definitions))


def _rate(expression: Any, rates: dict[Any, Any]) -> Any:
    """Rate of an expression by the rates of its symbols; SymPy would ask each symbol anew."""
    if not expression.args or expression.free_symbols.isdisjoint(rates):
        return rates.get(expression, sp.Integer(0))
    if expression.is_Add:
        return sp.Add(*(_rate(term, rates) for term in expression.args))
    if expression.is_Mul:
        changes = [(_rate(factor, rates), i) for i, factor in enumerate(expression.args)]
        args = expression.args
        return sp.Add(*(sp.Mul(*args[:i], *args[i + 1 :], x) for x, i in changes if x != 0))
    if expression.is_Pow and expression.exp.is_Number:
        base, exponent = expression.args
        return exponent * base ** (exponent - 1) * _rate(base, rates)
    if isinstance(expression, sp.Function):
        changes = [_rate(argument, rates) for argument in expression.args]
        parts = [(expression.fdiff(i), x) for i, x in enumerate(changes, start=1) if x != 0]
        return sp.Add(*(part * x for part, x in parts))
    moving = sorted(expression.free_symbols & rates.keys(), key=str)
    return sp.Add(*(sp.diff(expression, s) * rates[s] for s in moving))


def compliance_formula(K: Any, budget: float | None = BUDGET) -> sp.ImmutableMatrix:
    """Compliance C = K^-1 as a formula, every entry a canonical fraction.

    The deflection under a wrench w at the reference point is C w. The same function gives the
    stiffness K = C^-1 of a compliance.

    Parameters
    ----------
    K : (n, n) matrix of SymPy expressions, or Derivation in closed form
        Symmetric.
    budget : float or None
        Seconds of computing; None for no limit.

    Raises
    ------
    InputError
        For a matrix without an inverse, and for a derivation in steps: `compliance_steps` has its
        compliance.
    OutOfTimeError
        When it does not end in time.
    """
    matrix = closed_matrix(K, "compliance")
    n = matrix.rows

    def inverse() -> sp.ImmutableMatrix:
        field = ExactField(matrix.flat())
        one, zero = field.one, field.zero
        units = [[one if i == j else zero for j in range(n)] for i in range(n)]
        rows = [[*map(field.element, matrix.row(i)), *units[i]] for i in range(n)]
        reduced, pivots, _ = echelon(field, rows)
        if pivots != list(range(n)):
            raise InputError(
                "compliance",
                got=Words(f"a matrix of rank {sum(pivot < n for pivot in pivots)} of {n}"),
                expected="one with an inverse",
                hint="free_motion_formulas(...) gives its free motions",
            )
        return sp.ImmutableMatrix(n, n, lambda i, j: field.expression(reduced[i][n + j]))

    return within(budget, inverse, "compliance")


@frozen
class ComplianceSteps(Formula):
    """Compliance as named steps."""

    C: sp.ImmutableMatrix  #: (n, n), about the reference point, in symbols given or defined
    #: what names stand for, in the order in which they can be computed
    definitions: tuple[Definition, ...] = ()  # pyright: ignore[reportIncompatibleMethodOverride]

    is_stiffness = False

    @property
    def matrices(self) -> tuple[Any, ...]:
        """C alone."""
        return (self.C,)

    def deflection(self, wrench: Sequence[Any]) -> sp.ImmutableMatrix:
        """Twist C w of the reference point under a wrench there (n, 1), in the same names.

        Parameters
        ----------
        wrench : sequence of n numbers or formulas
            Force and moment, such as ``(0, 0, F, 0, 0, 0)``.

        Raises
        ------
        InputError
            When it has another length.
        """
        entries = [sp.sympify(x) for x in wrench]
        if len(entries) != self.C.rows:
            raise InputError(
                "wrench",
                got=Words(f"{len(entries)} entries"),
                expected=f"{self.C.rows}: force and moment",
            )
        return sp.ImmutableMatrix(self.C * sp.Matrix(entries))


def compliance_steps(derivation: Formula) -> ComplianceSteps:
    """Compliance C = K^-1 of any derivation as named steps, which never explode.

    Coordinates are released one after the other. Each pivot is the stiffness against one of them,
    those released before being free to move: it is positive wherever K has full rank, so that the
    steps hold wherever C exists.

    Parameters
    ----------
    derivation : Formula
        In closed form, of which entries get names, in steps, or in vectors.

    Raises
    ------
    InputError
        When K has not full rank.
    """
    (K, *_), definitions = derivation.as_printed
    n = K.rows
    rank = derivation.general_rank
    if (rank is not None and rank < n) or any(not any(K.row(i)) for i in range(n)):
        raise InputError(
            f"compliance of {derivation.name!r}",
            got=Words(f"a stiffness of a rank below {n}"),
            expected="full rank",
            hint="free_motion_formulas(...) gives its free motions",
        )
    steps = NamedSteps(map(str, K.free_symbols), definitions)
    C = steps.inverse(steps.entries(K, "K"), "a")
    used = used_definitions(steps.definitions, [C])
    about: Any = {"conditions": derivation.conditions, "meanings": derivation.meanings}
    return ComplianceSteps(C, used, name=f"compliance of {derivation.name}", **about)
