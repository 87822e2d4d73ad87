"""Cholesky factors of the stiffness of bodies, in dense fronts by nested dissection.

Bodies whose removal cuts a network in two come last, and so on in both halves (A. George, Nested
dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10, 1973). Those that are
eliminated together make a dense front with those that they act on; what is left of the latter is
added to the front of the first of them (I. Duff and J. Reid, ACM Trans. Math. Softw. 9, 1983).
NumPy alone: at ten thousand beams SciPy takes a sixth of the time to be imported.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

# Bodies that are no longer divided.
_LEAF = 16
# Columns of a front that are eliminated together, and stored.
_PANEL = 96


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
        if len(bodies):
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
        yield border


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
    def of_elements(
        number: np.ndarray, parts: Iterable[tuple[np.ndarray, np.ndarray]]
    ) -> BlockMatrix:
        """Sum of the stiffness of elements.

        Parameters
        ----------
        number : (M,) array of int
            Of each body in the order of elimination; negative where it is fixed.
        parts : iterable of ((N, e) array of int, (N, e, e, n, n) array)
            Bodies that elements connect, and their stiffness.
        """
        keys, given = [np.zeros(0, dtype=int)], []
        for ends, own in parts:
            for i, j in np.ndindex(own.shape[1:3]):
                row, column = number[ends[:, i]], number[ends[:, j]]
                lower = np.flatnonzero((row >= column) & (column >= 0))
                keys.append(column[lower] * len(number) + row[lower])
                given.append((own, lower, i, j))
        columns, rows = np.divmod(places := np.unique(np.concatenate(keys)), len(number))
        blocks = np.zeros((len(places), *given[0][0].shape[3:]))
        for key, (own, lower, i, j) in zip(keys[1:], given, strict=True):
            np.add.at(blocks, np.searchsorted(places, key), own[lower, i, j])
        return BlockMatrix(rows, columns, blocks)


@dataclass(frozen=True)
class FrontPanel:
    """Columns of the factor, of unknowns side by side in the order of elimination."""

    rows: np.ndarray  # (r,) of int: its unknowns, then those that they act on
    entries: np.ndarray  # (r, p): the inverse of its lower diagonal block; then the other rows

    def before(self, y: np.ndarray) -> None:
        """Solve ``L y = b`` (m n, k) in place, up to these unknowns."""
        p = self.entries.shape[1]
        own, below = self.rows[:p], self.rows[p:]
        y[own] = part = self.entries[:p] @ y[own]
        y[below] -= self.entries[p:] @ part

    def after(self, y: np.ndarray) -> None:
        """Solve ``L^T y = b`` (m n, k) in place, down to these unknowns."""
        p = self.entries.shape[1]
        own, below = self.rows[:p], self.rows[p:]
        y[own] = self.entries[:p].T @ (y[own] - self.entries[p:].T @ y[below])


@dataclass(frozen=True)
class CholeskyFactors:
    """``K = L L^T`` of bodies with n displacements each.

    Attributes
    ----------
    order : (m n,) array of int
        Rows of their unknowns in the order of elimination; in all others a solution is 0.
    panels : sequence of FrontPanel
        Of all bodies but the last.
    size : int
        Displacements n of a body.
    last : FrontPanel or None
        Of the last body; None where the others leave it no stiffness in some direction.
    """

    order: np.ndarray
    panels: Sequence[FrontPanel]
    size: int
    last: FrontPanel | None

    @staticmethod
    def of(K: BlockMatrix, pieces: Sequence[int], order: np.ndarray) -> CholeskyFactors:
        """Factorise, piece after piece of so many bodies, the last body alone.

        Raises LinAlgError where a pivot of another body is not positive.
        """
        panels: list[FrontPanel] = []
        n = K.blocks.shape[-1]
        try:
            for panel in _panels(K, pieces):
                panels.append(panel)
        except np.linalg.LinAlgError:
            if sum(panel.entries.shape[1] for panel in panels) < len(order) - n:
                raise
            return CholeskyFactors(order, panels, n, None)
        return CholeskyFactors(order, panels[:-1], n, panels[-1])

    def solve(self, b: np.ndarray, *, last_is_fixed: bool) -> np.ndarray:
        """Solution (size, k) for right sides (size, k), the last body fixed or not."""
        y, panels = b[self.order], self.panels
        if not last_is_fixed and self.last is not None:
            panels = [*panels, self.last]
        for panel in panels:
            panel.before(y)
        if last_is_fixed:
            y[len(y) - self.size :] = 0.0
        for panel in reversed(panels):
            panel.after(y)
        x = np.zeros_like(b)
        x[self.order] = y
        return x


def _panels(K: BlockMatrix, pieces: Sequence[int]) -> Iterator[FrontPanel]:
    """Of the factor of a positive definite matrix; LinAlgError where a pivot is not positive."""
    n, stops = K.blocks.shape[-1], np.cumsum(pieces)
    # What fronts leave, by the first of the bodies that it is added to: these, and lower half
    waiting: dict[int, list[tuple[np.ndarray, np.ndarray]]] = defaultdict(list)
    begin = 0
    for stop, size, end in zip(stops, pieces, np.searchsorted(K.columns, stops), strict=True):
        own, given = np.arange(stop - size, stop), slice(begin, begin := end)
        children = [one for body in own.tolist() for one in waiting.pop(body, [])]
        bodies = np.unique(np.concatenate([own, K.rows[given], *(of for of, _ in children)]))
        F = np.zeros((len(bodies), n, size, n))
        F[np.searchsorted(bodies, K.rows[given]), :, K.columns[given] - own[0]] = K.blocks[given]
        F, rest, beyond = F.reshape(-1, n * size), bodies[size:], []
        while children:  # of each only what lies beyond the front is kept
            of_child, left = children.pop()
            _add(F, np.searchsorted(bodies, of_child), left)
            inside = int(np.searchsorted(of_child, stop))
            beyond.append((of_child[inside:], left[n * inside :, n * inside :].copy()))
            del left
        unknowns = (n * bodies[:, None] + np.arange(n)).ravel()
        for a, b in pairwise([*range(0, n * size, _PANEL), n * size]):
            F[a:, a:b] -= F[a:, :a] @ F[a:b, :a].T
            inverse = np.linalg.inv(np.linalg.cholesky(F[a:b, a:b]))
            F[b:, a:b] = F[b:, a:b] @ inverse.T
            yield FrontPanel(unknowns[a:], np.concatenate([inverse, F[b:, a:b]]))
        if len(rest):
            remainder = F[n * size :] @ F[n * size :].T
            np.negative(remainder, out=remainder)
            for of_child, left in beyond:
                _add(remainder, np.searchsorted(rest, of_child), left)
            waiting[int(rest[0])].append((rest, remainder))


def _add(F: np.ndarray, place: np.ndarray, left: np.ndarray) -> None:
    """Add to some columns of a front what a child leaves to the bodies at `place`.

    Of symmetric matrices the lower halves are enough. Bodies side by side are added at once.
    """
    if len(place):
        n = len(left) // len(place)
        inside = int(np.searchsorted(place, F.shape[1] // n))
        apart = (np.flatnonzero(np.diff(place) != 1) + 1).tolist()
        runs = [(n * a, n * b, n * int(place[a])) for a, b in pairwise([0, *apart, len(place)])]
        for i, (c, end, column) in enumerate(runs):
            if c < (d := min(end, n * inside)):
                for a, b, row in runs[i:]:
                    F[row : row + b - a, column : column + d - c] += left[a:b, c:d]
