"""Closure of legs as equations: gaps, and the rates at which coordinates close them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from robostiff.kinematics.closure.assembly_mode import CLOSED, AssemblyMode, ClosurePart, nearest
from robostiff.kinematics.closure.motion_tree import (
    MotionTree,
    PlacedTree,
    Spin,
    advanced,
    spins_of,
)
from robostiff.kinematics.frames import Loop, PlacedChain, beam_lengths, place_chain
from robostiff.kinematics.jacobians import freedom_twists
from robostiff.kinematics.turn import rotvec_rate, turn_by_vector
from robostiff.model import Leg
from robostiff.spatial import cross
from robostiff.spatial.batch import product, transposed
from robostiff.spatial.rotation import vector_of_rotation


@dataclass(frozen=True)
class Followed:
    """Postures that legs take together."""

    pose: np.ndarray  # (N, 6): pose coordinates (x, y, z, rotation vector)
    # (N, size) of each leg; where no closure is found, the nearest that was
    coordinates: list[np.ndarray]
    closed: np.ndarray  # (N,) of bool: where they close in the assembly mode of home
    # (N,) of bool: where they close, but no path without singularity was found that leads there
    # from home
    elsewhere: np.ndarray


@dataclass(frozen=True)
class NewtonTask:
    """Legs to close together, and the platform coordinates that they determine.

    A posture x is the pose coordinates, then the coordinates of all legs.
    """

    legs: Sequence[Leg]
    open: tuple[int, ...]  # pose coordinates (x, y, z, rx, ry, rz by number) that the legs decide
    length: float  # characteristic length [m] that weighs turns against shifts

    def follow(self, start: np.ndarray, q: list[np.ndarray], goal: np.ndarray) -> Followed:
        """Postures at poses (N, 6), in the assembly mode of one closed posture, a pose (6,) and q.

        Coordinates of the goal that are open are found.
        """
        home = np.concatenate([start, *q])
        key = home.tobytes()
        if key not in self._modes:
            self._modes.clear()
            self._modes[key] = AssemblyMode(self, home)
        found = self._modes[key].at(goal[:, self.given])
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
    def _modes(self) -> dict[bytes, AssemblyMode]:
        """The assembly mode that was followed last, mostly that of home, by its closed posture."""
        return {}

    @cached_property
    def given(self) -> np.ndarray:
        """Pose coordinates that are prescribed."""
        return np.array([k for k in range(6) if k not in self.open])

    @cached_property
    def parts(self) -> tuple[ClosurePart, ...]:
        """Every leg, then all together."""
        parts, row, column = [], 0, 0
        for leg, count in zip(self.legs, self._tree.ends_of_legs, strict=True):
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
        return self._gaps_of(self._placed(x))

    def rates(self, x: np.ndarray) -> np.ndarray:
        """Rates of the gaps closed by the moving coordinates, then by the free pose coordinates."""
        return self.gaps_and_rates(x)[1]

    def gaps_and_rates(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Both, of legs that are placed once."""
        if len(x) == 1:
            e, J = self.gaps_and_rates(np.repeat(x, 2, axis=0))
            return e[:1], J[:1]
        placed = self._placed(x)
        J = self._tree.closing_twists(placed)
        for spin in self._spins:
            spin.add_to(J, placed.axes)
        J = np.concatenate([np.take(J, self._free, axis=-1), self._open_twists(x, placed)], axis=-1)
        J[:, :, :3] /= self.length
        J = J.reshape(len(x), 6 * J.shape[1], J.shape[-1]) * self._unit_steps
        return self._gaps_of(placed), J

    def _gaps_of(self, placed: PlacedTree) -> np.ndarray:
        turn = vector_of_rotation(placed.R_wanted @ transposed(placed.R))
        shift = (placed.p_wanted - placed.p) / self.length
        return np.concatenate([shift, turn], axis=-1).reshape(len(turn), 6 * turn.shape[1])

    def _open_twists(self, x: np.ndarray, placed: PlacedTree) -> np.ndarray:
        """Twists by which free pose coordinates close the ends (N, ends, 6, k): of legs alone."""
        J = np.zeros((*placed.p.shape[:2], 6, len(self.open)))
        if self.open:
            rates = rotvec_rate(x[:, 3:6])
            legs = np.cumsum([0, *self._tree.ends_of_legs])[:-1]  # their ends on the platform
            arm = placed.p_wanted[:, legs] - x[:, None, :3]
            for k, coordinate in enumerate(self.open):
                twist = np.zeros((*arm.shape[:-1], 6))
                if coordinate < 3:
                    twist[..., coordinate] = 1.0
                else:
                    w = np.broadcast_to(rates[:, None, :, coordinate - 3], arm.shape)
                    twist[..., :3], twist[..., 3:] = cross(w, arm), w
                J[..., k][:, legs] = -twist
        return J

    def moved(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Postures after steps of the moving coordinates and the free pose coordinates."""
        x, step = x.copy(), step * self._unit_steps
        q, delta, count = x[:, 6:], np.zeros((len(x), x.shape[1] - 6)), self._free.size
        delta[:, self._free] = step[:, :count]
        if self._spins:
            axes, back = self._placed(x).axes, np.zeros_like(delta)
            for spin in self._spins:
                spin.take_from(delta, back, axes)
            # Last, so that what is turned back is turned about the very axis of the screw.
            q = advanced(advanced(q, delta, self._tree.balls), back, self._tree.balls)
        else:
            q = advanced(q, delta, self._tree.balls)
        x[:, 6:] = q
        x[:, list(self.open)] += step[:, count:]
        return x

    def lengths(self, x: np.ndarray) -> np.ndarray:
        """Lengths of the beams of telescopes (N, k) [m]."""
        found = [np.zeros((len(x), 0))]
        for leg, own in zip(self.legs, self._apart(x)[1], strict=True):
            found += [length[:, None] for length in beam_lengths(leg.chain, own)]
        return np.concatenate(found, axis=-1)

    def _apart(self, x: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """Views of the pose coordinates and of the coordinates of each leg."""
        ends = np.cumsum([6, *(leg.chain.size for leg in self.legs)])
        legs = [x[:, a:b] for a, b in pairwise(ends)]
        return x[:, :6], legs

    def _placed(self, x: np.ndarray) -> PlacedTree:
        return self._tree.placed(turn_by_vector(x[:, 3:6]), x[:, :3], x[:, 6:])

    @cached_property
    def _tree(self) -> MotionTree:
        return MotionTree(self.legs)

    @cached_property
    def _free(self) -> np.ndarray:
        """Places of the moving coordinates among those of all legs."""
        return np.flatnonzero(np.concatenate([leg.chain.free for leg in self.legs]))

    @cached_property
    def _spins(self) -> tuple[Spin, ...]:
        """The screws whose turns another joint takes back."""
        starts = np.cumsum([0, *(leg.chain.size for leg in self.legs)]).tolist()
        return tuple(
            spin.after(start)
            for leg, start in zip(self.legs, starts, strict=False)
            for spin in spins_of(leg.chain, self.length)
        )

    @cached_property
    def _unit_steps(self) -> np.ndarray:
        """Unit of each unknown: the length for a shift, a radian for a turn."""
        turns = [*self._tree.turns[self._free], *(coordinate >= 3 for coordinate in self.open)]
        return np.where(turns, 1.0, self.length)


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


def attachment_frame(
    leg: Leg, R_platform: np.ndarray, p_platform: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Frame on the platform at which the chain of a leg ends, in the world."""
    R_attachment, p_attachment = leg.attachment.R, leg.attachment.p
    p = p_platform + np.einsum("...ij,j->...i", R_platform, p_attachment)
    return product(R_platform, R_attachment), p


def pose_of_end(leg: Leg, q: np.ndarray) -> np.ndarray:
    """Pose coordinates (6,) of the platform at the end of a leg."""
    placed = place_chain(leg.chain, q, leg.base.R, leg.base.p)
    R = placed.R @ leg.attachment.R.T
    return np.concatenate([placed.p - R @ leg.attachment.p, vector_of_rotation(R)])


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
