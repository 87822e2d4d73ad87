"""What generated functions share, whatever their language: their words, and entries in order."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.entries import rows
from robostiff.analytic.export.program import FormulaProgram, Guard
from robostiff.spatial import Space

#: Integers up to this one are doubles.
LARGEST_EXACT = 2**53

#: Message of a generated function for one point.
NO_ANSWER = "the formula does not hold at these values"


def plain_text(name: str) -> str:
    """A name inside a comment or a string: printable, without quotes and signs of comments.

    Examples
    --------
    >>> plain_text('K "of"  a */ leg%')
    'K of a leg'
    """
    kept = "".join(c for c in name if c.isascii() and c.isprintable() and c not in '"*/\\?%$`#')
    return " ".join(kept.split()) or "without a plain name"


def title_of_function(derivation: Derivation | FormulaDerivative) -> str:
    """What a generated function computes, in words, for a string of Python."""
    if isinstance(derivation, FormulaDerivative):
        name, symbol = derivation.derivation.name, derivation.symbol.name
        return f"{_unquoted(name)} with its derivative by {_unquoted(symbol)}"
    return _unquoted(derivation.name)


def convention(size: int) -> str:
    """Order, point and units of a stiffness matrix of a size, in words."""
    space = Space.of_size(size)
    return (
        f"relates the twist ({', '.join(space.twist_order)}) of the reference point to the "
        f"wrench ({', '.join(space.wrench_order)}) about the reference point, F = K t: "
        "translation before rotation, force before moment, SI units."
    )


def where_it_holds(compute: FormulaProgram) -> str:
    """The arguments for which a generated function gives no answer, in words."""
    words = (
        "where the formula does not hold: where a denominator vanishes up to rounding, "
        "a radicand is negative, or K is not finite"
    )
    besides = dict.fromkeys(_unquoted(own) for own, _ in compute.conditions)
    return words + "".join(f"; unless {own}" for own in besides)


def _unquoted(name: str) -> str:
    kept = "".join(c for c in name if c.isprintable() and c not in '"\\')
    return " ".join(kept.split())


def filled(
    matrix: sp.ImmutableMatrix, place: Callable[[int, int], str], write: Callable[[sp.Expr], str]
) -> Iterator[tuple[str, str]]:
    """Targets and right-hand sides for the entries of a matrix of zeros that are not zero.

    Parameters
    ----------
    matrix : (n, n) matrix
    place : callable
        How the entry in row i and column j, from 0, is written.
    write : callable
        How an expression is written.
    """
    K_rows = rows(matrix)
    for i, row in enumerate(K_rows):
        for j, entry in enumerate(row):
            if entry == 0:
                continue
            copied = j < i and entry == K_rows[j][i]
            yield place(i, j), place(j, i) if copied else write(entry)


def guard_test(guard: Guard, write: Callable[[sp.Expr], str]) -> str:
    """The test that a sum does not cancel, in languages with ``abs``."""
    sizes = " + ".join(f"abs({write(term)})" for term in guard.terms)
    return f"abs({write(guard.value)}) > {guard.part}*({sizes})"


def tests_after(
    holds: str, finite: str, compute: FormulaProgram, write: Callable[[sp.Expr], str]
) -> list[str]:
    """What is assigned to the flag `holds`, one test after the other, in languages with ``&&``.

    Parameters
    ----------
    holds : str
        Name of the flag.
    finite : str
        The first test: results are finite.
    compute : FormulaProgram
    write : callable
        How an expression is written.
    """
    guards = [guard_test(guard, write) for guard in compute.guards]
    conditions = [f"{write(expression)} >= 0" for _, expression in compute.conditions]
    return [finite, *(f"{holds} && {test}" for test in (*guards, *conditions))]
