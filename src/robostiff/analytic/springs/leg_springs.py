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
from robostiff.analytic.springs.unit_wrenches import IDLE, UnitWrench, WrenchSearch
from robostiff.elasticity import uniform_beam
from robostiff.frozen import frozen
from robostiff.model import PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record, is_zero
from robostiff.recorded.elimination import WorkingFrame, dot, least_size
from robostiff.recorded.leg import at_samples

_ROUNDING, _CLOSE = 1e-11, 1e-9


#: The square of a spring's load under a wrench, of two wrenches the product of its loads, and its
#: compliance, with the lengths of the part, over a named stiffness.
Contribution = tuple[Any, Any]


def sum_of(contributions: Sequence[Contribution]) -> Any:
    """The sum of contributions; springs that feel the same stand in one bracket."""
    of_load: dict[Any, Any] = {}
    for square, compliance in contributions:
        of_load[square] = of_load.get(square, sp.Integer(0)) + compliance
    return sp.Add(*(square * compliance for square, compliance in of_load.items()))


def _bending_energy(L: Any, across: Any, lever: Any, turning: Any) -> tuple[Any, Any]:
    """Integral of the squared bending moment over a beam: f x + m, by its end's f and m."""
    terms = (across, 3), (lever, 2), (turning, 1)
    present = [(square, L**n / n) for square, n in terms if square != 0]
    if len(present) == 1:
        return present[0]
    return sp.Add(*(square * along for square, along in present)), sp.Integer(1)


def recognised_beam(spring: PlacedSpring, record: Record) -> tuple[Any, dict[str, Any]] | None:
    """Length and products of a uniform slender beam, recognised by its compliance."""
    C: Any = spring.elasticity.compliance
    each = [uniform_beam(x) for x in at_samples(C, record.count)]
    if any(beam is None or beam.shear_y or beam.shear_z for beam in each):
        return None
    along = record.simplify(C[1, 5] * 2 / C[5, 5])
    places = {"EA": 0, "EI_z": 5, "EI_y": 4, "GJ": 3}
    return along, {letter: record.simplify(along / C[i, i]) for letter, i in places.items()}


_SAME = 1e-10
_SHORT = 12  # operations of the compliance of one spring that needs no name, such as l/EA
_CANCELLED = 0.6  # of the operations of a sum, for which it becomes one fraction


class NoUnitWrenchesError(Exception):
    """No basis of unit wrenches was found: the other forms answer."""


@frozen(eq=False)
class ConjugateWrench:
    """A wrench of a leg, conjugate to its others."""

    parts: tuple[tuple[Any, UnitWrench], ...]  # (factor, UnitWrench): whose sum it is
    compliance: Any  # a name, or a short formula
    sample: np.ndarray  # (count,): values of the compliance

    def seen_from(self, place: WorkingFrame | np.ndarray, search: WrenchSearch) -> list[Any]:
        """Its six entries in a frame, about its origin, or about a point in world axes."""
        each = [w.seen_from(place, search) for _, w in self.parts]
        factors = [f for f, _ in self.parts]
        columns = zip(*each, search.scale, strict=True)
        return [search.record.simplify(dot(factors, own), scale) for *own, scale in columns]


@frozen(eq=False)
class BlockSprings:
    """Parallel branches as a spring."""

    frame: WorkingFrame  # in which wrenches are compared
    columns: tuple[list[Any], ...]  # its wrenches there
    compliances: tuple[Any, ...]
    search: WrenchSearch

    def shares(self, wrench: UnitWrench) -> list[Any]:
        """What of each of its wrenches makes up a given one."""
        return shares_of(self.columns, wrench.seen_from(self.frame, self.search), self.search)


