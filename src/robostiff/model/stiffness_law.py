"""Drives whose stiffness depends on their coordinate, such as ball screws held at both ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial.formula import is_formula


@dataclass(frozen=True)
class StiffnessLaw:
    """Stiffness of a drive by its coordinate x, a ratio of polynomials ``k(x) = a(x) / b(x)``.

    Small loads meet k at the coordinate of the pose, x0. Under finite loads the drive stores
    ``k(x0 + q) q^2 / 2`` after the motion q, and resists with its derivative
    ``F = k(x0 + q) q + k'(x0 + q) q^2 / 2``: the point of the screw that carries moves along.

    Attributes
    ----------
    numerator, denominator : tuple of float or formula
        Coefficients of a and b, that of the highest power first, SI units.

    Examples
    --------
    >>> import sympy as sp
    >>> x = sp.Symbol("x")
    >>> screw = StiffnessLaw.of(1 / (1 / sp.Float(2e8) + x * (1 - x) / 1e8), x)
    >>> round(screw.at(0.5)), round(screw.at(0.1))
    (133333333, 169491525)
    """

    numerator: tuple[Any, ...]
    denominator: tuple[Any, ...] = (1.0,)

    @staticmethod
    def of(k: Any, x: Any, *, exact: bool = False) -> StiffnessLaw:
        """From a SymPy expression of a symbol x; numbers in it become floats unless `exact`.

        Raises
        ------
        InputError
            When it is no ratio of polynomials in x.
        """
        import sympy as sp

        ratio = sp.fraction(sp.together(sp.sympify(k)))
        if not all(part.is_polynomial(x) for part in ratio):
            raise InputError(
                "stiffness of a drive by its coordinate",
                got=str(k),
                expected=f"sums, products and quotients of {x}, such as 1/(1/k0 + {x}*(L-{x})/c)",
                hint="force laws may be any formula, or a table: write laws",
            )
        every = [tuple(sp.Poly(part, x).all_coeffs()) for part in ratio]
        if not exact:
            every = [tuple(c if c.free_symbols else float(c) for c in own) for own in every]
        return StiffnessLaw(*every)

    def at(self, x: Any) -> Any:
        """Stiffness [N/m or N m/rad] at coordinates x, numbers, arrays or formulas."""
        return _value(self.numerator, x) / _value(self.denominator, x)

    def check(self, limits: tuple[float, float]) -> None:
        """Raise unless it is positive within limits; what is written in formulas is not checked.

        Raises
        ------
        InputError
            When it is zero, negative or infinite somewhere.
        """
        if any(map(is_formula, (*self.numerator, *self.denominator))):
            return
        low, high = limits
        for part in (self.numerator, self.denominator):
            roots = np.roots(np.array(part, dtype=float))
            real = roots.real[np.abs(roots.imag) <= 1e-9 * np.abs(roots)]
            bad = real[(real >= low) & (real <= high)]
            if bad.size:
                _refuse(float(bad[0]), 0.0 if part is self.numerator else np.inf)
        if not self.at(0.5 * (low + high)) > 0:
            _refuse(0.5 * (low + high), float(self.at(0.5 * (low + high))))

    def from_rest(self, x0: float) -> ForceFromStiffness:
        """Force by the motion from the coordinate x0."""
        a, b = (
            np.poly1d(np.array(part, dtype=float)) for part in (self.numerator, self.denominator)
        )
        return ForceFromStiffness(a, b, float(x0))


@dataclass(frozen=True)
class ForceFromStiffness:
    """What a drive stores and how it resists, by its motion q from the coordinate `start`."""

    a: np.poly1d
    b: np.poly1d
    start: float

    def energy(self, q: float) -> float:
        """``k q^2 / 2`` [J]."""
        return 0.5 * self._rates(q)[0] * q * q

    def at(self, q: float) -> float:
        """``k q + k' q^2 / 2`` [N or N m]."""
        k, rate, _ = self._rates(q)
        return k * q + 0.5 * rate * q * q

    def tangent(self, q: float) -> float:
        """``k + 2 k' q + k'' q^2 / 2``."""
        k, rate, second = self._rates(q)
        return k + 2 * rate * q + 0.5 * second * q * q

    def _rates(self, q: float) -> tuple[float, float, float]:
        """``k``, ``k'`` and ``k''``: of ``a = k b``, order by order."""
        x = self.start + q
        a, a1, a2 = self.a(x), self.a.deriv()(x), self.a.deriv(2)(x)
        b, b1, b2 = self.b(x), self.b.deriv()(x), self.b.deriv(2)(x)
        k = a / b
        k1 = (a1 - k * b1) / b
        return float(k), float(k1), float((a2 - 2 * k1 * b1 - k * b2) / b)


def _value(coefficients: Sequence[Any], x: Any) -> Any:
    total = coefficients[0]
    for c in coefficients[1:]:
        total = total * x + c
    return total


def _refuse(x: float, k: float) -> None:
    raise InputError(
        "stiffness of a drive by its coordinate",
        got=f"{k:g} at {x:g} [m or rad], within its limits",
        expected="a positive one between the limits of the drive",
    )
