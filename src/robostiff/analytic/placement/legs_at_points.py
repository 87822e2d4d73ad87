"""Legs at exact points: their stiffness in ball arithmetic, and which of them are turns of others.

The equilibrium of springs and joints is inverted as a whole, eq. (7), in numbers that enclose the
exact ones: no formula is written, and a wrong derivation by elimination differs from them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations, pairwise, product
from typing import Any

import flint
import numpy as np
import sympy as sp
from scipy.spatial.transform import Rotation

from robostiff.analytic.exact.exact_points import BITS, ExactPoints
from robostiff.kinematics.closure import LegSolver, legs_alike
from robostiff.kinematics.formula import FormulaPose
from robostiff.kinematics.jacobians import freedom_twist
from robostiff.model import (
    Chain,
    CoupledFreedom,
    Joint,
    JointKind,
    Link,
    Passive,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Robot,
)
from robostiff.model.entries import are_equal
from robostiff.record import Entry
from robostiff.spatial import Space, skew

_REDUNDANT = 1e-9  # of a unit twist, as in the elimination of joints
_SAME = 1e-10  # of the largest entry, in floats
_NOTHING = 1e-40  # of the largest entry, in balls; [m]
_PARTS = 60  # most parts of a turn


@dataclass(frozen=True)
class LegAtPoints:
    """A leg in numbers that enclose the exact ones."""

    stiffness: tuple[Any, ...]  # (n, n): about the reference point, world axes; one a point
    redundant: tuple[bool, ...]  # which passive joints add no freedom to those before

    def turned(self, way: Image, rows: Sequence[int]) -> LegAtPoints:
        """Its image."""
        with flint.ctx.workprec(BITS):
            T = way.exact(rows)
            return replace(self, stiffness=tuple(T * K * T.transpose() for K in self.stiffness))

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
            read = _BallReader(points, point)
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
        J = np.array([[float(x) for x in twist] for twist in self.J]).reshape(-1, self.C.nrows())
        J = J / np.linalg.norm(J, axis=1, keepdims=True)
        count = len(J)
        ranks = [0, *(np.linalg.matrix_rank(J[: k + 1], tol=_REDUNDANT) for k in range(count))]
        return [bool(after == before) for before, after in pairwise(ranks)]

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
class _BallReader:
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
    robot: Robot,
    entries: Robot,
    solvers: Sequence[LegSolver],
    pose: FormulaPose,
    points: ExactPoints,
) -> dict[int, tuple[int, Image]]:
    """Legs that are an earlier one turned about the vertical through the reference point.

    Only turns by all equal parts, of three or more: their average is a short formula. Chains and
    assembly modes are equal, and so are, in enclosures of exact numbers, where the legs begin and
    end: a turned leg closes as the first one does.

    `robot`, `entries`: as it was given, and on entries of the record of the points; `solvers`: of
    its legs in floats; `pose`: of the platform.

    Returns
    -------
    dict of leg numbers to the number of the earlier leg, and how the leg is made from it
    """
    found: dict[int, tuple[int, Image]] = {}
    alike = [own for own, one in legs_alike(solvers) if one.recorded_form is not None]
    for places in alike:
        chain, left = robot.legs[places[0]].chain, list(places)
        if len(left) < 3 or chain.is_coupled:
            continue
        ends = _ends(entries, left, pose, points)
        while len(left) > 2:
            first, *left = left
            # Solvers have numbers, which may be equal where formulas are not.
            same = [i for i in left if are_equal(robot.legs[i].chain, robot.legs[first].chain)]
            turns = {_turn(ends[first], ends[i]): i for i in same}
            for N in range(len(same) + 1, 2, -1):
                parts = [Fraction(k, N) for k in range(1, N)]
                if all(part in turns for part in parts):
                    found |= {turns[part]: (first, Image(part)) for part in parts}
                    break
            left = [i for i in left if i not in found]
    return found


def _ends(
    robot: Robot, legs: Sequence[int], pose: FormulaPose, points: ExactPoints
) -> dict[int, list[Any]]:
    """Columns in balls, one matrix a point: where legs begin and end, and their axes there."""
    found: dict[int, list[Any]] = {i: [] for i in legs}
    for point in range(points.count):
        read = _BallReader(points, point)
        with flint.ctx.workprec(BITS):
            R, p = read.array(pose.R), read.array(pose.p)
            reference = p + R @ read.array(robot.reference_point)
            for i, own in found.items():
                leg = robot.legs[i]
                end = p + R @ read.array(leg.attachment.p)
                begin = read.array(leg.base.p)
                columns = [begin - reference, end - reference, *read.array(leg.base.R).T]
                if not _turns_freely(leg.chain, robot.space):
                    columns += [*(R @ read.array(leg.attachment.R)).T]
                own.append(_matrix(columns).transpose())
    return found


def _turns_freely(chain: Chain, space: Space) -> bool:
    """Whether the turn of a chain's end matters to nothing but its last joints."""
    for element in reversed(chain.elements):
        if isinstance(element, Joint):
            kind = JointKind.REVOLUTE if space is Space.PLANAR else JointKind.SPHERICAL
            return element.kind is kind and isinstance(element.role, Passive)
        if not isinstance(element, Link) or np.any(element.to != 0):
            return False
        C: Any = element.elasticity.compliance[:3, :3]
        if np.any(C[0, 0] * np.eye(3, dtype=int) != C):
            return False
    return False


