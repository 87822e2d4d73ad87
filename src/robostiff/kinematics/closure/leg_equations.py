"""Closure of legs as equations: gaps, and the rates at which coordinates close them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from robostiff.kinematics.closure.assembly_mode import CLOSED, AssemblyMode, nearest
from robostiff.kinematics.closure.loop_equations import (
    ClosurePart,
    LoopEquations,
)
from robostiff.kinematics.closure.motion_tree import AT_REST, LoopEnd, MotionTree
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.model import Chain, Leg, Passive, prismatic, spherical
from robostiff.spatial.batch import product
from robostiff.spatial.rotation import vector_of_rotation

#: A body that nothing holds; its coordinates are those of a pose.
_FREE_BODY = Chain(
    (
        *(prismatic(e, Passive(), name=name) for name, e in zip("xyz", np.eye(3), strict=True)),
        spherical(Passive(), name="turn"),
    )
)


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
class NewtonTask(LoopEquations):
    """Legs to close together, and the platform coordinates that they determine.

    A posture x is the pose coordinates, then the coordinates of all legs.
    """

    legs: Sequence[Leg]
    open: tuple[int, ...]  # pose coordinates (x, y, z, rx, ry, rz by number) that the legs decide
    length: float  # characteristic length [m]

    summed = slice(3, 6)

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
        """Places of the pose coordinates that are prescribed."""
        return np.array([k for k in range(6) if k not in self.open])

    @cached_property
    def parts(self) -> tuple[ClosurePart, ...]:
        """Every leg, then all together."""
        parts, row, column = [], 0, 0
        for leg, count in zip(self.legs, self._read[1], strict=True):
            ends, loops = np.arange(row, row + 6), np.arange(row + 6, row + 6 * count)
            unknowns = column + np.arange(int(np.count_nonzero(leg.chain.free)))
            parts.append(ClosurePart(loops, ends, unknowns))
            row, column = row + 6 * count, column + len(unknowns)
        if len(parts) == 1 and not self.open:
            return tuple(parts)
        loops = np.concatenate([part.loops for part in parts])
        ends = np.concatenate([part.ends for part in parts])
        return (*parts, ClosurePart(loops, ends, np.arange(column + len(self.open))))

    @cached_property
    def tree(self) -> MotionTree:
        """Moving frames of the platform and of all legs; of each its end, then loops inside it."""
        return self._read[0]

    @cached_property
    def _read(self) -> tuple[MotionTree, list[int]]:
        """The tree, and how many ends each leg has."""
        tree, counts = MotionTree(), []
        platform, pose = tree.along(_FREE_BODY, AT_REST)
        for leg in self.legs:
            place = len(tree.ends)
            end, moving = tree.along(leg.chain, AT_REST.to(leg.base.R, leg.base.p))
            wanted = platform.to(leg.attachment.R, leg.attachment.p)
            leading = pose if self.open else ()
            tree.ends.insert(place, LoopEnd(end, wanted, moving, leading))
            counts.append(len(tree.ends) - place)
        return tree, counts

    @cached_property
    def unknowns(self) -> np.ndarray:
        """Places of the coordinates of legs that move, then of the open pose coordinates."""
        free = np.concatenate([leg.chain.free for leg in self.legs])
        return np.array([*(6 + np.flatnonzero(free)), *self.open], dtype=int)

    @cached_property
    def guess(self) -> np.ndarray:
        """No pose, and the home coordinates of all legs."""
        return np.concatenate([np.zeros(6), *(leg.chain.home for leg in self.legs)])

    def _apart(self, x: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """Views of the pose coordinates and of the coordinates of each leg."""
        ends = np.cumsum([6, *(leg.chain.size for leg in self.legs)])
        legs = [x[:, a:b] for a, b in pairwise(ends)]
        return x[:, :6], legs


def gaps(
    leg: Leg, placed: PlacedChain, R_platform: np.ndarray, p_platform: np.ndarray
) -> Iterator[Loop]:
    """Gaps of a leg: at its frame of the platform, then of the loops inside the leg."""
    main = tuple(leg.chain.main_places.tolist())
    yield Loop("", placed.R, placed.p, R_platform, p_platform, own=main, leading=())
    yield from placed.loops


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
