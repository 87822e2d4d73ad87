"""Trigonometry in its shortest form: sums of angles, and sines with a phase."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import sympy as sp
from sympy.core.cache import cacheit

from robostiff.analytic.operation_count import count_of

# Degree in sine and cosine, and operations, beyond which no shorter form is looked for.
_DEGREE = 4
_LONGEST = 60
# Phases are multiples of this part of a turn about pi: 15 degrees.
_PARTS = 12


def shortest_trigonometry(expression: Any) -> Any:
    """An expression or matrix with sines and cosines in their shortest form.

    Sums over multiples of one angle become sines and cosines with a phase,
    ``a sin x + b cos x = sqrt(a^2 + b^2) sin(x + phi)``, where the phase is a multiple of 15
    degrees; ``cos a cos b - sin a sin b`` becomes ``cos(a + b)``. What would be longer stays.

    Examples
    --------
    >>> a, r, R = sp.symbols("alpha r R")
    >>> shortest_trigonometry(r * (sp.sqrt(3) * sp.sin(a) + sp.cos(a)) / 2)
    r*sin(alpha + pi/6)
    >>> shortest_trigonometry(2 * R * sp.sin(a) * sp.cos(a) + r)
    R*sin(2*alpha) + r
    >>> shortest_trigonometry(1 / (sp.cos(a) * sp.cos(r) - sp.sin(a) * sp.sin(r)))
    1/cos(alpha + r)
    """
    if isinstance(expression, sp.MatrixBase):
        return sp.ImmutableMatrix(*expression.shape, [_shortest(x) for x in expression.flat()])
    return _shortest(expression)


@cacheit
def _shortest(expression: Any) -> Any:
    if not expression.has(sp.sin, sp.cos):
        return expression
    expression = _with_sums_of_angles(expression)
    if count_of(expression) > _LONGEST:
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
        angles = sorted({x.args[0] for x in pair.atoms(sp.sin, sp.cos)}, key=str)
        if len(angles) != 2:
            continue
        a, b = angles
        for whole, parts in _sums_of(a, b):
            if pair in (parts, -parts):
                expression = expression.xreplace({pair: whole if pair == parts else -whole})
                break
    return expression


def _sums_of(a: Any, b: Any) -> Iterator[tuple[Any, Any]]:
    """Sines and cosines of sum and difference of two angles, and what they are in those of each."""
    for sign in (1, -1):
        yield sp.sin(a + sign * b), sp.sin(a) * sp.cos(b) + sign * sp.cos(a) * sp.sin(b)
        yield sp.cos(a + sign * b), sp.cos(a) * sp.cos(b) - sign * sp.sin(a) * sp.sin(b)


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
    for x in sorted((x for x in angles if isinstance(x, sp.Symbol)), key=str):
        shortest = _first_shortest(forms)
        for form in dict.fromkeys([expression, shortest]):
            forms += _in_harmonics(form, x)
    return _first_shortest(forms)


def _in_harmonics(expression: Any, x: sp.Symbol) -> Iterator[Any]:
    """The expression in sines and cosines of multiples of x, if it is a polynomial in these."""
    s, c = sp.Dummy(), sp.Dummy()
    plain = expression.xreplace({sp.sin(x): s, sp.cos(x): c})
    if plain.has(x) or not plain.is_polynomial(s, c):
        return
    polynomial = sp.Poly(plain, s, c)
    turning = [degrees for degrees in polynomial.monoms() if any(degrees)]
    if polynomial.total_degree() > _DEGREE or (len(turning) == 1 and 0 in turning[0]):
        return
    waves: dict[int, Any] = {}  # amplitudes of exp(i k x)
    for (m, n), coefficient in polynomial.terms():
        for k, amplitude in _power(m, n).items():
            waves[k] = waves.get(k, 0) + coefficient * amplitude
    total: Any = sp.factor_terms(sp.expand(waves.get(0, sp.Integer(0))))
    functions: dict[Any, Any] = {}
    for k in sorted({abs(k) for k in waves} - {0}):
        even = sp.expand(waves.get(k, 0) + waves.get(-k, 0))
        odd = sp.expand(sp.I * (waves.get(k, 0) - waves.get(-k, 0)))
        for function, amplitude in _with_phases(even, odd, k * x):
            functions[function] = functions.get(function, 0) + amplitude
    for function, amplitude in functions.items():
        total += sp.factor_terms(amplitude) * function
    yield total
    yield sp.factor_terms(total)


def _power(m: int, n: int) -> dict[int, Any]:
    """Amplitudes of exp(i k x) in sin(x)^m cos(x)^n."""
    waves: dict[int, Any] = {0: sp.Integer(1)}
    half = sp.Rational(1, 2)
    for up, down in [(-sp.I * half, sp.I * half)] * m + [(half, half)] * n:
        raised: dict[int, Any] = {}
        for k, amplitude in waves.items():
            raised[k + 1] = raised.get(k + 1, 0) + up * amplitude
            raised[k - 1] = raised.get(k - 1, 0) + down * amplitude
        waves = raised
    return waves


def _with_phases(even: Any, odd: Any, angle: Any) -> Iterator[tuple[Any, Any]]:
    """Functions and amplitudes of ``even cos(angle) + odd sin(angle)``, term by term."""
    cosines, sines = _numbers_of_terms(even), _numbers_of_terms(odd)
    for term in sorted(cosines | sines, key=str):
        a, b = sines.get(term, sp.Integer(0)), cosines.get(term, sp.Integer(0))
        parts = round(_PARTS * math.atan2(float(b), float(a)) / math.pi)
        phase = sp.Rational(parts, _PARTS) * sp.pi
        across = sp.expand(a * sp.sin(phase) - b * sp.cos(phase))
        if not (a and b) or sp.sqrtdenest(across) != 0:
            yield sp.sin(angle), a * term
            yield sp.cos(angle), b * term
            continue
        size = sp.sqrtdenest(sp.sqrt(sp.expand(a * a + b * b)))
        yield from _nearest(parts, angle, size * term)


def _nearest(parts: int, angle: Any, amplitude: Any) -> Iterator[tuple[Any, Any]]:
    """``sin(angle + parts pi/12)``, by the function and sign whose phase is smallest."""
    forms = [(sp.sin, 1, parts), (sp.sin, -1, parts - _PARTS), (sp.sin, -1, parts + _PARTS)]
    forms += [(sp.cos, 1, parts - _PARTS // 2), (sp.cos, -1, parts + _PARTS // 2)]
    function, sign, own = min(forms, key=lambda form: abs(form[2]))
    yield function(angle + sp.Rational(own, _PARTS) * sp.pi), sign * amplitude


def _numbers_of_terms(expression: Any) -> dict[Any, Any]:
    """For each product of symbols the number before it."""
    found: dict[Any, Any] = {}
    for term in sp.Add.make_args(expression):
        number, symbols = term.as_independent(*term.free_symbols, as_Add=False)
        if not term.free_symbols:
            number, symbols = term, sp.Integer(1)
        found[symbols] = found.get(symbols, 0) + number
    return {symbols: number for symbols, number in found.items() if number != 0}
