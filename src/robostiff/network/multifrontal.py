"""Cholesky factors of the stiffness of bodies, in dense fronts by nested dissection.

Bodies whose removal cuts a network in two come last, and so on in both halves (A. George, Nested
dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10, 1973). Those that are
eliminated together make a dense front with those that feel it; what is left of the latter is added
to the front of the first of them (I. Duff and J. Reid, ACM Trans. Math. Softw. 9, 1983). NumPy
alone: at ten thousand beams SciPy takes a sixth of the time to be imported.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

# Bodies that are no longer divided.
_LEAF = 12
# Columns of a front that are eliminated together, and stored.
_PANEL = 96
# Stretches of bodies side by side up to which a remainder is added stretch by stretch.
_STRETCHES = 16


def dissected(bodies: np.ndarray, pairs: np.ndarray, places: np.ndarray) -> Iterator[np.ndarray]:
    """Bodies in an order of elimination that fills in little, in pieces.

    Parameters
    ----------
    bodies : (m,) array of int
    pairs : (p, 2) array of int
        Connected ones.
    places : (M, c) array of int
        Coordinates of all bodies, along one of which they are cut: where it cuts the fewest pairs.

    Yields
    ------
    (k,) array of int
        Those that are eliminated together.

    Examples
    --------
    >>> chain = np.arange(31)
    >>> pairs = np.stack([chain[1:], chain[:-1]], axis=1)
    >>> [piece.tolist() for piece in dissected(chain, pairs, chain[:, None])][-1]
    [15]
    """
    least, cut = len(pairs) + 1, None
    side = np.zeros(len(places), dtype=np.int8)
    for place in places[bodies].T if len(bodies) > _LEAF else ():
        middle = np.partition(place, len(place) // 2)[len(place) // 2]
        before = place < middle
        if 4 * np.count_nonzero(before) < len(place):
            before = place <= middle
        if not len(place) <= 4 * np.count_nonzero(before) <= 3 * len(place):
            continue
        side[bodies] = before
        crossing = side[pairs[:, 0]] != side[pairs[:, 1]]
        if (count := np.count_nonzero(crossing)) < least:
            least, cut = count, (before, crossing)
    if cut is None:
        yield bodies
        return
    before, crossing = cut
    side[bodies] = before
    ends = pairs[crossing].ravel()
    borders = [np.unique(ends[side[ends] == own]) for own in (0, 1)]
    if 2 * np.count_nonzero(before) > len(bodies):  # of borders of one size that of the larger half
        borders.reverse()
    border = min(borders, key=len)
    side[border] = 2
    of_pairs = side[pairs]
    for own in (1, 0):
        inside = np.all(of_pairs == own, axis=1)
        yield from dissected(bodies[side[bodies] == own], pairs[inside], places)
    if len(border):
        yield np.concatenate([*_halved(border, places)])


def _halved(bodies: np.ndarray, places: np.ndarray) -> Iterator[np.ndarray]:
    """Bodies of a border halved again and again: those of each part of it lie side by side."""
    own = places[bodies]
    place = own[:, np.argmax(np.ptp(own, axis=0))]
    before = place < np.partition(place, len(place) // 2)[len(place) // 2]
    if len(bodies) <= 2 or not before.any():
        yield bodies
    else:
        yield from _halved(bodies[before], places)
        yield from _halved(bodies[~before], places)


@dataclass(frozen=True)
class BlockMatrix:
    """Lower half of a symmetric matrix of blocks.

    Attributes
    ----------
    rows, columns : (N,) arrays of int
        By columns, then rows; ``rows >= columns``.
    blocks : (N, n, n) array
    """

    rows: np.ndarray
    columns: np.ndarray
    blocks: np.ndarray

    @staticmethod
    def of(number: np.ndarray, parts: Iterable[tuple[np.ndarray, np.ndarray]]) -> BlockMatrix:
        """Sum of the stiffness of elements.

        Parameters
        ----------
        number : (M,) array of int
            Of each body in the order of elimination; negative where it is fixed.
        parts : iterable of ((N, e) array of int, (N, e, e, n, n) array)
            Bodies that elements connect, and their stiffness.
        """
        row, column, blocks = [], [], []
        for ends, own in parts:
            for i, j in np.ndindex(own.shape[1:3]):
                lower = (number[ends[:, i]] >= number[ends[:, j]]) & (number[ends[:, j]] >= 0)
                row.append(number[ends[lower, i]])
                column.append(number[ends[lower, j]])
                blocks.append(own[lower, i, j])
        rows, columns = np.concatenate(row), np.concatenate(column)
        order = np.lexsort((rows, columns))
        rows, columns = rows[order], columns[order]
        first = np.flatnonzero(np.diff(columns * len(number) + rows, prepend=-1))
        total = np.add.reduceat(np.concatenate(blocks)[order], first)
        return BlockMatrix(rows[first], columns[first], total)


@dataclass(frozen=True)
class Panel:
    """Columns of the factor, of unknowns side by side in the order of elimination."""

    own: slice
    below: np.ndarray  # (r,) of int: unknowns of its other rows
    inverse: np.ndarray  # (p, p): of its lower diagonal block
    factor: np.ndarray  # (r, p): its other rows


@dataclass(frozen=True)
class Factors:
    """``K = L L^T`` of bodies with n displacements each.

    Attributes
    ----------
    order : (m n,) array of int
        Unknowns in the order of elimination.
    panels : sequence of Panel
        Of all bodies but the last.
    last : Panel or None
        Of the last body; None where the others leave it no stiffness in some direction.
    """

    order: np.ndarray
    panels: Sequence[Panel]
    last: Panel | None

    def solve(self, b: np.ndarray, *, last_is_fixed: bool) -> np.ndarray:
        """Solution (m n, k) for right sides (m n, k), the last body fixed or not."""
        y, panels = b[self.order], self.panels
        if not last_is_fixed and self.last is not None:
            panels = [*panels, self.last]
        for panel in panels:
            y[panel.own] = part = panel.inverse @ y[panel.own]
            y[panel.below] -= panel.factor @ part
        if last_is_fixed:
            y[self.panels[-1].own.stop if self.panels else 0 :] = 0.0
        for panel in reversed(panels):
            y[panel.own] = panel.inverse.T @ (y[panel.own] - panel.factor.T @ y[panel.below])
        x = np.empty_like(y)
        x[self.order] = y
        return x


def factorised(K: BlockMatrix, pieces: Sequence[int]) -> Iterator[Panel]:
    """Panels of the factor of a positive definite matrix, piece after piece of so many bodies.

    Raises LinAlgError where a pivot is not positive.
    """
    n, stops = K.blocks.shape[-1], np.cumsum(pieces)
    front_of, at = np.repeat(np.arange(len(stops)), pieces), np.searchsorted(K.columns, stops)
    # What other fronts leave, by the number of the front that it is added to: bodies, lower half
    waiting: dict[int, list[tuple[np.ndarray, np.ndarray]]] = defaultdict(list)
    begin = 0
    for i, (stop, size, end) in enumerate(zip(stops.tolist(), pieces, at.tolist(), strict=True)):
        start, children = stop - size, waiting.pop(i, [])
        given, begin = slice(begin, end), end
        rest = np.unique(np.concatenate([K.rows[given], *(bodies for bodies, _ in children)]))
        rest = rest[np.searchsorted(rest, stop) :]
        bodies = np.concatenate([np.arange(start, stop), rest])
        F = np.zeros((len(bodies), n, size, n))
        F[np.searchsorted(bodies, K.rows[given]), :, K.columns[given] - start] = K.blocks[given]
        F = F.reshape(-1, n * size)
        for k, (own, left) in enumerate(children):
            _add(F, np.searchsorted(bodies, own), left)
            inside = int(np.searchsorted(own, stop))
            children[k] = own[inside:], left[n * inside :, n * inside :].copy()
        unknowns = (n * bodies[:, None] + np.arange(n)).ravel()
        for a, b in pairwise([*range(0, n * size, _PANEL), n * size]):
            F[a:, a:b] -= F[a:, :a] @ F[a:b, :a].T
            inverse = np.linalg.inv(np.linalg.cholesky(F[a:b, a:b]))
            F[b:, a:b] = factor = F[b:, a:b] @ inverse.T
            yield Panel(slice(n * start + a, n * start + b), unknowns[b:], inverse, factor)
        if len(rest):
            below = F[n * size :]
            remainder = below @ below.T
            np.negative(remainder, out=remainder)
            for own, left in children:
                _add(remainder, np.searchsorted(rest, own), left)
            waiting[int(front_of[rest[0]])].append((rest, remainder))


def _add(F: np.ndarray, place: np.ndarray, left: np.ndarray) -> None:
    """Add to some columns of a front what a child leaves to the bodies at `place`.

    Of symmetric matrices the lower halves are enough.
    """
    if not len(place):
        return
    n = len(left) // len(place)
    inside = int(np.searchsorted(place, F.shape[1] // n))
    ends = np.flatnonzero(np.diff(place, prepend=-2, append=-2) != 1)
    if len(ends) > _STRETCHES:
        rows = (n * place[:, None] + np.arange(n)).ravel()
        F[np.ix_(rows, rows[: n * inside])] += left[:, : n * inside]
        return
    stretches = [(n * a, n * b, n * int(place[a])) for a, b in pairwise(ends.tolist())]
    for k, (a, b, column) in enumerate(stretches):
        if (b := min(b, n * inside)) > a:
            for c, d, row in stretches[k:]:
                F[row : row + d - c, column : column + b - a] += left[c:d, a:b]
