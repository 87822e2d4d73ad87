"""What the elements of a leg do by unit twists of its end, and how it goes on to second order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.errors import InputError
from robostiff.model import (
    CoupledFreedom,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    StiffnessLaw,
)
from robostiff.record import Entry, is_zero
from robostiff.recorded.elimination import dot, least_size
from robostiff.spatial import exact_number

_NOTHING = 1e-11  # of its terms: rounding
_HALF = exact_number(1) / 2


@dataclass(frozen=True)
class BeamInLeg:
    """A beam in the response of its leg: stretch u (n), bending th (6, n), EA/L, and G th."""

    axial: Any
    u: np.ndarray
    th: np.ndarray
    G_th: np.ndarray

    def curvature(self, t: Sequence[Any]) -> np.ndarray:
        """Third derivative of ``EA/L u (th^T G th) / 2`` along t (n, n)."""
        n = len(self.u)
        u_t, th_t = dot(self.u, t), [dot(row, t) for row in self.th]
        found = zeros(n, n)
        for i in range(n):
            for j in range(i, n):
                both = product(u_t, dot(self.th[:, i], self.G_th[:, j]))
                both = both + product(self.u[i], dot(th_t, self.G_th[:, j]))
                both = both + product(self.u[j], dot(th_t, self.G_th[:, i]))
                found[i, j] = found[j, i] = product(self.axial, both)
        return found


@dataclass(frozen=True)
class _Moved:
    """What one element does by unit twists of the end of its leg."""

    # v, w: (3, n): velocity of the reference point, rate of turn
    v: np.ndarray
    w: np.ndarray
    v_turned: np.ndarray  # (3, n): the part of v that is due to turning
    spring: PlacedSpring | None = None
    own: np.ndarray | None = None  # (6, n): deflection of a spring in its own axes


@dataclass(frozen=True)
class LegResponse:
    """The elements of a leg, from the base, in the response of the unloaded leg."""

    moved: tuple[_Moved, ...]
    rows: tuple[int, ...]

    @classmethod
    def of(cls, leg: PlacedLeg, placed: PlacedRobot, K: np.ndarray) -> LegResponse:
        """What the elements do by unit twists of the end; K is the stiffness of the leg (n, n).

        Raises
        ------
        InputError
            When an element is none of those for which it is written, or a joint is redundant.
        """
        reference, rows = placed.reference, tuple(placed.entries.space.rows)
        n = len(rows)
        wrench = zeros(6, n)
        wrench[list(rows)] = K
        left = np.array([[int(i == row) for row in rows] for i in range(6)], dtype=object)
        moved: list[_Moved | np.ndarray] = []
        for element in leg.elements:
            _check(element, leg.name)
            if isinstance(element, PlacedSpring):
                moved.append(_spring_moved(element, reference, wrench, rows))
            elif isinstance(element, PlacedFreedom):
                twist = _twist(element, reference)
                if element.is_passive:
                    moved.append(twist)
                    continue
                if element.stiffness is None:
                    continue
                q = [dot(twist, wrench[:, j]) / element.stiffness for j in range(n)]
                moved.append(_joint_moved(twist, q))
        for one in moved:
            if isinstance(one, _Moved):
                left = left - np.concatenate([one.v, one.w])
        passive = [one for one in moved if isinstance(one, np.ndarray)]
        if passive:
            sizes = np.array([1.0 if row < 3 else placed.length for row in rows])
            J = np.array([p[list(rows)] for p in passive], dtype=object).T
            found = iter(_closing(J, left[list(rows)], sizes, leg.name))
            moved = [m if isinstance(m, _Moved) else _joint_moved(m, next(found)) for m in moved]
        return cls(tuple(m for m in moved if isinstance(m, _Moved)), rows)

    def second_derivative(self) -> np.ndarray:
        """B (n, n, n): rows, then the column that turns along, then the motion."""
        n = len(self.rows)
        B = zeros(6, n, n)
        before = zeros(3, n)  # turned by all elements nearer to the base
        for one in self.moved:
            for i in range(n):
                for j in range(n):
                    v = _crossed(before[:, i], one.v[:, j]) + _crossed(before[:, j], one.v[:, i])
                    w = _crossed(before[:, j], one.w[:, i])
                    there, back = (
                        _crossed(one.w[:, i], one.v_turned[:, j]),
                        _crossed(one.w[:, j], one.v_turned[:, i]),
                    )
                    v = v + _HALF * (there + back)
                    if one.spring is not None:
                        w = w + _HALF * _crossed(one.w[:, j], one.w[:, i])
                    B[:3, i, j] += v
                    B[3:, i, j] += w
            before = before + one.w
        return B[list(self.rows)]

    def shapes(self, is_beam: Callable[[np.ndarray], bool], count: int) -> list[BeamInLeg]:
        """Its beams that bending shortens."""
        found = []
        for one in self.moved:
            if one.spring is None or one.own is None:
                continue
            C: Any = one.spring.elasticity.compliance
            at = np.array(
                [
                    [x.sample if isinstance(x, Entry) else np.full(count, float(x)) for x in row]
                    for row in C
                ]
            )
            if not all(is_beam(at[:, :, s]) for s in range(count)):
                continue
            L = C[1, 5] * 2 / C[5, 5]
            th = one.own
            G_th = zeros(*th.shape)
            for d, r, sign in ((1, 5, -1), (2, 4, 1)):
                tenth = exact_number(sign) / 10
                G_th[d] = th[d] * (exact_number(6) / 5) / L + th[r] * tenth
                G_th[r] = th[d] * tenth + th[r] * (exact_number(2) / 15) * L
            found.append(BeamInLeg(1 / C[0, 0], th[0], th, G_th))
        return found


def _check(element: Any, leg: str) -> None:
    """Raise where an element is none of those for which the terms are written."""
    got = None
    if isinstance(element, PlacedBlock):
        got = "a parallel block"
    elif isinstance(element, CoupledFreedom):
        got = "coupled joints"
    elif isinstance(element, PlacedSpring):
        if element.elasticity.freedoms.size:
            got = "a spring with freedoms"
    elif not element.is_passive and isinstance(element.role.stiffness, StiffnessLaw):
        got = "a stiffness that depends on the coordinate of its drive"
    if got is not None:
        raise InputError(
            f"leg {leg!r} to first order in the load",
            got=got,
            expected="joints and elastic parts in series, of constant stiffness",
            hint="ask rs.equilibrium(robot, pose, wrench).K, in numbers",
        )


def _twist(freedom: PlacedFreedom, reference: np.ndarray) -> np.ndarray:
    """Twist of the point at the reference by a unit of the joint (6,)."""
    axis = np.array(freedom.axis, dtype=object)
    if not freedom.turns:
        return np.concatenate([axis, [0, 0, 0]])
    v = _crossed(axis, reference - freedom.point)
    if not is_zero(freedom.pitch):
        v = v + axis * freedom.pitch
    return np.concatenate([v, axis])


def _joint_moved(twist: np.ndarray, q: Sequence[Any]) -> _Moved:
    whole = np.array([[product(x, one) for one in q] for x in twist], dtype=object)
    return _Moved(whole[:3], whole[3:], whole[:3])


def _spring_moved(
    spring: PlacedSpring, reference: np.ndarray, wrench: np.ndarray, rows: Sequence[int]
) -> _Moved:
    """What a spring does where its leg carries wrenches (6, n) at the reference point."""
    R: Any = np.array(spring.rotation, dtype=object)
    C: Any = spring.elasticity.compliance
    arm = reference - spring.point
    n = wrench.shape[1]
    own, v, w, turned = zeros(6, n), zeros(3, n), zeros(3, n), zeros(3, n)
    for j in range(n):
        f, m = wrench[:3, j], wrench[3:, j] + _crossed(arm, wrench[:3, j])
        felt = [*times(R.T, f), *times(R.T, m)]
        th = times(C, felt)
        world = [*times(R, th[:3]), *times(R, th[3:])]
        world = [x if i in rows else 0 for i, x in enumerate(world)]
        d, r = np.array(world[:3], dtype=object), np.array(world[3:], dtype=object)
        own[:, j] = [*times(R.T, d), *times(R.T, r)]
        turned[:, j], w[:, j] = _crossed(r, arm), r
        v[:, j] = d + turned[:, j]
    return _Moved(v, w, turned, spring, own)


def _closing(J: np.ndarray, left: np.ndarray, sizes: np.ndarray, leg: str) -> list[list[Any]]:
    """Motions q (p, n) of passive joints with J q = left, rows of which agree.

    Raises
    ------
    InputError
        When a joint adds no freedom to the others.
    """
    rows = [[*J[i], *left[i]] for i in range(len(J))]
    count = J.shape[1]
    open_ = list(range(len(rows)))
    order: list[int] = []
    for column in range(count):
        large = {i: least_size(rows[i][column]) * sizes[i] for i in open_}
        pivot = max(open_, key=lambda i: large[i], default=None)
        if pivot is None or large[pivot] <= _NOTHING * max(sizes):
            raise InputError(
                f"leg {leg!r} to first order in the load",
                got="passive joints that add no freedom to the others",
                expected="joints that the platform holds",
                hint="leave the redundant joint out; K does not depend on it",
            )
        open_.remove(pivot)
        order.append(pivot)
        own = rows[pivot][column]
        rows[pivot] = [0 if is_zero(x) else x / own for x in rows[pivot]]
        for i, row in enumerate(rows):
            if i != pivot and not is_zero(row[column]):
                factor = row[column]
                rows[i] = [a - product(factor, b) for a, b in zip(row, rows[pivot], strict=True)]
    return [rows[pivot][count:] for pivot in order]


def times(A: Any, x: Any) -> list[Any]:
    """``A x``; zeros leave no trace."""
    return [dot(row, x) for row in A]


def product(a: Any, b: Any) -> Any:
    """``a b``; zeros leave no trace."""
    return 0 if is_zero(a) or is_zero(b) else a * b


def _crossed(a: Any, b: Any) -> np.ndarray:
    """``a x b``; zeros leave no trace."""
    return np.array(
        [
            product(a[1], b[2]) - product(a[2], b[1]),
            product(a[2], b[0]) - product(a[0], b[2]),
            product(a[0], b[1]) - product(a[1], b[0]),
        ],
        dtype=object,
    )


def zeros(*shape: int) -> np.ndarray:
    """An array of zeros, to hold entries."""
    return np.zeros(shape, dtype=int).astype(object)
