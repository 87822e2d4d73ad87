"""Chains as a tree of moving frames, placed level by level, and the frames that loops close.

`place_chain` makes names, springs and elasticities as well; Newton's method needs none of them, but
frames at many hundred postures. The kinds of joints do not depend on the pose, and are read once.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from robostiff.frozen import frozen, replace
from robostiff.kinematics.closure.body import tidy_numbers, tidy_point
from robostiff.kinematics.turn import turn_about, turn_by_vector
from robostiff.model import Chain, Joint, JointKind, ParallelBlock, Rigid, Telescope
from robostiff.spatial import Screw, skew
from robostiff.spatial.batch import product
from robostiff.spatial.rotation import vector_of_rotation
from robostiff.spatial.screw import twists_of_screws

_WORLD = 0


@frozen
class Fixed:
    """A frame at rest in one of the moving frames: its number, axes and origin [m]."""

    frame: int
    R: np.ndarray
    p: np.ndarray
    # The end of a block on the way, and axes and origin in it: records share what leads there
    via: tuple[Fixed, np.ndarray, np.ndarray] | None = None

    def to(self, R: np.ndarray, p: np.ndarray) -> Fixed:
        """The frame that it leads to by its own axes and origin."""
        via = self.via and (self.via[0], self.via[1] @ R, self.via[2] + self.via[1] @ p)
        return Fixed(self.frame, self.R @ R, self.p + self.R @ p, via)


#: The frame of the world.
AT_REST = Fixed(_WORLD, np.eye(3), np.zeros(3))


@frozen
class LoopEnd:
    """Two frames that closure brings together, and the places of coordinates that move them."""

    own: Fixed
    wanted: Fixed
    moving: tuple[int, ...]  # those that move the one
    leading: tuple[int, ...]  # those that move the other


@frozen
class PlacedTree:
    """All frames, axes and ends of loops at N postures, or at one of recorded entries without N.

    Equal entries of all postures are side by side in memory.
    """

    frames: tuple[np.ndarray, np.ndarray]  # (N, frames, 3, 3) and (N, frames, 3)
    # (N, size, 3): unit vector of each coordinate, and a point of its line [m]
    axes: np.ndarray
    points: np.ndarray
    # (N, ends, 3, 3) and (N, ends, 3): of each end, the frame that it is at and the one where it
    # should be
    R: np.ndarray
    p: np.ndarray
    R_wanted: np.ndarray
    p_wanted: np.ndarray

    def at(self, fixed: Fixed) -> tuple[np.ndarray, np.ndarray]:
        """Axes (N, 3, 3) and origin (N, 3) of a frame at rest in one of the moving frames."""
        R, p = self.frames[0][..., fixed.frame, :, :], self.frames[1][..., fixed.frame, :]
        if R.dtype != object:
            return R @ fixed.R, p + R @ fixed.p
        if fixed.via is None:
            start, R_own, p_own = p, fixed.R, fixed.p
        else:
            end, R_own, p_own = fixed.via
            R, start = self.at(end)
        # Products with what is rounding would be recorded.
        return R @ tidy_numbers(R_own), start + R @ tidy_point(p_own)


@frozen
class _Sorted:
    """What every frame but the world does.

    They turn by A + sin q A E + (1 - cos q) A E^2, and shift along an axis.
    """

    parents: np.ndarray  # (frames,) of int
    places: np.ndarray  # (frames,) of int: coordinates
    shift: np.ndarray  # (frames, 3, 1)
    slide: np.ndarray  # (frames, 3, 1): for one of the coordinate
    A: np.ndarray  # (frames, 3, 3, 1)
    AE: np.ndarray
    AEE: np.ndarray
    levels: list[np.ndarray]  # of int: frames that are placed at once
    frames: np.ndarray  # (size,) of int: those that coordinates move
    axes: np.ndarray  # (size, 3): theirs, in the frames before
    balls: np.ndarray  # (b,) of int: frames of spherical joints
    # Of the ends, and of where they should be: moving frames, axes and origins in them
    ends: list[tuple[np.ndarray, np.ndarray, np.ndarray]]


class MotionTree:
    """Chains read into moving frames; coordinates are counted as they are met.

    Attributes
    ----------
    ends : list of LoopEnd
    beams : list of (int, float, float)
        Of telescopes: place of the coordinate, length where it is 0 [m], and part of it.
    screws : list of Screw
        Of each coordinate.
    chains : list of int or None
        Of each coordinate the chain or branch in which it is; None where joints are coupled.
    """

    def __init__(self) -> None:
        self.ends: list[LoopEnd] = []
        self.beams: list[tuple[int, float, float]] = []
        self._motions: list[tuple[int, np.ndarray]] = []  # of coupled chains, with first places
        self._before: list[Fixed] = []
        self.screws: list[Screw] = []
        self.chains: list[int | None] = []
        self._count = 0  # of chains
        self._coordinates: list[int] = []  # of each frame
        self._frames: list[int] = []  # of each coordinate
        self._axes: list[np.ndarray] = []  # of each coordinate, in the frame before
        self._slides: list[np.ndarray] = []  # of each frame, for one of its coordinate
        self._balls: list[tuple[int, int]] = []  # frame and first coordinate
        self._levels: list[int] = [0]

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.screws)

    def along(self, chain: Chain, at: Fixed) -> tuple[Fixed, tuple[int, ...]]:
        """Where a chain ends, and the places of coordinates that lead there."""
        first, T = self.size, chain.joint_motions
        found = self._along(chain, at)
        if T is not None:
            self._motions.append((first, T))
            self.chains[first:] = [None] * len(T)
        return found

    def _along(self, chain: Chain, at: Fixed) -> tuple[Fixed, tuple[int, ...]]:
        led_by: list[int] = []
        self._count = number = self._count + 1
        for element in chain.elements:
            first = self.size
            if isinstance(element, Rigid):
                at = at.to(element.transform.R, element.transform.p)
            elif isinstance(element, ParallelBlock):
                # Where the block ends, as its first branch has it.
                (end, leading), *others = (
                    self._along(branch.chain, at.to(branch.start.R, branch.start.p))
                    for branch in element.branches
                )
                back = element.branches[0].end.inverse
                end = end.to(back.R, back.p)
                at = replace(end, via=(end, np.eye(3), np.zeros(3)))
                led_by += leading
                for branch, (own, moving) in zip(element.branches[1:], others, strict=True):
                    wanted = at.to(branch.end.R, branch.end.p)
                    self.ends.append(LoopEnd(own, wanted, moving, leading))
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
                    self.beams += [(first, beam.fixed, beam.share) for beam in element.beams]
                for screw in element.freedoms:
                    led_by.append(self.size)
                    self._freedom(at, screw)
                    at = self._moved(at, screw, led_by[-1], share)
            else:
                at = at.to(np.eye(3), element.to)
            self.chains += [number] * (self.size - len(self.chains))
        return at, tuple(led_by)

    def _freedom(self, at: Fixed, screw: Screw) -> None:
        """A coordinate whose line passes through the origin of the frame made next."""
        self._frames.append(len(self._levels))
        self._axes.append(at.R @ screw.axis)
        self.screws.append(screw)

    def _moved(self, at: Fixed, screw: Screw, place: int, share: float = 1.0) -> Fixed:
        """The frame that a screw moves, by a share of its advance."""
        self._slides.append(at.R @ screw.axis * (share * screw.advance(1.0)))
        self._before.append(at)
        self._coordinates.append(place)
        self._levels.append(1 + self._levels[at.frame])
        return Fixed(len(self._levels) - 1, np.eye(3), np.zeros(3))

    @cached_property
    def balls(self) -> np.ndarray:
        """Places of the coordinates of spherical joints (b, 3)."""
        first = np.array([place for _, place in self._balls], dtype=int)
        return first[:, None] + np.arange(3)

    @cached_property
    def turns(self) -> np.ndarray:
        """Which coordinates turn (size,) bool."""
        return np.array([screw.turns for screw in self.screws], dtype=bool)

    @cached_property
    def _sorted(self) -> _Sorted:
        before, places = self._before, np.array(self._coordinates, dtype=int)
        screws, level = [self.screws[i] for i in places], np.array(self._levels)
        A = np.array([one.R for one in before], dtype=float).reshape(-1, 3, 3)
        E = np.array([skew(screw.axis) * screw.turns for screw in screws]).reshape(-1, 3, 3)
        return _Sorted(
            parents=np.array([one.frame for one in before], dtype=int),
            places=places,
            shift=np.array([one.p for one in before], dtype=float).reshape(-1, 3, 1),
            slide=np.array(self._slides, dtype=float).reshape(-1, 3, 1),
            A=A[..., None],
            AE=(A @ E)[..., None],
            AEE=(A @ E @ E)[..., None],
            levels=[np.flatnonzero(level == one) for one in range(1, max(self._levels) + 1)],
            frames=np.array(self._frames, dtype=int),
            axes=np.array(self._axes, dtype=float).reshape(-1, 3),
            balls=np.array([frame for frame, _ in self._balls], dtype=int),
            ends=[
                (
                    np.array([one.frame for one in fixed], dtype=int),
                    np.array([one.R for one in fixed], dtype=float).reshape(-1, 3, 3),
                    np.array([one.p for one in fixed], dtype=float).reshape(-1, 3),
                )
                for fixed in ([end.own for end in self.ends], [end.wanted for end in self.ends])
            ],
        )

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

    def placed(self, q: np.ndarray, turned: Mapping[int, np.ndarray] | None = None) -> PlacedTree:
        """The tree at coordinates (N, size) [m, rad], or at entries (size,).

        At entries axes (3, 3) behind ball joints may be known, by the first places of these.
        """
        if q.dtype == object:
            return self._on_entries(q, turned or {})
        own = self._sorted
        q = q if self._transmission is None else q @ self._transmission.T
        frames, balls, count = own.frames, own.balls, len(q)
        x = q.T[own.places][:, None]
        sine, versine = np.sin(x)[:, None], 2.0 * np.sin(0.5 * x[:, None]) ** 2
        M = own.A + sine * own.AE + versine * own.AEE
        if balls.size:
            turns = turn_by_vector(q[:, self.balls])
            M[balls - 1] = np.einsum("fij,nfjk->fikn", own.A[balls - 1, ..., 0], turns)
        d = own.shift + x * own.slide
        R, p = np.empty((1 + len(M), 3, 3, count)), np.empty((1 + len(M), 3, count))
        R[_WORLD], p[_WORLD] = np.eye(3)[..., None], 0.0
        for level in own.levels:
            parents = own.parents[level - 1]
            R_before = R[parents]
            R[level] = np.einsum("fijn,fjkn->fikn", R_before, M[level - 1])
            p[level] = p[parents] + np.einsum("fijn,fjn->fin", R_before, d[level - 1])
        along = np.einsum("fijn,fj->fin", R[own.parents[frames - 1]], own.axes)
        found = [R, p, along, p[frames]]
        for at, R_own, p_own in own.ends:
            R_at = R[at]
            found.append(np.einsum("fijn,fjk->fikn", R_at, R_own))
            found.append(p[at] + np.einsum("fijn,fj->fin", R_at, p_own))
        R, p, *rest = (own.transpose(own.ndim - 1, *range(own.ndim - 1)) for own in found)
        return PlacedTree((R, p), *rest)

    def _on_entries(self, q: np.ndarray, turned: Mapping[int, np.ndarray]) -> PlacedTree:
        q = q if self._transmission is None else self._transmission @ q
        count, balls = 1 + len(self._before), dict(self._balls)
        R, p = np.empty((count, 3, 3), dtype=object), np.empty((count, 3), dtype=object)
        R[_WORLD], p[_WORLD] = np.eye(3, dtype=int), 0
        none, starts = np.zeros((0, 3, 3)), p.copy()
        placed = PlacedTree((R, p), none, none, none, none, none, none)
        for k, (before, i) in enumerate(zip(self._before, self._coordinates, strict=True), start=1):
            R[k], p[k] = placed.at(before)
            starts[k] = p[k]
            if k in balls:
                R[k] = turned[i] if i in turned else R[k] @ turn_by_vector(q[i : i + 3])
            elif self.screws[i].turns:
                R[k] = R[k] @ turn_about(self.screws[i].axis, q[i : i + 1].reshape(()))
            p[k] = p[k] + (R[before.frame] @ tidy_point(self._slides[k - 1])) * q[i]
        parents = [self._before[frame - 1].frame for frame in self._frames]
        axes = [R[k] @ tidy_numbers(axis) for k, axis in zip(parents, self._axes, strict=True)]
        ends = [(*placed.at(one.own), *placed.at(one.wanted)) for one in self.ends]
        four = [np.array(x) for x in zip(*ends, strict=True)] or [none] * 4
        return PlacedTree((R, p), np.array(axes), starts[self._frames], *four)

    def closing_twists(self, placed: PlacedTree) -> np.ndarray:
        """Twists (17) by which each coordinate closes each end (N, ends, 6, size), side by side."""
        ends, places, leads = self._pairs
        four = (placed.axes, placed.points, placed.p, placed.p_wanted)
        axes, points, *at = (own.transpose(1, 2, 0) for own in four)
        arms = np.concatenate(at)[ends + leads * len(self.ends)] - points[places]
        pitches = [self.screws[i].pitch for i in places]
        twist = twists_of_screws(axes[places].T, arms.T, pitches) * np.where(leads, -1.0, 1.0)
        J = np.zeros((len(self.ends), 6, self.size, len(placed.p)))
        J[ends, :, places] = twist.T
        J = J.transpose(3, 0, 1, 2)
        return J if self._transmission is None else J @ self._transmission

    @cached_property
    def _transmission(self) -> np.ndarray | None:
        """Motions of all joints for each coordinate (size, size); None where they are equal."""
        if not self._motions:
            return None
        T = np.eye(self.size)
        for first, own in self._motions:
            T[first : first + len(own), first : first + len(own)] = own
        return T


def after_motion(q: np.ndarray, delta: np.ndarray, balls: np.ndarray) -> np.ndarray:
    """Coordinates (..., size) after small motions; balls at places (b, 3) turn about frame axes."""
    moved = q + delta
    if balls.size:
        turn = turn_by_vector(delta[..., balls])
        moved[..., balls] = vector_of_rotation(product(turn, turn_by_vector(q[..., balls])))
    return moved
