"""Drives and springs whose force is no multiple of their motion: tangent and secant stiffness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial import as_floats
from robostiff.spatial.formula import is_formula

# Of the largest force: what a law may have without motion.
_NONE = 1e-9


@dataclass(frozen=True)
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
                got=f"a force of {resting:g} without motion",
                expected="none",
                hint="write what pushes at the unloaded posture as preload",
            )
        if not np.isfinite(k) or k < 0:
            raise InputError(
                "force law", got=f"stiffness {k:g} without motion", expected="zero or more"
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

    (q,) = force.free_symbols
    F, rate = (sp.lambdify(q, own, "math") for own in (force, sp.diff(force, q)))
    nodes, weights = np.polynomial.legendre.leggauss(40)

    def energy(end: float) -> float:
        places = 0.5 * end * (nodes + 1)
        return float(0.5 * end * (weights @ np.array([F(float(own)) for own in places])))

    return lambda own: float(F(own)), lambda own: float(rate(own)), energy


def _of_table(table: np.ndarray) -> tuple[Callable[[float], float], ...]:
    from scipy.interpolate import PchipInterpolator

    q, F = table.T
    curve = PchipInterpolator(q, F)
    rate, integral = curve.derivative(), curve.antiderivative()

    def force(own: float) -> float:
        inside = min(max(own, q[0]), q[-1])
        return float(curve(inside) + rate(inside) * (own - inside))

    def tangent(own: float) -> float:
        return float(rate(min(max(own, q[0]), q[-1])))

    def energy(own: float) -> float:
        inside = min(max(own, q[0]), q[-1])
        beyond = own - inside
        stored = integral(inside) - integral(0.0)
        return float(stored + curve(inside) * beyond + 0.5 * rate(inside) * beyond**2)

    return force, tangent, energy
