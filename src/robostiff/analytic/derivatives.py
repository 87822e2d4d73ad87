"""Derivatives of stiffness formulas by lengths, angles and stiffnesses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import sympy as sp

from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.closed import canonical
from robostiff.analytic.exact.definition import (
    Definition,
    Unwritten,
    WrittenField,
    in_given_symbols,
)
from robostiff.analytic.substitution import Substitution, at_values
from robostiff.errors import InputError


@dataclass(frozen=True)
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
    definitions: tuple[Definition, ...] = ()

    @property
    def name(self) -> str:
        """Name of the derivative, such as dK_C_dR."""
        return derivative_name(self.derivation.name, self.symbol)

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
        return replace(self, derivation=derivation, dK=dK, definitions=definitions)

    @cached_property
    def in_names(self) -> FormulaDerivative:
        """The same in the names of a robot's formula, by the chain rule; itself without names."""
        named = getattr(self.derivation, "named", None)
        return self if named is None else _by_steps(named, self.symbol)

    @property
    def conditions(self) -> tuple[Any, ...]:
        """What must hold besides regular denominators and roots."""
        return self.derivation.conditions

    @property
    def meanings(self) -> Mapping[str, str]:
        """Of given symbols, in words."""
        return self.derivation.meanings


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

    Examples
    --------
    >>> from robostiff.analytic import Derivation
    >>> E, I, L = sp.symbols("E I L", positive=True)
    >>> K = sp.ImmutableMatrix(sp.diag(3 * E * I / L**3, 0, 0))
    >>> differentiate(Derivation("K_C", K, (), K), L).dK[0, 0]
    -9*E*I/L**4
    """
    own = {s.name: s for s in derivation.symbols}
    symbol = own.get(str(symbol), symbol)
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
            got=f"a formula in {', '.join(derivation.following)}, which change with it as the legs "
            "close",
            expected="a formula in symbols that can be chosen freely",
            hint="name fewer symbols, such as the stiffnesses alone, so that these are numbers",
        )
    if not derivation.is_closed:
        return _by_steps(derivation, symbol)
    if getattr(derivation, "named", None) is None:
        return FormulaDerivative(
            derivation, symbol, derivative_formula(derivation.matrices[0], symbol)
        )

    def write() -> Any:
        names = in_given_symbols(found.in_names.definitions)
        return found.in_names.dK.xreplace(names)

    found = FormulaDerivative(derivation, symbol, Unwritten(write))
    return found


def derivative_formula(K: Any, symbol: sp.Symbol) -> sp.ImmutableMatrix:
    """Derivative of a matrix of formulas, every entry a canonical fraction.

    Examples
    --------
    >>> R, h, phi = sp.symbols("R h phi", positive=True)
    >>> derivative_formula(sp.Matrix([[sp.sqrt(R**2 + h**2), sp.cos(phi)]]), h)
    Matrix([[h/sqrt(R**2 + h**2), 0]])
    """
    return canonical(_rates(sp.Matrix(K), {symbol: sp.Integer(1)}))


def derivative_name(name: str, symbol: sp.Symbol) -> str:
    """Name of a derivative, such as dK_1_11_dR of K_1_11."""
    return f"d{name}_d{symbol.name}"


def _by_steps(derivation: Formula, symbol: sp.Symbol) -> FormulaDerivative:
    """Forward mode: the chain rule, one step after the other."""
    taken = {s.name for s in derivation.symbols} | {d.symbol.name for d in derivation.definitions}
    rates: dict[Any, Any] = {symbol: sp.Integer(1)}
    definitions: list[Definition] = []

    for definition in derivation.definitions:
        definitions.append(definition)
        expression: Any = definition.expression
        if expression.is_Pow and expression.exp == sp.S.Half:
            change = _rate(expression.base, rates) / (2 * definition.symbol)
        else:
            change = _rate(expression, rates)
        if change == 0:
            continue
        if change.is_Atom or (-change).is_Atom:
            rates[definition.symbol] = change
            continue
        name = derivative_name(definition.symbol.name, symbol)
        while name in taken:
            name = f"{name}'"
        taken.add(name)
        rates[definition.symbol] = sp.Symbol(name)
        definitions.append(Definition(rates[definition.symbol], change))
    dK = _rates(derivation.matrices[0], rates)
    return FormulaDerivative(derivation, symbol, dK, tuple(definitions))


def _rates(K: Any, rates: dict[Any, Any]) -> sp.ImmutableMatrix:
    """Rates of the entries of a matrix; those that differ by a sign are one."""
    found: dict[Any, Any] = {}
    for entry in K:
        if entry not in found:
            found[entry] = -found[-entry] if -entry in found else _rate(entry, rates)
    return sp.ImmutableMatrix(K.rows, K.cols, [found[entry] for entry in K])


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
