"""Damped Newton closure of legs without a closed form, followed from the home configuration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.jacobians import freedom_twists
from robostiff.kinematics.turn import rotvec_rate, turn_by_vector, vector_of_turn
from robostiff.model import Joint, JointKind, Leg, Motion
from robostiff.spatial import cross
from robostiff.spatial.batch import product

_ITERATIONS = 40
_CONVERGED = 1e-13
_CLOSED = 1e-10
_STEPS = (8, 64)
_LARGEST_STEP = 0.5


@dataclass(frozen=True)
class NewtonTask:
    """Legs to close together, and the platform coordinates that they leave open.

    Attributes
    ----------
    legs : sequence of Leg
    open : tuple of int
        Pose coordinates (x, y, z, rx, ry, rz by number) that the legs decide.
    length : float
        Characteristic length [m] that weighs turns against shifts.
    """

    legs: Sequence[Leg]
    open: tuple[int, ...]
    length: float

    def follow(
        self, start: np.ndarray, q: list[np.ndarray], goal: np.ndarray
    ) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
        """Pose coordinates and leg coordinates at the goals, followed from one closed posture.

        Parameters
        ----------
        start : (6,) array
            Pose coordinates (x, y, z, rotation vector) of the closed posture.
        q : list of (size,) arrays
            Leg coordinates of the closed posture.
        goal : (N, 6) array
            Wanted pose coordinates; the open ones are first guesses.

        Returns
        -------
        pose : (N, 6) array
        q : list of (N, size) arrays
            Where no closure is found, the nearest that was.
        closed : (N,) array of bool
            Where closure is found.
        """
        N = len(goal)
        # At once: where that fails, this is the nearest posture.
        pose, found = self.close(goal.copy(), [np.tile(own, (N, 1)) for own in q])
        left = np.flatnonzero(self._errors(pose, found)[1] > _CLOSED)
        for steps in _STEPS:
            if left.size == 0:
                break
            rows, at, own = self._in_steps(start, q, goal, left, steps)
            pose[rows] = at
            for coordinates, followed in zip(found, own, strict=True):
                coordinates[rows] = followed
            left = np.setdiff1d(left, rows)
        closed = np.ones(N, dtype=bool)
        closed[left] = False
        return pose, found, closed

    def _in_steps(
        self,
        start: np.ndarray,
        q: list[np.ndarray],
        goal: np.ndarray,
        rows: np.ndarray,
        steps: int,
    ) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Follow some poses in equal steps; those that are lost on the way are left behind."""
        at = np.tile(start, (rows.size, 1))
        own = [np.tile(coordinates, (rows.size, 1)) for coordinates in q]
        for k in range(1, steps + 1):
            at, own = self.close(_between(start, goal[rows], k / steps, at, self.open), own)
            kept = self._errors(at, own)[1] <= _CLOSED
            rows, at, own = rows[kept], at[kept], [coordinates[kept] for coordinates in own]
            if rows.size == 0:
                break
        return rows, at, own

    def close(self, pose: np.ndarray, q: list[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
        """Close from a guess, by Levenberg steps damped by the square of the error.

        The answer at a pose is the same to the last bit whatever other poses come with it.
        """
        if len(pose) == 1:  # sums over a lone pose round in another order: it comes with its twin
            twins = self.close(np.repeat(pose, 2, axis=0), [np.repeat(own, 2, axis=0) for own in q])
            return twins[0][:1], [own[:1] for own in twins[1]]
        best = (pose, q)
        best_error = np.full(len(pose), np.inf)
        done = np.zeros(len(pose), dtype=bool)
        for _ in range(_ITERATIONS):
            e, size = self._errors(pose, q)
            better = (size < best_error) & ~done
            best_error = np.where(better, size, best_error)
            best = _where(better, (pose, q), best)
            done |= (best_error <= _CONVERGED) | (~better & (best_error < 1e-11))
            if np.all(done):
                break
            J = self._jacobian(pose, q)
            if J.shape[-1] == 0:
                break  # nothing can move
            A = np.einsum("nij,nik->njk", J, J)
            damping = np.maximum(np.minimum(size, 1.0) ** 2, 1e-15)
            damping = damping * np.trace(A, axis1=-2, axis2=-1) / A.shape[-1]
            A = A + damping[:, None, None] * np.eye(A.shape[-1])
            step = np.linalg.solve(A, np.einsum("nij,ni->nj", J, e)[..., None])[..., 0]
            longest = np.max(np.abs(step), axis=-1, keepdims=True)
            step = step * np.minimum(1.0, _LARGEST_STEP / np.maximum(longest, 1e-300))
            pose, q = self._advance(pose, q, step)
        return best

    def _errors(self, pose: np.ndarray, q: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """All gaps as lengths (N, 6 m), and their largest part of the length (N,)."""
        R_platform = turn_by_vector(pose[:, 3:])
        parts = []
        for leg, own in zip(self.legs, q, strict=True):
            frame = attachment_frame(leg, R_platform, pose[:, :3])
            for gap in gaps(leg, place_chain(leg.chain, own, leg.base.R, leg.base.p), *frame):
                turn = vector_of_turn(np.einsum("nij,nkj->nik", gap.R_wanted, gap.R))
                parts += [gap.p_wanted - gap.p, turn * self.length]
        e = np.concatenate(parts, axis=-1) / self.length
        return e, np.max(np.abs(e), axis=-1)

    def _jacobian(self, pose: np.ndarray, q: list[np.ndarray]) -> np.ndarray:
        """Rates of the gaps closed by the moving coordinates, then by the open pose coordinates."""
        R_platform = turn_by_vector(pose[:, 3:])
        rates = rotvec_rate(pose[:, 3:])
        blocks = []
        columns = sum(int(np.count_nonzero(leg.chain.free)) for leg in self.legs)
        column = 0
        for leg, own in zip(self.legs, q, strict=True):
            moving = np.flatnonzero(leg.chain.free)
            frame = attachment_frame(leg, R_platform, pose[:, :3])
            arm = frame[1] - pose[:, :3]
            placed = place_chain(leg.chain, own, leg.base.R, leg.base.p)
            for number, gap in enumerate(gaps(leg, placed, *frame)):
                rows = np.zeros((len(pose), 6, columns + len(self.open)))
                rows[:, :, column : column + moving.size] = closing_rates(gap, placed)[:, :, moving]
                if number == 0:  # the platform's own
                    for k, coordinate in enumerate(self.open):
                        rows[:, :, columns + k] = -_pose_twist(coordinate, rates, arm)
                rows[:, :3] /= self.length
                blocks.append(rows)
            column += moving.size
        return np.concatenate(blocks, axis=1) * self._unit_steps

    @cached_property
    def _unit_steps(self) -> np.ndarray:
        """What a step of 1 means for each unknown: the length for a shift, a radian for a turn."""
        steps = []
        for leg in self.legs:
            motions = [freedom.motion for freedom in leg.chain.freedoms]
            steps += [
                self.length if motion is Motion.TRANSLATION else 1.0
                for motion, free in zip(motions, leg.chain.free, strict=True)
                if free
            ]
        steps += [self.length if coordinate < 3 else 1.0 for coordinate in self.open]
        return np.array(steps)

    def _advance(
        self, pose: np.ndarray, q: list[np.ndarray], step: np.ndarray
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        moved, column = [], 0
        step = step * self._unit_steps
        for leg, own in zip(self.legs, q, strict=True):
            free = leg.chain.free
            count = int(np.count_nonzero(free))
            delta = np.zeros_like(own)
            delta[:, free] = step[:, column : column + count]
            moved.append(advance(leg, own, delta))
            column += count
        pose = pose.copy()
        pose[:, list(self.open)] += step[:, column:]
        return pose, moved


def gaps(
    leg: Leg, placed: PlacedChain, R_platform: np.ndarray, p_platform: np.ndarray
) -> Iterator[Loop]:
    """What must close: the leg on its frame of the platform, then the loops inside the leg."""
    main = tuple(leg.chain.main_places.tolist())
    yield Loop("", placed.R, placed.p, R_platform, p_platform, own=main, leading=())
    yield from placed.loops


def closing_rates(gap: Loop, placed: PlacedChain) -> np.ndarray:
    """Twists by which each coordinate of a leg closes a gap (..., 6, size)."""
    freedoms = placed.freedoms
    J = np.zeros((*gap.p.shape[:-1], 6, len(freedoms)))
    if gap.own:
        J[..., gap.own] += freedom_twists([freedoms[i] for i in gap.own], gap.p)
    if gap.leading:
        J[..., gap.leading] -= freedom_twists([freedoms[i] for i in gap.leading], gap.p_wanted)
    return J


def advance(leg: Leg, q: np.ndarray, delta: np.ndarray) -> np.ndarray:
    """Coordinates after small motions; those of a spherical joint turn it about frame axes."""
    moved = q + delta
    for element, place in leg.chain.moving:
        if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
            turn = turn_by_vector(delta[..., place])
            R = product(turn, turn_by_vector(q[..., place]))
            moved[..., place] = vector_of_turn(R)
    return moved


def attachment_frame(
    leg: Leg, R_platform: np.ndarray, p_platform: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Frame on the platform at which the chain of a leg ends, in the world."""
    R_attachment, p_attachment = leg.attachment.R, leg.attachment.p
    p = p_platform + np.einsum("...ij,j->...i", R_platform, p_attachment)
    return product(R_platform, R_attachment), p


def _pose_twist(coordinate: int, rates: np.ndarray, arm: np.ndarray) -> np.ndarray:
    twist = np.zeros((len(arm), 6))
    if coordinate < 3:
        twist[:, coordinate] = 1.0
    else:
        w = rates[:, :, coordinate - 3]
        twist[:, :3], twist[:, 3:] = cross(w, arm), w
    return twist


def _between(
    start: np.ndarray, goal: np.ndarray, part: float, at: np.ndarray, open_: tuple[int, ...]
) -> np.ndarray:
    """Pose coordinates part of the way; the open ones stay as they were found."""
    between = start + part * (goal - start)
    between[:, list(open_)] = at[:, list(open_)]
    return between


def _where(
    better: np.ndarray,
    new: tuple[np.ndarray, list[np.ndarray]],
    old: tuple[np.ndarray, list[np.ndarray]],
) -> tuple[np.ndarray, list[np.ndarray]]:
    pick = better[:, None]
    legs = [np.where(pick, a, b) for a, b in zip(new[1], old[1], strict=True)]
    return np.where(pick, new[0], old[0]), legs
