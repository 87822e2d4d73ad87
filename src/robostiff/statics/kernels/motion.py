"""Elements of chains in finite motion on recorded entries: columns, forces, second order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.model import PlacedFreedom, PlacedSpring
from robostiff.record import cosine, is_zero, reciprocal, sine, square_root, usual_size
from robostiff.spatial import Space, cross
from robostiff.statics.chains.beam_bowing import (
    among_motions,
    bending_planes,
    bowing,
    bowing_energy,
    part_of_beam,
)
from robostiff.statics.chains.chain import BodyLoad, FiniteSpring

# Of the product of two diagonal entries of a compliance: a square beside it that is rounding.
_LOST = 1e-20
#: Square of the turn of an elastic part beyond which its series lose digits [rad^2].
FURTHEST_TURN = 0.04
_b = (1 / 2, -1 / 24, 1 / 720, -1 / 40320, 1 / 3628800)
_c = (1 / 6, -1 / 120, 1 / 5040, -1 / 362880, 1 / 39916800)
_b_rate = (-1 / 12, 1 / 180, -1 / 6720, 1 / 453600, -1 / 47900160)
_c_rate = (-1 / 60, 1 / 1260, -1 / 60480, 1 / 4989600, -1 / 622702080)


@dataclass(frozen=True)
class RecordedJoint:
    """A joint that moves by q along its screw, at the unloaded posture; see `FiniteJoint`."""

    # (3,) of entries and numbers
    point: np.ndarray
    axis: np.ndarray
    turns: bool
    slide: Any  # entry or number: shift for each unit of q
    stiffness: Any  # entry or number: 0 where it is passive
    # entry or number: with which it pushes along its coordinate at q = 0 [N or N m]
    preload: Any = 0

    size = 1

    def sample_sizes(self, length: float) -> list[float]:
        """A unit of motion of its coordinate: a radian, or the length of the robot."""
        return [1.0 if self.turns else length]

    @property
    def springs(self) -> list[Any]:
        """Stiffness of its coordinate, 0 of a passive one."""
        return [self.stiffness]


@dataclass(frozen=True)
class RecordedSpring:
    """An elastic part, ``(d, r) = V y`` with the energy ``sum(k y^2) / 2``; see `FiniteSpring`."""

    point: np.ndarray  # (3,) of entries and numbers: its far end at the unloaded posture
    rotation: np.ndarray  # (3, 3) of entries and numbers: its own axes
    # (6, m) of entries and numbers: V, each column of about the length of the robot or a radian
    modes: np.ndarray
    stiffness: list[Any]  # entries and numbers: k, 0 along a freedom
    axial: Any  # entry or number: EA/L of a beam with bowing [N/m]; 0 of a linear spring
    bowing: np.ndarray  # (m, m) of entries and numbers: ``y^T S y / 2`` is its shortening

    @property
    def size(self) -> int:
        """Number of its coordinates."""
        return len(self.stiffness)

    def sample_sizes(self, length: float) -> list[float]:
        """A unit of motion of each coordinate."""
        return [1.0] * self.size

    @property
    def springs(self) -> list[Any]:
        """Stiffness of each coordinate, 0 along freedoms."""
        return self.stiffness


RecordedElement = RecordedJoint | RecordedSpring


def recorded_joint(freedom: PlacedFreedom, preload: float = 0.0) -> RecordedJoint:
    """A placed freedom as an element."""
    k = freedom.stiffness
    return RecordedJoint(
        np.array(freedom.point, dtype=object),
        np.array(freedom.axis, dtype=object),
        freedom.turns,
        freedom.advance(1),
        0 if k is None else k,
        preload,
    )


def recorded_springs(
    spring: PlacedSpring, like: FiniteSpring, parts: int, space: Space, length: float
) -> list[RecordedElement]:
    """An elastic part as one spring, or a beam as so many elements.

    `like` is the same part of one leg in numbers: whether it bows. `length` is that of the robot
    [m].
    """
    C = np.array(spring.elasticity.compliance, dtype=object)
    free = np.array(spring.elasticity.freedoms, dtype=object)
    rotation = np.array(spring.rotation, dtype=object)
    point = np.array(spring.point, dtype=object)
    bows, shifts = bool(np.any(like.axial)), [None]
    beam, axial = (2 * C[1, 5] / C[5, 5], parts / C[0, 0]) if bows else (0, 0)
    if bows:
        C = part_of_beam(C, beam, parts)
        x = rotation[:, 0] * beam
        shifts = [x * ((i + 1) / parts - 1) if i + 1 < parts else None for i in range(parts)]
    V, stiffness = _coordinates(C, free, rotation, space, length)
    S: np.ndarray = np.zeros((len(stiffness),) * 2, dtype=int).astype(object)
    if bows:
        inner = like.size > len(stiffness)
        planes = bending_planes(space, rotation)
        S, more = bowing(V, C, beam * (1 / parts), planes, inner=inner)
        V, stiffness = np.pad(V, ((0, 0), (0, len(more)))), [*stiffness, *more]
    return [
        RecordedSpring(point if shift is None else point + shift, rotation, V, stiffness, axial, S)
        for shift in shifts
    ]


def _coordinates(
    C: np.ndarray, free: np.ndarray, rotation: np.ndarray, space: Space, length: float
) -> tuple[np.ndarray, list[Any]]:
    """V (6, m) of an elastic part of a compliance and freedoms; stiffness of its columns."""
    own, C, free = among_motions(space, rotation, C, free)
    modes = _modes(C)
    columns = [own @ column for column in modes] + [own @ column for column in free.T]
    V, stiffness = [], []
    for i, column in enumerate(columns):
        sizes = [usual_size(x) / (length if k < 3 else 1.0) for k, x in enumerate(column)]
        size = max(*sizes, 1e-300)
        V.append(column * (1 / size))
        stiffness.append(1 / size**2 if i < len(modes) else 0)
    return np.array(V, dtype=object).T.reshape(6, len(V)), stiffness


def _modes(C: np.ndarray) -> list[np.ndarray]:
    """Twists F in columns with ``sum F F^T = C``; rotations come first, as in bending."""
    left, found = C.copy(), []
    for i in reversed(range(len(C))):
        pivot = left[i, i]
        if usual_size(pivot) <= _LOST**0.5 * usual_size(C[i, i]):
            continue
        column = left[:, i] * reciprocal(square_root(pivot))
        found.append(column)
        for a in range(i + 1):
            for b in range(i + 1):
                if is_zero(column[a]) or is_zero(column[b]):
                    continue
                rest = left[a, b] - column[a] * column[b]
                lost = usual_size(rest) ** 2 <= _LOST * usual_size(C[a, a]) * usual_size(C[b, b])
                left[a, b] = 0 if lost else rest
    return found


def identity() -> np.ndarray:
    """Axes that have not turned."""
    return np.eye(3, dtype=int).astype(object)


@dataclass(frozen=True)
class Body:
    """A body that has moved: what was at X is at ``at + R (X - origin)``."""

    R: np.ndarray  # (3, 3) of entries and numbers
    # (3,) of entries and numbers: a point of it at the unloaded posture, and where it is [m]
    origin: np.ndarray
    at: np.ndarray

    def of(self, point: np.ndarray) -> np.ndarray:
        """Where a point of the unloaded posture is."""
        return self.at + self.R @ (point - self.origin)


@dataclass(frozen=True)
class Column:
    """How a chain moves by one coordinate, of an element, or of the body at the start (-1).

    With velocity v about a point [m], and angular velocity w, (3,) arrays of entries and numbers.
    """

    element: int
    v: np.ndarray
    w: np.ndarray
    at: np.ndarray


@dataclass(frozen=True)
class ChainEquations:
    """What a chain contributes to the equations of its leg."""

    end: Body
    P: np.ndarray  # (3,) of entries and numbers: its end point [m]
    J: list[np.ndarray]  # twist of the end about P, by the coordinates
    # entries and numbers: upper triangle of the Hessian of the energy less the work of the wrench
    T: dict[tuple[int, int], Any]
    gradient: list[Any]  # entries and numbers
    turns: list[Any]  # entries and numbers: squares of the turns of elastic parts


class MovingChain:
    """A chain at its coordinates, passed from base to platform.

    Parameters
    ----------
    elements : sequence of RecordedElement
    x : (n,) array of entries and numbers
    start : Body
    body_rows : sequence of int
        Coordinates of the body at the start, where that moves.
    """

    def __init__(
        self,
        elements: Sequence[RecordedElement],
        x: np.ndarray,
        start: Body,
        body_rows: Sequence[int],
    ) -> None:
        self.body, self.bodies = start, [start]
        self.columns: list[Column] = []
        self.stored: list[Any] = []  # gradient of the energy
        self.curved: dict[tuple[int, int], Any] = {}
        self.springs: list[tuple[RecordedSpring, int, np.ndarray, np.ndarray]] = []
        self.turns: list[Any] = []
        unit = np.eye(6, dtype=int).astype(object)
        for row in body_rows:
            self.columns.append(Column(-1, unit[row, :3], unit[row, 3:], start.at))
            self.stored.append(0)
        at = 0
        for k, element in enumerate(elements):
            y = x[at : at + element.size]
            at += element.size
            if isinstance(element, RecordedJoint):
                self._joint(k, element, y[0])
            else:
                self._spring(k, element, y)
            self.bodies.append(self.body)

    def _joint(self, k: int, joint: RecordedJoint, q: Any) -> None:
        R = self.body.R
        axis = R @ joint.axis
        at = self.body.of(joint.point)
        if not is_zero(joint.slide):
            at = at + axis * (joint.slide * q)
        still = np.zeros(3, dtype=int).astype(object)
        turning = axis if joint.turns else still
        own = len(self.columns)
        self.curved[own, own] = joint.stiffness
        self.columns.append(Column(k, axis * joint.slide, turning, at))
        self.stored.append(joint.stiffness * q - joint.preload)
        if joint.turns:
            half = q * 0.5
            s = sine(half)
            a = _skew(joint.axis)
            R = R @ (identity() + a * (2 * s * cosine(half)) + (a @ a) * (2 * s * s))
        self.body = Body(R, joint.point, at)

    def _spring(self, k: int, spring: RecordedSpring, y: np.ndarray) -> None:
        V = spring.modes
        th = V @ y if len(y) else np.zeros(6, dtype=int).astype(object)
        r = th[3:]
        Q = self.body.R @ spring.rotation
        at = self.body.of(spring.point) + Q @ th[:3]
        turns = any(not is_zero(x) for x in V[3:].flat)
        R, W = self.body.R, identity()
        if turns:
            u = r @ r
            self.turns.append(u)
            S = _skew(r)
            SS = S @ S
            b, c = _series(_b, u), _series(_c, u)
            R = Q @ (identity() + S * (1 - u * c) + SS * b) @ spring.rotation.T
            W = identity() + S * b + SS * c
        first = len(self.columns)
        v, w = Q @ V[:3], Q @ (W @ V[3:])
        for j in range(spring.size):
            self.columns.append(Column(k, v[:, j], w[:, j], at))
        gradient, curvature = _stored(spring, y)
        self.stored += gradient
        for (a, b_), value in curvature.items():
            self.curved[first + a, first + b_] = value
        if turns:
            self.springs.append((spring, first, r, Q))
        self.body = Body(R, spring.point, at)

    def velocities(self, after: int, at: np.ndarray) -> list[np.ndarray]:
        """Of a point on the body behind so many elements, by the coordinates (3,) each."""
        still = np.zeros(3, dtype=int).astype(object)
        return [
            own.v + cross(own.w, at - own.at) if own.element < after else still
            for own in self.columns
        ]

    def terms(
        self, end_point: np.ndarray, W: np.ndarray, loads: Sequence[BodyLoad]
    ) -> ChainEquations:
        """Under the wrench (6,) that the body at its end exerts on it, and dead forces.

        With a nearer the base than b the second derivative is ``w_a . h_b``, symmetric part, ``h_b
        = v_b x f + s (f . w_b) - (s . f) w_b + w_b x m / 2``, where the wrench (f, m) acts at s
        from the point of b; dead forces on bodies beyond add ``sum(s (f . w_b) - (s . f) w_b)``
        alike. The wrench is about the end point, where the chain has it; the point is given at the
        unloaded posture [m].
        """
        P = self.body.of(end_point)
        f, m = W[:3], W[3:]
        acting = [(own.after, self.bodies[own.after].of(own.point), own.force) for own in loads]
        J, gradient = [], []
        T = dict(self.curved)
        felt: dict[int, np.ndarray] = {}
        for b, column in enumerate(self.columns):
            v, w, s = column.v, column.w, P - column.at
            J.append(np.concatenate([v + cross(w, s), w]))
            N = np.zeros((3, 3), dtype=int).astype(object)
            more = N[0]
            for after, at, force in acting:
                if after > column.element:
                    more, N = more + force, N + (at - column.at)[:, None] * force[None, :]
            spread = N[0, 0] + N[1, 1] + N[2, 2]
            turned = np.array([N[1, 2] - N[2, 1], N[2, 0] - N[0, 2], N[0, 1] - N[1, 0]])
            beyond = m + cross(s, f) + turned
            felt[b] = beyond
            gradient.append(self.stored[b] - (v @ (f + more) + w @ beyond))
            turning = any(not is_zero(x) for x in w)
            fw, sf = f @ w, s @ f
            h = cross(v, f + more)
            if turning:
                h = h + s * fw - w * sf + cross(w, m) * 0.5 + N @ w - w * spread
            for a in range(b + 1):
                other = self.columns[a]
                if all(is_zero(x) for x in other.w):
                    continue
                if other.element != column.element:
                    T[a, b] = T.get((a, b), 0) - other.w @ h
                elif turning:
                    both = (other.w @ s) * fw + (w @ s) * (f @ other.w)
                    both = both + other.w @ (N @ w) + w @ (N @ other.w)
                    T[a, b] = T.get((a, b), 0) - (both * 0.5 - (sf + spread) * (other.w @ w))
        for spring, first, r, Q in self.springs:
            D = _rate_felt(r, Q.T @ felt[first])
            V = spring.modes[3:]
            DV = D @ V
            for b in range(spring.size):
                for a in range(b + 1):
                    place = first + a, first + b
                    T[place] = T.get(place, 0) - V[:, a] @ DV[:, b]
        return ChainEquations(self.body, P, J, T, gradient, self.turns)


def _rate_felt(r: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Symmetric part of the derivative of ``m . W(r)`` by r; see `FiniteTurn.rate_felt`."""
    u2 = r @ r
    b_rate, c, c_rate = (_series(own, u2) for own in (_b_rate, _c, _c_rate))
    u = cross(m, r)
    rows = u * b_rate + cross(u, r) * c_rate - m * c
    outer = rows[:, None] * r[None, :]
    return (outer + outer.T) * 0.5 + identity() * (c * (m @ r))


def _stored(spring: RecordedSpring, y: np.ndarray) -> tuple[list[Any], dict[tuple[int, int], Any]]:
    """Gradient and curvature (upper triangle) of the energy by y; see `MovingChains`."""
    k = spring.stiffness
    gradient = [own * q for own, q in zip(k, y, strict=True)]
    curvature: dict[tuple[int, int], Any] = {(i, i): own for i, own in enumerate(k)}
    if is_zero(spring.axial):
        return gradient, curvature
    _, force, bent = bowing_energy(y, spring.axial, spring.modes[0], spring.bowing)
    for b in range(spring.size):
        gradient[b] = gradient[b] + force[b]
        for a in range(b + 1):
            curvature[a, b] = curvature.get((a, b), 0) + bent[a, b]
    return gradient, curvature


def _series(coefficients: Sequence[float], u: Any) -> Any:
    value: Any = coefficients[-1]
    for own in reversed(coefficients[:-1]):
        value = value * u + own
    return value


def _skew(v: np.ndarray) -> np.ndarray:
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=object)
