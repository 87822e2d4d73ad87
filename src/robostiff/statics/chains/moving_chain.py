"""Chains in finite motion: where their bodies are, velocities, energy, and second derivatives.

All elements of all chains of a robot are computed at once. Arrays hold floats, or entries of a
record: what is zero there leaves no operation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from robostiff.frozen import frozen
from robostiff.record import cosine, sine
from robostiff.spatial import skew
from robostiff.statics.chains.elements import (
    Bending,
    BowingTerms,
    FiniteChain,
    FiniteJoint,
    FiniteSpring,
)
from robostiff.statics.chains.numbers import WIDE, ChainNumbers, side_by_side

#: Turn of an elastic part up to which series answer [rad]; entries have nothing else.
FURTHEST_TURN = 0.2
_SKEWS = skew(np.eye(3)).reshape(3, 9)
# b, c, and their derivatives by a, divided by a: by powers of a^2.
_SERIES = np.array(
    [
        [1 / 2, 1 / 6, -1 / 12, -1 / 60],
        [-1 / 24, -1 / 120, 1 / 180, 1 / 1260],
        [1 / 720, 1 / 5040, -1 / 6720, -1 / 60480],
        [-1 / 40320, -1 / 362880, 1 / 453600, 1 / 4989600],
        [1 / 3628800, 1 / 39916800, -1 / 47900160, -1 / 622702080],
    ]
)
NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


@frozen
class FiniteTurn:
    """Rotation exp(r x) and its angular velocity W dr: the left Jacobian of SO(3).

    ``W = I + b S + c S^2`` with ``S = (r x)``, ``a = |r|``, ``b = (1 - cos a)/a^2`` and
    ``c = (a - sin a)/a^3``.
    """

    r: np.ndarray  #: (..., 3): rotation vectors [rad]
    square: np.ndarray  #: (..., 1): a^2
    #: R, W (..., 3, 3): ``d exp(r x) = ((W dr) x) exp(r x)``
    R: np.ndarray
    W: np.ndarray
    factors: np.ndarray  #: (..., 4): b, c, and their derivatives by a, divided by a

    @staticmethod
    def of(r: np.ndarray) -> FiniteTurn:
        """Turn by rotation vectors (..., 3) [rad], of numbers or of entries."""
        S, u = skews(r), (r * r).sum(axis=-1, keepdims=True)
        is_near = np.ones(u.shape, dtype=bool) if u.dtype == object else u < FURTHEST_TURN**2
        are_near = bool(np.all(is_near))
        near = u if are_near else np.where(is_near, u, 0)
        square, one = near * near, np.ones(u.shape, dtype=int).astype(u.dtype)
        powers = [one, near, square, square * near, square * square]
        factors = np.concatenate(powers, axis=-1) @ _SERIES
        if not are_near:
            a = np.sqrt(np.where(is_near, 1.0, u))
            s, v = np.sin(a), 2.0 * np.sin(0.5 * a) ** 2
            far = (
                v / a**2,
                (a - s) / a**3,
                (s / a**2 - 2 * v / a**3) / a,
                (v / a**3 - 3 * (a - s) / a**4) / a,
            )
            factors = np.where(is_near, factors, np.concatenate(far, axis=-1))
        SS = S @ S
        b, c = factors[..., :1, None], factors[..., 1:2, None]
        first = 1 - u[..., None] * c
        unit = np.eye(3, dtype=int)
        return FiniteTurn(r, u, S * first + SS * b + unit, S * b + SS * c + unit, factors)

    def rate(self, m: np.ndarray) -> np.ndarray:
        """Symmetric part of the derivative of ``m . W[:, k]`` by ``r[b]`` (..., 3, 3).

        With ``dS^2/dr_b = E_b S + S E_b`` and ``u = m x r`` it is that of ``(b' u + c' u x r - c m)
        r^T + c (m . r) I``; m is (..., 3).
        """
        _, c, b_rate, c_rate = (self.factors[..., i : i + 1] for i in range(4))
        r, u = self.r, cross(m, self.r)
        rows = u * b_rate + cross(u, r) * c_rate - m * c
        outer = rows[..., :, None] * r[..., None, :]
        along = c * (m * r).sum(axis=-1, keepdims=True)
        return (outer + np.swapaxes(outer, -1, -2)) * 0.5 + along[..., None] * np.eye(3, dtype=int)


def skews(v: np.ndarray) -> np.ndarray:
    """Matrices (v x) of vectors (..., 3), by one product."""
    return (v @ _SKEWS).reshape(*v.shape, 3)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``a x b`` of vectors (..., 3), few calls for few vectors."""
    return a.take(NEXT, -1) * b.take(LAST, -1) - a.take(LAST, -1) * b.take(NEXT, -1)


