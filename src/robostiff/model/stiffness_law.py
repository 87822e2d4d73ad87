"""Drives and springs whose stiffness or force follows a law of their motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, reduce
from itertools import pairwise
from typing import Any

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.spatial import as_floats
from robostiff.spatial.formula import is_formula


@frozen
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
        ratios = [tuple(sp.Poly(part, x).all_coeffs()) for part in ratio]
        if not exact:
            ratios = [tuple(c if c.free_symbols else float(c) for c in part) for part in ratios]
        return StiffnessLaw(*ratios)

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
            zeros = real[(real >= low) & (real <= high)]
            if zeros.size:
                _refuse(float(zeros[0]), 0.0 if part is self.numerator else np.inf)
        if not self.at(0.5 * (low + high)) > 0:
            _refuse(0.5 * (low + high), float(self.at(0.5 * (low + high))))

    def from_rest(self, x0: float) -> ForceFromStiffness:
        """Force by the motion from the coordinate x0."""
        parts = (np.array(part, dtype=float) for part in (self.numerator, self.denominator))
        a, b = map(np.poly1d, parts)
        return ForceFromStiffness(a, b, float(x0))


@frozen
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
    return reduce(lambda total, c: total * x + c, coefficients)


def _refuse(x: float, k: float) -> None:
    raise InputError(
        "stiffness of a drive by its coordinate",
        got=Words(f"{k:g} at {x:g} [m or rad], within its limits"),
        expected="a positive one between the limits of the drive",
    )


# Of the largest force: what a law may have without motion.
_NONE = 1e-9
# Of force times motion, in the energy of a law: what is sought, and what is refused.
_ROUNDING, _INEXACT = 1e-13, 1e-8
# Of a motion: how far below it the scale of a law may be.
_DECADES = 9


@frozen
class ForceLaw:
    """Force of a joint by its motion q from the unloaded posture, in place of ``k q``.

    Attributes
    ----------
    force : SymPy expression of one symbol, or (n, 2) array
        F(q) [N or N m]; or a table of q [m or rad] and F, which is joined by cubics that do not
        overshoot (PCHIP) and go on straight beyond its ends.

    Raises
    ------
    InputError
        When it is neither; when it pushes without motion, or has a negative stiffness there; when
        a table does not ascend.

    Examples
    --------
    >>> import sympy as sp
    >>> q = sp.Symbol("q")
    >>> law = ForceLaw(2e5 * q + 3e9 * q**3)
    >>> law.at(0.01), law.tangent(0.01), law.secant(0.01)
    (5000.0, 1100000.0, 500000.0)
    >>> ForceLaw([[-1, -10], [0, 0], [1, 10]]).energy(0.5)
    1.25
    """

    force: Any

    def __post_init__(self) -> None:
        if not is_formula(self.force):
            expected = "a formula of one symbol, or rows of motion [m or rad] and force [N or N m]"
            table = as_floats("force law", self.force, expected)
            if table.ndim != 2 or table.shape[1] != 2 or len(table) < 2:
                raise InputError("force law", got=self.force, expected=expected)
            if np.any(np.diff(table[:, 0]) <= 0) or not table[0, 0] <= 0 <= table[-1, 0]:
                raise InputError(
                    "force law", got=table[:, 0].tolist(), expected="motions that ascend through 0"
                )
            object.__setattr__(self, "force", table)
        elif len(self.force.free_symbols) != 1:
            raise InputError("force law", got=str(self.force), expected="a formula of one symbol")
        resting, k = self.at(0.0), self.tangent(0.0)
        size = abs(k) * 1e-3 + abs(self.at(1e-3))
        if not np.isfinite(resting) or abs(resting) > _NONE * size:
            raise InputError(
                "force law",
                got=Words(f"a force of {resting:g} without motion"),
                expected="none",
                hint="write what pushes at the unloaded posture as preload",
            )
        if not np.isfinite(k) or k < 0:
            raise InputError(
                "force law", got=Words(f"stiffness {k:g} without motion"), expected="zero or more"
            )

    def at(self, q: float) -> float:
        """Force F(q) [N or N m]."""
        return self._functions[0](q)

    def tangent(self, q: float) -> float:
        """dF/dq: stiffness against a little more load [N/m or N m/rad]."""
        return self._functions[1](q)

    def secant(self, q: float) -> float:
        """F(q)/q: stiffness of the whole way from rest; the tangent at rest."""
        return self.tangent(0.0) if q == 0 else self.at(q) / q

    def energy(self, q: float) -> float:
        """Stored from rest, the integral of F [J]."""
        return self._functions[2](q)

    @cached_property
    def _functions(self) -> tuple[Callable[[float], float], ...]:
        return _of_formula(self.force) if is_formula(self.force) else _of_table(self.force)


def _of_formula(force: Any) -> tuple[Callable[[float], float], ...]:
    import sympy as sp
    from scipy.integrate import quad

    (q,) = force.free_symbols
    F, rate = (sp.lambdify(q, f, "math") for f in (force, sp.diff(force, q)))

    def energy(end: float) -> float:
        # A law may have a kink, as of a stop, and a scale far below its motion, as of friction.
        panels = [end * 0.1**i for i in range(_DECADES, -1, -1)]
        largest = max(abs(F(x)) for x in panels) * abs(end)
        stored, error = 0.0, 0.0
        for start, stop in pairwise([0.0, *panels]):
            part, off, *_ = quad(
                F, start, stop, epsabs=_ROUNDING * largest, epsrel=_ROUNDING, full_output=1
            )
            stored, error = stored + part, error + off
        if not error <= _INEXACT * largest:
            raise InputError(
                "energy of a force law",
                got=Words(f"{force}, uncertain by {error:.1g} J after a motion of {end:g}"),
                expected="a law that can be integrated, with at most some kinks",
            )
        return stored

    return lambda x: float(F(x)), lambda x: float(rate(x)), energy


def _of_table(table: np.ndarray) -> tuple[Callable[[float], float], ...]:
    """Force, its rate and its energy by the motion, of rows (N, 2) of motion and force."""
    from scipy.interpolate import PchipInterpolator

    q, F = table.T
    curve = PchipInterpolator(q, F)
    rate, integral = curve.derivative(), curve.antiderivative()

    def force(x: float) -> float:
        inside = min(max(x, q[0]), q[-1])
        return float(curve(inside) + rate(inside) * (x - inside))

    def tangent(x: float) -> float:
        return float(rate(min(max(x, q[0]), q[-1])))

    def energy(x: float) -> float:
        inside = min(max(x, q[0]), q[-1])
        beyond = x - inside
        stored = integral(inside) - integral(0.0)
        return float(stored + curve(inside) * beyond + 0.5 * rate(inside) * beyond**2)

    return force, tangent, energy
