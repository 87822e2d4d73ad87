"""Chains in finite motion: where their bodies are, velocities, energy, and second derivatives.

All elements of all chains of a robot are computed at once. Arrays hold floats, or entries of a
record: what is zero there leaves no operation.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.record import cosine, sine
from robostiff.statics.chains.bending import Bending, BowingTerms
from robostiff.statics.chains.elements import BodyLoad, FiniteChain, FiniteJoint, FiniteSpring, Spot
from robostiff.statics.chains.finite_turn import FiniteTurn, crossed, skews, sum_of_crossed

# Columns of the modes of every elastic part; those that it lacks are empty.
_WIDE = 6
# Columns of chains beyond which products of all of them take longer than those that are wanted.
_MANY = 500


@dataclass(frozen=True)
class ChainTerms:
    """What C chains contribute to the equations of their legs, by Q columns and P pairs of them.

    Columns are the unknowns that move a chain, chain by chain: the twist of the body at its start,
    where that moves, then its own coordinates. Pairs are those of columns of one chain, the first
    not after the second.
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


class MovingChains:
    """Elements of chains as arrays: J joints, S elastic parts, and B beams with bowing among these.

    Bodies are numbered: those at the starts of the chains, the longest chain first, then those
    behind the first elements of all chains, behind the second ones, and so on.

    Parameters
    ----------
    chains : sequence of FiniteChain
    points : (bodies, 3) array
        Of the bodies between chains, at the unloaded posture [m].
    ends : (C, 3) array
        Points of the bodies at the ends, about which wrenches are [m].
    body_rows : sequence of int
        Coordinates of bodies: six in space, three in the plane.
    anchors : sequence of (Spot, (3,) array)
        Where springs are held [m].

    Attributes
    ----------
    bodies : list of arrays of int
        Of every chain: at its start, and behind each of its elements.
    columns : list of slice
        Of every chain.
    coordinates : (U,) array of int
        Columns that are coordinates of elements, in order.
    pairs : pair of (P,) arrays of int
    """

    def __init__(
        self,
        chains: Sequence[FiniteChain],
        points: np.ndarray,
        ends: np.ndarray,
        body_rows: Sequence[int],
        anchors: Sequence[tuple[Spot, np.ndarray]] = (),
    ) -> None:
        self._kind, self._count = np.asarray(ends).dtype, len(chains)
        self._number(chains, body_rows)
        pairs = zip(chains, self.bodies, strict=True)
        each = [(b, e) for c, own in pairs for b, e in zip(own[1:], c.elements, strict=True)]
        firsts = np.cumsum([0, *(e.size for _, e in each)]).tolist()
        numbered = [(b, i, e) for (b, e), i in zip(each, firsts, strict=False)]
        springs = [(b, i, e) for b, i, e in numbered if isinstance(e, FiniteSpring)]
        self._set_joints([(b, i, e) for b, i, e in numbered if isinstance(e, FiniteJoint)])
        self._set_springs(springs)
        self._set_frames(chains, points, ends, springs, each)
        self._set_loads(chains, anchors)
        self._local = self._zeros(len(self.coordinates), 2, 3)
        self._local[self.joint_x, 0] = self._axis * self._slide
        self._local[self.joint_x, 1] = self._axis * self._turning
        self._local[self.spring_x, 0] = self._columns_of_springs(self._modes[:, :3])

    def _zeros(self, *shape: int) -> np.ndarray:
        return np.zeros(shape, dtype=int).astype(self._kind)

    def _array(self, values: Sequence[Any], *shape: int) -> np.ndarray:
        """Values one behind the other (n, *shape)."""
        found = self._zeros(len(values), *shape)
        for i, own in enumerate(values):
            found[i] = own
        return found

    def _number(self, chains: Sequence[FiniteChain], body_rows: Sequence[int]) -> None:
        """Number bodies, columns and pairs."""
        C, lengths = self._count, np.array([len(c.elements) for c in chains], dtype=int)
        rank = np.empty(C, dtype=int)
        rank[np.argsort(-lengths, kind="stable")] = np.arange(C)
        longer = [int(np.sum(lengths > k)) for k in range(lengths.max(initial=0))]
        first = np.cumsum([0, C, *longer])
        self.bodies: list[np.ndarray] = [
            first[: n + 1] + own for n, own in zip(lengths, rank, strict=True)
        ]
        self._starts, self._last = (
            np.array([own[i] for own in self.bodies], dtype=int) for i in (0, -1)
        )
        self._total = int(first[-1])
        self._chains = np.zeros(self._total, dtype=int)
        for c, own in enumerate(self.bodies):
            self._chains[own] = c
        #: Bodies behind elements, and those before them, step by step outwards.
        self._levels = [
            (slice(first[k + 1], first[k + 1] + n), slice(first[k], first[k] + n))
            for k, n in enumerate(longer)
        ]
        self._before = np.zeros(self._total, dtype=int)
        for here, there in self._levels:
            self._before[here] = np.arange(there.start, there.stop)
        moved = [0 if c.start is None else len(body_rows) for c in chains]
        sizes = [[n, *(e.size for e in c.elements)] for n, c in zip(moved, chains, strict=True)]
        stops = np.cumsum([0, *map(sum, sizes)]).tolist()
        none = np.zeros(0, dtype=int)
        self.columns: list[slice] = list(itertools.starmap(slice, itertools.pairwise(stops)))
        every = [np.repeat(b, n) for b, n in zip(self.bodies, sizes, strict=True)]
        #: Body that each column moves, and its chain.
        self.body: np.ndarray = np.concatenate([none, *every])
        self.of_chain: np.ndarray = np.repeat(np.arange(C), np.diff(stops))
        self.coordinates: np.ndarray = np.flatnonzero(self.body >= C)
        self._body_columns = np.flatnonzero(self.body < C)
        turns = np.tile(np.eye(6, dtype=int)[list(body_rows)], (sum(map(bool, moved)), 1))
        self._unit = turns.astype(self._kind)
        upper = [np.array(np.triu_indices(s.stop - s.start)) + s.start for s in self.columns]
        self.pairs: np.ndarray = np.concatenate([np.zeros((2, 0), dtype=int), *upper], axis=1)
        a, b = self.pairs
        self._same = np.flatnonzero(self.body[a] == self.body[b])
        width = np.array([s.stop - s.start for s in self.columns], dtype=int)
        start = np.cumsum([0, *(width * (width + 1) // 2)])[:-1]
        #: Of each column: its pair with itself; that with the k-th behind it stands k further.
        i = np.arange(len(self.body)) - np.array(stops[:-1], dtype=int)[self.of_chain]
        n = width[self.of_chain]
        self._diagonal = start[self.of_chain] + i * n - i * (i - 1) // 2

    def _set_joints(self, joints: Sequence[tuple[Any, int, FiniteJoint]]) -> None:
        self._joint_bodies = np.array([b for b, _, _ in joints], dtype=int)
        self.joint_x: np.ndarray = np.array([i for _, i, _ in joints], dtype=int)
        every = [e for _, _, e in joints]
        self._axis = self._array([e.axis for e in every], 3)
        self._slide = self._array([e.slide for e in every])[:, None]
        self.stiffness: np.ndarray = self._array([e.stiffness for e in every])
        self.preload: np.ndarray = self._array([e.preload for e in every])
        self.laws: list[tuple[int, Any]] = [
            (i, e.law) for i, e in enumerate(every) if e.law is not None
        ]
        self._turning = np.array([int(e.turns) for e in every], dtype=int)[:, None]
        self._axis_skew = skews(self._axis)
        self._axis_skew_squared = self._axis_skew @ self._axis_skew

    def _set_springs(self, springs: Sequence[tuple[Any, int, FiniteSpring]]) -> None:
        every, S = [e for _, _, e in springs], len(springs)
        self._spring_bodies = np.array([b for b, _, _ in springs], dtype=int)
        self._modes = self._zeros(S, 6, _WIDE)
        self.mode_stiffness: np.ndarray = self._zeros(S, _WIDE)
        for i, e in enumerate(every):
            self._modes[i, :, : e.size], self.mode_stiffness[i, : e.size] = e.modes, e.stiffness
        self._elastic = self.mode_stiffness[..., None] * np.eye(_WIDE, dtype=int)
        none = np.zeros(0, dtype=int)
        #: Coordinates of elastic parts: among all that there might be, and among all of chains.
        self.full: np.ndarray = np.concatenate(
            [none, *(_WIDE * i + np.arange(e.size) for i, e in enumerate(every))]
        )
        self.spring_x: np.ndarray = np.concatenate(
            [none, *(i + np.arange(e.size) for _, i, e in springs)]
        )
        part, place = np.divmod(self.full, _WIDE)
        a, b = np.nonzero((part[:, None] == part) & (place[:, None] <= place))
        self._block_entries = part[a], place[a], place[b]
        self._block_pairs = self._diagonal[self.coordinates[self.spring_x[a]]] + place[b] - place[a]
        beams = [i for i, e in enumerate(every) if e.bows]
        self.beams: np.ndarray = np.array(beams, dtype=int)
        self.axial: np.ndarray = self._array([every[i].axial for i in beams])
        self.along: np.ndarray = self._modes[self.beams, 0]
        z = self._zeros(len(beams), 6, _WIDE)
        for at, i in zip(z, beams, strict=True):
            at[:, : every[i].size] = every[i].bending.z
        others = [
            self._array([getattr(every[i].bending, name) for i in beams], *shape)
            for name, shape in (("s", (6,)), ("b", (6, 2)), ("l", (6, 2)))
        ]
        self.bending: Bending = Bending(z, *others)

    def _set_frames(
        self,
        chains: Sequence[FiniteChain],
        points: np.ndarray,
        ends: np.ndarray,
        springs: Sequence[tuple[Any, int, FiniteSpring]],
        each: Sequence[tuple[Any, Any]],
    ) -> None:
        """Axes and points of all bodies; frames from each to the next, and to those at the ends.

        Bodies behind joints have the axes of the world.
        """
        self._axes = np.tile(np.eye(3, dtype=int).astype(self._kind), (self._total, 1, 1))
        self._points = self._zeros(self._total, 3)
        for chain, own in zip(chains, self.bodies, strict=True):
            if chain.start is not None:
                self._points[own[0]] = points[chain.start]
        for body, e in each:
            self._points[body] = e.point
        for body, _, e in springs:
            self._axes[body] = e.rotation
        of_world = np.tile(np.eye(3, dtype=int).astype(self._kind), (self._count, 1, 1))
        self._steps = self._frames(self._before, self._axes, self._points)
        self._end_frames = self._frames(self._last, of_world, np.asarray(ends))

    def _frames(self, before: np.ndarray, axes: np.ndarray, points: np.ndarray) -> np.ndarray:
        """From bodies, by number, to axes and points (n, 4, 4)."""
        R, found = self._axes[before], self._zeros(len(before), 4, 4)
        turned = np.swapaxes(R, -1, -2)
        alike = np.all(axes == R, axis=(-1, -2))[..., None, None]
        found[:, :3, :3] = np.where(alike, np.eye(3, dtype=int), turned @ axes)
        found[:, :3, 3:] = turned @ (points - self._points[before])[..., None]
        found[:, 3, 3] = 1
        return found

    def _set_loads(
        self, chains: Sequence[FiniteChain], anchors: Sequence[tuple[Spot, np.ndarray]]
    ) -> None:
        """Loads, and behind them anchors, which have no force of their own."""
        loads = [(c, own) for c, chain in enumerate(chains) for own in chain.loads]
        self.first_anchor: int = len(loads)
        loads += [(spot.chain, BodyLoad(spot.after, p, 0 * p)) for spot, p in anchors]
        bodies = [self.bodies[c][own.after] for c, own in loads]
        self.load_bodies: np.ndarray = np.array(bodies, dtype=int)
        self._load_point = self._array([own.point for _, own in loads], 3)
        self.load_force: np.ndarray = self._array([own.force for _, own in loads], 3)
        arms = (self._load_point - self._points[self.load_bodies])[..., None]
        self._load_offset = np.swapaxes(self._axes[self.load_bodies], -1, -2) @ arms
        #: Bodies whose motion moves a load, and that load.
        beyond = [self.bodies[c][chains[c].start is None : own.after + 1] for c, own in loads]
        self._reach = (
            np.concatenate([np.zeros(0, dtype=int), *beyond]),
            np.repeat(np.arange(len(loads)), [len(own) for own in beyond]),
        )

    def moved(self, x: np.ndarray, R: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All bodies by number, at coordinates x (U,) of the chains.

        Those at the starts are at (R, p), (C, 3, 3) and (C, 3) [m], in the order of the chains. A
        point X of the unloaded posture is now at ``R X + t``: R (n, 3, 3) and t (n, 3).
        """
        behind = self._placed(x, R, p)[1]
        R = behind[:, :3, :3] @ np.swapaxes(self._axes, -1, -2)
        return R, behind[:, :3, 3] - (R @ self._points[..., None])[..., 0]

    def _placed(
        self, x: np.ndarray, R: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, FiniteTurn]:
        """Frames of all bodies before and behind the motion of their elements (n, 4, 4).

        And the turns of elastic parts.
        """
        q = x[self.joint_x][:, None]
        half = (q * (self._turning * 0.5))[..., None]
        s, c = (sine(half), cosine(half)) if x.dtype == object else (np.sin(half), np.cos(half))
        th = (self._modes @ self.spring_coordinates(x)[..., None])[..., 0]
        turned = FiniteTurn.of(th[:, 3:])
        own, before = self._zeros(2, self._total, 4, 4)
        joints, springs, starts = self._joint_bodies, self._spring_bodies, self._starts
        own[joints, :3, :3] = (
            np.eye(3, dtype=int)
            + self._axis_skew * (2 * s * c)
            + self._axis_skew_squared * (2 * s * s)
        )
        own[joints, :3, 3] = self._axis * self._slide * q
        own[springs, :3, :3], own[springs, :3, 3] = turned.R, th[:, :3]
        own[:, 3, 3] = 1
        behind = own.copy()
        behind[starts, :3, :3], behind[starts, :3, 3] = R, p
        for here, there in self._levels:
            np.matmul(behind[there], self._steps[here], out=before[here])
            np.matmul(before[here], own[here], out=behind[here])
        return before, behind, turned

    def spring_coordinates(self, x: np.ndarray) -> np.ndarray:
        """Coordinates of the elastic parts (S, 6) among those of the chains (U,)."""
        y = self._zeros(self.mode_stiffness.size)
        y[self.full] = x[self.spring_x]
        return y.reshape(self.mode_stiffness.shape)

    def terms(
        self,
        x: np.ndarray,
        R: np.ndarray,
        p: np.ndarray,
        W: np.ndarray,
        axial: np.ndarray,
        share: float,
        pulls: np.ndarray | None = None,
    ) -> ChainTerms:
        """What the chains contribute to the equations of their legs, at coordinates (U,).

        With a nearer the base than b, ``d_b v_a = w_a x v_b`` and ``d_b w_a = 0``; with b nearer,
        ``d_b v_a = w_b x v_a`` and ``d_b w_a = w_b x w_a``, the Lie bracket. Within an element,
        ``d_b v_a = d_b w_a x s + w_a x (w_b x s)``, s from its point to the one that moves. A force
        f feels of that ``w_a . (J_b x f)``, with J_b the velocity of its own point by b, and within
        an element ``w_a . ((w_b x s) x f)``. The antisymmetric part, ``w_a . (w_b x m) / 2`` of the
        moment m of the end wrench, is left out: see `Legs.steps`.

        Parameters
        ----------
        R, p : (C, 3, 3) and (C, 3) arrays
            Axes of the bodies at the starts, and their points, about which their twists are [m].
        W : (C, 6) array
            What the body at the end exerts on the chain, about the point where the chain has it [N,
            N m].
        axial : (B,) array
            Axial forces of beams [N].
        share, pulls : float, and (L, 3) array or None
            Share of loads and preloads; forces at the points of the loads beside these [N].
        """
        before, behind, turned = self._placed(x, R, p)
        w, v, C = self._columns(before, behind, turned)
        end = behind[self._last] @ self._end_frames
        P, f, m = end[:, :3, 3], W[:, :3], W[:, 3:]
        F, M = f[self.of_chain], m[self.of_chain]
        turning = crossed(w, P[self.of_chain] - C[self.body])
        moving = v + turning
        gradient = -(moving * F + w * M).sum(axis=-1)
        across, within = crossed(moving, F), crossed(turning, F)
        by_share, columns = self._zeros(len(gradient)), self.coordinates[self.joint_x]
        by_share[columns] = -self.preload
        bodies = self._spring_bodies
        chains = self._chains[bodies]
        moment = m[chains] + crossed(P[chains] - C[bodies], f[chains])
        if len(self.load_bodies):
            arms = self._arms(behind, C)
            G, S = self._beyond(arms, self.load_force)
            by_share -= (v * G[self.body] + w * sum_of_crossed(S)[self.body]).sum(axis=-1)
            acting = self.load_force * share + (0 if pulls is None else pulls)
            G, S = self._beyond(arms, acting)
            gradient -= (v * G[self.body] + w * sum_of_crossed(S)[self.body]).sum(axis=-1)
            moment = moment + sum_of_crossed(S)[bodies]
            spread = S - np.trace(S, axis1=-2, axis2=-1)[:, None, None] * np.eye(3, dtype=int)
            turned_forces = (spread[self.body] @ w[..., None])[..., 0]
            across = across + crossed(v, G[self.body]) + turned_forces
            within = within + turned_forces
        tangent = self._second_order(w, across + crossed(w, M) * 0.5, within)
        q = x[self.joint_x]
        tangent[self._diagonal[columns]] += self.stiffness
        gradient[columns] += self.stiffness * q - self.preload * share
        for i, law in self.laws:
            column, own, k = columns[i], float(q[i]), self.stiffness[i]
            gradient[column] += law.at(own) - k * own
            tangent[self._diagonal[column]] += law.tangent(own) - k
        y = self.spring_coordinates(x)
        beams = self.bending.terms(y[self.beams], axial, self.along, self.axial)
        if len(bodies):
            force, curvature = self.mode_stiffness * y, self._elastic.copy()
            force[self.beams] += beams.gradient
            curvature[self.beams] += beams.curvature
            gradient[self.coordinates[self.spring_x]] += force.ravel()[self.full]
            turned_axes = np.swapaxes(before[bodies, :3, :3], -1, -2)
            about, V = (turned_axes @ moment[..., None])[..., 0], self._modes[:, 3:]
            block = curvature - np.swapaxes(V, -1, -2) @ turned.rate(about) @ V
            tangent[self._block_pairs] += block[self._block_entries]
        J = np.concatenate([moving, w], axis=-1)
        return ChainTerms(end[:, :3, :3], P, J, tangent, gradient, by_share, turned.square, beams)

    def _second_order(self, w: np.ndarray, across: np.ndarray, within: np.ndarray) -> np.ndarray:
        """What forces do in second order (P,).

        By each column, `across` (Q, 3) is what the velocities of the points of all forces make of
        these, ``sum(J x f)``, and half of that of the moment at the end; `within` is the part of
        the forces that is due to turning.
        """
        a, b = self.pairs
        if w.dtype == object or len(w) > _MANY:
            tangent = -(w[a] * across[b]).sum(axis=-1)
        else:  # faster than to gather the vectors
            tangent = (w @ -across.T)[a, b]
        a, b = a[self._same], b[self._same]
        H = (w[a] * within[b]).sum(axis=-1) + (w[b] * within[a]).sum(axis=-1)
        tangent[self._same] = H * -0.5
        return tangent

    def _columns(
        self, before: np.ndarray, behind: np.ndarray, turned: FiniteTurn
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angular velocities and velocities (Q, 3) about the points of all bodies (n, 3)."""
        local = self._local.copy()
        local[self.spring_x, 1] = self._columns_of_springs(turned.W @ self._modes[:, 3:])
        both = local @ np.swapaxes(before[self.body[self.coordinates], :3, :3], -1, -2)
        v, w = self._zeros(2, len(self.body), 3)
        v[self.coordinates], w[self.coordinates] = both[:, 0], both[:, 1]
        v[self._body_columns], w[self._body_columns] = self._unit[:, :3], self._unit[:, 3:]
        return w, v, behind[:, :3, 3]

    def _columns_of_springs(self, by: np.ndarray) -> np.ndarray:
        """Of matrices (S, 3, 6) the columns that there are (m, 3)."""
        return np.swapaxes(by, -1, -2).reshape(-1, 3)[self.full]

    def anchored(
        self, x: np.ndarray, R: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Where anchors are (A, 3) [m], and their velocities by the columns (A, 3, Q)."""
        before, behind, turned = self._placed(x, R, p)
        w, v, C = self._columns(before, behind, turned)
        points = self._loaded_points(behind)[self.first_anchor :]
        rates = self._zeros(len(points), 3, len(self.body))
        for body, load in zip(*self._reach, strict=True):
            if load >= self.first_anchor:
                i, own = load - self.first_anchor, np.flatnonzero(self.body == body)
                rates[i, :, own] = v[own] + crossed(w[own], (points[i] - C[body])[None])
        return points, rates

    def twists(self, x: np.ndarray, R: np.ndarray, p: np.ndarray, about: np.ndarray) -> np.ndarray:
        """Twists (Q, 6) about a point (3,) of what each column moves."""
        w, v, C = self._columns(*self._placed(x, R, p))
        return np.concatenate([v + crossed(w, about - C[self.body]), w], axis=-1)

    def _arms(self, behind: np.ndarray, C: np.ndarray) -> np.ndarray:
        """From the points of bodies to the loads that they move, as in `reach`."""
        bodies, loads = self._reach
        return self._loaded_points(behind)[loads] - C[bodies]

    def _beyond(self, arms: np.ndarray, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums of the forces (L, 3) that each body moves (n, 3), and of ``s f^T`` (n, 3, 3)."""
        bodies, loads = self._reach
        F, S = self._zeros(self._total, 3), self._zeros(self._total, 3, 3)
        np.add.at(F, bodies, forces[loads])
        np.add.at(S, bodies, arms[:, :, None] * forces[loads][:, None])
        return F, S

    def _loaded_points(self, behind: np.ndarray) -> np.ndarray:
        """Where loads act (L, 3) [m]."""
        body = behind[self.load_bodies]
        return (body[:, :3, :3] @ self._load_offset)[..., 0] + body[:, :3, 3]

    def energies(self, x: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """Elastic energy before every body (n,) [J], preloads left out; axial as for `terms`."""
        found, q = np.zeros(self._total), x[self.joint_x]
        found[self._joint_bodies] = 0.5 * self.stiffness * q**2
        for i, law in self.laws:
            found[self._joint_bodies[i]] = law.energy(float(q[i]))
        y = self.spring_coordinates(x)
        found[self._spring_bodies] = 0.5 * np.sum(self.mode_stiffness * y * y, axis=-1)
        beams = self.bending.terms(y[self.beams], axial, self.along, self.axial)
        found[self._spring_bodies[self.beams]] += beams.energy
        return found

    def load_potential(self, x: np.ndarray, R: np.ndarray, p: np.ndarray) -> float:
        """Potential of whole loads and preloads, 0 at the unloaded posture [J]."""
        at = self._loaded_points(self._placed(x, R, p)[1])
        work = np.sum(self.load_force * (at - self._load_point))
        return -float(np.sum(self.preload * x[self.joint_x]) + work)