def _turn(ends: Sequence[Any], others: Sequence[Any]) -> Fraction | None:
    """The part of a full turn by which some columns are others, turned."""
    x, y = (
        [float(ends[0][row, 0]) for row in (0, 1)],
        [float(others[0][row, 0]) for row in (0, 1)],
    )
    angle = math.atan2(y[1], y[0]) - math.atan2(x[1], x[0])
    part = Fraction(angle / (2 * math.pi) % 1).limit_denominator(_PARTS) % 1
    with flint.ctx.workprec(BITS):
        T = Image(part).exact((0, 1, 2))
        pairs = zip(ends, others, strict=True)
        apart = [x for A, B in pairs for x in (T * A - B).entries()]
        return part if all(bool(abs(x) < _NOTHING) for x in apart) else None


def with_mirrored(
    turned: Mapping[int, tuple[int, Image]],
    legs: Sequence[LegAtPoints],
    rows: Sequence[int],
    length: float,
) -> dict[int, tuple[int, Image]]:
    """Turned legs, and those that are mirror images of turned ones, all of them.

    `rows`: which of six directions there are; `length`: characteristic length [m].
    """
    orbits: dict[int, dict[int, Fraction]] = {}
    for i, (first, way) in turned.items():
        orbits.setdefault(first, {first: Fraction(0)})[i] = way.part
    scale = np.array([1.0 if row < 3 else 1 / length for row in rows])
    K = {}
    for first in orbits:
        own = np.array([[float(x) for x in row] for row in legs[first].stiffness[0].table()])
        K[first] = np.zeros((6, 6))
        K[first][np.ix_(rows, rows)] = own * np.outer(scale, scale)
    found = dict(turned)
    for first, other in combinations(orbits, 2):
        N = len(orbits[first])
        if first in found or other in found or len(orbits[other]) != N:
            continue
        for way in (Image(Fraction(k, N), mirror) for mirror in MIRRORS for k in range(N)):
            wanted = way.of(way.of(K[first]).T)
            near = np.max(np.abs(K[other] - wanted)) <= _SAME * np.max(np.abs(wanted))
            if near and _is_image(legs[other], legs[first], way, rows):
                for i, part in orbits[other].items():
                    found[i] = first, replace(way, part=(way.part + part) % 1)
                break
    return found


def _is_image(leg: LegAtPoints, first: LegAtPoints, way: Image, rows: Sequence[int]) -> bool:
    """Whether a stiffness is the image of another, by enclosures at all points."""
    with flint.ctx.workprec(BITS):
        for K, image in zip(leg.stiffness, first.turned(way, rows).stiffness, strict=True):
            size = max(map(abs, K.entries()), key=float)
            if any(not bool(abs(x) < _NOTHING * size) for x in (K - image).entries()):
                return False
    return True


def _matrix(entries: Any) -> Any:
    return flint.arb_mat([[flint.arb(x) for x in row] for row in entries])


