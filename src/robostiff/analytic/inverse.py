"""Compliance as a formula: the inverse of a stiffness, and the stiffness of a compliance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from robostiff.analytic.budget import BUDGET, within
from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.definition import Condition, Definition, used_definitions
from robostiff.analytic.exact.exact_matrix import echelon
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.questions.rank import closed_matrix, matrix_by_entries
from robostiff.analytic.vectors.forms import inverse_in_steps
from robostiff.errors import InputError


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

    Examples
    --------
    A cantilever in the plane:

    >>> L, EA, EI, F = sp.symbols("L EA EI F", positive=True)
    >>> K = sp.Matrix([[EA / L, 0, 0], [0, 12 * EI / L**3, -6 * EI / L**2],
    ...                [0, -6 * EI / L**2, 4 * EI / L]])
    >>> (compliance_formula(K) * sp.Matrix([0, F, 0])).T
    Matrix([[0, F*L**3/(3*EI), F*L**2/(2*EI)]])
    """
    matrix = closed_matrix(K, "compliance")
    return within(budget, lambda: _inverse(matrix), "compliance")


@dataclass(frozen=True)
class ComplianceSteps(Formula):
    """Compliance as named steps.

    Attributes
    ----------
    name : str
    C : sympy.ImmutableMatrix
        (n, n), about the reference point, in symbols given or defined.
    definitions : tuple of Definition
        What names stand for, in the order in which they can be computed.
    conditions : tuple of Condition
        Under which the stiffness holds.
    meanings : mapping of str to str
        Of given symbols.
    """

    name: str
    C: sp.ImmutableMatrix
    definitions: tuple[Definition, ...]
    conditions: tuple[Condition, ...] = ()
    meanings: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

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
                "wrench", got=f"{len(entries)} entries", expected=f"{self.C.rows}: force and moment"
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

    Examples
    --------
    >>> from robostiff.analytic import Derivation
    >>> k, x = sp.symbols("k x", positive=True)
    >>> K = sp.ImmutableMatrix([[k, k * x, 0], [k * x, k * x**2 + k, 0], [0, 0, k]])
    >>> found = compliance_steps(Derivation("K_C", K, (), K))
    >>> found.substituted({"k": 2, "x": 3})
    Matrix([
    [   5, -3/2,   0],
    [-3/2,  1/2,   0],
    [   0,    0, 1/2]])
    """
    (K, *_), definitions = derivation.as_printed
    K, definitions = matrix_by_entries(K, definitions)
    n = K.rows
    rank = getattr(derivation, "general_rank", None)
    if (rank is not None and rank < n) or any(not any(K.row(i)) for i in range(n)):
        raise InputError(
            f"compliance of {derivation.name!r}",
            got=f"a stiffness of a rank below {n}",
            expected="full rank",
            hint="free_motion_formulas(...) gives its free motions",
        )
    steps = list(definitions)
    taken = {str(s) for d in steps for s in (d.symbol, *d.expression.free_symbols)}
    taken |= {str(s) for s in K.free_symbols}

    def named(released: int, i: int, j: int, value: Any) -> Any:
        if i == j == released or value.is_Atom or (-value).is_Atom:
            return value
        name = f"a{released + 1}_{i + 1}{j + 1}"
        while name in taken:
            name += "'"
        symbol = sp.Symbol(name, real=True)
        steps.append(Definition(symbol, value))
        return symbol

    C = inverse_in_steps(K, named)
    used = used_definitions(steps, [C])
    name = f"compliance of {derivation.name}"
    return ComplianceSteps(name, C, used, derivation.conditions, derivation.meanings)


def _inverse(K: Any) -> sp.ImmutableMatrix:
    n = K.rows
    field = ExactField(K.flat())
    one, zero = field.one, field.zero
    rows = [
        [*(field.element(K[i, j]) for j in range(n)), *(one if i == j else zero for j in range(n))]
        for i in range(n)
    ]
    reduced, pivots = echelon(field, rows)
    if pivots != list(range(n)):
        raise InputError(
            "compliance",
            got=f"a matrix of rank {sum(pivot < n for pivot in pivots)} of {n}",
            expected="one with an inverse",
            hint="free_motion_formulas(...) gives its free motions",
        )
    return sp.ImmutableMatrix(n, n, lambda i, j: field.expression(reduced[i][n + j]))
