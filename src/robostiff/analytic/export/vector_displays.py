"""Expressions of vectors in a language of mathematics."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robostiff.analytic.vector_expressions import (
    Coordinates,
    Cross,
    Dot,
    Norm,
    Over,
    Stacked,
    Sum,
    Times,
    Turned,
    Turns,
    Vector,
)

if TYPE_CHECKING:
    from robostiff.analytic.export.displays import MathLanguage


def written_vector(expression: Any, language: MathLanguage) -> str:
    """An expression of vectors in a language."""

    def write(part: Any) -> str:
        return written_vector(part, language)

    def half(part: Any) -> str:
        return language.number(0) if part is None else write(part)

    def factor(part: Any) -> str:
        return f"({write(part)})" if isinstance(part, Sum | Turned | Times | Cross) else write(part)

    match expression:
        case Vector(name):
            found = language.matrix_name(name)
        case Coordinates(entries):
            found = f"({', '.join(map(language.breaks.write, entries))})"
        case Sum(terms):
            signed = [(" - " if sign < 0 else " + ") + write(term) for sign, term in terms]
            found = "".join(signed).removeprefix(" + ").replace(" - ", "-", terms[0][0] < 0)
        case Turned(rotation, vector):
            found = f"{language.matrix_name(rotation)} {factor(vector)}"
        case Over(vector, scalar):
            found = language.fraction(write(vector), write(scalar))
        case Times(scalar, vector):
            number = language.breaks.write(scalar)
            number = f"({number})" if scalar.is_Add else number
            found = f"{number} {factor(vector)}"
        case Cross(left, right):
            found = f"{factor(left)} {language.times} {factor(right)}"
        case Dot(left, right):
            found = f"{factor(left)} {language.dot} {factor(right)}"
        case Norm(vector):
            found = language.norm(write(vector))
        case Stacked(force, moment):
            found = language.matrix([[half(force)], [half(moment)]])
        case Turns(turns):
            parts = [f"{language.matrix_name(f'R_{axis}')}({write(x)})" for axis, x in turns]
            found = " ".join(parts)
        case _:
            found = language.breaks.write(expression)
    return found
