"""What an exported derivative says, in order."""

from __future__ import annotations

from robostiff.analytic.combinations import name_combinations
from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import Derivative, derivative_name
from robostiff.analytic.export.matrix_names import MatrixName, Names
from robostiff.analytic.export.outline import (
    Block,
    Equations,
    Heading,
    MatrixEquation,
    Nomenclature,
    Words,
    outline,
)
from robostiff.analytic.export.readable import factored_matrix, readable_matrix
from robostiff.analytic.export.robot_outline import robot_outline
from robostiff.analytic.robot_derivation import RobotDerivation
from robostiff.errors import InputError


def outline_of(derivation: Derivation | Derivative) -> tuple[Block, ...]:
    """The blocks of an exported derivation, of that of a robot, or of a derivative."""
    if isinstance(derivation, Derivative):
        return derivative_outline(derivation)
    if isinstance(derivation, RobotDerivation):
        return robot_outline(derivation)
    return outline(derivation)


def refuse_derivative(derivation: Derivation) -> None:
    """For languages in which derivatives are not written.

    Raises
    ------
    InputError
        When it is a derivative.
    """
    if isinstance(derivation, Derivative):
        raise InputError(
            "derivation",
            got=f"the derivative {derivation.name}",
            expected="a derivation",
            hint="python_function and the printed forms write derivatives",
        )


def derivative_outline(derivative: Derivative) -> tuple[Block, ...]:
    """Definitions, the derivative of the stiffness matrix, and its nomenclature.

    Examples
    --------
    >>> import sympy as sp
    >>> from robostiff.analytic.derivatives import differentiate
    >>> k, L = sp.symbols("k L")
    >>> K = sp.ImmutableMatrix(sp.diag(k / L, 0, 0))
    >>> [type(b).__name__ for b in derivative_outline(differentiate(Derivation("K", K, (), K), L))]
    ['Heading', 'Words', 'Heading', 'MatrixEquation', 'Nomenclature']
    """
    names, symbol = Names(derivative.derivation), derivative.symbol
    result = MatrixName(derivative_name(names.result.name, symbol))
    definitions, dK = derivative.definitions, derivative.dK
    if derivative.is_closed:
        named = name_combinations(dK, names.given)
        definitions, dK = named.definitions, named.matrix
    form = "in closed form" if derivative.is_closed else "in named steps, each with its derivative"
    title = f"Derivative of the stiffness matrix {names.result.name} by {symbol.name}"
    blocks: list[Block] = [Heading(title, level=1), Words(f"Derivative {form}.")]
    blocks.append(Heading("Result"))
    if definitions:
        blocks.append(Equations(tuple((d.symbol.name, d.expression) for d in definitions)))
    factor, rest = factored_matrix(dK)
    entries = names.entries_of(result)
    blocks.append(MatrixEquation(result, factor, rest, readable_matrix(dK), entries))
    meaning = f"derivative of {names.result.name} by {symbol.name}, all other given symbols held"
    blocks.append(Nomenclature((((result,), meaning), (names.given, "given"))))
    return tuple(blocks)
