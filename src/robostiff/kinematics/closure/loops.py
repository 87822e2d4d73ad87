"""Loops of moving frames as equations: gaps, rates at which coordinates close them, and steps.

A leg that closes on its platform is such a loop, and so are the branches inside it.

Screws that make many turns take steps in which another joint about the same axis turns them back.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.frozen import field, frozen
from robostiff.kinematics.closure.motion_tree import AT_REST, LoopEnd, MotionTree, after_motion
from robostiff.kinematics.turn import rotvec_rate
from robostiff.model import (
    ALL_COORDINATES,
    Chain,
    Coordinate,
    Leg,
    Passive,
    Rigid,
    Robot,
    prismatic,
    revolute,
    spherical,
)
from robostiff.spatial import Frame
from robostiff.spatial.batch import product
from robostiff.spatial.rotation import vector_of_rotation

_COAXIAL = 1e-9  # sine, and part of the length
_SEED = 3  # of the postures at which axes are compared
_INDEPENDENT = 1e-6  # of rates: motions of the platform that the legs leave free


#: A screw and its place, the joint of the same chain about its axis that can take its turns back (a
#: turn, or a spherical joint on the axis) by its places, and the angle that advances by the
#: characteristic length, or one radian if that is more [rad].
Spin = tuple[int, tuple[int, ...], float]


def _spins_of(loops: Loops) -> tuple[Spin, ...]:
    """The screws whose turns another joint of their chain takes back, at any posture.

    A nut advances 100 mm in twenty turns, and nothing but the nut is turned where that joint turns
    back. One step of Newton's method goes that far only where both turn together.
    """
    tree, free = loops.tree, loops.unknowns.tolist()
    screws = [i for i in free if tree.screws[i].turns and tree.screws[i].slides]
    if not screws:
        return ()
    x = np.tile(loops.start, (2, 1))
    x[:, free] = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (2, len(free)))
    placed = tree.placed(x)

    def is_on_axis(screw: int, back: tuple[int, ...], pitch: float) -> bool:
        """Whether the axis of a turn is that of a screw, or a spherical joint is on it."""
        apart, axis = placed.points[:, back[0]] - placed.points[:, screw], placed.axes[:, screw]
        size = np.linalg.norm(apart, axis=-1).max() + pitch
        off = np.linalg.norm(np.cross(axis, apart), axis=-1).max()
        turned = 0.0
        if len(back) == 1:
            turned = float(np.linalg.norm(np.cross(axis, placed.axes[:, back[0]]), axis=-1).max())
        return bool(off <= _COAXIAL * size and turned <= _COAXIAL)

    balls = [tuple(own) for own in tree.balls.tolist() if own[0] in free]
    of_balls = {i for own in balls for i in own}
    turning = [(i,) for i in free if tree.screws[i].is_rotation and i not in of_balls]
    found = []
    for i in screws:
        chain, pitch = tree.chains[i], abs(float(tree.screws[i].pitch))
        fits = [
            back
            for back in (*balls, *turning)
            if tree.chains[back[0]] == chain and chain is not None
            if is_on_axis(i, back, pitch)
        ]
        if fits:
            nearest = min(fits, key=lambda back: abs(back[0] - i))
            found.append((i, nearest, max(1.0, loops.length / pitch)))
    return tuple(found)


@frozen
class ClosurePart:
    """Equations whose determinant keeps its sign within an assembly mode."""

    loops: np.ndarray  # (n,) of int: equations of loops inside legs, which are taken first
    ends: np.ndarray  # (n,) of int: the other equations
    unknowns: np.ndarray  # (n,) of int

    @property
    def equations(self) -> np.ndarray:
        """All equations, those of loops first."""
        return np.concatenate([self.loops, self.ends])


@frozen
class Loops:
    """Loops of a motion tree as equations at postures x (N, size), one in each row.

    Each loop has six: its shift as a part of the length, then its turn. Unknowns are scaled to
    radians and parts of the length.
    """

    tree: MotionTree
    start: np.ndarray  # (size,): coordinates to start from
    unknowns: np.ndarray  # (n,) of int: places of the unknown coordinates
    given: np.ndarray  # (g,) of int: places of the prescribed ones
    # What has an assembly mode of its own; the last has all equations and unknowns
    parts: tuple[ClosurePart, ...]
    length: float  # characteristic length [m] that weighs turns against shifts
    # Coordinates of a spherical joint whose rotation vector moves by sums; all others are turned
    summed: slice | None = None
    ends: tuple[int, ...] = ()  # where the coordinates of a pose end, and of each leg after it
    # The assembly mode that was followed last, mostly that of home, by its closed posture
    modes: dict[bytes, Any] = field(default_factory=dict, compare=False, repr=False)

    @cached_property
    def spins(self) -> tuple[Spin, ...]:
        """Screws whose turns another joint takes back."""
        return _spins_of(self)

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """All gaps as parts of the length and radians (N, 6 m)."""
        return self.gaps_and_rates(x)[0]

    def rates(self, x: np.ndarray) -> np.ndarray:
        """Rates at which the unknowns close the gaps (N, 6 m, n)."""
        return self.gaps_and_rates(x)[1]

    def in_general(self, x: np.ndarray) -> tuple[int, np.ndarray]:
        """Rank of the rates at drawn unknowns, and which coordinates (size,) can move there.

        What is given is as at a posture x (size,), and all gaps stay as they are.
        """
        drawn, places = x[None].copy(), self.unknowns
        drawn[:, places] = np.random.default_rng(_SEED).uniform(-1.0, 1.0, len(places))
        _, values, V_T = np.linalg.svd(self.rates(drawn)[0])
        rank, moving = int(np.count_nonzero(values > _INDEPENDENT)), np.zeros(x.size, dtype=bool)
        moving[places] = np.any(np.abs(V_T[rank:]) > _INDEPENDENT, axis=0)
        return rank, moving

    def gaps_and_rates(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Both, of frames that are placed once."""
        if len(x) == 1:  # sums over a lone pose round in another order: it comes with its twin
            e, J = self.gaps_and_rates(np.repeat(x, 2, axis=0))
            return e[:1], J[:1]
        placed = self.tree.placed(x)
        J = self.tree.closing_twists(placed)
        if self.spins:  # an advance without a turn
            J = J + J @ self._turned_back(placed.axes)[:, None]
        if self.summed is not None and np.any(J[..., self.summed]):
            J[..., self.summed] = J[..., self.summed] @ rotvec_rate(x[:, self.summed])[:, None]
        units = np.where(np.arange(6) < 3, 1.0 / self.length, 1.0)[:, None] * self._unit_steps
        J = J.transpose(1, 2, 3, 0)[:, :, self.unknowns] * units[..., None]
        turn = vector_of_rotation(np.einsum("neij,nekj->neik", placed.R_wanted, placed.R))
        shift = (placed.p_wanted - placed.p) / self.length
        e = np.concatenate([shift, turn], axis=-1).reshape(len(x), 6 * len(self.tree.ends))
        return e, J.transpose(3, 0, 1, 2).reshape(*e.shape, len(self.unknowns))

    def after_step(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Postures after steps (N, n) of the unknowns."""
        delta = np.zeros(x.shape)
        delta[:, self.unknowns] = step * self._unit_steps
        moved = after_motion(x, delta, self._turned)
        if not self.spins:
            return moved
        back = np.einsum("nij,nj->ni", self._turned_back(self.tree.placed(x).axes), delta)
        # Last, so that what is turned back is turned about the very axis of the screw.
        return after_motion(moved, back, self._turned)

    def _turned_back(self, axes: np.ndarray) -> np.ndarray:
        """What each joint turns back where a screw turns by one (N, size, size).

        With the axes (N, size, 3) of all coordinates.
        """
        S = np.zeros((*axes.shape[:2], axes.shape[1]))
        for place, back, _ in self.spins:
            S[:, back, place] = -np.einsum("ni,nki->nk", axes[:, place], axes[:, back])
        return S

    def lengths(self, x: np.ndarray) -> np.ndarray:
        """Lengths of the beams of telescopes (N, k) [m], which must be positive."""
        places, fixed, share = np.array(self.tree.beams, dtype=float).reshape(-1, 3).T
        return fixed + share * x[:, places.astype(int)]

    @cached_property
    def _turned(self) -> np.ndarray:
        """Spherical joints (b, 3) that are turned by steps."""
        balls = self.tree.balls
        return balls if self.summed is None else balls[balls[:, 0] != self.summed.start]

    @cached_property
    def _unit_steps(self) -> np.ndarray:
        """Unit of each unknown: the length for a shift, a radian for a turn, more for a screw."""
        units = np.where(self.tree.turns, 1.0, self.length)
        for place, _, unit in self.spins:
            units[place] = unit
        return units[self.unknowns]


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
    tool: tuple[np.ndarray, np.ndarray] | None = None,
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
    tool : ((3,), (3,) arrays), optional
        Tip and axis of the tool in the platform frame, by which the platform is posed: its
        coordinates are those of a pose of the tip, then the turn about the axis.
    """
    body = _FREE_BODY
    if tool is not None:
        spindle = revolute(tool[1], Passive(), name="spindle")
        to_origin = Rigid(Frame(np.eye(3), -tool[0]), "from the tip")
        body = Chain((*body.elements, spindle, to_origin))
    tree, parts, row, column = MotionTree(), [], 0, 0
    platform, pose = tree.along(body, AT_REST)
    size = body.size
    ends = np.cumsum([size, *(leg.chain.size for leg in legs)])
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
    given = [np.array([k for k in range(size) if k not in open_], dtype=int)]
    given += [start + held for start, held in zip(ends, drives, strict=False)]
    return Loops(
        tree=tree,
        start=np.concatenate([np.zeros(size), *(leg.chain.home for leg in legs)]),
        unknowns=np.array([*(size + np.flatnonzero(np.concatenate(free))), *open_], dtype=int),
        given=np.concatenate(given),
        parts=tuple(parts),
        length=length,
        summed=slice(3, 6),
        ends=tuple(ends.tolist()),
    )


def platform_mobility(
    robot: Robot,
    pose: np.ndarray,
    q: Sequence[np.ndarray],
    length: float,
    held: Sequence[np.ndarray] = (),
) -> np.ndarray:
    """Rates of the pose coordinates (6,) that the legs leave free at coordinates q of each.

    They are the pose part of what keeps all loops closed. Orthonormal columns (6, f), rotations
    multiplied by the length [m]. Of each leg coordinates at some places may be held.
    """
    loops = loops_of_legs(robot.legs, range(6), length, held)
    _, values, V_T = np.linalg.svd(loops.rates(np.concatenate([pose, *q])[None])[0])
    free = V_T[np.count_nonzero(values > _INDEPENDENT) :, -6:].T
    U, values, _ = np.linalg.svd(free)
    return U[:, : np.count_nonzero(values > _INDEPENDENT)]


def fitting_coordinates(mobility: np.ndarray) -> tuple[Coordinate, ...]:
    """Pose coordinates that determine the pose, the ones that move most (f of them)."""
    rest = mobility.copy()
    chosen: list[int] = []
    for _ in range(mobility.shape[1]):
        sizes = np.linalg.norm(rest, axis=-1)
        sizes[chosen] = -1.0
        # The first that is nearly as large as the largest keeps x before y before z.
        best = int(np.argmax(sizes > 0.9 * sizes.max()))
        chosen.append(best)
        rest = rest - np.outer(rest @ rest[best], rest[best]) / (rest[best] @ rest[best])
    return tuple(ALL_COORDINATES[k] for k in sorted(chosen))


def determine_pose(mobility: np.ndarray, coordinates: Sequence[Coordinate]) -> bool:
    """Whether as many coordinates as freedoms are chosen, and they are independent."""
    if len(coordinates) != mobility.shape[1]:
        return False
    rows = [ALL_COORDINATES.index(coordinate) for coordinate in coordinates]
    values = np.linalg.svd(mobility[rows], compute_uv=False)
    return bool(np.all(values > _INDEPENDENT))


def tree_of_leg(leg: Leg, R_base: np.ndarray) -> MotionTree:
    """A leg that begins in axes (3, 3); its first end is at the platform, whose place is given."""
    tree = MotionTree()
    end, path = tree.along(leg.chain, AT_REST.to(R_base, np.zeros(3)))
    tree.ends.insert(0, LoopEnd(end, AT_REST, path, ()))
    return tree


def attachment_frame(
    leg: Leg, R_platform: np.ndarray, p_platform: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Frame on the platform at which the chain of a leg ends, in the world."""
    p = p_platform + np.einsum("...ij,j->...i", R_platform, leg.attachment.p)
    return product(R_platform, leg.attachment.R), p