@dataclass
class LegReader:
    """Reads legs as sums of springs, in one set of names."""

    search: WrenchSearch
    read: NamedReading
    _named: list[tuple[np.ndarray, Any]] = field(default_factory=list)
    _shifts: list[tuple[np.ndarray, Any]] = field(default_factory=list)
    _blocks: dict[int, BlockSprings] = field(default_factory=dict)

    def contributions(
        self, leg: PlacedLeg, a: UnitWrench, b: UnitWrench
    ) -> tuple[Contribution, ...]:
        """What the springs and drives of a leg add to a^T C b, base to platform."""
        found, record = list[Contribution](), self.search.record
        beams = {id(x): recognised_beam(x, record) for x in leg.springs}
        for beam in filter(None, beams.values()):
            self.read.length(beam[0])  # named before anything is written with it
        for part in leg.elements:
            if isinstance(part, PlacedSpring):
                frame = WorkingFrame(part.rotation, part.point)
                load = a.seen_from(frame, self.search)
                both = load, load if b is a else b.seen_from(frame, self.search)
                beam = beams[id(part)]
                found += self.of_spring(both, beam, part.elasticity.compliance)
            elif isinstance(part, PlacedBlock):
                block = self.block(part)
                shares = [block.shares(w) for w in (a, b)]
                for x, y, c in zip(*shares, block.compliances, strict=True):
                    found.append((self._sum((x, y)), c))
            elif isinstance(part, PlacedFreedom) and part.stiffness is not None:
                work = [w.work_on(part, self.search) for w in (a, b)]
                found.append(self.of_drive(work, part.stiffness))
        return tuple(x for x in found if x[0] != 0)

    def of_spring(
        self, both: Sequence[list[Any]], beam: Any, compliance: Any
    ) -> list[Contribution]:
        """What an elastic part adds by what it feels of two wrenches."""
        if beam:
            return self._of_beam(both, *beam)
        (w, v), C, read = both, compliance, self.read
        at = at_samples(C, self.search.record.count)
        found, groups = list[Contribution](), list[set[int]]()
        for i in (i for i in range(6) if not is_zero(C[i, i])):  # what the compliance couples
            own = {i} | {j for j in range(6) if not is_zero(C[i, j])}
            for other in [g for g in groups if g & own]:
                own |= other
                groups.remove(other)
            groups.append(own)
        for block in ([0, 1, 2], [3, 4, 5]):
            others = [j for j in range(6) if j not in block]
            own = at[:, block][:, :, block]
            off, size = own - own[:, :1, :1] * np.eye(3), np.abs(own[:, 0, 0])[:, None, None]
            if np.all(np.abs(off) <= _ROUNDING * size) and np.all(at[:, block][:, :, others] == 0):
                square = self._sum(*((w[i], v[i]) for i in block))  # alike in all directions
                found.append((square, read(C[block[0], block[0]])))
                continue
            for group in (sorted(g) for g in groups if min(g) in block):
                terms = (read(w[i]) * read(v[j]) * read(C[i, j]) for i in group for j in group)
                found.append((sp.Add(*terms), sp.Integer(1)))
        return found

    def of_drive(self, work: Sequence[Any], stiffness: Any) -> Contribution:
        """What a drive adds by the work of two wrenches on it."""
        return self._sum((work[0], work[1])), 1 / self.read(stiffness)

    def _of_beam(
        self, both: Sequence[list[Any]], along: Any, products: dict[str, Any]
    ) -> list[Contribution]:
        (fx, fy, fz, mx, my, mz), (gx, gy, gz, nx, ny, nz) = both
        L = self.read.length(along)
        of_beam = {letter: self.read(x) for letter, x in products.items()}
        total = self._sum
        found = [(total((fx, gx)), L, "EA")]
        if of_beam["EI_z"] == of_beam["EI_y"]:
            levers = [(fy, nz), (mz, gy), (-fz, ny), (-my, gz)]
            turning = total((my, ny), (mz, nz))
            if both[0] is both[1] and all(is_zero(f) for f in both[0][:3]):
                # A unit couple, of which the rest bends.
                turning = min(turning, 1 - total((mx, nx)), key=count_of)
            bent = total((fy, gy), (fz, gz)), total(*levers), turning
            found.append((*_bending_energy(L, *bent), "EI_z"))
        else:
            for f, g, m, n, letter in ((fy, gy, mz, nz, "EI_z"), (fz, gz, -my, -ny, "EI_y")):
                bent = total((f, g)), total((f, n), (m, g)), total((m, n))
                found.append((*_bending_energy(L, *bent), letter))
        found.append((total((mx, nx)), L, "GJ"))
        return [(square, x / of_beam[letter]) for square, x, letter in found if square != 0]

    def _sum(self, *pairs: tuple[Any, Any]) -> Any:
        """A sum of products, simplified as a whole or left as it is, whichever is shorter."""
        pairs = tuple((x, y) for x, y in pairs if not (is_zero(x) or is_zero(y)))
        total: Any = sum((x * y for x, y in pairs), sp.Integer(0))
        simpler = self.search.record.simplify(total, self.search.length)
        if not isinstance(simpler, Entry):
            return self.read(simpler)
        for other, name in getattr(self.read, "known", ()):  # scalars of a generic leg
            if np.max(np.abs(simpler.sample - other**2)) <= _CLOSE * np.max(np.abs(other)) ** 2:
                return name**2
        apart = sp.Add(*(self.read(x) * self.read(y) for x, y in pairs))
        found = [apart] if len(pairs) == 1 else [apart, self.read.fraction(apart)]
        if simpler.step != total.step:
            found.append(self.read(simpler))
        return min(found, key=count_of)

    def of(self, leg: PlacedLeg) -> tuple[ConjugateWrench, ...]:
        """The wrenches by which a leg holds the platform, forces first.

        Raises
        ------
        NoUnitWrenchesError
        FormulaTooLargeError
            When more pairs of them share energy than there are wrenches.
        """
        basis = self.search.basis(leg)
        if basis is None:
            raise NoUnitWrenchesError
        units = basis.wrenches
        if basis.couplings > len(units):
            raise FormulaTooLargeError.beyond(len(units))

        def shared(i: int, j: int) -> Any:
            return sum_of(self.contributions(leg, units[i], units[j]))

        shifts, values, compliances = self._conjugate(basis.compliance, shared)
        # Rows of L^-1, a lower triangle with ones on its diagonal.
        rows: list[list[Any]] = [
            [int(i == j) for j in range(len(units))] for i in range(len(units))
        ]
        wrenches = []
        for i, row in enumerate(rows):
            for j in (j for j in range(i) if not is_zero(shifts[i][j])):
                for k in range(j + 1):
                    row[k] = row[k] - dot([shifts[i][j]], [rows[j][k]])
            parts = []
            for x, w in zip(row, units, strict=True):
                if isinstance(x, Entry) and x.record.cost([x.step]) > 1:
                    # What several shifts make together, as one.
                    parts.append((self._shift(x.sample, lambda x=x: self.read(x)), w))
                elif not is_zero(x):
                    parts.append((x, w))
            wrenches.append(ConjugateWrench(tuple(parts), compliances[i], values[:, i]))
        return tuple(sorted(wrenches, key=lambda one: all(w.point is None for _, w in one.parts)))

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
                shared = A[:, i, j] - np.einsum("nk,nk,nk->n", L[:, i, :j], L[:, j, :j], D[:, :j])
                size = np.sqrt(A[:, i, i] * D[:, j])
                if np.max(np.abs(shared) / size) <= IDLE:
                    continue
                L[:, i, j] = shared / D[:, j]
                shifts[i][j] = self._shift(
                    L[:, i, j],
                    lambda i=i, j=j: self.read.quotient(
                        _less(entry(i, j), shifts[i], shifts[j], pivots, self.read), pivots[j]
                    ),
                )
            D[:, i] = A[:, i, i] - np.einsum("nk,nk,nk->n", L[:, i, :i], L[:, i, :i], D[:, :i])
            if np.min(D[:, i]) <= 0:
                raise NoUnitWrenchesError
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

    def block(self, block: PlacedBlock) -> BlockSprings:
        """Parallel branches as a spring, their stiffnesses added: sum of u u^T / c."""
        if id(block) in self._blocks:
            return self._blocks[id(block)]
        search, record = self.search, self.search.record
        as_leg = PlacedLeg(block.name, (block,), block.branches[0].end)
        wrenches = [w for branch in block.branches for w in self.of(branch)]
        if search.sampled(as_leg).transmitted == len(wrenches):
            # All of them together are a basis, and share no energy.
            frame = self._frame(block, [u for w in wrenches for _, u in w.parts])
            columns = tuple(w.seen_from(frame, search) for w in wrenches)
            found = BlockSprings(frame, columns, tuple(w.compliance for w in wrenches), search)
            self._blocks[id(block)] = found
            return found
        basis = search.basis(as_leg)
        if basis is None:
            raise NoUnitWrenchesError
        units = basis.wrenches[::-1]  # forces first: they are moved by couples
        frame = self._frame(block, units)
        columns = [w.seen_from(frame, search) for w in units]
        shares = [shares_of(columns, w.seen_from(frame, search), search) for w in wrenches]
        at = at_samples(shares, record.count).reshape(record.count, len(wrenches), len(units))
        compliances = np.stack([w.sample for w in wrenches], axis=1)

        def added(i: int, j: int) -> Any:
            of_compliance: dict[Any, Any] = {}
            for w, share in zip(wrenches, shares, strict=True):
                so_far = of_compliance.get(w.compliance, 0)
                of_compliance[w.compliance] = so_far + share[i] * share[j]
            terms = [self.read(record.simplify(x)) / c for c, x in of_compliance.items()]
            return sp.Add(*terms)

        D = np.einsum("nbi,nb,nbj->nij", at, 1 / compliances, at)
        shifts, _, stiffnesses = self._conjugate(D, added, are_stiffnesses=True)
        # Rows of L^T: the wrench with which each stiffness comes.
        sample = []
        for i, column in enumerate(columns):
            later = [row[i] for row in shifts[i + 1 :]]
            moved = [dot(later, [c[r] for c in columns[i + 1 :]]) for r in range(6)]
            whole = (x if is_zero(y) else x + y for x, y in zip(column, moved, strict=True))
            sample.append([*map(record.simplify, whole, search.scale)])
        found = BlockSprings(frame, tuple(sample), tuple(1 / k for k in stiffnesses), search)
        self._blocks[id(block)] = found
        return found

    def _frame(self, block: PlacedBlock, units: Sequence[UnitWrench]) -> WorkingFrame:
        """A frame in which wrenches look simple: that of a spring, or the world's."""
        parts = [part for branch in block.branches for part in branch.springs]
        world = np.eye(3, dtype=int).astype(object)
        frames = [WorkingFrame(part.rotation, part.point) for part in parts]
        frames.append(WorkingFrame(world, block.branches[0].end))

        def entries(frame: WorkingFrame) -> int:
            seen = [x for w in units for x in w.seen_from(frame, self.search)]
            return sum(isinstance(x, Entry) for x in seen)

        return min(frames, key=entries)


