"""Trigonometry in its shortest form: sums of angles, and sines with a phase."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import sympy as sp
from sympy.core.cache import cacheit
from sympy.simplify.fu import TR8, TR10i

from robostiff.analytic.exact.definition import count_of

# Degree in sine and cosine, and operations, beyond which no shorter form is looked for.
_DEGREE = 4
_LONGEST = 60
# Phases are multiples of this part of a turn about pi: 15 degrees.
_PARTS = 12
# What stands for the sine and cosine of one angle.
_SINE, _COSINE = sp.Dummy("s"), sp.Dummy("c")


def shortest_trigonometry(expression: Any, longest: int = _LONGEST) -> Any:
    """An expression or matrix with sines and cosines in their shortest form.

    Sums over multiples of one angle become sines and cosines with a phase,
    ``a sin x + b cos x = sqrt(a^2 + b^2) sin(x + phi)``, where the phase is a multiple of 15
    degrees; ``cos a cos b - sin a sin b`` becomes ``cos(a + b)``. What would be longer stays, and
    so do sums with more than the `longest` operations.
    """
    if isinstance(expression, sp.MatrixBase):
        entries = [_shortest(x, longest) for x in expression.flat()]
        return sp.ImmutableMatrix(*expression.shape, entries)
    return _shortest(expression, longest)


@cacheit
def _shortest(expression: Any, longest: int) -> Any:
    if not expression.has(sp.sin, sp.cos):
        return expression
    expression = _with_sums_of_angles(expression)
    if count_of(expression) > longest:
        return expression
    found = _with_sums_of_angles(sp.factor_terms(_walked(expression)))
    return _first_shortest([expression, found])


def _with_sums_of_angles(expression: Any) -> Any:
    pairs = [
        part
        for part in sp.ordered(expression.atoms(sp.Add))
        if len(part.args) == 2 and all(len(x.atoms(sp.sin, sp.cos)) == 2 for x in part.args)
    ]
    for pair in pairs:
        if len({x.args[0] for x in pair.atoms(sp.sin, sp.cos)}) == 2:
            expression = expression.xreplace({pair: TR10i(pair)})
    return expression


def _first_shortest(forms: list[Any]) -> Any:
    """That of the fewest operations; of several, the one that prints shortest."""
    least = min(map(count_of, forms))
    found = [x for x in dict.fromkeys(forms) if count_of(x) == least]
    return found[0] if len(found) == 1 else min(found, key=lambda x: len(str(x)))


@cacheit
def _walked(expression: Any) -> Any:
    """The same with each sum and product in harmonics where that is shorter, inner ones first."""
    if not expression.has(sp.sin, sp.cos) or isinstance(expression, sp.sin | sp.cos):
        return expression
    walked = expression.func(*(_walked(part) for part in expression.args))
    both = [f for f in expression.args if isinstance(f.as_base_exp()[0], sp.sin | sp.cos)]
    if not isinstance(expression, sp.Add) and len(both) < 2:
        return walked
    angles = {f.args[0] for f in expression.atoms(sp.sin, sp.cos)}
    forms = [walked]
    if isinstance(expression, sp.Add) and len(angles) > 1:
        forms.append(TR10i(sp.expand(expression)))
    for x in sorted((x for x in angles if isinstance(x, sp.Symbol)), key=str):
        shortest = _first_shortest(forms)
        for form in dict.fromkeys([expression, shortest]):
            forms += _in_harmonics(form, x)
    return _first_shortest(forms)


def _in_harmonics(expression: Any, x: sp.Symbol) -> Iterator[Any]:
    """The expression in sines and cosines of multiples of x, if it is a polynomial in these."""
    plain = expression.xreplace({sp.sin(x): _SINE, sp.cos(x): _COSINE})
    if plain.has(x) or not plain.is_polynomial(_SINE, _COSINE):
        return
    # For each power of sine and cosine the numbers before the products of symbols.
    terms: dict[tuple[int, int], _Numbers] = {}
    for powers, before in sp.Poly(plain, _SINE, _COSINE).terms():
        numbers_of = terms.setdefault((powers[0], powers[1]), {})
        for term in sp.Add.make_args(sp.expand(before)):
            numbers, symbols = term.as_independent(*term.free_symbols, as_Add=False)
            numbers_of[symbols] = numbers_of.get(symbols, 0) + numbers
    turning = {powers for powers in terms if any(powers)}
    if max(map(sum, terms), default=0) > _DEGREE:
        return
    if len(turning) == 1 and 0 in next(iter(turning)):
        return
    # Numbers before the products of symbols in the amplitudes of cos(k x) and sin(k x).
    waves: dict[int, tuple[_Numbers, _Numbers]] = {}
    for (m, n), numbers in terms.items():
        for k, amplitudes in _harmonics(m, n).items():
            for wave, amplitude in zip(waves.setdefault(k, ({}, {})), amplitudes, strict=True):
                for symbols, number in numbers.items() if amplitude else ():
                    wave[symbols] = wave.get(symbols, 0) + amplitude * number
    constant = waves.pop(0, ({}, {}))[0]
    total: Any = sp.factor_terms(sp.Add(*(number * x for x, number in constant.items())))
    functions: dict[Any, Any] = {}
    for k in sorted(waves):
        for function, amplitude in _with_phases(*waves[k], k * x):
            functions[function] = functions.get(function, 0) + amplitude
    for function, amplitude in functions.items():
        total += sp.factor_terms(amplitude) * function
    yield total
    yield sp.factor_terms(total)


_Numbers = dict[Any, Any]  # for each product of symbols the number before it


@cache
def _harmonics(m: int, n: int) -> dict[int, tuple[Any, Any]]:
    """Amplitudes of cos(k x) and sin(k x) in sin(x)^m cos(x)^n."""
    x = sp.Dummy()
    wave = sp.sin(x) ** m * sp.cos(x) ** n
    for _ in range(2):  # of squares of squares
        wave = sp.expand(TR8(wave))
    found = {k: (wave.coeff(sp.cos(k * x)), wave.coeff(sp.sin(k * x))) for k in range(1, m + n + 1)}
    return found | {0: (wave.as_coeff_Add()[0], 0)}


def _with_phases(cosines: _Numbers, sines: _Numbers, angle: Any) -> Iterator[tuple[Any, Any]]:
    """Functions and amplitudes of sums of cos(angle) and sin(angle), term by term."""
    for term in sorted(cosines.keys() | sines.keys(), key=str):
        a, b = sines.get(term, sp.Integer(0)), cosines.get(term, sp.Integer(0))
        if a == b == 0:
            continue
        parts = round(_PARTS * math.atan2(float(b), float(a)) / math.pi)
        phase = sp.Rational(parts, _PARTS) * sp.pi
        across = sp.expand(a * sp.sin(phase) - b * sp.cos(phase)) if a and b else a or b
        if not (a and b) or sp.sqrtdenest(across) != 0:
            yield sp.sin(angle), a * term
            yield sp.cos(angle), b * term
            continue
        # The sine with a phase, by the function and sign whose phase is smallest.
        size = sp.sqrtdenest(sp.sqrt(sp.expand(a * a + b * b)))
        forms = [(sp.sin, 1, parts), (sp.sin, -1, parts - _PARTS), (sp.sin, -1, parts + _PARTS)]
        forms += [(sp.cos, 1, parts - _PARTS // 2), (sp.cos, -1, parts + _PARTS // 2)]
        function, sign, parts_of_phase = min(forms, key=lambda form: abs(form[2]))
        yield function(angle + sp.Rational(parts_of_phase, _PARTS) * sp.pi), sign * size * term
