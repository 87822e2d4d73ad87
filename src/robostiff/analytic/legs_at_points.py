"""Legs at exact points: their stiffness in ball arithmetic, and which of them are turns of others.

The equilibrium of springs and joints is inverted as a whole, eq. (7), in numbers that enclose the
exact ones: no formula is written, and a wrong derivation by elimination differs from them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import flint
import numpy as np

from robostiff.analytic.exact_points import ExactPoints
from robostiff.analytic.numeric_value import BITS
from robostiff.analytic.orbits import MIRRORS, Image
from robostiff.kinematics.jacobians import freedom_twist
from robostiff.model import CoupledFreedom, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry
from robostiff.spatial import skew

_REDUNDANT = 1e-9  # of a unit twist, as in the elimination of joints
_SAME = 1e-10  # of the largest entry, in floats
_NOTHING = 1e-40  # of the largest entry, in balls


@dataclass(frozen=True)
class LegAtPoints:
    """A leg in numbers that enclose the exact ones."""

    stiffness: tuple[Any, ...]  # (n, n): about the reference point, world axes; one a point
    redundant: tuple[bool, ...]  # which passive joints add no freedom to those before

    @classmethod
    def of(
        cls, leg: PlacedLeg, points: ExactPoints, reference: np.ndarray, rows: Sequence[int]
    ) -> LegAtPoints:
        """A leg of joints and springs in series.

        `leg`: on entries of the record of the points; `reference` (3,): reference point,
        entries or numbers; `rows`: which of six directions there are.
        """
        found = [_Flexibility.of(leg, points, i, reference, rows) for i in range(points.count)]
        lost = [own.redundant for own in found]
        redundant = tuple(all(joint) for joint in zip(*lost, strict=True))
        return cls(tuple(own.stiffness(redundant) for own in found), redundant)


def is_in_series(leg: PlacedLeg) -> bool:
    """Whether a leg has no parallel blocks, coupled joints or springs that leave motions free."""
    return not leg.blocks and not any(
        part.elasticity.freedoms.shape[1]
        if isinstance(part, PlacedSpring)
        else isinstance(part, CoupledFreedom)
        for part in leg.parts
    )


def total_stiffness(legs: Sequence[LegAtPoints]) -> tuple[Any, ...]:
    """Sum over the legs, eq. (12), one a point."""
    with flint.ctx.workprec(BITS):
        each = zip(*(leg.stiffness for leg in legs), strict=True)
        return tuple(sum(own[1:], own[0]) for own in each)


@dataclass(frozen=True)
class _Flexibility:
    """Twists J of the passive joints (p columns), and compliance C of the springs, at a point."""

    J: list[list[Any]]
    C: Any

    @classmethod
    def of(
        cls,
        leg: PlacedLeg,
        points: ExactPoints,
        point: int,
        reference: np.ndarray,
        rows: Sequence[int],
    ) -> _Flexibility:
        with flint.ctx.workprec(BITS):
            read = _Reader(points, point)
            at = read.array(reference)
            columns, C = [], flint.arb_mat(6, 6)
            for part in leg.elements:
                if isinstance(part, PlacedSpring):
                    R = read.array(part.rotation).T
                    lever = R @ skew(at - read.array(part.point))
                    felt = _matrix(
                        [[*a, 0, 0, 0] for a in R]
                        + [[*a, *b] for a, b in zip(lever, R, strict=True)]
                    )
                    own = _matrix(read.array(part.elasticity.compliance))
                    C += felt.transpose() * own * felt
                elif isinstance(part, PlacedFreedom):
                    twist = freedom_twist(read.freedom(part), at)
                    if part.is_passive:
                        columns.append([twist[i] for i in rows])
                    elif part.stiffness is not None:
                        column = _matrix([[x] for x in twist])
                        C += column * column.transpose() / read(part.stiffness)
            return cls(columns, _matrix([[C[i, j] for j in rows] for i in rows]))

    @property
    def redundant(self) -> list[bool]:
        """Which twists are combinations of those before."""
        found: list[bool] = []
        basis = np.zeros((0, self.C.nrows()))
        for twist in self.J:
            own = np.array([float(x) for x in twist])
            left = own / math.sqrt(own @ own)
            for _ in range(2):
                left = left - (basis @ left) @ basis
            size = math.sqrt(left @ left)
            found.append(size <= _REDUNDANT)
            if not found[-1]:
                basis = np.vstack([basis, left / size])
        return found

    def stiffness(self, redundant: Sequence[bool]) -> Any:
        """Eq. (7): a block of the inverse of [[C, J], [J^T, 0]]."""
        J = [twist for twist, is_lost in zip(self.J, redundant, strict=True) if not is_lost]
        n = self.C.nrows()
        with flint.ctx.workprec(BITS):
            whole = flint.arb_mat(n + len(J), n + len(J))
            for i in range(n):
                for j in range(n):
                    whole[i, j] = self.C[i, j]
                for j, twist in enumerate(J, start=n):
                    whole[i, j] = whole[j, i] = twist[i]
            inverse = whole.inv()
            return _matrix([[inverse[i, j] for j in range(n)] for i in range(n)])


@dataclass(frozen=True)
class _Reader:
    """Reads entries and numbers as balls at one of the points."""

    points: ExactPoints
    point: int

    def __call__(self, value: Any) -> Any:
        if isinstance(value, Entry):
            return self.points.values(value.step)[self.point]
        return self.points.number(value)

    def array(self, values: Any) -> np.ndarray:
        """An array of them."""
        given = np.asarray(values, dtype=object)
        return np.array([self(x) for x in given.flat], dtype=object).reshape(given.shape)

    def freedom(self, part: PlacedFreedom) -> PlacedFreedom:
        """A joint in balls."""
        own = {"axis": self.array(part.axis), "point": self.array(part.point)}
        if part.slides and part.turns:
            own["pitch"] = self(part.pitch)
        return replace(part, **own)


def turned_legs(
    legs: Sequence[LegAtPoints], rows: Sequence[int], length: float
) -> dict[int, tuple[int, Image]]:
    """Legs that are images of an earlier one by a turn about the vertical, perhaps with a mirror.

    Only images by all equal parts of a turn, of three or more: their average is a short formula.

    `rows`: which of six directions there are; `length`: characteristic length [m].

    Returns
    -------
    dict of leg numbers to the number of the earlier leg, and how the leg is made from it
    """
    scale = np.array([1.0 if row < 3 else 1 / length for row in rows])
    K = np.zeros((len(legs), 6, 6))
    for i, leg in enumerate(legs):
        own = np.array([[float(x) for x in row] for row in leg.stiffness[0].table()])
        K[np.ix_([i], rows, rows)] = own * np.outer(scale, scale)
    found: dict[int, tuple[int, Image]] = {}
    left = list(range(len(legs)))
    for N in range(len(legs), 2, -1):
        for first in tuple(left):
            if first not in left:
                continue
            for mirror in (None, *MIRRORS):
                images = {first: Image(Fraction(0))} if mirror is None else {}
                for way in (Image(Fraction(k, N), mirror) for k in range(len(images), N)):
                    wanted = way.of(way.of(K[first]).T)
                    near = _SAME * np.max(np.abs(wanted))
                    for i in left:
                        if i in images or np.max(np.abs(K[i] - wanted)) > near:
                            continue
                        if _is_image(legs[i], legs[first], way, rows):
                            images[i] = way
                            break
                    else:
                        break  # not all
                if len(images) == N:
                    left = [i for i in left if i not in images]
                    found |= {i: (first, way) for i, way in images.items() if i != first}
                if (len(images) == N) != (mirror is None):
                    break  # no turns, or both
    return found


def _is_image(leg: LegAtPoints, first: LegAtPoints, way: Image, rows: Sequence[int]) -> bool:
    """Whether a stiffness is the image of another, by enclosures at all points."""
    with flint.ctx.workprec(BITS):
        T = way.exact(rows)
        for K, known in zip(leg.stiffness, first.stiffness, strict=True):
            image = T * known * T.transpose()
            pairs = list(zip(K.entries(), image.entries(), strict=True))
            size = max((abs(x) for x, _ in pairs), key=float)
            if any(not bool(abs(x - y) < _NOTHING * size) for x, y in pairs):
                return False
    return True


def _matrix(entries: Any) -> Any:
    return flint.arb_mat([[flint.arb(x) for x in row] for row in entries])
