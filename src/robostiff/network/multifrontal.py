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
_LEAF = 8
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
        yield np.concatenate([*_halved(border, places)])


def _halved(bodies: np.ndarray, places: np.ndarray) -> Iterator[np.ndarray]:
    """Bodies of a border halved again and again: those of each part of it lie side by side."""
    own = places[bodies]
    place = own[:, np.argmax(np.ptp(own, axis=0))]
    before = place < np.partition(place, len(place) // 2)[len(place) // 2]
    if len(bodies) <= _LEAF or not before.any():
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
        Unknowns in the order of elimination.
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
        """Solution (m n, k) for right sides (m n, k), the last body fixed or not."""
        y, panels = b[self.order], self.panels
        if not last_is_fixed and self.last is not None:
            panels = [*panels, self.last]
        for panel in panels:
            panel.before(y)
        if last_is_fixed:
            y[len(y) - self.size :] = 0.0
        for panel in reversed(panels):
            panel.after(y)
        x = np.empty_like(y)
        x[self.order] = y
        return x


def _fronts(K: BlockMatrix, pieces: Sequence[int]) -> Iterator[tuple[int, np.ndarray, slice]]:
    """Number of bodies that a front eliminates, its bodies, and places of its blocks in K."""
    stops = np.cumsum(pieces)
    waiting: dict[int, list[np.ndarray]] = defaultdict(list)
    begin = 0
    ends = np.searchsorted(K.columns, stops).tolist()
    for stop, size, end in zip(stops.tolist(), pieces, ends, strict=True):
        own = range(stop - size, stop)
        children = [rest for body in own for rest in waiting.pop(body, [])]
        rest = np.unique(np.concatenate([K.rows[begin:end], *children]))
        rest = rest[np.searchsorted(rest, stop) :]
        if len(rest):
            waiting[int(rest[0])].append(rest)
        yield size, np.concatenate([own, rest]), slice(begin, end)
        begin = end


def _panels(K: BlockMatrix, pieces: Sequence[int]) -> Iterator[FrontPanel]:
    """Of the factor of a positive definite matrix; LinAlgError where a pivot is not positive."""
    n, fronts = K.blocks.shape[-1], [*_fronts(K, pieces)]
    steps = [[*pairwise([*range(0, n * size, _PANEL), n * size])] for size, _, _ in fronts]
    # All panels side by side: one by one they would lie scattered among what is soon left.
    room = np.empty(
        sum(
            (n * len(f[1]) - a) * (b - a)
            for f, own in zip(fronts, steps, strict=True)
            for a, b in own
        )
    )
    work = np.empty(max(n * len(f[1]) * n * f[0] for f in fronts))
    used = 0
    # What fronts leave, by the first of the bodies that it is added to: these, and lower half
    waiting: dict[int, list[tuple[np.ndarray, np.ndarray]]] = defaultdict(list)
    for (size, bodies, given), own_steps in zip(fronts, steps, strict=True):
        F = work[: n * len(bodies) * n * size].reshape(len(bodies), n, size, n)
        F[:] = 0.0
        F[np.searchsorted(bodies, K.rows[given]), :, K.columns[given] - bodies[0]] = K.blocks[given]
        F, rest = F.reshape(-1, n * size), bodies[size:]
        children, beyond = [own for body in bodies[:size] for own in waiting.pop(int(body), [])], []
        while children:  # of each only what lies beyond the front is kept
            of_child, left = children.pop()
            _add(F, np.searchsorted(bodies, of_child), left)
            inside = int(np.searchsorted(of_child, bodies[size - 1], side="right"))
            beyond.append((of_child[inside:], left[n * inside :, n * inside :].copy()))
            del left
        unknowns = (n * bodies[:, None] + np.arange(n)).ravel()
        for a, b in own_steps:
            F[a:, a:b] -= F[a:, :a] @ F[a:b, :a].T
            panel = room[used : (used := used + (len(F) - a) * (b - a))].reshape(-1, b - a)
            panel[: b - a] = inverse = np.linalg.inv(np.linalg.cholesky(F[a:b, a:b]))
            F[b:, a:b] = np.matmul(F[b:, a:b], inverse.T, out=panel[b - a :])
            yield FrontPanel(unknowns[a:], panel)
        if len(rest):
            below = F[n * size :]
            remainder = below @ below.T
            np.negative(remainder, out=remainder)
            for of_child, left in beyond:
                _add(remainder, np.searchsorted(rest, of_child), left)
            waiting[int(rest[0])].append((rest, remainder))


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
