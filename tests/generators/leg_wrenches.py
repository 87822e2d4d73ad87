"""Robots in 60 digits: the system over leg wrenches, min f.Cf / 2 subject to the equilibrium."""
# pyright: reportInvalidTypeForm=false
# pyright: reportArgumentType=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false

from __future__ import annotations

from dataclasses import dataclass

import mpmath as mp
import numpy as np

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.model import PlacedElement, PlacedFreedom, PlacedLeg, PlacedSpring
from tests.generators.chains import drawn_pitch

DIGITS = 60
_ZERO = mp.mpf(10) ** -45
_NOTHING = 1e-40  # a compliance below is what rounding leaves of zero


@dataclass(frozen=True)
class Exact:
    """Stiffness, None where a direction is rigid, and compliance, None where one is free."""

    K: np.ndarray | None
    C: np.ndarray | None


def exact_statics(snapshot: rs.Snapshot) -> Exact:
    """K and C of legs without parallel blocks about the reference point.

    Everything that floats say is taken as exact. A saddle point system over the sizes of the leg
    wrenches and the twist, ``[[D, W^T], [W, 0]]``, solved by elimination.
    """
    with mp.workdps(DIGITS):
        legs = [_leg(leg, snapshot.reference_point) for leg in snapshot.legs]
        regular = all(_rank(D) == D.rows for _, D in legs)
        K = mp.zeros(6) if regular else None
        if K is not None:
            for W, D in legs:
                if W.cols:
                    K += W * mp.inverse(D) * W.T
        return Exact(None if K is None else _floats(K), _compliance(legs))


def _compliance(legs: list[tuple[mp.matrix, mp.matrix]]) -> np.ndarray | None:
    m = sum(W.cols for W, _ in legs)
    whole, start = mp.zeros(6, m), 0
    S = mp.zeros(m + 6)
    for W, D in legs:
        for j in range(W.cols):
            for i in range(6):
                whole[i, start + j] = S[m + i, start + j] = S[start + j, m + i] = W[i, j]
            for i in range(W.cols):
                S[start + i, start + j] = D[i, j]
        start += W.cols
    if _rank(whole) < 6:
        return None
    right = mp.zeros(m + 6, 6)
    for i in range(6):
        right[m + i, i] = 1
    # Stresses between rigid parts are open: rows that say nothing are left out.
    C = -_floats(_solved(S, right)[m:, :])
    return np.where(np.abs(C) < _NOTHING, 0.0, C)


def _leg(leg: PlacedLeg, at: np.ndarray) -> tuple[mp.matrix, mp.matrix]:
    columns, springs = [], []
    for element in leg.elements:
        v = _vector(at) - _vector(element.point)
        if isinstance(element, PlacedSpring):
            J = mp.zeros(6)
            for k in range(3):
                axis = _vector(element.rotation[:, k])
                lever = _cross(axis, v)
                for i in range(3):
                    J[i, k] = J[3 + i, 3 + k] = axis[i]
                    J[i, 3 + k] = lever[i]
            springs.append((J, mp.matrix(element.elasticity.compliance.tolist())))
            continue
        axis = _vector(element.axis)
        if element.pitch is None:
            twist = mp.matrix([*axis, 0, 0, 0])
        else:
            h = mp.mpf(float(element.pitch))
            twist = mp.matrix([*(_cross(axis, v) + h * axis), *axis])
        if element.is_passive:
            columns.append(twist)
        elif element.stiffness is not None:
            springs.append((twist, mp.matrix([[1 / mp.mpf(float(element.stiffness))]])))
    W = _null_space(columns)
    D = mp.zeros(W.cols)
    for J, C in springs:
        D += (J.T * W).T * C * (J.T * W)
    return W, D


def _null_space(columns: list[mp.matrix]) -> mp.matrix:
    """Wrenches that do no work on any of the twists (6, m)."""
    rows = mp.zeros(max(len(columns), 1), 6)
    for i, column in enumerate(columns):
        for j in range(6):
            rows[i, j] = column[j]
    pivots = _eliminated(rows)
    free = [j for j in range(6) if j not in pivots.values()]
    W = mp.zeros(6, len(free))
    for k, j in enumerate(free):
        W[j, k] = 1
        for row, pivot in pivots.items():
            W[pivot, k] = -rows[row, j]
    return W