def sum_of_crosses(S: np.ndarray) -> np.ndarray:
    """Sum of ``s x f`` (..., 3) from that of ``s f^T`` (..., 3, 3)."""
    return S[..., NEXT, LAST] - S[..., LAST, NEXT]


@frozen
class ChainTerms:
    """What C chains contribute to the equations of their legs, by Q columns and P pairs of them.

    Columns and pairs are those of `ChainNumbers`.
    """

    # (C, 3, 3) and (C, 3): where the body at the end is, as the chain has it, and its point [m]
    R: np.ndarray
    P: np.ndarray
    J: np.ndarray  # (Q, 6): velocity of the end point and angular velocity
    # (P,): curvature of the energy, less what wrench and loads do in second order, symmetric part
    tangent: np.ndarray
    gradient: np.ndarray  # (Q,): of the energy, less the work of wrench and loads
    by_share: np.ndarray  # (Q,): derivative of the gradient by the share of loads and preloads
    turns: np.ndarray  # (S, 1): squares of the turns of elastic parts [rad^2]
    beams: BowingTerms  # of beams with bowing (B,)


class PlacedChains(NamedTuple):
    """Where chains are: frames of all n bodies, and velocities by the Q columns."""

    before: np.ndarray  # (n, 4, 4): before the motion of their elements, and behind it
    behind: np.ndarray
    turned: FiniteTurn  # turns of elastic parts
    # (Q, 3): angular velocities, and velocities of the points of the bodies that columns move
    w: np.ndarray
    v: np.ndarray

    @property
    def points(self) -> np.ndarray:
        """Of all bodies (n, 3) [m]."""
        return self.behind[:, :3, 3]


