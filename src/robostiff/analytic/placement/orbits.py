"""Wrenches that are turns or mirror images of one another about the vertical."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import flint
import numpy as np
import sympy as sp

_SAME = 1e-10

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
        f1, f2, f3, m1, m2, m3 = wrenches[orbit.first]
        count = sp.Integer(len(orbit.images))
        half = count / 2
        averages = {
            (0, 0): [(half, f1, f1), (half, f2, f2)],
            (1, 1): [(half, f1, f1), (half, f2, f2)],
            (2, 2): [(count, f3, f3)],
            (3, 3): [(half, m1, m1), (half, m2, m2)],
            (4, 4): [(half, m1, m1), (half, m2, m2)],
            (5, 5): [(count, m3, m3)],
            (0, 4): [(half, f1, m2), (-half, f2, m1)],
            (1, 3): [(-half, f1, m2), (half, f2, m1)],
        }
        if not orbit.is_mirrored:
            averages |= {
                (0, 3): [(half, f1, m1), (half, f2, m2)],
                (1, 4): [(half, f1, m1), (half, f2, m2)],
                (2, 5): [(count, f3, m3)],
            }
        for place, products in averages.items():
            M[place] += products
    return M
