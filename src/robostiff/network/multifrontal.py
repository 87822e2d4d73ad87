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
from itertools import pairwise

import numpy as np

from robostiff.frozen import frozen

# Bodies that are no longer divided, and those of whose columns a remainder is made.
_LEAF, _STRIP = 16, 16
# Columns of a front that are eliminated together, and stored.
_PANEL = 64
# Of the lengths of a long part, in widths: the boxes into which it is cut.
_LONG = 1.4


def dissection(bodies: np.ndarray, pairs: np.ndarray, places: np.ndarray) -> Iterator[np.ndarray]:
    """Bodies in an order of elimination that fills in little, in pieces.

    Parameters
    ----------
    bodies : (m,) array of int
    pairs : (p, 2) array of int
        Connected ones.
    places : (M, c) array of int
        Coordinates of all bodies, along one of which they are cut: where it cuts the fewest pairs.
        The last, in which all differ, is for those in one place.

    Yields
    ------
    (k,) array of int
        Those that are eliminated together.
    """
    if len(bodies) <= _LEAF:
        if len(bodies):
            yield bodies
        return
    side, cuts = np.empty(len(places), dtype=int), []
    for place in places[bodies].T:
        middle = np.partition(place, len(place) // 2)[len(place) // 2]
        for after in (place >= middle, place > middle):
            if len(place) <= 4 * np.count_nonzero(after) <= 3 * len(place):
                side[bodies] = after
                crossing = np.count_nonzero(side[pairs[:, 0]] != side[pairs[:, 1]])
                cuts.append((crossing, len(cuts), after, place))
                break
    cuts = sorted(cuts[:-1] or cuts)
    (least, _, part, place), (second, *_) = cuts[0], cuts[:2][-1]
    # What is long is cut into boxes in a row, and their borders are eliminated one after another.
    if (boxes := int(_LONG * second / max(least, 1))) > 2:
        ends = np.sort(place)[len(place) * np.arange(1, boxes) // boxes]
        part = np.searchsorted(np.unique(ends), place, side="right")
    side[bodies] = part
    pairs = np.take_along_axis(pairs, np.argsort(side[pairs], axis=1), axis=1)
    crossing = side[pairs[:, 0]] != side[pairs[:, 1]]
    before, after = map(np.unique, pairs[crossing].T)
    # Of borders of one size that of the larger half
    is_before = (len(before), np.mean(part > 0)) <= (len(after), 0.5)
    border = before if is_before else after
    last = side[border] + is_before  # of the boxes beside it
    side[border] = -1
    of_bodies, of_pairs = side[bodies], side[pairs]
    for own in range(int(part.max()) + 1):
        inside = np.all(of_pairs == own, axis=1)
        yield from dissection(bodies[of_bodies == own], pairs[inside], places)
        if np.any(last == own):
            yield border[last == own]


def lower_blocks(
    number: np.ndarray, parts: Iterable[tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lower half of the sum of the stiffness of elements, in blocks.

    Parameters
    ----------
    number : (M,) array of int
        Of each body in the order of elimination; negative where it is fixed.
    parts : iterable of ((N, e) array of int, (N, e, e, n, n) array)
        Bodies that elements connect, and their stiffness.

    Returns
    -------
    rows, columns : (B,) arrays of int
        By columns, then rows; ``rows >= columns``.
    blocks : (B, n, n) array
    """
    keys, given = [], []
    for ends, own in parts:
        row, column = number[ends][:, :, None], number[ends][:, None]
        lower = np.nonzero((row >= column) & (column >= 0))
        keys.append((len(number) * column + row)[lower])
        given.append(own[lower])
    order = np.argsort(key := np.concatenate(keys))
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    columns, rows = np.divmod(key[order[first]], len(number))
    return rows, columns, np.add.reduceat(np.concatenate(given)[order], first)


#: Columns of a factor, of unknowns side by side in the order of elimination: the numbers (r,) of
#: these, and of those that they act on; entries (r, p), of their own block the inverse.
Panel = tuple[np.ndarray, np.ndarray]


@frozen
class CholeskyFactors:
    """``K = L L^T`` of bodies with n displacements each."""

    #: (m n,): rows of their unknowns in the order of elimination; in all others a solution is 0
    order: np.ndarray
    panels: Sequence[Panel]  #: of all bodies but the last
    size: int  #: displacements n of a body
    #: of the last body; None where the others leave it no stiffness in some direction
    last: Panel | None

    @staticmethod
    def of(
        K: tuple[np.ndarray, np.ndarray, np.ndarray], pieces: Sequence[int], order: np.ndarray
    ) -> CholeskyFactors:
        """Factorise `lower_blocks`, piece after piece of so many bodies, the last body alone.

        Raises LinAlgError where a pivot of another body is not positive.
        """
        panels: list[Panel] = []
        n = K[2].shape[-1]
        try:
            for panel in _panels(K, pieces):
                panels.append(panel)
        except np.linalg.LinAlgError:
            if sum(entries.shape[1] for _, entries in panels) < len(order) - n:
                raise
            return CholeskyFactors(order, panels, n, None)
        return CholeskyFactors(order, panels[:-1], n, panels[-1])

    def solve(self, b: np.ndarray, *, last_is_fixed: bool) -> np.ndarray:
        """Solution (size, k) for right sides (size, k), the last body fixed or not."""
        y, panels = b[self.order], self.panels
        if not last_is_fixed and self.last is not None:
            panels = [*panels, self.last]
        for rows, L in panels:
            own, below = rows[: (p := L.shape[1])], rows[p:]
            y[own] = part = L[:p] @ y[own]
            y[below] -= L[p:] @ part
        if last_is_fixed:
            y[len(y) - self.size :] = 0.0
        for rows, L in reversed(panels):
            own, below = rows[: (p := L.shape[1])], rows[p:]
            y[own] = L[:p].T @ (y[own] - L[p:].T @ y[below])
        x = np.zeros_like(b)
        x[self.order] = y
        return x


def _panels(K: tuple[np.ndarray, np.ndarray, np.ndarray], pieces: Sequence[int]) -> Iterator[Panel]:
    """Of the factor of a positive definite matrix; LinAlgError where a pivot is not positive."""
    rows, columns, blocks = K
    n, stops = blocks.shape[-1], np.cumsum(pieces)
    # What fronts leave, by the first of the bodies that it is added to: these, and columns of it
    waiting: dict[int, list[tuple[np.ndarray, list[np.ndarray]]]] = defaultdict(list)
    begin = 0
    for stop, size, end in zip(stops, pieces, np.searchsorted(columns, stops), strict=True):
        numbers, given = np.arange(stop - size, stop), slice(begin, begin := end)
        children = [one for body in numbers.tolist() for one in waiting.pop(body, [])]
        bodies = np.unique(np.concatenate([numbers, rows[given], *(of for of, _ in children)]))
        # Columns of the front from the diagonal down, its own and some of the others after others
        starts = [0, *range(size, len(bodies), _STRIP)]
        ends = pairwise([*starts, len(bodies)])
        strips = [np.zeros((n * (len(bodies) - a), n * (b - a))) for a, b in ends]
        row, column = np.searchsorted(bodies, rows[given]), columns[given] - numbers[0]
        strips[0].reshape(len(bodies), n, size, n)[row, :, column] = blocks[given]
        while children:
            of_child, left = children.pop()
            _add(strips, starts, np.searchsorted(bodies, of_child), left)
            del left
        F, unknowns = strips[0], (n * bodies[:, None] + np.arange(n)).ravel()
        for a, b in pairwise([*range(0, n * size, _PANEL), n * size]):
            F[a:, a:b] -= F[a:, :a] @ F[a:b, :a].T
            inverse = np.linalg.inv(np.linalg.cholesky(F[a:b, a:b]))
            F[b:, a:b] = F[b:, a:b] @ inverse.T
            yield unknowns[a:], np.concatenate([inverse, F[b:, a:b]])
        for a, own in zip(starts[1:], strips[1:], strict=True):
            np.subtract(own, F[n * a :] @ F[n * a : n * a + own.shape[1]].T, out=own)
        if len(bodies) > size:
            waiting[int(bodies[size])].append((bodies[size:], strips[1:]))


def _add(
    strips: Sequence[np.ndarray], starts: Sequence[int], place: np.ndarray, left: list[np.ndarray]
) -> None:
    """Add to the columns of a front, which begin at `starts`, what a child leaves.

    The bodies of the child stand at `place` in the front; those side by side are added at once.
    """
    of_strip = np.searchsorted(starts, place, side="right") - 1
    apart = np.diff(place) != 1
    cut = apart | (np.diff(of_strip) != 0)
    cut[_STRIP - 1 :: _STRIP] = True
    rows, columns = (
        [*pairwise([0, *(np.flatnonzero(where) + 1).tolist(), len(place)])]
        for where in (apart, cut)
    )
    n, at = left[-1].shape[1] // ((len(place) - 1) % _STRIP + 1), place.tolist()
    for a, b in columns:
        first, start, into = a - a % _STRIP, starts[of_strip[a]], strips[of_strip[a]]
        column, given = n * (at[a] - start), left[a // _STRIP][:, n * (a % _STRIP) :]
        for low, high in rows:
            if high > a:
                row = n * (at[max(low, a)] - start)
                some = given[n * (max(low, a) - first) : n * (high - first), : n * (b - a)]
                into[row : row + len(some), column : column + n * (b - a)] += some
