"""Wrenches that are turns or mirror images of one another about the vertical."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

_SAME = 1e-10

#: Names of the entries of a wrench: force, moment.
COMPONENTS = ("u_x", "u_y", "u_z", "m_x", "m_y", "m_z")

Products = list[tuple[Any, Any, Any]]  # number, and two entries


@dataclass(frozen=True)
class Orbit:
    """All images of a wrench under turns by equal parts, and perhaps under a mirror.

    Attributes
    ----------
    first : int
        Of the wrenches.
    images : dict of int to sympy.Matrix
        For each wrench of the orbit the matrix (6, 6) that makes it from the first.
    is_mirrored : bool
        Whether half of them are mirror images.
    """

    first: int
    images: dict[int, Any]
    is_mirrored: bool


def orbits_of(wrenches: np.ndarray) -> list[Orbit] | None:
    """Orbits that wrenches form together, of three turns or more; None where they do not.

    Parameters
    ----------
    wrenches : (count, m, 6) array
        At several samples, moments over a length.

    Examples
    --------
    >>> turns = [sp.Matrix([sp.cos(a), sp.sin(a)]) for a in (0, 2 * sp.pi / 3, 4 * sp.pi / 3)]
    >>> W = np.array([[[float(d[0]), float(d[1]), 1, 0, 0, 2] for d in turns]])
    >>> [(orbit.first, sorted(orbit.images)) for orbit in orbits_of(W)]
    [(0, [0, 1, 2])]
    """
    count = wrenches.shape[1]
    for N in (n for n in range(count, 2, -1) if count % n == 0):
        turns = [_turn(2 * sp.pi * k / N) for k in range(N)]
        found: list[Orbit] = []
        left = set(range(count))
        while left:
            first = min(left)
            orbit = _orbit(wrenches, first, turns, left)
            if len(orbit) < N:
                break
            left -= orbit.keys()
            for mirror in _MIRRORS:
                mirrored = _orbit(wrenches, first, [turn * mirror for turn in turns], left)
                if len(mirrored) == N:
                    left -= mirrored.keys()
                    found.append(Orbit(first, orbit | mirrored, is_mirrored=True))
                    break
            else:
                found.append(Orbit(first, orbit, is_mirrored=False))
        if not left:
            return found
    return None


def _orbit(wrenches: np.ndarray, first: int, ways: list[Any], left: set[int]) -> dict[int, Any]:
    """The wrenches that are images of the first in some ways, or opposite to them."""
    found: dict[int, Any] = {}
    for way in ways:
        image = wrenches[:, first] @ np.array(way, dtype=float).T
        for i in sorted(left - found.keys()):
            sign = next((s for s in (1, -1) if _alike(wrenches[:, i], s * image)), None)
            if sign is not None:
                found[i] = sign * way
                break
    return found


def _turn(angle: Any) -> Any:
    c, s = sp.cos(angle), sp.sin(angle)
    return sp.diag(*2 * [sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])])


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.max(np.abs(a - b)) < _SAME)


# Moments are turned the other way about by a mirror.
_MIRRORS = (sp.diag(1, -1, 1, -1, 1, -1), sp.diag(-1, 1, 1, 1, -1, -1))


def averages(
    wrenches: list[list[Any]], orbits: list[Orbit] | None
) -> dict[tuple[int, int], Products]:
    """Products whose sum is that of w w^T, by averages where the wrenches are turns of one."""
    M: dict[tuple[int, int], Products] = {(i, j): [] for i in range(6) for j in range(i, 6)}
    if orbits is None:
        for w in wrenches:
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
