"""How the stiffness of a robot changes with its load, to first order, on recorded entries.

Every leg meets the platform, so that motions of its end are twists t of the platform; joints and
elastic parts follow them by the response of the unloaded leg, x = X t. With
``B_ij = sum_ab (d_b J_a) X_ai X_bj``, the second derivative of the motion, the leg that deflects
by t and carries W = K t has the stiffness ``K + K_1``:

``K_1,ij = E_ij(t) - W . B_ij - sum_k t_k ((K B_jk)_i + (K B_ik)_j)``

with E the third derivative of the elastic energy, that of beams which bending shortens.
"""

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
from robostiff.recorded import RecordedRobot
from robostiff.recorded.elimination import dot, least_size, most_size
from robostiff.recorded.leg import stiffness_entries
from robostiff.spatial import exact_number

_SAME = 1e-9  # of K: what free motions may change of it


@dataclass(frozen=True)
class LoadedTerms:
    """Stiffness without load, and its rate by the components of a wrench."""

    K: np.ndarray  # (n, n)
    K_by: np.ndarray  # (n, n, m): derivative of K by each component of the wrench


def loaded_terms(
    placed: PlacedRobot,
    recorded: RecordedRobot,
    components: Sequence[int],
    is_beam: Callable[[np.ndarray], bool],
) -> LoadedTerms:
    """Record how K changes with a wrench on the platform at the reference point.

    `recorded`: its elimination; `components`: which components of the wrench there are, among
    the n of K; `is_beam`: whether a compliance (6, 6) is that of a beam which bending shortens.

    Raises
    ------
    InputError
        When a leg has parallel blocks, coupled joints, springs with freedoms, stiffnesses that
        depend on a coordinate, or more joints than it needs; or the wrench does work on a free
        motion of the platform.
    """
    n = recorded.space.size
    K = np.array(
        [[recorded.K[min(i, j), max(i, j)] for j in range(n)] for i in range(n)], dtype=object
    )
    factors = recorded.factors
    deflections = [factors.solved([int(i == c) for i in range(n)]) for c in components]
    free = _free_motions(recorded)
    along_free = [zeros(n, n) for _ in free]
    K_by = zeros(n, n, len(components))
    for own, leg in zip(placed.legs, recorded.legs, strict=True):
        upper = stiffness_entries([leg], n)
        K_leg = zeros(n, n)
        for (i, j), value in upper.items():
            K_leg[i, j] = K_leg[j, i] = value
        response = LegResponse.of(own.leg, placed, K_leg)
        B, shapes = response.second_derivative(), response.shapes(is_beam, placed.record.count)
        for i, t in enumerate(free):
            along_free[i] += _rate(K_leg, B, shapes, t, times(K_leg, t))
        for m, t in enumerate(deflections):
            alone = len(placed.legs) == 1
            W = [int(i == components[m]) for i in range(n)] if alone else times(K_leg, t)
            K_by[:, :, m] += _rate(K_leg, B, shapes, t, W)
    _check_free_motions(recorded, components, along_free, free)
    return LoadedTerms(K, K_by)


def _free_motions(recorded: RecordedRobot) -> list[list[Any]]:
    """Basis of the twists that K lets go free."""
    factors = recorded.factors
    found = []
    for own in sorted(set(range(factors.size)) - set(factors.pivots)):
        x: list[Any] = [int(i == own) for i in range(factors.size)]
        for column, pivot in reversed(list(zip(factors.columns, factors.pivots, strict=True))):
            rest = [0 if i == pivot else c for i, c in enumerate(column)]
            x[pivot] = 0 - dot(rest, x)
        found.append(x)
    return found


def _check_free_motions(
    recorded: RecordedRobot, components: Sequence[int], rates: Sequence[np.ndarray], free: Any
) -> None:
    """Raise where the load does work on a free motion, or K changes along one."""
    space, name = recorded.space, recorded.name
    sizes = [1.0 if row < 3 else recorded.length for row in space.rows]
    largest = max(most_size(x) / (sizes[i] * sizes[j]) for (i, j), x in recorded.K.items())
    for t, rate in zip(free, rates, strict=True):
        size = max(most_size(x) * s for x, s in zip(t, sizes, strict=True)) / recorded.length
        works = [i for i in components if most_size(t[i]) * sizes[i] > _SAME * size]
        changes = max(most_size(x) / (sizes[i] * sizes[j]) for (i, j), x in np.ndenumerate(rate))
        if works:
            got = f"{space.wrench_order[works[0]]}, which does work on a free motion"
            hint = "give the passive joint a stiffness, or leave that component of the wrench out"
        elif changes > _SAME * largest * size:
            got = "a free motion of the platform along which K changes"
            hint = "the posture follows from higher orders of the load: ask rs.equilibrium"
        else:
            continue
        raise InputError(
            f"stiffness of {name!r} to first order in the load",
            got=got,
            expected="a posture that the load decides",
            hint=hint,
        )


def _rate(
    K: np.ndarray, B: np.ndarray, shapes: Sequence[BeamInLeg], t: Sequence[Any], W: Sequence[Any]
) -> np.ndarray:
    """K_1 of a leg that deflects by t and carries W (n, n)."""
    n = len(K)
    found = zeros(n, n)
    by_load = zeros(n, n)
    for i in range(n):
        D = [dot(B[row, i], t) for row in range(n)]
        by_load[:, i] = [dot(K[row], D) for row in range(n)]
    for i in range(n):
        for j in range(n):
            found[i, j] = 0 - dot(W, B[:, i, j]) - by_load[i, j] - by_load[j, i]
    for shape in shapes:
        found = found + shape.curvature(t)
    return found


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
