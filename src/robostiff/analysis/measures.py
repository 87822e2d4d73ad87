"""Measures of stiffness as formulas of K and C, and of results, and how far results differ."""

from __future__ import annotations

from functools import cache
from itertools import combinations, combinations_with_replacement
from typing import Any, cast

import numpy as np

from robostiff.analysis.cable_stiffness import CableStiffness
from robostiff.analysis.deflection_under_load import Deflection
from robostiff.analysis.result import Stiffness
from robostiff.compiled import (
    ArrayCode,
    ComplianceMatrix,
    DeflectionUnder,
    DisplacementUnder,
    EntryOf,
    MachineCode,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    TensionsOf,
    WorstDeflection,
    machine_code_is_available,
)
from robostiff.elastostatics import Status
from robostiff.elastostatics.tolerance import scaling
from robostiff.record import Program, Record, greater, plain_root
from robostiff.spatial import Space
from robostiff.spatial.batch import empty_batch

# Poses: few enough for the cache, and no power of two, at which rows would share lines of it.
_AT_ONCE = 8184
_MANY = 30_000  # matrices, which take as long as machine code for them takes to make
_SWEEPS = 12
_ROUNDING = 1e-9  # of the largest eigenvalue, where the rank is decided
_DONE = 1e-30  # of squares: rounding
_TINY = 1e-300  # keeps the quotient where there is nothing to rotate


def symmetric_eigenvalues(A: np.ndarray) -> np.ndarray:
    """Eigenvalues of small symmetric matrices (N, n, n), ascending (N, n).

    Cyclic Jacobi rotations on all matrices side by side: as accurate as LAPACK's, and several times
    faster on a batch.

    References
    ----------
    Golub, Van Loan: Matrix Computations, 4th ed., section 8.5.
    """
    n, places = A.shape[-1], [*combinations_with_replacement(range(A.shape[-1]), 2)]
    values = empty_batch((len(A),), (n,))
    sweep = _sweep(n, by_machine_code=len(A) >= _MANY and machine_code_is_available())
    for start in range(0, len(A), _AT_ONCE):
        own = A[start : start + _AT_ONCE]
        a, after = np.empty((2, len(places) + 1, len(own)))
        for entry, (i, j) in zip(a, places, strict=False):
            entry[...] = own[:, i, j]
        for _ in range(_SWEEPS if n > 1 else 0):
            sweep.evaluate(a[:-1], after)
            a, after = after, a
            if np.max(a[-1]) <= 0:
                break
        rows = [entry for entry, (i, j) in zip(a, places, strict=False) if i == j]
        for j in (j for i in range(n) for j in range(n - 1 - i)):  # poses stay where they are
            rows[j : j + 2] = np.minimum(*rows[j : j + 2]), np.maximum(*rows[j : j + 2])
        for i, own in enumerate(rows):
            values[start : start + _AT_ONCE, i] = own
    return values


@cache
def _sweep(n: int, *, by_machine_code: bool) -> MachineCode | ArrayCode:
    """Code that makes each entry off the diagonal zero once, in the upper triangle (rows, N).

    A last row is above zero where more is left of these entries than rounding.
    """
    places = list(combinations_with_replacement(range(n), 2))
    record = Record({f"{i} {j}": [1.0 + i + 3 * j] for i, j in places})
    a: dict[tuple[int, int], Any] = {(i, j): record.input(f"{i} {j}") for i, j in places}
    for p, q in combinations(range(n), 2):
        difference = a[q, q] - a[p, p]
        # t = tan of the smaller angle; zero where all is zero, as of diagonal matrices.
        side, twice = 2 * greater(difference, 0) - 1, 2 * a[p, q]
        root = plain_root(difference * difference + twice * twice)
        t = side * twice / (side * difference + root + _TINY)
        c = 1 / plain_root(1 + t * t)
        s, moved = t * c, t * a[p, q]
        a |= {(p, p): a[p, p] - moved, (q, q): a[q, q] + moved, (p, q): 0}
        for r in set(range(n)) - {p, q}:
            rp, rq = (min(r, p), max(r, p)), (min(r, q), max(r, q))
            a[rp], a[rq] = c * a[rp] - s * a[rq], s * a[rp] + c * a[rq]
    squares = {(i, j): a[i, j] * a[i, j] for i, j in places}
    whole = sum(squares[i, i] for i in range(n))
    apart = sum(squares[p, q] for p, q in combinations(range(n), 2)) - _DONE * whole
    program = Program.of(record, [*(a[place] for place in places), apart])
    return MachineCode(program) if by_machine_code else ArrayCode(program)


def principal_stiffnesses(K: np.ndarray, *, definite: bool = True) -> np.ndarray:
    """Eigenvalues (N, n) of the two diagonal blocks of K (N, n, n) [N/m], [N m/rad], ascending.

    Those of rotation depend on the reference point, none on the axes; neither mixes units.
    """
    d = Space.of_size(K.shape[-1]).translations
    blocks = [symmetric_eigenvalues(block) for block in (K[:, :d, :d], K[:, d:, d:])]
    # Of a semidefinite K, what is below zero is rounding.
    return np.maximum(np.concatenate(blocks, axis=-1), 0.0 if definite else -np.inf)


