"""The derivation of a chain at random values: redundant joints, and a check by the block form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Any

import flint
import numpy as np
import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.exact.exact_matrix import ExactMatrix
from robostiff.analytic.exact.numeric_value import BITS, balls_of
from robostiff.analytic.placement.agreement import (
    AGREED,
    check_value,
    length_of,
    matrix_distance,
    random_values,
)
from robostiff.errors import DisagreementError, InputError

_SETS = 2
_SEED = 15
_ZERO = 1e-30  # of its terms, computed with ninety digits
_FLOOR = 1e-3
_CLEAR = 1e-7  # of the largest singular value: what is not zero


def redundant_joints(K0: Any, columns: Sequence[Any]) -> tuple[bool, ...]:
    """Redundant joints, decided at random values of the symbols with many digits.

    A polynomial that is zero at random values is zero (Schwartz and Zippel).

    Raises
    ------
    InputError
        When K0 is indefinite: J^T K J = 0 for a joint with K J not zero.
    """
    found: list[bool] | None = None
    entries = [*K0, *(x for J in columns for x in J)]
    for values, _ in islice(random_values(entries, _SEED), _SETS):
        with flint.ctx.workprec(BITS):
            K = flint.arb_mat(K0.rows, K0.rows, balls_of(K0.flat(), values))
            here = []
            for J in columns:
                column = flint.arb_mat(K0.rows, 1, balls_of(list(J), values))
                u = K * column
                mu = (column.transpose() * u)[0, 0]
                size, largest, feels = (_largest(x) for x in (column, K, u))
                is_zero = abs(float(mu)) <= _ZERO * size**2 * largest
                if is_zero and feels > 1e-15 * size * largest:
                    raise InputError(
                        "stiffness matrix",
                        got="a joint whose motion causes forces but stores no energy, J^T K J = 0",
                        expected="a positive semidefinite matrix",
                    )
                here.append(bool(is_zero))
                if not is_zero:
                    K = K - u * u.transpose() / mu
        found = here if found is None else [a and b for a, b in zip(found, here, strict=True)]
    return tuple(found or [False] * len(columns))


def _largest(M: Any) -> float:
    return max(abs(float(x)) for x in M.entries())


def check_chain(derivation: Derivation, entries: Sequence[Any], columns: Mapping[str, Any]) -> None:
    """Compare the formula of a chain with the block form, eq. (9), at random values.

    `entries`: those of K0, row by row.

    Raises
    ------
    DisagreementError
        When they differ.
    """
    K0 = derivation.K0
    n, count = K0.rows, len(columns)
    entries = [*entries, *(x for J in columns.values() for x in J)]
    # Formulas that differ do so at almost all values: the first at which the block form decides.
    for values, numbers in random_values(entries, _SEED):
        K = numbers[: n * n].reshape(n, n)
        J = numbers[n * n :].reshape(count, n).T
        expected = _block_form(K, J)
        if expected is None:
            continue
        where = f"chain {derivation.name!r}"
        # A part of K0 is added on both sides: where K vanishes, rounding is not compared.
        expected = expected + _FLOOR * K
        if derivation.exact is None:
            steps, whole = derivation.definitions, derivation.K + K0 * sp.Rational(1, 1000)
            check_value(whole, steps, values, expected, AGREED, where, length_of(K))
            return
        found = _exact_value(derivation.exact, values) + _FLOOR * K
        distance = matrix_distance(found, expected, length_of(K))
        if distance <= AGREED:
            return
        at = ", ".join(f"{symbol} = {value:.6g}" for symbol, value in values.items())
        raise DisagreementError(
            "the closed form and the block form of K", distance, f"{where}, at {at}"
        )


def _block_form(K: np.ndarray, J: np.ndarray) -> np.ndarray | None:
    """K - K J (J^T K J)^-1 J^T K without redundant joints; None where these are undecided."""
    if J.size == 0:
        return K
    KJ = K @ J
    U, s, Vt = np.linalg.svd(J.T @ KJ)
    kept = s > _CLEAR * s[0]
    if s[0] == 0:
        return K
    if np.any(s[~kept] > 1e-12 * s[0]) or s[kept][-1] < 1e-4 * s[0]:
        return None
    inverse = (Vt[kept].T / s[kept]) @ U[:, kept].T
    return K - KJ @ inverse @ KJ.T


def _exact_value(K: ExactMatrix, values: Mapping[Any, float]) -> np.ndarray:
    """Polynomials at rational numbers, so that cancellation loses no digits."""
    known = {x: flint.fmpq(*value.as_integer_ratio()) for x, value in values.items()}
    if others := [x for x in K.field.generators if x not in known]:
        with flint.ctx.workprec(BITS):
            known |= zip(others, map(_rational, balls_of(others, values)), strict=True)
    rational = [known[x] for x in K.field.generators]
    n = len(K.entries)
    below = K.denominator(*rational)
    found = np.zeros((n, n))
    for i in range(n):
        for j in range(i, n):
            entry = K.entries[i][j]
            if not entry.is_zero():
                quotient = entry(*rational) / below
                found[i, j] = found[j, i] = int(quotient.p) / int(quotient.q)
    return found


def _rational(ball: Any) -> Any:
    mantissa, exponent = ball.mid().man_exp()
    return flint.fmpq(int(mantissa)) * flint.fmpq(2) ** int(exponent)
