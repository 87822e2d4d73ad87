"""Closure of legs as equations: the loops that they form with a platform, and what they miss."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.kinematics.closure.loops import ClosurePart, Loops
from robostiff.kinematics.closure.motion_tree import AT_REST, LoopEnd, MotionTree
from robostiff.kinematics.frames import Loop, PlacedChain
from robostiff.model import Chain, Leg, Passive, prismatic, spherical
from robostiff.spatial.batch import product

#: A body that nothing holds; its coordinates are those of a pose.
_FREE_BODY = Chain(
    (
        *(prismatic(e, Passive(), name=name) for name, e in zip("xyz", np.eye(3), strict=True)),
        spherical(Passive(), name="turn"),
    )
)


def loops_of_legs(
    legs: Sequence[Leg],
    open_: Sequence[int],
    length: float,
    drives: Sequence[np.ndarray] = (),
) -> Loops:
    """Legs to close together with a platform, and the platform coordinates that they determine.

    A posture x is the pose coordinates, then the coordinates of all legs.

    Parameters
    ----------
    legs : sequence of Leg
    open_ : sequence of int
        Pose coordinates (x, y, z, rx, ry, rz by number) that the legs decide.
    length : float
        Characteristic length [m].
    drives : sequence of (d,) arrays, optional
        Of each leg the places of coordinates that are held, and prescribed as well.
    """
    tree, parts, row, column = MotionTree(), [], 0, 0
    platform, pose = tree.along(_FREE_BODY, AT_REST)
    ends = np.cumsum([6, *(leg.chain.size for leg in legs)])
    free = [leg.chain.free.copy() for leg in legs]
    for own, held in zip(free, drives, strict=bool(drives)):
        own[held] = False
    for leg, own in zip(legs, free, strict=True):
        end, moving = tree.along(leg.chain, AT_REST.to(leg.base.R, leg.base.p))
        wanted = platform.to(leg.attachment.R, leg.attachment.p)
        tree.ends.insert(row, LoopEnd(end, wanted, moving, pose if open_ else ()))
        unknowns = column + np.arange(int(np.count_nonzero(own)))
        column += len(unknowns)
        loops = np.arange(6 * row + 6, 6 * len(tree.ends))
        parts.append(ClosurePart(loops, np.arange(6 * row, 6 * row + 6), unknowns))
        row = len(tree.ends)
    if len(parts) > 1 or open_:  # every leg, then all together
        inner = np.concatenate([own.loops for own in parts])
        outer = np.concatenate([own.ends for own in parts])
        parts.append(ClosurePart(inner, outer, np.arange(column + len(open_))))
    given = [np.array([k for k in range(6) if k not in open_], dtype=int)]
    given += [start + held for start, held in zip(ends, drives, strict=False)]
    return Loops(
        tree=tree,
        start=np.concatenate([np.zeros(6), *(leg.chain.home for leg in legs)]),
        unknowns=np.array([*(6 + np.flatnonzero(np.concatenate(free))), *open_], dtype=int),
        given=np.concatenate(given),
        parts=tuple(parts),
        length=length,
        summed=slice(3, 6),
        ends=tuple(ends.tolist()),
    )


def gaps(
    leg: Leg, placed: PlacedChain, R_platform: np.ndarray, p_platform: np.ndarray
) -> list[Loop]:
    """Gaps of a leg: at its frame of the platform, then of the loops inside the leg."""
    main = tuple(leg.chain.main_places.tolist())
    at_platform = Loop("", placed.R, placed.p, R_platform, p_platform, own=main, leading=())
    return [at_platform, *placed.loops]


def attachment_frame(
    leg: Leg, R_platform: np.ndarray, p_platform: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Frame on the platform at which the chain of a leg ends, in the world."""
    p = p_platform + np.einsum("...ij,j->...i", R_platform, leg.attachment.p)
    return product(R_platform, leg.attachment.R), p