def _eliminated(A: mp.matrix, columns: int | None = None) -> dict[int, int]:
    """Gauss and Jordan in place, the largest pivot of what is left first; row to column."""
    columns = A.cols if columns is None else columns
    size = max((abs(A[i, j]) for i in range(A.rows) for j in range(columns)), default=mp.mpf(0))
    pivots: dict[int, int] = {}
    while True:
        left = [
            (abs(A[i, j]), i, j)
            for i in range(A.rows)
            if i not in pivots
            for j in range(columns)
            if j not in pivots.values()
        ]
        largest, row, column = max(left, default=(mp.mpf(0), 0, 0))
        if largest <= _ZERO * size:
            return pivots
        pivots[row] = column
        lead = A[row, column]
        for j in range(A.cols):
            A[row, j] /= lead
        for i in range(A.rows):
            factor = A[i, column]
            if i != row and factor:
                for j in range(A.cols):
                    A[i, j] -= factor * A[row, j]


def _rank(A: mp.matrix) -> int:
    if not A.cols:
        return 0
    return len(_eliminated(_evened(A)))


def _evened(A: mp.matrix) -> mp.matrix:
    """A positive semidefinite matrix with ones on its diagonal; any other as it is."""
    B = A.copy()
    if A.rows == A.cols:
        size = [mp.sqrt(A[i, i]) if A[i, i] > 0 else mp.mpf(1) for i in range(A.rows)]
        for i in range(A.rows):
            for j in range(A.rows):
                B[i, j] = A[i, j] / size[i] / size[j]
    return B


def _solved(S: mp.matrix, right: mp.matrix) -> mp.matrix:
    whole = mp.zeros(S.rows, S.cols + right.cols)
    whole[:, : S.cols], whole[:, S.cols :] = S, right
    pivots = _eliminated(whole, S.cols)
    solution = mp.zeros(S.cols, right.cols)
    for row, column in pivots.items():
        for j in range(right.cols):
            solution[column, j] = whole[row, S.cols + j]
    return solution


def _vector(values: np.ndarray) -> mp.matrix:
    return mp.matrix([mp.mpf(float(x)) for x in values])


def _cross(a: mp.matrix, b: mp.matrix) -> mp.matrix:
    return mp.matrix(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def _floats(A: mp.matrix) -> np.ndarray:
    return np.array([[float(A[i, j]) for j in range(A.cols)] for i in range(A.rows)])


def beam_compliance(length: float, radius: float, E: float = 2.1e11) -> np.ndarray:
    """Tip of a round Euler-Bernoulli beam, nu = 0.3."""
    A, I = np.pi * radius**2, np.pi * radius**4 / 4
    C = np.diag([1 / A, length**2 / 3 / I, length**2 / 3 / I, 1.3 / I, 1 / I, 1 / I]) * length / E
    C[1, 5] = C[5, 1] = length**2 / (2 * E * I)
    C[2, 4] = C[4, 2] = -C[1, 5]
    return C


def random_frame(rng: np.random.Generator) -> np.ndarray:
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.sign(np.diag(R)) * np.linalg.det(Q * np.sign(np.diag(R)))


def random_beam(rng: np.random.Generator, slenderness: float, name: str = "beam") -> PlacedSpring:
    """A beam of 0.3 to 1 m somewhere; `slenderness` is its radius over its length."""
    length = rng.uniform(0.3, 1.0)
    C = beam_compliance(length, slenderness * length)
    return PlacedSpring(name, rng.uniform(-1, 1, 3), random_frame(rng), Elasticity(C))


def passive_joint(rng: np.random.Generator, name: str = "joint") -> PlacedFreedom:
    axis = rng.normal(size=3)
    pitch = drawn_pitch(rng.uniform(), 0.2, 0.4)
    unit = axis / np.linalg.norm(axis)
    return PlacedFreedom(unit, rng.uniform(-1, 1, 3), pitch, name, rs.Passive())


def drive(rng: np.random.Generator, stiffness: float, name: str = "drive") -> PlacedFreedom:
    axis = rng.normal(size=3)
    pitch = drawn_pitch(rng.uniform(), 0.5, 0.7)
    unit = axis / np.linalg.norm(axis)
    return PlacedFreedom(unit, rng.uniform(-1, 1, 3), pitch, name, rs.Actuated(stiffness))


def robot_of(legs: list[list[PlacedElement]], rng: np.random.Generator) -> rs.Snapshot:
    """Legs of these elements that meet at a random point."""
    end = rng.uniform(-1, 1, 3)
    placed = tuple(PlacedLeg(f"leg{i}", tuple(own), end) for i, own in enumerate(legs))
    return rs.Snapshot("random", placed, end)