class MovingChains:
    """Elements of chains as arrays: J joints, S elastic parts, and B beams with bowing among these.

    Bodies, columns and pairs are numbered as `ChainNumbers` says.

    Parameters
    ----------
    chains : sequence of FiniteChain
        Of one robot.
    numbers : ChainNumbers
        Of all robots.
    starts : (C, 3) array
        Points of the bodies at the starts, at the unloaded posture [m].
    ends : (C, 3) array
        Points of the bodies at the ends, about which wrenches are [m].
    body_rows : sequence of int
        Coordinates of bodies: six in space, three in the plane.
    anchors : sequence of (3,) arrays
        Where springs are held [m].
    robots : int
        How many equal robots are side by side.
    """

    def __init__(
        self,
        chains: Sequence[FiniteChain],
        numbers: ChainNumbers,
        starts: np.ndarray,
        ends: np.ndarray,
        body_rows: Sequence[int],
        anchors: Sequence[np.ndarray] = (),
        robots: int = 1,
    ) -> None:
        self._kind, self._at, at = np.asarray(ends).dtype, numbers, numbers
        self._robots = robots
        elements = [e for c in chains for e in c.elements]
        springs = [e for e in elements if isinstance(e, FiniteSpring)]
        self._set_springs(springs)
        joints = [e for e in elements if isinstance(e, FiniteJoint)]
        self._axis = self._array([e.axis for e in joints], 3)
        self._slide = self._array([e.slide for e in joints])[:, None]
        self.turning: np.ndarray = side_by_side(robots, [e.turns for e in joints], kind=int)[
            :, None
        ]
        self._axis_skew = skews(self._axis)
        self._axis_skew_squared = self._axis_skew @ self._axis_skew
        self.stiffness: np.ndarray = self._array([e.stiffness for e in joints])
        self.preload: np.ndarray = self._array([e.preload for e in joints])
        self.inertia: np.ndarray = self._array([e.inertia for e in joints])
        self.laws: list[tuple[int, Any]] = [
            (i, e.law) for i, e in enumerate(joints) if e.law is not None
        ]
        # axes and points of all bodies, those behind joints along the world; from each to the next,
        # and to those at the ends
        identity = np.eye(3, dtype=int).astype(self._kind)
        self._axes, self._points = np.tile(identity, (at.total, 1, 1)), self._zeros(at.total, 3)
        self._axes[at.spring_bodies] = self._array([e.rotation for e in springs], 3, 3)
        self._points[at.starts] = starts
        self._points[at.joint_bodies] = self._array([e.point for e in joints], 3)
        self._points[at.spring_bodies] = self._array([e.point for e in springs], 3)
        self._steps = self._frames(at.before, self._axes, self._points)
        self._end_frames = self._frames(at.last, np.tile(identity, (len(ends), 1, 1)), ends)
        # loads, and behind them anchors, which have no force of their own
        loads, bodies = [load for c in chains for load in c.loads], at.load_bodies
        self.load_point: np.ndarray = self._array([*(load.point for load in loads), *anchors], 3)
        self.load_force: np.ndarray = self._zeros(len(bodies), 3)
        self.load_force[: at.first_anchor] = self._array([load.force for load in loads], 3)
        arms = (self.load_point - self._points[bodies])[..., None]
        self._load_offset = np.swapaxes(self._axes[bodies], -1, -2) @ arms
        # velocities of elements by their coordinates, and twists of bodies by themselves
        moved = len(at.of_bodies) // len(body_rows)
        self._unit = np.tile(np.eye(6, dtype=int)[list(body_rows)], (moved, 1)).astype(self._kind)
        self._local = self._zeros(len(at.coordinates), 2, 3)
        self._local[at.joint_x, 0] = self._axis * self._slide
        self._local[at.joint_x, 1] = self._axis * self.turning
        self._local[at.spring_x, 0] = self._columns_of_springs(self.modes[:, :3])

    def _zeros(self, *shape: int) -> np.ndarray:
        return np.zeros(shape, self._kind)

    def _array(self, values: Sequence[Any], *shape: int) -> np.ndarray:
        return side_by_side(self._robots, values, *shape, kind=self._kind)

    def _set_springs(self, springs: Sequence[FiniteSpring]) -> None:
        P, S = self._robots, len(springs)
        modes, stiffness = self._zeros(P, S, 6, WIDE), self._zeros(P, S, WIDE)
        for i, e in enumerate(springs):
            modes[:, i, :, : e.size], stiffness[:, i, : e.size] = e.modes, e.stiffness
        self.modes: np.ndarray = modes.reshape(P * S, 6, WIDE)
        self.mode_stiffness: np.ndarray = stiffness.reshape(P * S, WIDE)
        self._elastic = self.mode_stiffness[..., None] * np.eye(WIDE, dtype=int)
        self.beams: np.ndarray = self._at.beams
        beams = [springs[i] for i in self.beams[: len(self.beams) // P]]
        self.axial: np.ndarray = self._array([e.axial for e in beams])
        self.along: np.ndarray = self.modes[self.beams, 0]
        forms = [e.bending.s.shape[-1] for e in beams]
        z = self._zeros(P, len(beams), max(forms, default=0), WIDE)
        s, b, l = self._zeros(3, *z.shape[:3])
        for i, (e, n) in enumerate(zip(beams, forms, strict=True)):
            z[:, i, :n, : e.size], s[:, i, :n] = e.bending.z, e.bending.s
            b[:, i, :n], l[:, i, :n] = e.bending.b, e.bending.l
        forms = (x.reshape(P * len(beams), *x.shape[2:]) for x in (z, s, b, l))
        self.bending: Bending = Bending(*forms)

    def _frames(self, before: np.ndarray, axes: np.ndarray, points: np.ndarray) -> np.ndarray:
        """From bodies, by number, to axes and points (n, 4, 4)."""
        R, found = self._axes[before], self._zeros(len(before), 4, 4)
        turned = np.swapaxes(R, -1, -2)
        alike = np.all(axes == R, axis=(-1, -2))[..., None, None]
        found[:, :3, :3] = np.where(alike, np.eye(3, dtype=int), turned @ axes)
        found[:, :3, 3:] = turned @ (points - self._points[before])[..., None]
        found[:, 3, 3] = 1
        return found

    def moved(self, placed: PlacedChains) -> tuple[np.ndarray, np.ndarray]:
        """All bodies by number: a point X of the unloaded posture is now at ``R X + t``.

        R (n, 3, 3) and t (n, 3).
        """
        R = placed.behind[:, :3, :3] @ np.swapaxes(self._axes, -1, -2)
        return R, placed.points - (R @ self._points[..., None])[..., 0]

    def placed(self, x: np.ndarray, R: np.ndarray, p: np.ndarray) -> PlacedChains:
        """The chains at coordinates x (U,), the bodies at their starts at (R, p).

        (C, 3, 3) and (C, 3) [m], in the order of the chains.
        """
        q = x[self._at.joint_x][:, None]
        half = (q * (self.turning * 0.5))[..., None]
        s, c = sine(half), cosine(half)
        th = (self.modes @ self.spring_coordinates(x)[..., None])[..., 0]
        turned = FiniteTurn.of(th[:, 3:])
        motion, before = self._zeros(2, self._at.total, 4, 4)
        joints, springs, starts = self._at.joint_bodies, self._at.spring_bodies, self._at.starts
        motion[joints, :3, :3] = (
            np.eye(3, dtype=int)
            + self._axis_skew * (2 * s * c)
            + self._axis_skew_squared * (2 * s * s)
        )
        motion[joints, :3, 3] = self._axis * self._slide * q
        motion[springs, :3, :3], motion[springs, :3, 3] = turned.R, th[:, :3]
        motion[:, 3, 3] = 1
        behind = motion.copy()
        behind[starts, :3, :3], behind[starts, :3, 3] = R, p
        for outer, inner in self._at.levels:
            np.matmul(behind[inner], self._steps[outer], out=before[outer])
            np.matmul(before[outer], motion[outer], out=behind[outer])
        local = self._local.copy()
        local[self._at.spring_x, 1] = self._columns_of_springs(turned.W @ self.modes[:, 3:])
        axes = before.take(self._at.body[self._at.coordinates], 0)[:, :3, :3]
        both = local @ np.swapaxes(axes, -1, -2)
        v, w = self._zeros(2, len(self._at.body), 3)
        v[self._at.coordinates], w[self._at.coordinates] = both[:, 0], both[:, 1]
        v[self._at.of_bodies], w[self._at.of_bodies] = self._unit[:, :3], self._unit[:, 3:]
        return PlacedChains(before, behind, turned, w, v)

    def spring_coordinates(self, x: np.ndarray) -> np.ndarray:
        """Coordinates of the elastic parts (S, 6) among those of the chains (U,)."""
        y = self._zeros(self.mode_stiffness.size)
        y[self._at.full] = x[self._at.spring_x]
        return y.reshape(self.mode_stiffness.shape)

    def terms(
        self,
        x: np.ndarray,
        placed: PlacedChains,
        W: np.ndarray,
        axial: np.ndarray,
        share: float,
        pulls: np.ndarray | None = None,
    ) -> ChainTerms:
        """What the chains contribute to the equations of their legs, placed at coordinates (U,).

        With a nearer the base than b, ``d_b v_a = w_a x v_b`` and ``d_b w_a = 0``; with b nearer,
        ``d_b v_a = w_b x v_a`` and ``d_b w_a = w_b x w_a``, the Lie bracket. Within an element,
        ``d_b v_a = d_b w_a x s + w_a x (w_b x s)``, s from its point to the one that moves. The
        tangent has ``w_a . (J_b x f)`` of a force f, J_b the velocity of its point by b, and within
        an element ``w_a . ((w_b x s) x f)``. The antisymmetric part, ``w_a . (w_b x m) / 2`` of the
        moment m of the end wrench, is left out: see `Legs.steps`.

        Parameters
        ----------
        W : (C, 6) array
            What the body at the end exerts on the chain, about the point where the chain has it [N,
            N m].
        axial : (B,) array
            Axial forces of beams [N].
        share, pulls : float, and (L, 3) array or None
            Share of loads and preloads; forces at the points of the loads beside these [N].
        """
        before, behind, turned, w, v = placed
        C, body = placed.points, self._at.body
        end = behind[self._at.last] @ self._end_frames
        P, f, m, of_chain = end[:, :3, 3], W[:, :3], W[:, 3:], self._at.of_chain
        F, M = f.take(of_chain, 0), m.take(of_chain, 0)
        turning = cross(w, P.take(of_chain, 0) - C.take(body, 0))
        moving = v + turning
        gradient = -(moving * F + w * M).sum(axis=-1)
        # what the velocities of the points of all forces make of these, ``sum(J x f)``
        across, within = cross(moving, F), cross(turning, F)
        by_share, columns = self._zeros(len(gradient)), self._at.coordinates[self._at.joint_x]
        by_share[columns] = -self.preload
        bodies = self._at.spring_bodies
        chains = self._at.chains[bodies]
        moment = m[chains] + cross(P[chains] - C[bodies], f[chains])
        if len(self._at.load_bodies):
            of_bodies, of_loads = self._at.reach
            arms = self._loaded_points(behind)[of_loads] - C[of_bodies]
            G, S = self._beyond(arms, self.load_force)
            by_share -= (v * G.take(body, 0) + w * sum_of_crosses(S).take(body, 0)).sum(axis=-1)
            acting = self.load_force * share + (0 if pulls is None else pulls)
            G, S = self._beyond(arms, acting)
            gradient -= (v * G.take(body, 0) + w * sum_of_crosses(S).take(body, 0)).sum(axis=-1)
            moment = moment + sum_of_crosses(S)[bodies]
            spread = S - np.trace(S, axis1=-2, axis2=-1)[:, None, None] * np.eye(3, dtype=int)
            turned_forces = (spread.take(body, 0) @ w[..., None])[..., 0]
            across = across + cross(v, G.take(body, 0)) + turned_forces
            within = within + turned_forces
        # half of the moment at the end; within an element the part that is due to turning
        (a, b), (c, d) = self._at.pairs, self._at.pairs[:, self._at.same]
        across = (across + cross(w, M) * 0.5).take(b, 0)[..., None]
        tangent = -(w.take(a, 0)[:, None] @ across)[:, 0, 0]
        H = (w[c] * within[d]).sum(axis=-1) + (w[d] * within[c]).sum(axis=-1)
        tangent[self._at.same] = H * -0.5
        q, y = x[self._at.joint_x], self.spring_coordinates(x)
        tangent[self._at.diagonal[columns]] += self.stiffness
        gradient[columns] += self.stiffness * q - self.preload * share
        for i, law in self.laws:
            column, q_i, k = columns[i], float(q[i]), self.stiffness[i]
            gradient[column] += law.at(q_i) - k * q_i
            tangent[self._at.diagonal[column]] += law.tangent(q_i) - k
        beams = self.bending.terms(y[self.beams], axial, self.along, self.axial)
        if len(bodies):
            force, curvature = self.mode_stiffness * y, self._elastic.copy()
            force[self.beams] += beams.gradient
            curvature[self.beams] += beams.curvature
            gradient[self._at.coordinates[self._at.spring_x]] += force.ravel()[self._at.full]
            turned_axes = np.swapaxes(before[bodies, :3, :3], -1, -2)
            about, V = (turned_axes @ moment[..., None])[..., 0], self.modes[:, 3:]
            block = curvature - np.swapaxes(V, -1, -2) @ turned.rate(about) @ V
            tangent[self._at.block_pairs] += block[self._at.block_entries]
        J = np.concatenate([moving, w], axis=-1)
        return ChainTerms(end[:, :3, :3], P, J, tangent, gradient, by_share, turned.square, beams)

    def _columns_of_springs(self, by: np.ndarray) -> np.ndarray:
        """Of matrices (S, 3, 6) the columns that there are (m, 3)."""
        return np.swapaxes(by, -1, -2).reshape(-1, 3)[self._at.full]

    def twists(
        self,
        placed: PlacedChains,
        bodies: np.ndarray,
        points: np.ndarray | None,
        unknowns: np.ndarray,
        total: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Twists (M, 6, T) of some bodies by all unknowns, about points (M, 3) [m], and these.

        Where no points are given, they are those at which the last M loads, or anchors, are.
        `unknowns` (Q,) are those of the columns, out of a `total` of T.
        """
        at, (_, behind, _, w, v), C = self._at, placed, placed.points
        if points is None:
            points = self._loaded_points(behind)[len(self.load_point) - len(bodies) :]
        chains = at.chains[bodies]
        first, stop = (np.searchsorted(at.of_chain, chains, side) for side in ("left", "right"))
        i = np.repeat(np.arange(len(bodies)), stop - first)
        k = np.arange(len(i)) + (stop - np.cumsum(stop - first))[i]
        i, k = (each[at.body[k] <= bodies[i]] for each in (i, k))
        found = self._zeros(len(bodies), 6, total)
        found[i, :3, unknowns[k]] = v[k] + cross(w[k], points[i] - C[at.body[k]])
        found[i, 3:, unknowns[k]] = w[k]
        return found, points

    def _beyond(self, arms: np.ndarray, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums of the forces (L, 3) that each body moves (n, 3), and of ``s f^T`` (n, 3, 3)."""
        bodies, loads = self._at.reach
        F, S = self._zeros(self._at.total, 3), self._zeros(self._at.total, 3, 3)
        np.add.at(F, bodies, forces[loads])
        np.add.at(S, bodies, arms[:, :, None] * forces[loads][:, None])
        return F, S

    def _loaded_points(self, behind: np.ndarray) -> np.ndarray:
        """Where loads act (L, 3) [m]."""
        body = behind[self._at.load_bodies]
        return (body[:, :3, :3] @ self._load_offset)[..., 0] + body[:, :3, 3]

    def energies(self, x: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """Elastic energy before every body (n,) [J], preloads left out; axial as for `terms`."""
        found, q = np.zeros(self._at.total), x[self._at.joint_x]
        found[self._at.joint_bodies] = 0.5 * self.stiffness * q**2
        for i, law in self.laws:
            found[self._at.joint_bodies[i]] = law.energy(float(q[i]))
        y = self.spring_coordinates(x)
        found[self._at.spring_bodies] = 0.5 * np.sum(self.mode_stiffness * y * y, axis=-1)
        beams = self.bending.terms(y[self.beams], axial, self.along, self.axial)
        found[self._at.spring_bodies[self.beams]] += beams.energy
        return found

    def load_potential(self, x: np.ndarray, placed: PlacedChains) -> float:
        """Potential of whole loads and preloads, 0 at the unloaded posture [J]."""
        at = self._loaded_points(placed.behind)
        work = np.sum(self.load_force * (at - self.load_point))
        return -float(np.sum(self.preload * x[self._at.joint_x]) + work)
