"""What a leg holds by: wrenches that share no energy, each with a compliance in names.

Unit wrenches that share energy are made conjugate one after the other, couples first: a force is
moved to the line on which it turns nothing, w' = w - e v with e = w^T C v / v^T C v, and what is
left of its compliance is c - e^2 c_v. Parallel branches are a spring of their own: their
stiffnesses are added, and made conjugate alike, so that each of its wrenches has a compliance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.definition import count_of
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.springs.contributions import ContributionReader, summed
from robostiff.analytic.springs.sampled_leg import SampledLeg
from robostiff.analytic.springs.unit_wrenches import IDLE, UnitWrench, WrenchSearch
from robostiff.model import PlacedBlock, PlacedLeg
from robostiff.record import Entry, is_zero
from robostiff.recorded.elimination import least_size
from robostiff.recorded.leg import at_samples
from robostiff.recorded.working_frame import WorkingFrame, dot

_SAME = 1e-10
_SHORT = 12  # operations of the compliance of one spring that needs no name, such as l/EA
_CANCELLED = 0.6  # of the operations of a sum, for which it becomes one fraction


class NotHeldByUnitWrenchesError(Exception):
    """No basis of unit wrenches was found: the other forms answer."""


@dataclass(frozen=True, eq=False)
class HeldWrench:
    """A wrench of a leg, conjugate to its others."""

    parts: tuple[tuple[Any, UnitWrench], ...]  # (factor, UnitWrench): whose sum it is
    compliance: Any  # a name, or a short formula
    met: np.ndarray  # (count,): its values at the samples

    def about(self, reference: np.ndarray, search: WrenchSearch) -> list[Any]:
        """Its six entries about a point, world axes."""
        record, length = search.record, search.length
        return _combined([(f, w.about(reference, record, length)) for f, w in self.parts], search)

    def seen_from(self, frame: WorkingFrame, search: WrenchSearch) -> list[Any]:
        """Its six entries in a frame, about its origin."""
        record, length = search.record, search.length
        return _combined([(f, w.seen_from(frame, record, length)) for f, w in self.parts], search)


@dataclass(frozen=True, eq=False)
class BlockSprings:
    """Parallel branches as a spring."""

    frame: WorkingFrame  # in which wrenches are compared
    columns: tuple[list[Any], ...]  # its wrenches there
    compliances: tuple[Any, ...]
    search: WrenchSearch

    def shares(self, wrench: UnitWrench) -> list[Any]:
        """What of each of its wrenches makes up a given one."""
        w = wrench.seen_from(self.frame, self.search.record, self.search.length)
        return shares_of(self.columns, w, self.search)


@dataclass
class LegReader:
    """Reads legs as sums of springs, in one set of names."""

    search: WrenchSearch
    read: NamedReading
    _named: list[tuple[np.ndarray, Any]] = field(default_factory=list)
    _shifts: list[tuple[np.ndarray, Any]] = field(default_factory=list)
    _blocks: dict[int, BlockSprings] = field(default_factory=dict)

    def __post_init__(self) -> None:
        search = self.search
        self.contributions: ContributionReader = ContributionReader(
            search.record, search.length, self.read, self.block
        )

    def of(self, leg: PlacedLeg) -> tuple[HeldWrench, ...]:
        """The wrenches by which a leg holds the platform, forces first.

        Raises
        ------
        NotHeldByUnitWrenchesError
        FormulaTooLargeError
            When more pairs of them share energy than there are wrenches.
        """
        basis = self.search.basis(leg)
        if basis is None:
            raise NotHeldByUnitWrenchesError
        units = basis.wrenches
        if basis.couplings > len(units):
            raise FormulaTooLargeError.beyond(len(units))

        def shared(i: int, j: int) -> Any:
            return summed(self.contributions.of(leg, units[i], units[j]))

        shifts, met, compliances = self._conjugate(basis.compliance, shared)
        held = [
            HeldWrench(
                tuple(
                    (self._factor(x), w) for x, w in zip(row, units, strict=True) if not is_zero(x)
                ),
                compliances[i],
                met[:, i],
            )
            for i, row in enumerate(_inverse(shifts))
        ]
        return tuple(sorted(held, key=lambda one: all(w.point is None for _, w in one.parts)))

    def _conjugate(
        self, A: np.ndarray, entry: Callable[[int, int], Any], *, are_stiffnesses: bool = False
    ) -> tuple[list[list[Any]], np.ndarray, list[Any]]:
        """A = L D L^T with a name for each long entry; L, D at the samples, 1/D or D in names."""
        m = A.shape[1]
        L = np.zeros_like(A)
        D = np.zeros(A.shape[:2])
        shifts: list[list[Any]] = [[0] * m for _ in range(m)]
        pivots: list[Any] = []
        for i in range(m):
            for j in range(i):
                own = A[:, i, j] - np.einsum("nk,nk,nk->n", L[:, i, :j], L[:, j, :j], D[:, :j])
                size = np.sqrt(A[:, i, i] * D[:, j])
                if np.max(np.abs(own) / size) <= IDLE:
                    continue
                L[:, i, j] = own / D[:, j]
                shifts[i][j] = self._shift(
                    L[:, i, j],
                    lambda i=i, j=j: self.read.quotient(
                        _less(entry(i, j), shifts[i], shifts[j], pivots, self.read), pivots[j]
                    ),
                )
            D[:, i] = A[:, i, i] - np.einsum("nk,nk,nk->n", L[:, i, :i], L[:, i, :i], D[:, :i])
            if np.min(D[:, i]) <= 0:
                raise NotHeldByUnitWrenchesError
            pivots.append(
                self._compliance(
                    D[:, i],
                    lambda i=i: _less(entry(i, i), shifts[i], shifts[i], pivots, self.read),
                    is_stiffness=are_stiffnesses,
                )
            )
        return shifts, D, pivots

    def _compliance(
        self, values: np.ndarray, write: Callable[[], Any], *, is_stiffness: bool
    ) -> Any:
        """A compliance under a name where it is long; the same for the same values."""
        for known, name in self._named:
            if np.allclose(known, values, rtol=_SAME, atol=0):
                return name
        plain = write()
        total = min(plain, self.read.without_shifts(plain), key=count_of)
        cancelled = self.read.written_out(total, _CANCELLED * count_of(total))
        if count_of(cancelled) <= _CANCELLED * count_of(total):
            total = cancelled
        short = not total.is_Add and count_of(total) <= _SHORT
        name = total if short else self.read.define("k" if is_stiffness else "c", total)
        self._named.append((values, name))
        return name

    def _shift(self, values: np.ndarray, write: Callable[[], Any]) -> Any:
        """By how much one wrench comes with another: an input of the record with a name."""
        for known, entry in self._shifts:
            for sign in (1, -1):
                if np.allclose(known, sign * values, rtol=_SAME, atol=0):
                    return sign * entry
        entry = self.read.entry("e", write(), values)
        self._shifts.append((values, entry))
        return entry

    def _factor(self, value: Any) -> Any:
        """What several shifts make together, as one."""
        if not isinstance(value, Entry) or value.record.cost([value.step]) <= 1:
            return value
        return self._shift(value.sample, lambda: self.read(value))

    def block(self, block: PlacedBlock) -> BlockSprings:
        """Parallel branches as a spring."""
        if id(block) not in self._blocks:
            self._blocks[id(block)] = self._of_block(block)
        return self._blocks[id(block)]

    def _of_block(self, block: PlacedBlock) -> BlockSprings:
        """Wrenches of parallel branches, their stiffnesses added: sum of u u^T / c."""
        search, record = self.search, self.search.record
        as_leg = PlacedLeg(block.name, (block,), block.branches[0].end)
        held = [w for branch in block.branches for w in self.of(branch)]
        own = SampledLeg.of(as_leg, search)
        if own is not None and own.transmitted == len(held):
            # All of them together are a basis, and share no energy.
            frame = self._frame(block, [u for w in held for _, u in w.parts])
            columns = tuple(w.seen_from(frame, search) for w in held)
            return BlockSprings(frame, columns, tuple(w.compliance for w in held), search)
        basis = search.basis(as_leg, few_couplings=False)
        if basis is None:
            raise NotHeldByUnitWrenchesError
        units = basis.wrenches[::-1]  # forces first: they are moved by couples
        frame = self._frame(block, units)
        columns = [w.seen_from(frame, record, search.length) for w in units]
        shares = [shares_of(columns, w.seen_from(frame, search), search) for w in held]
        at = at_samples(shares, record.count).reshape(record.count, len(held), len(units))
        met = np.stack([w.met for w in held], axis=1)

        def added(i: int, j: int) -> Any:
            of_compliance: dict[Any, Any] = {}
            for w, own in zip(held, shares, strict=True):
                so_far = of_compliance.get(w.compliance, 0)
                of_compliance[w.compliance] = so_far + own[i] * own[j]
            terms = [self.read(record.simplified(x)) / c for c, x in of_compliance.items()]
            return sp.Add(*terms)

        D = np.einsum("nbi,nb,nbj->nij", at, 1 / met, at)
        shifts, _, stiffnesses = self._conjugate(D, added, are_stiffnesses=True)
        # Rows of L^T: the wrench with which each stiffness comes.
        own = []
        for i, column in enumerate(columns):
            later = [row[i] for row in shifts[i + 1 :]]
            moved = [dot(later, [c[r] for c in columns[i + 1 :]]) for r in range(6)]
            whole = (x if is_zero(y) else x + y for x, y in zip(column, moved, strict=True))
            own.append([*map(record.simplified, whole, search.scale)])
        return BlockSprings(frame, tuple(own), tuple(1 / k for k in stiffnesses), search)

    def _frame(self, block: PlacedBlock, units: Sequence[UnitWrench]) -> WorkingFrame:
        """A frame in which wrenches look simple: that of a spring, or the world's."""
        record, length = self.search.record, self.search.length
        parts = [part for branch in block.branches for part in branch.springs]
        world = np.eye(3, dtype=int).astype(object)
        frames = [WorkingFrame(part.rotation, part.point) for part in parts]
        frames.append(WorkingFrame(world, block.branches[0].end))

        def entries(frame: WorkingFrame) -> int:
            seen = [x for w in units for x in w.seen_from(frame, record, length)]
            return sum(isinstance(x, Entry) for x in seen)

        return min(frames, key=entries)


