"""Legs as a tree of moving frames, placed level by level: gaps and rates of closure at many poses.

`place_chain` makes names, springs and elasticities as well; Newton's method needs none of them, but
frames at many hundred postures. The kinds of joints do not depend on the pose, and are read once.
Screws that make many turns take steps in which another joint about the same axis turns them back.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from robostiff.kinematics.frames import place_chain
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import (
    Chain,
    Joint,
    JointKind,
    Leg,
    Locked,
    ParallelBlock,
    PlacedFreedom,
    Rigid,
    Telescope,
)
from robostiff.spatial import Screw, skew
from robostiff.spatial.batch import product, transposed
from robostiff.spatial.rotation import vector_of_rotation
from robostiff.spatial.screw import twists_of_screws

_COAXIAL = 1e-9  # sine, and part of the length
_SEED = 3  # of the postures at which axes are compared


@dataclass(frozen=True)
class Spin:
    """A screw, and the joint of the same chain about its axis that can take its turns back.

    A nut advances 100 mm in twenty turns, and nothing but the nut is turned where that joint turns
    back. One step of Newton's method goes that far only where both turn together.
    """

    place: int  # of the screw in the coordinate vector of its leg
    back: tuple[int, ...]  # places of a coaxial turn, or of a spherical joint on the axis
    # Angle that advances by the characteristic length, or one radian if that is more [rad]
    unit: float

    def after(self, start: int) -> Spin:
        """The same in a vector that has other coordinates before those of the chain."""
        return Spin(self.place + start, tuple(i + start for i in self.back), self.unit)

    def add_to(self, rates: np.ndarray, axes: np.ndarray) -> None:
        """In rates (N, ends, 6, size), the screw's become those of an advance without a turn.

        With the axes (N, size, 3) of all coordinates.
        """
        own = rates[..., self.place]
        for place, share in self._shares(axes):
            own = own + share[:, None, None] * rates[..., place]
        rates[..., self.place] = self.unit * own

    def take_from(self, step: np.ndarray, back: np.ndarray, axes: np.ndarray) -> None:
        """From steps (N, size) so scaled, those of the coordinates, and what is taken back."""
        step[..., self.place] *= self.unit
        for place, share in self._shares(axes):
            back[..., place] += share * step[..., self.place]

    def _shares(self, axes: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """What each joint that turns back turns where the screw turns by one (N,), by its place."""
        for i in self.back:
            yield i, -np.einsum("...i,...i->...", axes[:, self.place], axes[:, i])


def spins_of(chain: Chain, length: float) -> tuple[Spin, ...]:
    """The screws of a chain whose turns another of its joints takes back, at any posture."""
    if chain.is_coupled or not any(screw.turns and screw.slides for screw in chain.freedoms):
        return ()  # what turns back must be free to turn alone
    drawn = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (2, chain.size))
    q = np.where(chain.free, drawn, chain.home)
    freedoms = place_chain(chain, q, np.eye(3), np.zeros(3)).freedoms
    found = []
    for moving in _of_one_chain(chain):
        turning = list(_turning(moving))
        for i in (i for _, where in moving for i in range(where.start, where.stop)):
            screw = freedoms[i]
            if not (screw.turns and screw.slides) or not chain.free[i]:
                continue
            fits = [back for back in turning if _is_on_axis(screw, [freedoms[k] for k in back])]
            if fits:
                nearest = min(fits, key=lambda back: abs(back[0] - i))
                unit = max(1.0, length / abs(float(screw.pitch)))
                found.append(Spin(i, nearest, unit))
    return tuple(found)


_Moving = list[tuple[Joint | Telescope, slice]]


def _of_one_chain(chain: Chain, start: int = 0) -> Iterator[_Moving]:
    """What moves, with its places, in the branches of blocks and in the chain itself."""
    own: _Moving = []
    for element in chain.elements:
        if isinstance(element, ParallelBlock):
            for branch in element.branches:
                yield from _of_one_chain(branch.chain, start)
                start += branch.chain.size
        elif isinstance(element, Joint | Telescope):
            own.append((element, slice(start, start + len(element.freedoms))))
            start += len(element.freedoms)
    yield own


def _turning(moving: _Moving) -> Iterator[tuple[int, ...]]:
    """Places of pure turns, each alone, and of spherical joints, all three."""
    for element, where in moving:
        places = tuple(range(where.start, where.stop))
        if isinstance(element.role, Locked):
            continue
        if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
            yield places
        else:
            yield from (
                (i,) for i, screw in zip(places, element.freedoms, strict=True) if screw.is_rotation
            )


def _is_on_axis(screw: PlacedFreedom, back: list[PlacedFreedom]) -> bool:
    """Whether the axis of a turn is that of a screw, or a spherical joint is on it."""
    apart = back[0].point - screw.point
    size = np.linalg.norm(apart, axis=-1).max() + abs(float(screw.pitch))
    off = np.linalg.norm(np.cross(screw.axis, apart), axis=-1).max()
    turned = 0.0
    if len(back) == 1:
        turned = float(np.linalg.norm(np.cross(screw.axis, back[0].axis), axis=-1).max())
    return bool(off <= _COAXIAL * size and turned <= _COAXIAL)


WORLD, PLATFORM = 0, 1


@dataclass(frozen=True)
class Fixed:
    """A frame at rest in one of the moving frames: its number, axes and origin [m]."""

    frame: int
    R: np.ndarray
    p: np.ndarray

    def to(self, R: np.ndarray, p: np.ndarray) -> Fixed:
        """The frame that it leads to by its own axes and origin."""
        return Fixed(self.frame, self.R @ R, self.p + self.R @ p)


@dataclass(frozen=True)
class LoopEnd:
    """Two frames that closure brings together, and the coordinates that move them."""

    own: Fixed
    wanted: Fixed
    moving: tuple[int, ...]  # coordinates of all legs that move the one
    leading: tuple[int, ...]  # those that move the other


@dataclass(frozen=True)
class PlacedTree:
    """All frames, axes and ends of loops at N postures."""

    # (N, size, 3): unit vector of each coordinate, and a point of its line [m]
    axes: np.ndarray
    points: np.ndarray
    # (N, ends, 3, 3) and (N, ends, 3): of each end, the frame that it is at and the one where it
    # should be
    R: np.ndarray
    p: np.ndarray
    R_wanted: np.ndarray
    p_wanted: np.ndarray


@dataclass
class MotionTree:
    """Legs read into moving frames; the first two are the world and the platform."""

    legs: Sequence[Leg]
    # Of each leg its end on the platform, then those of the loops inside it
    ends: list[LoopEnd] = field(default_factory=list)
    ends_of_legs: list[int] = field(default_factory=list)  # how many each leg has

    def __post_init__(self) -> None:
        self._before: list[Fixed] = []
        self._screws: list[Screw] = []
        self._coordinates: list[int] = []  # of each frame
        self._frames: list[int] = []  # of each coordinate
        self._axes: list[np.ndarray] = []  # of each coordinate, in the frame before
        self._slides: list[np.ndarray] = []  # of each frame, for one of its coordinate
        self._balls: list[tuple[int, int]] = []  # frame and first coordinate
        self._levels: list[int] = [0, 0]
        for leg in self.legs:
            base = Fixed(WORLD, leg.base.R, leg.base.p)
            attachment = Fixed(PLATFORM, leg.attachment.R, leg.attachment.p)
            place = len(self.ends)
            end, led_by = self._along(leg.chain, base)
            self.ends.insert(place, LoopEnd(end, attachment, led_by, ()))
            self.ends_of_legs.append(len(self.ends) - place)
        self._sort()

    def _along(self, chain: Chain, at: Fixed) -> tuple[Fixed, tuple[int, ...]]:
        """Where a chain ends, and the coordinates that lead there."""
        led_by: list[int] = []
        for element in chain.elements:
            first = len(self._frames)
            if isinstance(element, Rigid):
                at = at.to(element.transform.R, element.transform.p)
            elif isinstance(element, ParallelBlock):
                at, own = self._across(element, at)
                led_by += own
            elif isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
                for screw in element.freedoms:
                    self._freedom(at, screw)
                at = self._moved(at, element.freedoms[0], first)
                self._balls.append((at.frame, first))
                led_by += range(first, first + 3)
            elif isinstance(element, Joint | Telescope):
                share = 1.0
                if isinstance(element, Telescope) and element.beams:
                    at = at.to(np.eye(3), element.direction * element.fixed_length)
                    share = sum(beam.share for beam in element.beams)
                for screw in element.freedoms:
                    led_by.append(len(self._frames))
                    self._freedom(at, screw)
                    at = self._moved(at, screw, led_by[-1], share)
            else:
                at = at.to(np.eye(3), element.to)
        return at, tuple(led_by)

    def _across(self, block: ParallelBlock, at: Fixed) -> tuple[Fixed, tuple[int, ...]]:
        """Where a block ends, as its first branch has it."""
        found = [
            self._along(branch.chain, at.to(branch.start.R, branch.start.p))
            for branch in block.branches
        ]
        (end, leading), *others = found
        back = block.branches[0].end.inverse
        end = end.to(back.R, back.p)
        for branch, (own, moving) in zip(block.branches[1:], others, strict=True):
            wanted = end.to(branch.end.R, branch.end.p)
            self.ends.append(LoopEnd(own, wanted, moving, leading))
        return end, leading

    def _freedom(self, at: Fixed, screw: Screw) -> None:
        """A coordinate whose line passes through the origin of the frame made next."""
        self._frames.append(len(self._levels))
        self._axes.append(at.R @ screw.axis)
        self._screws.append(screw)

    def _moved(self, at: Fixed, screw: Screw, place: int, share: float = 1.0) -> Fixed:
        """The frame that a screw moves, by a share of its advance."""
        self._slides.append(at.R @ screw.axis * (share * screw.advance(1.0)))
        self._before.append(at)
        self._coordinates.append(place)
        self._levels.append(1 + self._levels[at.frame])
        return Fixed(len(self._levels) - 1, np.eye(3), np.zeros(3))

    @cached_property
    def balls(self) -> np.ndarray:
        """Coordinates of the spherical joints (b, 3)."""
        first = np.array([place for _, place in self._balls], dtype=int)
        return first[:, None] + np.arange(3)

    @cached_property
    def turns(self) -> np.ndarray:
        """Which coordinates turn (size,) bool."""
        return np.array([screw.turns for screw in self._screws], dtype=bool)

    def _sort(self) -> None:
        """Set what every frame does, the frames in the order of levels.

        They turn by A + sin q A E + (1 - cos q) A E^2, and shift along an axis.
        """
        order = 2 + np.argsort(np.array(self._levels[2:], dtype=int), kind="stable")
        number = np.concatenate([[WORLD, PLATFORM], np.zeros(len(order), dtype=int)])
        number[order] = 2 + np.arange(len(order))
        before = [self._before[i - 2] for i in order]
        places = np.array([self._coordinates[i - 2] for i in order], dtype=int)
        screws = [self._screws[i] for i in places]
        A = np.array([one.R for one in before], dtype=float).reshape(-1, 3, 3)
        shift = np.array([one.p for one in before], dtype=float).reshape(-1, 3)
        E = np.array([skew(screw.axis) * screw.turns for screw in screws]).reshape(-1, 3, 3)
        level = np.array(self._levels, dtype=int)[order]
        starts = 2 + np.searchsorted(level, np.arange(1, max(self._levels) + 2))
        self._order = number  # place of each frame among those in the order of levels
        self._parents = number[np.array([one.frame for one in before], dtype=int)]
        self._places, self._shift = places, shift
        self._A, self._AE, self._AEE = A, A @ E, A @ E @ E
        self._slide = np.array([self._slides[i - 2] for i in order], dtype=float).reshape(-1, 3)
        self._of_balls = number[np.array([frame for frame, _ in self._balls], dtype=int)] - 2
        self._slices = [slice(a, b) for a, b in pairwise(starts.tolist())]  # of the levels
        self._own_axes = np.array(self._axes, dtype=float).reshape(-1, 3, 1)

    @cached_property
    def _ends(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Moving frames, axes and origins in them: of the ends, and of where they should be."""
        found = []
        for fixed in ([end.own for end in self.ends], [end.wanted for end in self.ends]):
            frames = self._order[[one.frame for one in fixed]]
            R = np.array([one.R for one in fixed], dtype=float).reshape(-1, 3, 3)
            p = np.array([one.p for one in fixed], dtype=float).reshape(-1, 3, 1)
            found.append((frames, R, p))
        return found

    @cached_property
    def _pairs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Ends, the coordinates that move either frame, and whether it is the wanted one."""
        found = [
            (i, place, leads)
            for i, end in enumerate(self.ends)
            for leads, places in enumerate((end.moving, end.leading))
            for place in places
        ]
        ends, places, leads = np.array(found, dtype=int).reshape(-1, 3).T
        return ends, places, leads.astype(bool)

    def placed(self, R_platform: np.ndarray, p_platform: np.ndarray, q: np.ndarray) -> PlacedTree:
        """The tree at poses (N, 3, 3), (N, 3) of the platform and coordinates (N, size)."""
        count, size = len(q), len(self._order)
        q = q if self._motions is None else q @ self._motions.T
        own = q[:, self._places]
        sine, versine = np.sin(own), 2.0 * np.sin(0.5 * own) ** 2
        M = self._A + sine[..., None, None] * self._AE + versine[..., None, None] * self._AEE
        if self._of_balls.size:
            M[:, self._of_balls] = self._A[self._of_balls] @ turn_by_vector(q[:, self.balls])
        d = (self._shift + own[..., None] * self._slide)[..., None]
        R, p = np.empty((count, size, 3, 3)), np.empty((count, size, 3, 1))
        R[:, WORLD], p[:, WORLD] = np.eye(3), 0.0
        R[:, PLATFORM], p[:, PLATFORM] = R_platform, p_platform[..., None]
        for level in self._slices:
            here = slice(level.start - 2, level.stop - 2)
            R_before = R[:, self._parents[here]]
            R[:, level] = R_before @ M[:, here]
            p[:, level] = p[:, self._parents[here]] + R_before @ d[:, here]
        frames = self._order[np.array(self._frames, dtype=int)]
        axes = (R[:, self._parents[frames - 2]] @ self._own_axes)[..., 0]
        ends = []
        for own, R_own, p_own in self._ends:
            ends += [R[:, own] @ R_own, (p[:, own] + R[:, own] @ p_own)[..., 0]]
        return PlacedTree(axes, p[:, frames][..., 0], *ends)

    def closing_twists(self, placed: PlacedTree) -> np.ndarray:
        """Twists (17) by which each coordinate closes each end (N, ends, 6, size)."""
        ends, places, leads = self._pairs
        at = np.where(leads[:, None], placed.p_wanted[:, ends], placed.p[:, ends])
        e, r = placed.axes[:, places], at - placed.points[:, places]
        pitches = [self._screws[i].pitch for i in places]
        twist = twists_of_screws(transposed(e), transposed(r), pitches)
        J = np.zeros((len(at), len(self.ends), 6, len(self._screws)))
        J[:, ends, :, places] = np.moveaxis(np.where(leads, -twist, twist), -1, 0)
        return J if self._motions is None else J @ self._motions

    @cached_property
    def _motions(self) -> np.ndarray | None:
        """Motions of all joints for each coordinate (size, size); None where they are equal."""
        if not any(leg.chain.is_coupled for leg in self.legs):
            return None
        T, start = np.eye(len(self._frames)), 0
        for leg in self.legs:
            own, stop = leg.chain.joint_motions, start + leg.chain.size
            if own is not None:
                T[start:stop, start:stop] = own
            start = stop
        return T


def advanced(q: np.ndarray, delta: np.ndarray, balls: np.ndarray) -> np.ndarray:
    """Coordinates (..., size) after small motions; balls at places (b, 3) turn about frame axes."""
    moved = q + delta
    if balls.size:
        turn = turn_by_vector(delta[..., balls])
        moved[..., balls] = vector_of_rotation(product(turn, turn_by_vector(q[..., balls])))
    return moved
