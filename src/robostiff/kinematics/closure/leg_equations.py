"""Closure of legs as equations: gaps, and the rates at which coordinates close them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from robostiff.kinematics.closure.assembly_mode import AssemblyMode
from robostiff.kinematics.closure.newton import CLOSED, ClosurePart, nearest
from robostiff.kinematics.closure.spin import Spin, spins_of
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.jacobians import freedom_twists
from robostiff.kinematics.turn import rotvec_rate, turn_by_vector, vector_of_turn
from robostiff.model import Joint, JointKind, Leg, Telescope
from robostiff.spatial import cross
from robostiff.spatial.batch import product


@dataclass(frozen=True)
class Followed:
    """Postures that legs take together.

    Attributes
    ----------
    pose : (N, 6) array
        Pose coordinates (x, y, z, rotation vector).
    coordinates : list of (N, size) arrays
        Of each leg. Where no closure is found, the nearest that was.
    closed : (N,) array of bool
        Where they close in the assembly mode of home.
    elsewhere : (N,) array of bool
        Where they close, but no path without singularity was found that leads there from home.
    """

    pose: np.ndarray
    coordinates: list[np.ndarray]
    closed: np.ndarray
    elsewhere: np.ndarray


@dataclass(frozen=True)
class NewtonTask:
    """Legs to close together, and the platform coordinates that they determine.

    A posture x is the pose coordinates, then the coordinates of all legs.

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

    def follow(self, start: np.ndarray, q: list[np.ndarray], goal: np.ndarray) -> Followed:
        """Postures at the goals, in the assembly mode of one closed posture.

        Parameters
        ----------
        start : (6,) array
            Pose coordinates (x, y, z, rotation vector) of the closed posture.
        q : list of (size,) arrays
            Leg coordinates of the closed posture.
        goal : (N, 6) array
            Wanted pose coordinates; the open ones are found.
        """
        home = np.concatenate([start, *q])
        found = AssemblyMode(self, home).at(goal[:, self.given])
        return Followed(*self._apart(found.x), found.kept, found.elsewhere)

    def close(self, pose: np.ndarray, q: list[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
        """Close from a guess, in whatever assembly mode is near, or as nearly as it goes."""
        return self._apart(nearest(self, np.concatenate([pose, *q], axis=-1)))

    def closed_near(self, pose: np.ndarray, q: list[np.ndarray]) -> Followed:
        """Postures closed from a guess, in the assembly mode of the guess."""
        x = nearest(self, np.concatenate([pose, *q], axis=-1))
        closed = np.max(np.abs(self.gaps(x)), axis=-1) <= CLOSED
        return Followed(*self._apart(x), closed, np.zeros(len(x), dtype=bool))

    @cached_property
    def given(self) -> np.ndarray:
        """Pose coordinates that are prescribed."""
        return np.array([k for k in range(6) if k not in self.open])

    @cached_property
    def parts(self) -> tuple[ClosurePart, ...]:
        """Every leg, then all together."""
        parts, row, column = [], 0, 0
        for leg, count in zip(self.legs, self._gap_counts, strict=True):
            ends, loops = np.arange(row, row + 6), np.arange(row + 6, row + 6 * count)
            unknowns = column + np.arange(int(np.count_nonzero(leg.chain.free)))
            parts.append(ClosurePart(loops, ends, unknowns))
            row, column = row + 6 * count, column + len(unknowns)
        if len(parts) == 1 and not self.open:
            return tuple(parts)
        loops = np.concatenate([part.loops for part in parts])
        ends = np.concatenate([part.ends for part in parts])
        return (*parts, ClosurePart(loops, ends, np.arange(column + len(self.open))))

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """All gaps as parts of the length and radians (N, 6 m)."""
        if len(x) == 1:  # sums over a lone pose round in another order: it comes with its twin
            return self.gaps(np.repeat(x, 2, axis=0))[:1]
        pose, q = self._apart(x)
        R_platform = turn_by_vector(pose[:, 3:])
        parts = []
        for leg, own in zip(self.legs, q, strict=True):
            frame = attachment_frame(leg, R_platform, pose[:, :3])
            for gap in gaps(leg, place_chain(leg.chain, own, leg.base.R, leg.base.p), *frame):
                turn = vector_of_turn(np.einsum("nij,nkj->nik", gap.R_wanted, gap.R))
                parts += [(gap.p_wanted - gap.p) / self.length, turn]
        return np.concatenate(parts, axis=-1)

    def rates(self, x: np.ndarray) -> np.ndarray:
        """Rates of the gaps closed by the moving coordinates, then by the free pose coordinates."""
        if len(x) == 1:
            return self.rates(np.repeat(x, 2, axis=0))[:1]
        pose, q = self._apart(x)
        R_platform = turn_by_vector(pose[:, 3:])
        rates = rotvec_rate(pose[:, 3:])
        columns = sum(int(np.count_nonzero(leg.chain.free)) for leg in self.legs)
        J = np.zeros((len(pose), 6 * sum(self._gap_counts), columns + len(self.open)))
        row, column = 0, 0
        for leg, own, own_spins in zip(self.legs, q, self._spins, strict=True):
            moving = np.flatnonzero(leg.chain.free)
            frame = attachment_frame(leg, R_platform, pose[:, :3])
            arm = frame[1] - pose[:, :3]
            placed = place_chain(leg.chain, own, leg.base.R, leg.base.p)
            spins = [spin.at(placed) for spin in own_spins]
            for number, gap in enumerate(gaps(leg, placed, *frame)):
                rows = J[:, row : row + 6]
                own_rates = closing_rates(gap, placed)
                for spin in spins:
                    spin.add_to(own_rates)
                rows[:, :, column : column + moving.size] = own_rates[:, :, moving]
                if number == 0:  # the platform's own
                    for k, coordinate in enumerate(self.open):
                        rows[:, :, columns + k] = -_pose_twist(coordinate, rates, arm)
                rows[:, :3] /= self.length
                row += 6
            column += moving.size
        return J * self._unit_steps

    def moved(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Postures after steps of the moving coordinates and the free pose coordinates."""
        x, step = x.copy(), step * self._unit_steps
        pose, q = self._apart(x)
        column = 0
        for leg, own, spins in zip(self.legs, q, self._spins, strict=True):
            free = leg.chain.free
            count = int(np.count_nonzero(free))
            delta = np.zeros_like(own)
            delta[:, free] = step[:, column : column + count]
            if spins:
                placed = place_chain(leg.chain, own, leg.base.R, leg.base.p)
                back = np.zeros_like(own)
                for spin in spins:
                    spin.at(placed).take_from(delta, back)
                # Last, so that what is turned back is turned about the very axis of the screw.
                own[:] = advance(leg, advance(leg, own, delta), back)
            else:
                own[:] = advance(leg, own, delta)
            column += count
        pose[:, list(self.open)] += step[:, column:]
        return x

    def lengths(self, x: np.ndarray) -> np.ndarray:
        """Lengths of the beams of telescopes (N, k) [m]."""
        found = [np.zeros((len(x), 0))]
        for leg, own in zip(self.legs, self._apart(x)[1], strict=True):
            for element, where in leg.chain.moving:
                if isinstance(element, Telescope):
                    q = own[:, where]
                    found += [beam.fixed + beam.share * q for beam in element.beams]
        return np.concatenate(found, axis=-1)

    def _apart(self, x: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """Views of the pose coordinates and of the coordinates of each leg."""
        ends = np.cumsum([6, *(leg.chain.size for leg in self.legs)])
        legs = [x[:, a:b] for a, b in pairwise(ends)]
        return x[:, :6], legs

    @cached_property
    def _gap_counts(self) -> tuple[int, ...]:
        """How many gaps each leg has: at the platform, and one a loop."""
        counts = []
        for leg in self.legs:
            placed = place_chain(leg.chain, leg.chain.home, leg.base.R, leg.base.p)
            counts.append(1 + len(placed.loops))
        return tuple(counts)

    @cached_property
    def _spins(self) -> tuple[tuple[Spin, ...], ...]:
        """Of each leg, the screws whose turns another joint takes back."""
        return tuple(spins_of(leg.chain, self.length) for leg in self.legs)

    @cached_property
    def _unit_steps(self) -> np.ndarray:
        """Unit of each unknown: the length for a shift, a radian for a turn."""
        steps = []
        for leg in self.legs:
            steps += [
                1.0 if screw.turns else self.length
                for screw, free in zip(leg.chain.freedoms, leg.chain.free, strict=True)
                if free
            ]
        steps += [self.length if coordinate < 3 else 1.0 for coordinate in self.open]
        return np.array(steps)


def gaps(
    leg: Leg, placed: PlacedChain, R_platform: np.ndarray, p_platform: np.ndarray
) -> Iterator[Loop]:
    """Gaps of a leg: at its frame of the platform, then of the loops inside the leg."""
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


def pose_of_end(leg: Leg, q: np.ndarray) -> np.ndarray:
    """Pose coordinates (6,) of the platform at the end of a leg."""
    placed = place_chain(leg.chain, q, leg.base.R, leg.base.p)
    R = placed.R @ leg.attachment.R.T
    return np.concatenate([placed.p - R @ leg.attachment.p, vector_of_turn(R)])


def frame_in_base(
    leg: Leg, R_platform: np.ndarray, p_platform: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Frame at which the chain of a leg ends, seen from the frame in which it begins."""
    R, p = attachment_frame(leg, R_platform, p_platform)
    R_base, p_base = leg.base.R, leg.base.p
    return (
        product(R_base.T, R),
        np.einsum("ji,...j->...i", R_base, p - p_base),
    )
