"""Symmetric systems of coordinates and multipliers on recorded entries, eliminated stably."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from robostiff.record import as_part, is_zero, least_size, usual_size

# Of the largest entry of its column, and of its own mean over the samples: a pivot above is safe.
_OF_COLUMN, _OF_ITSELF = 0.2, 0.3
# Of a unit: a rate at the unloaded samples that is rounding.
_STILL = 1e-9
# Of a multiplier's row: what is left of it after elimination is rounding.
_LOST = 1e-11
# Of the stiffness by loads: what is none.
_NOTHING = 1e-6


class RigidLegError(Exception):
    """A leg has a direction without compliance: a kernel of its stiffness does not exist."""


@dataclass
class SymmetricElimination:
    """Elimination of ``[[T, J^T], [J, 0]]``, whose signs say whether T is positive where J x = 0.

    Pairs of a free coordinate and a multiplier come first: ``[[a, b], [b, 0]]`` has the determinant
    ``-b^2`` whatever the load. Elastic coordinates then have positive pivots, and the other
    multipliers negative ones. Where all signs are so, the matrix has as many positive eigenvalues
    as coordinates: T reduced to the closure is positive definite.
    """

    # dict of int to dicts of entries or numbers: rows without zeros, both triangles
    A: dict[int, dict[int, Any]] = field(default_factory=dict)
    right: dict[int, Any] = field(default_factory=dict)  # dict of int to entries or numbers
    # entries or numbers: positive where the signs are as they should be
    pivots: list[Any] = field(default_factory=list)
    # entries or numbers: positive where coordinates that are left at zero stay there
    still: list[Any] = field(default_factory=list)
    _scale: dict[int, float] = field(default_factory=dict)
    _solved: list[Any] = field(default_factory=list)

    def unknown(self, name: int, size: float) -> None:
        """An unknown, and a number that makes its unit like that of others."""
        self.A[name], self.right[name], self._scale[name] = {}, 0, size

    def add(self, a: int, b: int, value: Any) -> None:
        """To an entry, and to the one across the diagonal."""
        if is_zero(value):
            return
        for i, j in {(a, b), (b, a)}:
            total = self.A[i].get(j, 0) + value
            if is_zero(total):
                self.A[i].pop(j, None)
            else:
                self.A[i][j] = total

    def add_right(self, a: int, value: Any) -> None:
        """To the right side."""
        self.right[a] = self.right[a] + value

    def eliminate(
        self,
        elastic: Sequence[int],
        free: Sequence[int],
        multipliers: Sequence[int],
        carried: Sequence[tuple[int, int]],
        by_loads: float,
    ) -> None:
        """Eliminate a leg: bodies, pairs, what is elastic, then single multipliers.

        Free coordinates that move nothing and are held by nothing, such as the spin of a rod, are
        left at zero. `carried` are motions of bodies between chains, and multipliers of a chain
        that takes them there: they move as it does, which leaves its coordinates alone. `by_loads`
        is the stiffness that the loads of the samples make.

        Raises
        ------
        RigidLegError
            When the leg has a direction without compliance.
        """
        for motion, multiplier in carried:
            self._eliminate_pair(motion, multiplier)
        taken = {name for _, name in carried}
        open_free, rest = list(free), [name for name in multipliers if name not in taken]
        while open_free:
            found = self._best_pair(open_free, rest)
            if found is None:
                break
            q, j = found
            open_free.remove(q)
            rest.remove(j)
            self._eliminate_pair(q, j)
        open_ = list(elastic)
        while open_:
            chosen = min(open_, key=lambda name: (len(self.A[name]), elastic.index(name)))
            open_.remove(chosen)
            pivot = self.A[chosen].get(chosen, 0)
            self.pivots.append(as_part(pivot))
            self._eliminate_one(chosen)
        for name in open_free:  # left at zero, where nothing drives it and loads do not push it
            row, right = self.A.pop(name), self.right.pop(name)
            for other in row:
                if other != name:
                    del self.A[other][name]
            resistance = row.get(name, 0) * (1 / by_loads) + _NOTHING
            driven = right * (1 / by_loads)
            self.still += [resistance, _NOTHING**2 - driven * driven]
            self._solved.append(({name: {}}, {name: 0}))
        # in units of the robot's length: what carries a force is a spring of some compliance
        sizes = {name: self._size(name, name)[1] / self._scale[name] ** 2 for name in rest}
        softest = max(sizes.values(), default=0.0)
        while rest:
            chosen = max(rest, key=lambda name: self._size(name, name)[0] / self._scale[name] ** 2)
            if self._size(chosen, chosen)[0] / self._scale[chosen] ** 2 <= _LOST * softest:
                raise RigidLegError(chosen)
            rest.remove(chosen)
            self.pivots.append(as_part(-self.A[chosen][chosen]))
            self._eliminate_one(chosen)

    def solution(self, known: dict[int, Any]) -> dict[int, Any]:
        """Every unknown that was eliminated, from the others."""
        found = dict(known)
        for rows, rights in reversed(self._solved):
            for name, row in rows.items():
                value = rights[name]
                for other, rate in row.items():
                    if not is_zero(found[other]):
                        value = value - rate * found[other]
                found[name] = value
        return found

    def _eliminate_one(self, k: int) -> None:
        row = self.A.pop(k)
        pivot, right = row.pop(k), self.right.pop(k)
        inverse = 1 / pivot
        solved = {name: value * inverse for name, value in row.items()}
        new_right = right * inverse
        for name in row:
            del self.A[name][k]
        names = list(row)
        for i, a in enumerate(names):
            for b in names[i:]:
                self.add(a, b, -(solved[a] * row[b]))
            if not is_zero(right):
                self.right[a] = self.right[a] - solved[a] * right
        self._solved.append(({k: solved}, {k: new_right}))

    def _eliminate_pair(self, q: int, j: int) -> None:
        """A pair, by ``[[a, b], [b, d]]^-1 = [[d, -b], [-b, a]] / (a d - b^2)``."""
        first, second = self.A.pop(q), self.A.pop(j)
        a, b, d = first.pop(q, 0), first.pop(j), second.pop(j, 0)
        second.pop(q)
        right = {q: self.right.pop(q), j: self.right.pop(j)}
        minus = b * b - a * d
        self.pivots.append(as_part(minus))
        if is_zero(a) and is_zero(d):
            of_q, of_both, of_j = 0, 1 / b, 0
        else:
            inverse = 1 / minus
            of_q, of_both, of_j = -d * inverse, b * inverse, -a * inverse
        names = sorted({*first, *second})
        for name in names:
            self.A[name].pop(q, None)
            self.A[name].pop(j, None)
        rows: dict[int, dict[int, Any]] = {q: {}, j: {}}
        for name in names:
            x, y = first.get(name, 0), second.get(name, 0)
            rows[q][name], rows[j][name] = of_q * x + of_both * y, of_both * x + of_j * y
        x, y = right[q], right[j]
        rights = {q: of_q * x + of_both * y, j: of_both * x + of_j * y}
        for i, one in enumerate(names):
            x, y = first.get(one, 0), second.get(one, 0)
            for other in names[i:]:
                self.add(one, other, -(x * rows[q][other] + y * rows[j][other]))
            self.right[one] = self.right[one] - (x * rights[q] + y * rights[j])
        rows = {k: {n: v for n, v in row.items() if not is_zero(v)} for k, row in rows.items()}
        self._solved.append((rows, rights))

    def _best_pair(self, free: Sequence[int], multipliers: Sequence[int]) -> tuple[int, int] | None:
        best: tuple[Any, ...] | None = None
        for q in free:
            sizes = {
                j: tuple(s / self._scale[j] for s in self._size(q, j))
                for j in multipliers
                if j in self.A[q]
            }
            largest = max((least for least, _ in sizes.values()), default=0.0)
            if largest <= _STILL:
                continue
            for j, (least, usual) in sizes.items():
                part = least / largest
                safe = part > _OF_COLUMN and least > _OF_ITSELF * usual
                fill = len(self.A[q]) * len(self.A[j])
                key = (not safe, fill if safe else 0, -part, q, j)
                best = key if best is None else min(best, key)
        return None if best is None else (best[-2], best[-1])

    def _size(self, a: int, b: int) -> tuple[float, float]:
        """Least and mean size over the samples."""
        value = self.A[a].get(b, 0)
        return least_size(value), usual_size(value)
