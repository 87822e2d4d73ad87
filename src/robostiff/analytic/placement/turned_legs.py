"""Legs and wrenches that are turns or mirror images of others, seen at the samples."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations, product
from typing import Any

import numpy as np
import sympy as sp
from scipy.spatial.transform import Rotation

from robostiff.kinematics.closure import LegSolver, legs_alike
from robostiff.kinematics.formula import FormulaPose
from robostiff.model import Chain, Joint, JointKind, Link, Passive, Robot
from robostiff.model.entries import are_equal
from robostiff.recorded.leg import at_samples
from robostiff.spatial import Space

_SAME = 1e-10  # of the largest entry
_PLACE = 1e-12  # of the largest coordinate [m]
_PARTS = 60  # most parts of a turn


def turned_legs(
    robot: Robot, entries: Robot, solvers: Sequence[LegSolver], pose: FormulaPose, count: int
) -> dict[int, tuple[int, Image]]:
    """Legs that are an earlier one turned about the vertical through the reference point.

    Only turns by all equal parts, of three or more: their average is a short formula. Chains and
    assembly modes are equal, and so are, at all samples, where the legs begin and end: a turned leg
    closes as the first one does.

    `robot`, `entries`: as it was given, and on entries of a record of `count` samples; `solvers`:
    of its legs in floats; `pose`: of the platform.

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
        ends = {i: _ends(entries, i, pose, count) for i in left}
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


def _ends(robot: Robot, number: int, pose: FormulaPose, count: int) -> np.ndarray:
    """Where a leg begins and ends, and its axes there, at the samples (count, vectors, 3)."""
    leg = robot.legs[number]
    R, p = at_samples(pose.R, count), at_samples(pose.p, count)
    away = np.asarray(leg.attachment.p, dtype=object) - robot.reference_point
    end = np.einsum("nij,nj->ni", R, at_samples(away, count))
    reference = p + np.einsum("nij,nj->ni", R, at_samples(robot.reference_point, count))
    points = np.stack([at_samples(leg.base.p, count) - reference, end], axis=1)
    axes = [at_samples(leg.base.R, count).mT]
    if not _turns_freely(leg.chain, robot.space):
        axes.append((R @ at_samples(leg.attachment.R, count)).mT)
    return np.concatenate([points, *axes], axis=1)


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


def _turn(vectors: np.ndarray, others: np.ndarray) -> Fraction | None:
    """The part of a full turn about z by which some vectors are others, turned."""
    x, y = vectors[0, 0], others[0, 0]
    angle = math.atan2(y[1], y[0]) - math.atan2(x[1], x[0])
    part = Fraction(angle / (2 * math.pi) % 1).limit_denominator(_PARTS) % 1
    image = Image(part).of(np.concatenate([vectors, np.zeros_like(vectors)], axis=-1))[..., :3]
    return part if np.max(np.abs(image - others)) < _PLACE * np.max(np.abs(vectors)) else None


def with_mirrored(
    turned: Mapping[int, tuple[int, Image]],
    stiffness: Callable[[int], np.ndarray],
    rows: Sequence[int],
) -> dict[int, tuple[int, Image]]:
    """Turned legs, and those that are mirror images of turned ones, all of them.

    `stiffness`: of a leg, at the samples (count, n, n), moments and turns by a length; `rows`:
    which of six directions there are.
    """
    orbits: dict[int, dict[int, Fraction]] = {}
    for i, (first, way) in turned.items():
        orbits.setdefault(first, {first: Fraction(0)})[i] = way.part
    K: dict[int, np.ndarray] = {}
    for first in orbits if len(orbits) > 1 else ():
        own = stiffness(first)
        K[first] = np.zeros((len(own), 6, 6))
        K[first][np.ix_(range(len(own)), rows, rows)] = own
    found = dict(turned)
    for first, other in combinations(orbits, 2):
        N = len(orbits[first])
        if first in found or other in found or len(orbits[other]) != N:
            continue
        for way in (Image(Fraction(k, N), mirror) for mirror in MIRRORS for k in range(N)):
            wanted = way.of(way.of(K[first]).mT)
            if np.max(np.abs(K[other] - wanted)) <= _SAME * np.max(np.abs(wanted)):
                for i, part in orbits[other].items():
                    found[i] = first, replace(way, part=(way.part + part) % 1)
                break
    return found


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
    """All images of a wrench under turns by equal parts, half of them perhaps in a mirror."""

    first: int  # of the wrenches
    images: dict[int, Image]  # for each wrench of the orbit how it is made from the first


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
                    found.append(Orbit(first, orbit | mirrored))
                    break
            else:
                found.append(Orbit(first, orbit))
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