def shares_of(columns: Sequence[list[Any]], w: list[Any], search: WrenchSearch) -> list[Any]:
    """Factors by which wrenches make up another, by elimination with safe pivots.

    Raises
    ------
    NotHeldByUnitWrenchesError
        When they do not.
    """
    record, m = search.record, len(columns)
    scale = search.scale
    rows = [[*(column[r] for column in columns), w[r]] for r in range(6)]
    taken: list[int] = []
    for k in range(m):
        left = [r for r in range(6) if r not in taken and not is_zero(rows[r][k])]
        if not left:
            raise NotHeldByUnitWrenchesError
        pivot = min(left, key=lambda r: _awkwardness(rows[r], k, scale[r]))
        taken.append(pivot)
        own = rows[pivot][k]
        rows[pivot] = [record.simplified(x / own) for x in rows[pivot]]
        for r in range(6):
            factor = rows[r][k]
            if r != pivot and not is_zero(factor):
                rows[r] = [
                    record.simplified(x - dot([factor], [y]), scale[r])
                    for x, y in zip(rows[r], rows[pivot], strict=True)
                ]
    return [rows[r][m] for r in taken]


def _awkwardness(row: list[Any], k: int, scale: float) -> tuple[int, int, float]:
    used = sum(isinstance(x, Entry) for x in row)
    return isinstance(row[k], Entry), used, -least_size(row[k]) / scale


def _combined(terms: Sequence[tuple[Any, list[Any]]], search: WrenchSearch) -> list[Any]:
    scale, factors = search.scale, [f for f, _ in terms]
    return [
        search.record.simplified(dot(factors, [w[i] for _, w in terms]), scale[i]) for i in range(6)
    ]


def _inverse(shifts: list[list[Any]]) -> list[list[Any]]:
    """L^-1 of a lower triangle with ones on its diagonal."""
    m = len(shifts)
    inverse: list[list[Any]] = [[int(i == j) for j in range(m)] for i in range(m)]
    for i in range(m):
        for j in range(i):
            if is_zero(shifts[i][j]):
                continue
            for k in range(j + 1):
                inverse[i][k] = inverse[i][k] - dot([shifts[i][j]], [inverse[j][k]])
    return inverse


def _less(
    total: Any, a: Sequence[Any], b: Sequence[Any], pivots: Sequence[Any], read: NamedReading
) -> Any:
    """What is left of an entry by the wrenches before."""
    before = [
        read(x) * read(y) * c
        for x, y, c in zip(a, b, pivots, strict=False)
        if not (is_zero(x) or is_zero(y))
    ]
    return total - sp.Add(*before)