def shares_of(columns: Sequence[list[Any]], w: list[Any], search: WrenchSearch) -> list[Any]:
    """Factors by which wrenches make up another, by elimination with safe pivots.

    Raises
    ------
    NoUnitWrenchesError
        When they do not.
    """
    record, m = search.record, len(columns)
    scale = search.scale
    rows = [[*(column[r] for column in columns), w[r]] for r in range(6)]
    taken: list[int] = []
    for k in range(m):
        open_rows = [r for r in range(6) if r not in taken and not is_zero(rows[r][k])]
        if not open_rows:
            raise NoUnitWrenchesError

        def awkwardness(r: int, k: int = k) -> tuple[int, int, float]:
            used = sum(isinstance(x, Entry) for x in rows[r])
            return isinstance(rows[r][k], Entry), used, -least_size(rows[r][k]) / scale[r]

        pivot = min(open_rows, key=awkwardness)
        taken.append(pivot)
        divisor = rows[pivot][k]
        rows[pivot] = [record.simplify(x / divisor) for x in rows[pivot]]
        for r in range(6):
            factor = rows[r][k]
            if r != pivot and not is_zero(factor):
                rows[r] = [
                    record.simplify(x - dot([factor], [y]), scale[r])
                    for x, y in zip(rows[r], rows[pivot], strict=True)
                ]
    return [rows[r][m] for r in taken]


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
