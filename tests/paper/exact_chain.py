"""The paper's matrices with exact entries: SymPy symbols and rationals."""

from __future__ import annotations

import sympy as sp

from robostiff.analytic import canonical


def skew(v: sp.Matrix) -> sp.Matrix:
    """(v x), eq. (14)."""
    return sp.Matrix([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def symmetric(n: int, name: str = "k") -> sp.Matrix:
    """A full symmetric matrix of symbols."""
    return sp.Matrix(n, n, lambda i, j: sp.Symbol(f"{name}{min(i, j) + 1}{max(i, j) + 1}"))


def eliminated(K: sp.Matrix, J: sp.Matrix) -> sp.Matrix:
    """K - u u^T / mu, eq. (15)."""
    u = K * J
    return (K - u * u.T / (J.T * u)[0]).applyfunc(sp.cancel)


def generic(rows: int, columns: int, name: str = "j") -> sp.Matrix:
    """A matrix of symbols."""
    return sp.Matrix(rows, columns, lambda i, j: sp.Symbol(f"{name}{i + 1}{j + 1}"))


def block_form(K0: sp.Matrix, J: sp.Matrix) -> sp.Matrix:
    """K0 - K0 J (J^T K0 J)^-1 J^T K0, eq. (9), with the inverse by its adjugate."""
    M = J.T * K0 * J
    return K0 - K0 * J * M.adjugate() * J.T * K0 / M.det(method="berkowitz")


def vanishes(M: sp.Matrix) -> bool:
    """Whether every entry is zero as a rational function of its symbols."""
    return not any(canonical(sp.Matrix(M)))


def blocks(a: sp.Matrix, b: sp.Matrix, c: sp.Matrix, d: sp.Matrix) -> sp.Matrix:
    """[[a, b], [c, d]]."""
    return sp.Matrix(sp.BlockMatrix([[a, b], [c, d]]))


def jointed_legs(
    phi: list[sp.Expr],
    psi: list[sp.Expr],
    R: sp.Expr,
    r: sp.Expr,
    h: sp.Expr,
    squares: sp.Expr,
    sign: int = -1,
) -> sp.Matrix:
    """Sum over legs of eq. (25) for K11 = 1: columns [u; sign v x u] / L with (26).

    sign = -1 is right for v from the leg end to the reference point; +1 is printed.
    """
    K = sp.zeros(6)
    for a, b in zip(phi, psi, strict=True):
        u = sp.Matrix([r * sp.cos(b) - R * sp.cos(a), r * sp.sin(b) - R * sp.sin(a), h])
        v = sp.Matrix([-r * sp.cos(b), -r * sp.sin(b), 0])
        w = sp.Matrix.vstack(u, sign * v.cross(u))
        K += w * w.T / squares
    return K.applyfunc(sp.expand)


def degrees(*angles: int) -> list[sp.Expr]:
    """Angles as multiples of pi."""
    return [sp.pi * sp.Rational(angle, 180) for angle in angles]


def case_a_angles() -> tuple[list[sp.Expr], list[sp.Expr]]:
    """phi and psi of case A."""
    angles = degrees(0, 60, 120, 180, 240, 300)
    return angles, angles


def case_b_angles() -> tuple[list[sp.Expr], list[sp.Expr]]:
    """phi and psi of case B."""
    return degrees(0, 120, 120, 240, 240, 360), degrees(60, 60, 180, 180, 300, 300)
