"""Legs and wrenches that are turns or mirror images of others, seen at the samples."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import sympy as sp
from scipy.spatial.transform import Rotation

from robostiff.frozen import are_equal, frozen, replace
from robostiff.kinematics.jacobians import in_groups
from robostiff.model import Robot
from robostiff.spatial import Space

_SAME = 1e-10  # of the largest entry
_ALIKE = 1e-11  # of the stiffness of legs
_FEWER = 1e-4  # digits that count of its small entries, as part of those of the largest
_LEAST = 1e-6  # root of an entry that may be rounding, as part of the largest


def images_of_legs(
    robot: Robot, stiffness: Sequence[np.ndarray], length: float
) -> dict[int, tuple[int, Image]]:
    """Legs of one chain that hold as an earlier one, turned about the vertical or mirrored.

    Only turns by all equal parts, of three or more, and mirror images of all of them: their average
    is a short formula.

    `stiffness`: (n, n) of each leg about the reference point, at values of the symbols at which
    nothing is equal by chance; `length`: of the robot [m].

    Returns
    -------
    dict of leg numbers to the number of the earlier leg, and how the leg is made from it
    """
    rows = np.array(robot.space.rows)
    K = np.zeros((len(stiffness), 6, 6))
    K[:, rows[:, None], rows] = stiffness
    K /= np.outer(scale := np.array([1.0] * 3 + [length] * 3), scale)
    found: dict[int, tuple[int, Image]] = {}
    for alike in map(list, in_groups([leg.chain for leg in robot.legs], are_equal)):
        x, y, z, a, b, c = np.abs(np.diag(K[alike[0]]))
        sizes = np.sqrt([x + y, x + y, z, a + b, a + b, c])
        sizes = np.maximum(sizes, _LEAST * np.max(sizes)) if np.any(sizes) else np.ones(6)
        # Of a small entry its own digits count as well, though fewer of them.
        whole, parts = K[alike] / np.max(sizes) ** 2, _FEWER * K[alike] / np.outer(sizes, sizes)
        each = np.stack([whole, parts], axis=1)
        for orbit in _orbits(each, lambda way, x: way.of(way.of(x).mT), _ALIKE)[0]:
            first = next(iter(orbit))
            found |= {alike[i]: (alike[first], way) for i, way in orbit.items() if i != first}
    return found


#: Names of the entries of a wrench: force, moment.
COMPONENTS = ("u_x", "u_y", "u_z", "m_x", "m_y", "m_z")

Products = list[tuple[Any, Any, Any]]  # number, and two entries


@frozen
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


#: All images of a wrench under turns by equal parts, half of them perhaps in a mirror, by their
#: numbers, and how each is made from the first.
Orbit = dict[int, Image]


def orbits_of(wrenches: np.ndarray) -> list[Orbit] | None:
    """Orbits that wrenches form together, of three turns or more; None where they do not.

    `wrenches` (count, m, 6): at several samples, moments over a length.

    Examples
    --------
    >>> turns = [sp.Matrix([sp.cos(a), sp.sin(a)]) for a in (0, 2 * sp.pi / 3, 4 * sp.pi / 3)]
    >>> W = np.array([[[float(d[0]), float(d[1]), 1, 0, 0, 2] for d in turns]])
    >>> [sorted(orbit) for orbit in orbits_of(W)]
    [[0, 1, 2]]
    """
    found, rest = _orbits(wrenches.swapaxes(0, 1), lambda way, w: way.of(w), _SAME, whole=True)
    return None if rest else found


def _orbits(
    items: np.ndarray,
    image: Callable[[Image, np.ndarray], np.ndarray],
    close: float,
    *,
    whole: bool = False,
) -> tuple[list[Orbit], set[int]]:
    """The orbits of the most turns, half of each perhaps in a mirror, and what is in none of them.

    `image`: of one of the items (m, ...); `whole`: whether orbits count only where all are in one.
    """

    def images(first: int, ways: list[Image], remaining: set[int]) -> dict[int, Image]:
        found: dict[int, Image] = {}
        for way in ways:
            moved, rest = image(way, items[first]), sorted(remaining - found.keys())
            both = np.stack([items[rest] - moved, items[rest] + moved])
            apart = np.abs(both).max(axis=tuple(range(2, both.ndim)))
            near = np.flatnonzero(apart.min(axis=0) < close)
            if not near.size:
                return {}
            k = near[0]
            found[rest[k]] = replace(way, sign=1 if apart[0, k] <= apart[1, k] else -1)
        return found

    every = set(range(len(items)))
    for N in range(len(items), 2, -1):
        turns = [Image(Fraction(k, N)) for k in range(N)]
        found, remaining, alone = list[Orbit](), set(every), set[int]()
        while remaining and not (whole and alone):
            first = min(remaining)
            turned = images(first, turns, remaining)
            alone |= set() if turned else {first}
            remaining -= turned.keys() or {first}
            if turned:
                ways = ([replace(turn, mirror=mirror) for turn in turns] for mirror in MIRRORS)
                mirrored = next(filter(None, (images(first, x, remaining) for x in ways)), {})
                remaining -= mirrored.keys()
                found.append(turned | mirrored)
        if found and not (whole and alone):
            return found, alone
    return [], every


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
        w = wrenches[next(iter(orbit))]
        T = np.stack([way.of(np.eye(6)) for way in orbit.values()])
        shares = np.einsum("nai,nbj->ijab", T, T)
        for (i, j), products in M.items():
            both = shares[i, j] + shares[i, j].T - np.diag(np.diag(shares[i, j]))
            # Of turns by equal parts they are whole numbers and halves.
            for a, b in np.argwhere(np.triu(np.rint(2 * both))):
                products.append((sp.Rational(round(2 * both[a, b]), 2), w[a], w[b]))
    return M


_TURNS = tuple(Fraction(k, n) for n in range(2, 7) for k in range(1, n) if math.gcd(k, n) == 1)


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
    rows = Space.of_size(len(wrenches[0])).rows

    def is_made_by(turned: Callable[[list[Any]], Sequence[Any]]) -> bool:
        for w, other in zip(wrenches, others, strict=True):
            known = dict(zip(rows, other, strict=True))
            image = turned([known.get(i, sp.Integer(0)) for i in range(6)])
            pairs = [(sp.sympify(image[i]), x) for i, x in zip(rows, w, strict=True)]
            if all(any(sp.expand(a - sign * b, trig=True) for a, b in pairs) for sign in (1, -1)):
                return False
        return True

    for part in _TURNS:
        if is_made_by(Image(part).made_from):
            return f"about z by {360 * part} degrees"
    # Turns of a cube, those about its diagonals first.
    axes = [x for x in product((1, 0, -1), repeat=3) if x > (0, 0, 0) and len(rows) == 6]
    for axis in sorted(axes, key=lambda x: (-abs(np.array(x)).sum(), -sum(x))):
        size = sum(map(abs, axis))
        about = str(axis) if size > 1 else "xyz"[axis.index(1)]
        for degrees in {3: (120, 240), 2: (180,), 1: (90, 180, 270)}[size]:
            turn = Rotation.from_rotvec(np.array(axis) * degrees / math.sqrt(size), degrees=True)
            R = np.rint(turn.as_matrix()).astype(int)
            if is_made_by(lambda w, R=R: [*(R @ np.array(w[:3])), *(R @ np.array(w[3:]))]):
                return f"about {about} by {degrees} degrees"
    return None
