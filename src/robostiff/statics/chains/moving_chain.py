"""Chains in finite motion: where their bodies are, velocities, energy, and second derivatives.

All elements of all chains alike are computed at once: a leading axis N counts the chains, K the
elements. Arrays hold floats, or entries of a record: what is zero there leaves no operation. All
elastic parts have the same number c of coordinates here, those that they lack being empty columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.record import cosine, sine
from robostiff.statics.chains.bending import Bending
from robostiff.statics.chains.chain import (
    BodyLoad,
    ChainTerms,
    Element,
    FiniteChain,
    FiniteJoint,
    Law,
)
from robostiff.statics.chains.finite_turn import LAST, NEXT, FiniteTurn, crossed, skews


class MovingChains:
    """Elements of chains as arrays: in each slot a chain has an element of its kind, or none.

    Where it has none, nothing moves: a joint without axis, or an elastic part without modes.

    Parameters
    ----------
    kinds : sequence of str
        Of the slots: ``turn``, ``slide`` or ``spring``.
    sizes : sequence of int
        Coordinates in each slot, of the chain that has most.
    chains : sequence of FiniteChain
    slots : sequence of arrays of int
        Of their elements.
    loads : sequence of BodyLoad
        Behind slots.
    rows : sequence of slice
        Of every chain.
    ends : pair of (N, 3) arrays
        Points of the bodies at the starts and at the ends, at the unloaded posture [m].
    body_rows : sequence of int
        Coordinates of the bodies at the starts, where some of them move.
    moves : (N,) array of bool
        Rows whose body at the start moves.
    """

    count: int
    size: int
    slots: int
    kind: np.dtype[Any]
    joint_elements: np.ndarray
    spring_elements: np.ndarray
    joint_places: np.ndarray
    spring_places: np.ndarray
    axis: np.ndarray
    slide: np.ndarray
    turning: np.ndarray
    stiffness: np.ndarray
    preload: np.ndarray
    modes: np.ndarray
    mode_stiffness: np.ndarray
    axial: np.ndarray
    bending: Bending
    axis_skew: np.ndarray
    axis_skew_squared: np.ndarray
    #: Which of the c S coordinates there are, and their places in x.
    full: np.ndarray
    along: np.ndarray
    body_rows: list[int]
    moves: np.ndarray
    #: Velocity and angular velocity (N, n, 2, 3) by its coordinates, as far as they stay.
    local: np.ndarray
    axes: np.ndarray
    points: np.ndarray
    #: From each of them to the next, and to the body at the end (N, K + 1, 4, 4), unloaded.
    frames: np.ndarray
    load_after: np.ndarray
    load_point: np.ndarray
    load_force: np.ndarray
    load_offset: np.ndarray
    #: Element that moves by each unknown, counted from the body at the start.
    order: np.ndarray
    nearer: np.ndarray
    same: np.ndarray
    joint_columns: np.ndarray
    spring_columns: np.ndarray
    #: Blocks of the elastic parts, among all pairs of their coordinates.
    block_pairs: np.ndarray
    block_places: np.ndarray

    def __init__(
        self,
        kinds: Sequence[str],
        sizes: Sequence[int] | np.ndarray,
        chains: Sequence[FiniteChain],
        slots: Sequence[np.ndarray],
        loads: Sequence[BodyLoad],
        rows: Sequence[slice],
        ends: tuple[np.ndarray, np.ndarray],
        body_rows: Sequence[int],
        moves: np.ndarray,
    ) -> None:
        self.slots, self.count = len(kinds), len(moves)
        N = self.count
        of_entries = any(own.dtype == object for own in ends)
        self.kind = np.dtype(object if of_entries else float)
        starts = np.cumsum([0, *sizes])
        self.size = int(starts[-1])
        is_spring = np.array([kind == "spring" for kind in kinds], dtype=bool)
        self.joint_elements, self.spring_elements = (
            np.flatnonzero(own) for own in (~is_spring, is_spring)
        )
        at = np.where(is_spring, np.cumsum(is_spring), np.cumsum(~is_spring)) - 1
        J, S = len(self.joint_elements), len(self.spring_elements)
        self.joint_places = starts[self.joint_elements]
        self.axis, self.slide = self._zeros(N, J, 3), self._zeros(N, J, 1)
        self.stiffness, self.preload = self._zeros(2, N, J)
        #: Row, joint, and law of what is no linear spring.
        self.laws: list[tuple[int, int, Law]] = []
        within = [np.arange(int(sizes[k])) for k in self.spring_elements.tolist()]
        width = max((len(own) for own in within), default=0)
        self.modes, self.mode_stiffness = self._zeros(N, S, 6, width), self._zeros(N, S, width)
        self.axial, shapes = self._zeros(N, S), [(width,), (), (2,), (2,)]
        self.bending = Bending(*(self._zeros(N, S, 6, *own) for own in shapes))
        for chain, own, here in zip(chains, slots, rows, strict=True):
            for e, k in zip(chain.elements, own, strict=True):
                self._put(e, here, int(at[k]))
        self._set_frames(chains, slots, rows, ends)
        turns = [int(kinds[k] == "turn") for k in self.joint_elements.tolist()]
        self.turning = np.array(turns, dtype=int).reshape(J, 1)
        self.axis_skew = skews(self.axis)
        self.axis_skew_squared = self.axis_skew @ self.axis_skew
        none = np.zeros(0, dtype=int)
        self.full = np.concatenate([none, *(width * i + own for i, own in enumerate(within))])
        places = zip(starts[self.spring_elements], within, strict=True)
        self.spring_places = np.concatenate([none, *(k + own for k, own in places)])
        is_beam = self.axial != 0
        self.along = self.modes[:, :, 0] * is_beam[..., None].astype(int)
        self.axial = np.where(is_beam, self.axial, 1)
        self._set_loads(loads)
        self.body_rows = list(body_rows)
        self.moves = moves.astype(int)[:, None, None]
        self._set_order(starts)
        self.local = self._zeros(N, self.size, 2, 3)
        self.local[:, self.joint_places, 0] = self.axis * self.slide
        self.local[:, self.joint_places, 1] = self.axis * self.turning
        self.local[:, self.spring_places, 0] = self._columns_of_springs(self.modes[:, :, :3])

    def _zeros(self, *shape: int) -> np.ndarray:
        return np.zeros(shape, dtype=int).astype(self.kind)

    def _put(self, e: Element, rows: slice, i: int) -> None:
        """An element of some rows as the i-th joint or elastic part."""
        if isinstance(e, FiniteJoint):
            self.axis[rows, i], self.slide[rows, i, 0] = e.axis, e.slide
            self.stiffness[rows, i], self.preload[rows, i] = e.stiffness, e.preload
            self.laws += [
                (rows.start + n, i, law) for n, law in enumerate(e.laws) if law is not None
            ]
            return
        self.modes[rows, i, :, : e.size], self.mode_stiffness[rows, i, : e.size] = (
            e.modes,
            e.stiffness,
        )
        self.axial[rows, i], self.bending.z[rows, i, :, : e.size] = e.axial, e.bending.z
        for name in ("s", "b", "l"):
            getattr(self.bending, name)[rows, i] = getattr(e.bending, name)

    def _set_frames(
        self,
        chains: Sequence[FiniteChain],
        slots: Sequence[np.ndarray],
        rows: Sequence[slice],
        ends: tuple[np.ndarray, np.ndarray],
    ) -> None:
        """Axes and points of the body at the start and of all elements; frames between them.

        Joints have the axes of the world; an empty slot is where the element before it is.
        """
        N, K = self.count, self.slots
        axes = np.tile(np.eye(3, dtype=int).astype(self.kind), (N, K + 2, 1, 1))
        points = self._zeros(N, K + 2, 3)
        points[:, 0], points[:, -1] = ends
        last = np.zeros((N, K + 1), dtype=int)
        for chain, own, here in zip(chains, slots, rows, strict=True):
            for e, k in zip(chain.elements, own, strict=True):
                points[here, k + 1], last[here, k + 1] = e.point, k + 1
                if not isinstance(e, FiniteJoint):
                    axes[here, k + 1] = e.rotation
        last = np.maximum.accumulate(last, axis=1)
        points[:, :-1] = points[np.arange(N)[:, None], last]
        self.axes, self.points = axes[:, :-1], points[:, :-1]
        self.frames = self._zeros(N, K + 1, 4, 4)
        turned = np.swapaxes(self.axes, -1, -2)
        alike = np.all(self.axes == axes[:, 1:], axis=(-1, -2))[..., None, None]
        self.frames[..., :3, :3] = np.where(alike, np.eye(3, dtype=int), turned @ axes[:, 1:])
        self.frames[..., :3, 3:] = turned @ (points[:, 1:] - self.points)[..., None]
        self.frames[..., 3, 3] = 1

    def _set_loads(self, loads: Sequence[BodyLoad]) -> None:
        self.load_after = np.array([load.after for load in loads], dtype=int)
        self.load_point, self.load_force = self._zeros(2, self.count, len(loads), 3)
        self.load_offset = self._zeros(self.count, len(loads), 3, 1)
        for i, load in enumerate(loads):
            self.load_point[:, i], self.load_force[:, i] = load.point, load.force
            arm = (load.point - self.points[:, load.after])[..., None]
            self.load_offset[:, i] = np.swapaxes(self.axes[:, load.after], -1, -2) @ arm

    def _set_order(self, starts: np.ndarray) -> None:
        body = len(self.body_rows)
        own = np.repeat(np.arange(self.slots), np.diff(starts))
        self.order = np.concatenate([np.zeros(body, dtype=int), own + bool(body)])
        self.nearer = self.order[:, None] < self.order[None, :]
        self.same = self.order[:, None] == self.order[None, :]
        self.joint_columns = self.joint_places + body
        self.spring_columns = self.spring_places + body
        n = len(self.order)
        width = max(self.modes.shape[-1], 1)
        a, b = np.nonzero(self.full[:, None] // width == self.full // width)
        self.block_pairs = width * self.full[a] + self.full[b] % width
        self.block_places = self.spring_columns[a] * n + self.spring_columns[b]

    def moved(self, x: np.ndarray, R: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The bodies at the start and behind every element, at coordinates x (N, size).

        The body at the start is at (R, p), (3, 3) and (3,), or (N, 3, 3) and (N, 3). A point X of
        the unloaded posture is now at ``R X + t``: R (N, K + 1, 3, 3) and t (N, K + 1, 3).
        """
        behind = self._placed(x, R, p)[1]
        R = behind[..., :3, :3] @ np.swapaxes(self.axes, -1, -2)
        return R, behind[..., :3, 3] - (R @ self.points[..., None])[..., 0]

    def _placed(
        self, x: np.ndarray, R: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, FiniteTurn]:
        """Frames before and behind the motion of every element, and turns of elastic parts.

        The former (N, K + 1, 4, 4) end with that of the body at the end, the latter begin with that
        of the body at the start.
        """
        N, K = self.count, self.slots
        q = x[:, self.joint_places][..., None]
        half = (q * (self.turning * 0.5))[..., None]
        s, c = (sine(half), cosine(half)) if x.dtype == object else (np.sin(half), np.cos(half))
        th = (self.modes @ self.spring_coordinates(x)[..., None])[..., 0]
        turned = FiniteTurn.of(th[..., 3:])
        own = self._zeros(N, K, 4, 4)
        own[:, self.joint_elements, :3, :3] = (
            np.eye(3, dtype=int)
            + self.axis_skew * (2 * s * c)
            + self.axis_skew_squared * (2 * s * s)
        )
        own[:, self.joint_elements, :3, 3:] = (self.axis * self.slide * q)[..., None]
        own[:, self.spring_elements, :3, :3] = turned.R
        own[:, self.spring_elements, :3, 3:] = th[..., :3, None]
        own[..., 3, 3] = 1
        before, behind = self._zeros(N, K + 1, 4, 4), self._zeros(N, K + 1, 4, 4)
        behind[:, 0, :3, :3], behind[:, 0, :3, 3], behind[:, 0, 3, 3] = R, p, 1
        for k in range(K):
            np.matmul(behind[:, k], self.frames[:, k], out=before[:, k])
            np.matmul(before[:, k], own[:, k], out=behind[:, k + 1])
        np.matmul(behind[:, K], self.frames[:, K], out=before[:, K])
        return before, behind, turned

    def spring_coordinates(self, x: np.ndarray) -> np.ndarray:
        """Coordinates of the elastic parts (N, S, c) among those of the chains (N, size)."""
        y = self._zeros(self.count, self.modes.shape[1] * self.modes.shape[3])
        y[:, self.full] = x[:, self.spring_places]
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
        """What the chains contribute to the equations of their legs, at coordinates (N, size).

        With a nearer the base than b, ``d_b v_a = w_a x v_b`` and ``d_b w_a = 0``; with b nearer,
        ``d_b v_a = w_b x v_a`` and ``d_b w_a = w_b x w_a``, the Lie bracket. Within an element,
        ``d_b v_a = d_b w_a x s + w_a x (w_b x s)``, s from its point to the one that moves. A force
        f feels of that ``w_a . (J_b x f)``, with J_b the velocity of its own point by b, and within
        an element ``w_a . ((w_b x s) x f)``. The antisymmetric part is ``w_a . (w_b x m) / 2`` of
        the moment m of the end wrench; between two twists of the body at the start, which are no
        coordinates, m is less by the moment about its point.

        Parameters
        ----------
        R, p : (3, 3) and (3,) arrays, or (N, 3, 3) and (N, 3)
            Axes of the body at the start, and its point, about which its twist is [m].
        W : (N, 6) array
            What the body at the end exerts on the chain, about the point where the chain has it [N,
            N m].
        axial : (N, S) array
            Axial forces of beams among the elastic parts, 0 of others [N].
        share, pulls : float, and (N, L, 3) array or None
            Share of loads and preloads; forces at the points of the loads beside these [N].
        """
        before, behind, turned = self._placed(x, R, p)
        w, v, C = self._columns(before, behind, turned)
        P, f, m = before[:, -1, None, :3, 3], W[:, None, :3], W[:, None, 3:]
        order, N = self.order, self.count
        turning = crossed(w, P - C[:, order])
        moving = v + turning
        gradient = -(moving * f + w * m).sum(axis=-1)
        across, within = crossed(moving, f), crossed(turning, f)
        moment = m + crossed(P - C, f)
        by_share = self._zeros(*gradient.shape)
        by_share[:, self.joint_columns] = -self.preload
        if len(self.load_after):
            arms = self._arms(behind, C)
            F, S = self._beyond(arms, self.load_force)
            by_share -= (v * F[:, order] + w * _axial(S)[:, order]).sum(axis=-1)
            acting = self.load_force * share + (0 if pulls is None else pulls)
            F, S = self._beyond(arms, acting)
            gradient -= (v * F[:, order] + w * _axial(S)[:, order]).sum(axis=-1)
            moment = moment + _axial(S)
            spread = S - np.trace(S, axis1=-2, axis2=-1)[..., None, None] * np.eye(3, dtype=int)
            turned_forces = (spread[:, order] @ w[..., None])[..., 0]
            across = across + crossed(v, F[:, order]) + turned_forces
            within = within + turned_forces
        tangent, bracket = self._second_order(w, across, within, m, moment)
        q = x[:, self.joint_places]
        columns = self.joint_columns
        tangent[:, columns, columns] += self.stiffness
        gradient[:, columns] += self.stiffness * q - self.preload * share
        for n, i, law in self.laws:
            column, own, k = columns[i], float(q[n, i]), self.stiffness[n, i]
            gradient[n, column] += law.at(own) - k * own
            tangent[n, column, column] += law.tangent(own) - k
        y = self.spring_coordinates(x)
        beams = self.bending.terms(y, axial, self.along, self.axial)
        if len(self.spring_elements):
            force = self.mode_stiffness * y + beams.gradient
            curvature = self._elastic + beams.curvature
            gradient[:, self.spring_columns] += force.reshape(N, -1)[:, self.full]
            beyond = moment[:, self.spring_elements + (C.shape[1] - self.slots)]
            axes = before[:, self.spring_elements, :3, :3]
            about = (np.swapaxes(axes, -1, -2) @ beyond[..., None])[..., 0]
            V = self.modes[:, :, 3:]
            block = curvature - np.swapaxes(V, -1, -2) @ turned.rate(about) @ V
            flat = tangent.reshape(N, -1)
            flat[:, self.block_places] += block.reshape(N, -1)[:, self.block_pairs]
        return ChainTerms(
            before[:, -1, :3, :3],
            P[:, 0],
            np.swapaxes(np.concatenate([moving, w], axis=-1), -1, -2),
            tangent,
            bracket,
            gradient,
            by_share,
            turned.square,
            beams,
        )

    def _second_order(
        self,
        w: np.ndarray,
        across: np.ndarray,
        within: np.ndarray,
        m: np.ndarray,
        moment: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Symmetric and antisymmetric part (N, n, n) of what forces do in second order.

        By each unknown, `across` (N, n, 3) is what the velocities of the points of all forces make
        of these, ``sum(J x f)``, `within` the part of that which is due to turning. m (N, 1, 3) is
        the moment of the end wrench, `moment` (N, K, 3) that of all forces about every element.
        """
        half = crossed(w, m) * 0.5
        U = w @ np.swapaxes(across + half, -1, -2)
        bracket = w @ np.swapaxes(half, -1, -2)
        if self.body_rows:
            b = slice(len(self.body_rows))
            of_body = crossed(w[:, b], moment[:, :1]) * 0.5
            bracket[:, b, b] -= w[:, b] @ np.swapaxes(of_body, -1, -2)
        H = w @ np.swapaxes(within, -1, -2)
        H = np.where(self.same, (H + np.swapaxes(H, -1, -2)) * 0.5, np.swapaxes(U, -1, -2))
        return -np.where(self.nearer, U, H), bracket

    def _columns(
        self, before: np.ndarray, behind: np.ndarray, turned: FiniteTurn
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angular velocities and velocities (N, n, 3) about points of the elements (N, K, 3)."""
        body = len(self.body_rows)
        local = self.local.copy()
        turning = turned.W @ self.modes[:, :, 3:]
        local[:, self.spring_places, 1] = self._columns_of_springs(turning)
        axes = before[:, self.order[body:] - bool(body), :3, :3]
        both = local @ np.swapaxes(axes, -1, -2)
        v, w, C = both[:, :, 0], both[:, :, 1], behind[:, not body :, :3, 3]
        if body:
            unit = self.moves * np.eye(6, dtype=int)[self.body_rows]
            v = np.concatenate([unit[..., :3], v], axis=1)
            w = np.concatenate([unit[..., 3:], w], axis=1)
        return w, v, C

    def _columns_of_springs(self, by: np.ndarray) -> np.ndarray:
        """Of matrices (N, S, 3, c) the columns that there are (N, m, 3)."""
        columns = np.swapaxes(by, -1, -2).reshape(self.count, by.shape[1] * by.shape[3], 3)
        return columns[:, self.full]

    @cached_property
    def _elastic(self) -> np.ndarray:
        return self.mode_stiffness[..., None] * np.eye(self.modes.shape[-1], dtype=int)

    def loaded(self, x: np.ndarray, R: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where loads act (N, L, 3) [m], and velocities there by the unknowns (N, L, 3, n)."""
        before, behind, turned = self._placed(x, R, p)
        w, v, C = self._columns(before, behind, turned)
        arms = np.swapaxes(self._arms(behind, C), 1, 2)[:, :, self.order]
        reach = self._reach(C.shape[1])[self.order].T[..., None]
        moving = v[:, None] * reach + crossed(w[:, None], arms)
        return self._loaded_points(behind), np.swapaxes(moving, -1, -2)

    def twists(self, x: np.ndarray, R: np.ndarray, p: np.ndarray, about: np.ndarray) -> np.ndarray:
        """Twists (N, n, 6) about a point (3,) of what each unknown moves."""
        w, v, C = self._columns(*self._placed(x, R, p))
        return np.concatenate([v + crossed(w, about - C[:, self.order]), w], axis=-1)

    def moving(self, behind: np.ndarray) -> np.ndarray:
        """Which unknowns move the bodies behind so many slots (K, n)."""
        return self.order < behind[:, None] + bool(self.body_rows)

    def _arms(self, behind: np.ndarray, C: np.ndarray) -> np.ndarray:
        """From points of the elements (N, K, 3) to those of loads beyond them (N, K, L, 3)."""
        arms = self._loaded_points(behind)[:, None] - C[:, :, None]
        return arms * self._reach(C.shape[1])[..., None]

    def _beyond(self, arms: np.ndarray, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums F of the forces (N, L, 3) beyond every element (N, K, 3), and of ``s f^T``."""
        F = self._reach(arms.shape[1]) @ forces
        return F, np.swapaxes(arms, -1, -2) @ forces[:, None]

    def _loaded_points(self, behind: np.ndarray) -> np.ndarray:
        """Where loads act (N, L, 3) [m]."""
        body = behind[:, self.load_after]
        return (body[..., :3, :3] @ self.load_offset)[..., 0] + body[..., :3, 3]

    def _reach(self, elements: int) -> np.ndarray:
        """1 where an element, counted from the body at the start, feels a load (K, L), else 0."""
        after = self.load_after + (elements - self.slots)
        return (np.arange(elements)[:, None] < after).astype(int)

    def energies(self, x: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """Elastic energy in every slot (N, K) [J], preloads left out; axial as for `terms`."""
        found = np.zeros((self.count, self.slots))
        found[:, self.joint_elements] = 0.5 * self.stiffness * x[:, self.joint_places] ** 2
        for n, i, law in self.laws:
            found[n, self.joint_elements[i]] = law.energy(float(x[n, self.joint_places[i]]))
        y = self.spring_coordinates(x)
        linear = 0.5 * np.sum(self.mode_stiffness * y * y, axis=-1)
        beams = self.bending.terms(y, axial, self.along, self.axial)
        found[:, self.spring_elements] = linear + beams.energy
        return found

    def load_potential(self, x: np.ndarray, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Potential of whole loads and preloads, 0 at the unloaded posture (N,) [J]."""
        found = -np.sum(self.preload * x[:, self.joint_places], axis=-1)
        if len(self.load_after):
            at = self._loaded_points(self._placed(x, R, p)[1])
            found -= np.sum(self.load_force * (at - self.load_point), axis=(-1, -2))
        return found


def _axial(S: np.ndarray) -> np.ndarray:
    """Sum of ``s x f`` (..., 3) from that of ``s f^T`` (..., 3, 3)."""
    return S[..., NEXT, LAST] - S[..., LAST, NEXT]
