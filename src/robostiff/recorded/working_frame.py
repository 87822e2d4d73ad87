"""A recorded leg in a working frame, in which its joints are trivial."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from robostiff.model import CoupledFreedom, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record, is_zero, most_size
from robostiff.spatial import Screw

#: A wrench or twist: six entries or numbers, or three in the plane.
Column = list[Any]

_MOST_FRAMES, _OF_LONG_LEGS = 64, 12
_SQUARE = 1e-12  # cosine of a right angle: rounding


@dataclass(frozen=True)
class WorkingFrame:
    """Axes (columns of R, world) and origin p in which a leg is worked on."""

    R: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class LocalSpring:
    """An elastic part in a working frame: own axes R (columns), place p, compliance (6, 6)."""

    R: np.ndarray
    p: np.ndarray
    compliance: np.ndarray

    def wrench(self, w: Column) -> Column:
        """A wrench about the frame's origin, moved to the end of the part, in the part's axes."""
        force, moment = w[:3], w[3:]
        moment = [m - c for m, c in zip(moment, cross(self.p, force), strict=True)]
        return [*turned_back(self.R, force), *turned_back(self.R, moment)]


@dataclass(frozen=True)
class LocalLeg:
    """A leg in a working frame."""

    twists: list[Column]  # J_q, one column a passive freedom, about the frame's origin
    springs: list[LocalSpring]
    drives: list[tuple[Column, Any]]  # twists of the elastic joints
    # The branches of each parallel block
    blocks: list[tuple[LocalLeg, ...]] = field(default_factory=list)

    @property
    def entries(self) -> int:
        """Number of entries that are not numbers; fewer give a shorter record."""
        seen = [x for twist in self.twists for x in twist]
        seen += [x for spring in self.springs for x in (*spring.R.flat, *spring.p)]
        seen += [x for twist, _ in self.drives for x in twist]
        inner = sum(branch.entries for block in self.blocks for branch in block)
        return sum(isinstance(x, Entry) for x in seen) + inner


def local_leg(leg: PlacedLeg, frame: WorkingFrame, record: Record, length: float) -> LocalLeg:
    """A leg in a working frame; entries that are 0 or 1 there at all poses become numbers."""
    twists, springs, drives = [], [], []
    blocks = [
        tuple(local_leg(branch, frame, record, length) for branch in block.branches)
        for block in leg.blocks
    ]
    for element in leg.own_parts:
        if isinstance(element, PlacedFreedom):
            twist = _twist(element, frame, record, length)
            if element.is_passive:
                twists.append(twist)
            elif element.stiffness is not None:
                drives.append((twist, element.stiffness))
            continue
        p = [record.simplified(x, length) for x in turned_back(frame.R, element.point - frame.p)]
        R = np.array(
            [
                [record.simplified(dot(frame.R[:, i], element.rotation[:, k])) for k in range(3)]
                for i in range(3)
            ],
            dtype=object,
        )
        spring = LocalSpring(R, np.array(p, dtype=object), element.elasticity.compliance)
        springs.append(spring)
        for freedom in element.elasticity.freedoms.T:
            move, turn = ([dot(row, part) for row in R] for part in (freedom[:3], freedom[3:]))
            lever = cross(spring.p, turn)
            twists.append([*(a + b for a, b in zip(move, lever, strict=True)), *turn])
    return LocalLeg(twists, springs, drives, blocks)


def working_frames(leg: PlacedLeg, world: WorkingFrame) -> Iterator[WorkingFrame]:
    """Candidate frames: the world, and the axes of springs and joints at each of their points.

    A slide or turn and the next axis across it make a frame, too. A long leg has too many pairs of
    axes and points: axes are then tried at points as far along the leg.
    """
    yield world
    rotations = [e.rotation for e in leg.springs]
    for first, second in pairwise(() if rotations else leg.freedoms):
        if most_size(dot(first.axis, second.axis)) < _SQUARE:
            columns = [first.axis, second.axis, cross(first.axis, second.axis)]
            rotations.append(np.array(columns, dtype=object).T)
    rotations = rotations or [world.R]
    points = [e.point for e in leg.parts if isinstance(e, PlacedSpring) or e.turns]
    pairs = [(R, p) for R in rotations for p in points]
    if len(pairs) > _MOST_FRAMES:
        along = np.arange(_OF_LONG_LEGS) / _OF_LONG_LEGS
        axes, at = ((along * len(choices)).astype(int) for choices in (rotations, points))
        pairs = [(rotations[i], points[k]) for i, k in zip(axes, at, strict=True)]
    tried: set[tuple[Any, ...]] = set()
    for R, p in pairs:
        key = (*map(_key, R.flat), *map(_key, p))
        if key not in tried:
            tried.add(key)
            yield WorkingFrame(R, p)


def energy_of(leg: LocalLeg, wrenches: Sequence[Column], rows: Sequence[int]) -> list[list[Any]]:
    """W^T C W of a leg's wrenches (in some rows of six), spring by spring, blocks left out."""
    whole = [_whole(w, rows) for w in wrenches]
    n = len(whole)
    energy: list[list[Any]] = [[0] * n for _ in range(n)]
    for spring in leg.springs:
        seen = [spring.wrench(w) for w in whole]
        given = [[dot(w, column) for column in spring.compliance.T] for w in seen]
        for i in range(n):
            for j in range(i, n):
                energy[i][j] = energy[i][j] + dot(given[i], seen[j])
    for twist, stiffness in leg.drives:
        work = [dot(w, twist) for w in whole]
        for i in range(n):
            for j in range(i, n):
                if not (is_zero(work[i]) or is_zero(work[j])):
                    energy[i][j] = energy[i][j] + work[i] * work[j] / stiffness
    for i in range(n):
        for j in range(i):
            energy[i][j] = energy[j][i]
    return energy