def worst_deflection(C: np.ndarray) -> np.ndarray:
    """Largest displacement per unit force over all directions of the force (N,) [m/N].

    The largest eigenvalue of the displacement-force block of the compliance (N, n, n): no moment
    acts, and the platform may turn.
    """
    d = Space.of_size(C.shape[-1]).translations
    return symmetric_eigenvalues(C[:, :d, :d])[:, -1]


def stiffness_indices(K: np.ndarray, rank: np.ndarray, length: float) -> dict[str, np.ndarray]:
    """Eigenvalues of K scaled by a characteristic length, their ratio, and the determinant.

    Rotations times the length L are displacements, moments over it forces: all entries of
    S^-1 K S^-1, S = diag(1, 1, 1, L, L, L), are in N/m, and eigenvalues have a meaning.
    Where the rank (N,) of K (N, n, n) is below n the smallest eigenvalue is zero, and the
    determinant has no logarithm.

    References
    ----------
    C. Gosselin: Stiffness mapping for parallel manipulators. IEEE Transactions on Robotics and
    Automation 6(3), 1990 (maps of stiffness). G. Carbone, M. Ceccarelli: Comparison of indices for
    stiffness performance evaluation. Frontiers of Mechanical Engineering in China 5(3), 2010
    (eigenvalues, their ratio and the determinant as indices). O. Ma, J. Angeles: Optimum
    architecture design of platform manipulators. ICAR 1991 (characteristic length).
    """
    space = Space.of_size(K.shape[-1])
    s = scaling(np.array(length), space)
    scaled = K / np.outer(s, s)
    known = np.isfinite(scaled[:, 0, 0])
    eigenvalues = np.full(scaled.shape[:2], np.nan)
    if np.any(known):
        eigenvalues[known] = np.linalg.eigvalsh(scaled[known])
    smallest, largest = eigenvalues[:, 0], eigenvalues[:, -1]
    singular = known & (rank < space.size)
    rounding = smallest > -_ROUNDING * largest  # below, K is not semidefinite
    smallest = np.where(singular & rounding, 0.0, smallest)
    positive = known & (smallest > 0)
    logarithms = np.log10(
        eigenvalues, where=positive[:, None], out=np.full(scaled.shape[:2], np.nan)
    )
    return {
        "smallest_eigenvalue": smallest,
        "largest_eigenvalue": largest,
        "isotropy": np.divide(
            smallest, largest, out=np.full(len(K), np.nan), where=known & (largest > 0)
        ),
        "log10_determinant": np.sum(logarithms, axis=-1),
    }


def stiffness_where_answered(result: Stiffness | CableStiffness) -> np.ndarray:
    """Stiffness matrices (N, n, n); NaN where there is none."""
    K, where = result.matrix, result.answered
    return K if np.all(where) else np.where(where[:, None, None], K, np.nan)


def values_of(output: Output, result: Stiffness | CableStiffness) -> tuple[np.ndarray, np.ndarray]:
    """Values (N, ...) of an output, and status (N,) of its own.

    Not a number where there are none, which the status explains: what a record alone has is
    `Status.ILL_CONDITIONED`, as nothing else computes it.
    """
    of_load = np.zeros(result.batch_shape, dtype=np.uint16)
    match output:
        case StiffnessMatrix():
            values = stiffness_where_answered(result)
        case ComplianceMatrix():
            values = result.compliances
        case DeflectionUnder() | DisplacementUnder():
            wrench = np.array(output.wrench)
            F = np.broadcast_to(wrench, (*result.batch_shape, len(wrench)))
            bent = Deflection(F, cast("Stiffness", result))  # cables have no such output
            values, of_load = bent.twist.filled(np.nan), bent.status_codes
            if isinstance(output, DisplacementUnder):
                values = np.linalg.norm(values[:, : result.space.translations], axis=-1)
        case EntryOf():
            values, of_load = values_of(output.of, result)
            values = values[(slice(None), *output.place)]
        case WorstDeflection():
            values = worst_deflection(result.compliances)
        case PrincipalStiffness():
            definite = isinstance(result, Stiffness)  # K of cables may be indefinite
            values = principal_stiffnesses(stiffness_where_answered(result), definite=definite)
        case TensionsOf():
            cables = cast("CableStiffness", result)
            chosen = [cables.cable_names.index(name) for name in output.names]
            values = np.where(result.answered[:, None], cables.tensions[:, chosen], np.nan)
        case _:
            values = np.full((*result.batch_shape, *output.shape(result.space)), np.nan)
            of_load[result.answered] = int(Status.ILL_CONDITIONED)
    return values, of_load