#: Of a wrench in space and in the plane.
ROWS: dict[int, Sequence[int]] = {6: range(6), 3: (0, 1, 5)}
#: Names of the entries of a wrench: force, moment.
COMPONENTS = ("u_x", "u_y", "u_z", "m_x", "m_y", "m_z")

Products = list[tuple[Any, Any, Any]]  # number, and two entries


@dataclass(frozen=True)
class Image:
    """How a wrench is made from another: by a mirror, a turn about the vertical, and a sign."""

    part: Fraction  # of a full turn
    mirror: tuple[int, ...] | None = None  # signs of its six entries; None without a mirror
    sign: int = 1

    def made_from(self, wrench: Sequence[Any]) -> list[Any]:
        """The image of a wrench of six formulas or entries."""
        angle = 2 * sp.pi * sp.Rational(self.part.numerator, self.part.denominator)
        return self._image(wrench, sp.cos(angle), sp.sin(angle))

    def exact(self, rows: Sequence[int]) -> Any:
        """Some rows and columns of the matrix that makes an image, in balls."""
        part = 2 * flint.fmpq(self.part.numerator, self.part.denominator)
        c, s = flint.arb.cos_pi_fmpq(part), flint.arb.sin_pi_fmpq(part)
        columns = [self._image([int(i == j) for i in range(6)], c, s) for j in rows]
        return flint.arb_mat([[column[i] for column in columns] for i in rows])

    def of(self, wrenches: np.ndarray) -> np.ndarray:
        """The images of wrenches in numbers (..., 6)."""
        c, s = np.cos(2 * np.pi * self.part), np.sin(2 * np.pi * self.part)
        return np.stack(self._image([wrenches[..., i] for i in range(6)], c, s), axis=-1)

    def _image(self, wrench: Sequence[Any], c: Any, s: Any) -> list[Any]:
        """By cosine and sine of the turn."""
        signs = [self.sign * x for x in self.mirror or 6 * (1,)]
        image: list[Any] = []
        for (x, y, z), (i, j, k) in ((wrench[:3], signs[:3]), (wrench[3:], signs[3:])):
            image += [(i * c) * x + (-j * s) * y, (i * s) * x + (j * c) * y, k * z]
        return image


@dataclass(frozen=True)
class Orbit:
    """All images of a wrench under turns by equal parts, and perhaps under a mirror."""

    first: int  # of the wrenches
    images: dict[int, Image]  # for each wrench of the orbit how it is made from the first
    is_mirrored: bool  # whether half of them are mirror images


def orbits_of(wrenches: np.ndarray) -> list[Orbit] | None:
    """Orbits that wrenches form together, of three turns or more; None where they do not.

    `wrenches` (count, m, 6): at several samples, moments over a length.

    Examples
    --------
    >>> turns = [sp.Matrix([sp.cos(a), sp.sin(a)]) for a in (0, 2 * sp.pi / 3, 4 * sp.pi / 3)]
    >>> W = np.array([[[float(d[0]), float(d[1]), 1, 0, 0, 2] for d in turns]])
    >>> [(orbit.first, sorted(orbit.images)) for orbit in orbits_of(W)]
    [(0, [0, 1, 2])]
    """
    count = wrenches.shape[1]
    for N in (n for n in range(count, 2, -1) if count % n == 0):
        turns = [Image(Fraction(k, N)) for k in range(N)]
        found: list[Orbit] = []
        left = set(range(count))
        while left:
            first = min(left)
            orbit = _orbit(wrenches, first, turns, left)
            if len(orbit) < N:
                break
            left -= orbit.keys()
            for mirror in MIRRORS:
                ways = [replace(turn, mirror=mirror) for turn in turns]
                mirrored = _orbit(wrenches, first, ways, left)
                if len(mirrored) == N:
                    left -= mirrored.keys()
                    found.append(Orbit(first, orbit | mirrored, is_mirrored=True))
                    break
            else:
                found.append(Orbit(first, orbit, is_mirrored=False))
        if not left:
            return found
    return None