def to_world(
    w: Column, frame: WorkingFrame, reference: np.ndarray, rows: tuple[int, ...]
) -> Column:
    """A wrench of a working frame in world axes, about the reference point."""
    whole = _whole(w, rows)
    force = [dot(row, whole[:3]) for row in frame.R]
    moment = [dot(row, whole[3:]) for row in frame.R]
    arm = frame.p - reference
    moment = [m + c for m, c in zip(moment, cross(arm, force), strict=True)]
    both = [*force, *moment]
    return [both[row] for row in rows]


def from_world(
    w: Column, frame: WorkingFrame, reference: np.ndarray, rows: tuple[int, ...]
) -> Column:
    """A wrench about the reference point in world axes, in a working frame."""
    whole = _whole(w, rows)
    moment = [m - c for m, c in zip(whole[3:], cross(frame.p - reference, whole[:3]), strict=True)]
    both = [*turned_back(frame.R, whole[:3]), *turned_back(frame.R, moment)]
    return [both[row] for row in rows]


def turned_back(R: np.ndarray, v: Any) -> Column:
    """R^T v."""
    return [dot(R[:, k], v) for k in range(3)]


def cross(a: Any, b: Any) -> Column:
    """Cross product of a and b."""
    return [
        dot((a[1], a[2]), (b[2], -b[1])),
        dot((a[2], a[0]), (b[0], -b[2])),
        dot((a[0], a[1]), (b[1], -b[0])),
    ]


def _twist(freedom: Screw, frame: WorkingFrame, record: Record, length: float) -> Column:
    """Column (17) about the frame's origin."""
    if isinstance(freedom, CoupledFreedom):
        moves = [(t, _twist(screw, frame, record, length)) for _, t, screw in freedom.moves]
        return [dot([t for t, _ in moves], [twist[row] for _, twist in moves]) for row in range(6)]
    p = [record.simplified(x, length) for x in turned_back(frame.R, freedom.point - frame.p)]
    axis = [record.simplified(x) for x in turned_back(frame.R, freedom.axis)]
    here = Screw(np.array(axis, dtype=object), np.array(p, dtype=object), freedom.pitch)
    return here.twist(np.zeros(3, dtype=int)).tolist()


def _whole(w: Column, rows: Sequence[int]) -> Column:
    whole: Column = [0] * 6
    for row, x in zip(rows, w, strict=True):
        whole[row] = x
    return whole


def _key(value: Any) -> Any:
    return ("entry", value.step) if isinstance(value, Entry) else float(value)


def dot(a: Sequence[Any] | np.ndarray, b: Sequence[Any] | np.ndarray) -> Any:
    """Sum of products; zeros leave no trace."""
    total: Any = 0
    for x, y in zip(a, b, strict=True):
        if (isinstance(x, Entry) or x != 0) and (isinstance(y, Entry) or y != 0):
            total = total + x * y
    return total