def _orbit(wrenches: np.ndarray, first: int, ways: list[Image], left: set[int]) -> dict[int, Image]:
    """The wrenches that are images of the first in some ways, or opposite to them."""
    found: dict[int, Image] = {}
    for way in ways:
        image = way.of(wrenches[:, first])
        for i in sorted(left - found.keys()):
            apart = {s: np.max(np.abs(wrenches[:, i] - s * image)) for s in (1, -1)}
            if min(apart.values()) < _SAME:
                found[i] = replace(way, sign=min(apart, key=lambda s: apart[s]))
                break
    return found


#: Signs of the entries of a wrench: moments are turned the other way about by a mirror.
MIRRORS = ((1, -1, 1, -1, 1, -1), (-1, 1, 1, 1, -1, -1))


def averages(
    wrenches: Mapping[int, Sequence[Any]], orbits: list[Orbit] | None
) -> dict[tuple[int, int], Products]:
    """Products whose sum is that of w w^T, by averages where the wrenches are turns of one.

    Of orbits, only the first wrenches are needed.
    """
    M: dict[tuple[int, int], Products] = {(i, j): [] for i in range(6) for j in range(i, 6)}
    if orbits is None:
        for w in wrenches.values():
            for (i, j), products in M.items():
                products.append((1, w[i], w[j]))
        return M
    for orbit in orbits:
        w = wrenches[orbit.first]
        T = np.stack([way.of(np.eye(6)) for way in orbit.images.values()])
        shares = np.einsum("nai,nbj->ijab", T, T)
        for (i, j), products in M.items():
            both = shares[i, j] + shares[i, j].T - np.diag(np.diag(shares[i, j]))
            # Of turns by equal parts they are whole numbers and halves.
            for a, b in np.argwhere(np.triu(np.rint(2 * both))):
                products.append((sp.Rational(round(2 * both[a, b]), 2), w[a], w[b]))
    return M


_TURNS = tuple(Fraction(k, n) for n in range(2, 7) for k in range(1, n) if math.gcd(k, n) == 1)


def _turns_of_a_cube() -> Iterator[tuple[str, np.ndarray]]:
    """Its turns in words and as matrices (3, 3), those about its diagonals first."""
    axes = [x for x in product((1, 0, -1), repeat=3) if x > (0, 0, 0)]
    for axis in sorted(axes, key=lambda x: (-abs(np.array(x)).sum(), -sum(x))):
        size = sum(map(abs, axis))
        about = str(axis) if size > 1 else "xyz"[axis.index(1)]
        for degrees in {3: (120, 240), 2: (180,), 1: (90, 180, 270)}[size]:
            turn = Rotation.from_rotvec(np.array(axis) * degrees / math.sqrt(size), degrees=True)
            yield f"about {about} by {degrees} degrees", np.rint(turn.as_matrix()).astype(int)


def turn_in_words(wrenches: Sequence[Any], others: Sequence[Any]) -> str | None:
    """The turn that makes wrenches of formulas from others, one by one, up to signs; None of none.

    About z, or, where coordinates change places or signs, one of those of a cube.

    Examples
    --------
    >>> a, b = sp.symbols("a b")
    >>> turn_in_words([(0, a, 0, 0, 0, b)], [(a, 0, 0, 0, b, 0)])
    'about (1, 1, 1) by 120 degrees'
    >>> turn_in_words([(0, a, 0, b, 0, 0)], [(a, 0, 0, 0, b, 0)])
    'about (1, 1, 0) by 180 degrees'
    """
    if len(wrenches) != len(others) or not wrenches:
        return None
    rows = ROWS[len(wrenches[0])]

    def is_made_by(turned: Callable[[list[Any]], Sequence[Any]]) -> bool:
        for w, other in zip(wrenches, others, strict=True):
            known = dict(zip(rows, other, strict=True))
            image = turned([known.get(i, sp.Integer(0)) for i in range(6)])
            pairs = [(sp.sympify(image[i]), x) for i, x in zip(rows, w, strict=True)]
            if all(any(sp.expand(a - sign * b) != 0 for a, b in pairs) for sign in (1, -1)):
                return False
        return True

    for part in _TURNS:
        if is_made_by(Image(part).made_from):
            return f"about z by {360 * part} degrees"
    for words, R in _turns_of_a_cube() if len(rows) == 6 else ():
        if is_made_by(lambda w, R=R: [*(R @ np.array(w[:3])), *(R @ np.array(w[3:]))]):
            return words
    return None
