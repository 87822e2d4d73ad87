"""The compliance that a unit wrench meets: a sum of contributions, each of a named spring.

Traction, bending and torsion of a beam, a drive, a joint's elasticity: each is the square of what
the spring feels of the wrench over its stiffness, and stays a term of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.definition import count_of
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.springs.unit_wrenches import UnitWrench
from robostiff.model import PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record, is_zero
from robostiff.recorded.leg import at_samples

_SAME, _CLOSE = 1e-11, 1e-9


#: The square of a spring's load under a wrench, of two wrenches the product of its loads, and its
#: compliance, with the lengths of the part, over a named stiffness.
Contribution = tuple[Any, Any]


def summed(contributions: Sequence[Contribution]) -> Any:
    """The sum of contributions; springs that feel the same stand in one bracket."""
    of_load: dict[Any, Any] = {}
    for square, compliance in contributions:
        of_load[square] = of_load.get(square, sp.Integer(0)) + compliance
    return sp.Add(*(square * compliance for square, compliance in of_load.items()))


@dataclass(frozen=True)
class ContributionReader:
    """Writes the contributions of legs in one set of names."""

    record: Record
    length: float  # characteristic length [m]
    read: NamedReading
    # a parallel block as a spring: `compliances` of its wrenches, and what `shares` of them make up
    # a given one; None where there are none
    of_block: Callable[[PlacedBlock], Any] | None = None

    def of(self, leg: PlacedLeg, a: UnitWrench, b: UnitWrench) -> tuple[Contribution, ...]:
        """What the springs and drives of a leg add to a^T C b, base to platform."""
        found: list[Contribution] = []
        beams = {id(x): recognised_beam(x, self.record) for x in leg.springs}
        for beam in filter(None, beams.values()):
            self.read.length(beam[0])  # named before anything is written with it
        for part in leg.elements:
            if isinstance(part, PlacedSpring):
                load = a.load_on(part, self.record, self.length)
                both = load, load if b is a else b.load_on(part, self.record, self.length)
                beam = beams[id(part)]
                found += self.of_spring(both, beam, part.elasticity.compliance)
            elif isinstance(part, PlacedBlock) and self.of_block:
                block = self.of_block(part)
                shares = [block.shares(w) for w in (a, b)]
                for x, y, c in zip(*shares, block.compliances, strict=True):
                    found.append((self._sum((x, y)), c))
            elif isinstance(part, PlacedFreedom) and part.stiffness is not None:
                work = [w.work_on(part, self.record, self.length) for w in (a, b)]
                found.append(self.of_drive(work, part.stiffness))
        return tuple(x for x in found if x[0] != 0)

    def of_spring(
        self, both: Sequence[list[Any]], beam: Any, compliance: Any
    ) -> list[Contribution]:
        """What an elastic part adds by what it feels of two wrenches."""
        return self._of_beam(both, *beam) if beam else self._of_matrix(both, compliance)

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
            found.append((*_bent(L, *bent), "EI_z"))
        else:
            for f, g, m, n, letter in ((fy, gy, mz, nz, "EI_z"), (fz, gz, -my, -ny, "EI_y")):
                bent = total((f, g)), total((f, n), (m, g)), total((m, n))
                found.append((*_bent(L, *bent), letter))
        found.append((total((mx, nx)), L, "GJ"))
        return [(square, x / of_beam[letter]) for square, x, letter in found if square != 0]

    def _of_matrix(self, both: Sequence[list[Any]], C: Any) -> list[Contribution]:
        """Contributions of any elastic part: what its compliance couples comes together."""
        w, v = both
        found = []
        for block in ([0, 1, 2], [3, 4, 5]):
            if _is_isotropic(C, block, self.record):
                square = self._sum(*((w[i], v[i]) for i in block))
                compliance = self.read(C[block[0], block[0]])
                found.append((square, compliance))
                continue
            for group in _coupled(C, block):
                terms = [
                    self.read(w[i]) * self.read(v[j]) * self.read(C[i, j])
                    for i in group
                    for j in group
                ]
                found.append((sp.Add(*terms), sp.Integer(1)))
        return found

    def _sum(self, *pairs: tuple[Any, Any]) -> Any:
        """A sum of products, simplified as a whole or left as it is, whichever is shorter."""
        pairs = tuple((x, y) for x, y in pairs if not (is_zero(x) or is_zero(y)))
        total: Any = sum((x * y for x, y in pairs), sp.Integer(0))
        simpler = self.record.simplified(total, self.length)
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


def _bent(L: Any, across: Any, lever: Any, turning: Any) -> tuple[Any, Any]:
    """Integral of the squared bending moment over a beam: f x + m, by its end's f and m."""
    terms = (across, 3), (lever, 2), (turning, 1)
    present = [(square, L**n / n) for square, n in terms if square != 0]
    if len(present) == 1:
        return present[0]
    return sp.Add(*(square * along for square, along in present)), sp.Integer(1)


def recognised_beam(spring: PlacedSpring, record: Record) -> tuple[Any, dict[str, Any]] | None:
    """Length and products of a uniform slender beam, recognised by its compliance."""
    C: Any = spring.elasticity.compliance
    at = at_samples(C, record.count)
    c = {i: at[:, i, i] for i in range(6)}
    if min(np.min(np.abs(x)) for x in c.values()) <= 0 or np.min(np.abs(at[:, 1, 5])) <= 0:
        return None
    L = 2 * at[:, 1, 5] / c[5]
    expected = np.zeros_like(at)
    for i in (0, 3, 4, 5):
        expected[:, i, i] = c[i]
    expected[:, 1, 1], expected[:, 2, 2] = L**2 / 3 * c[5], L**2 / 3 * c[4]
    expected[:, 1, 5] = expected[:, 5, 1] = L / 2 * c[5]
    expected[:, 2, 4] = expected[:, 4, 2] = -L / 2 * c[4]
    if np.any(np.abs(at - expected) > _SAME * np.abs(expected)):
        return None
    along = record.simplified(C[1, 5] * 2 / C[5, 5])
    places = {"EA": 0, "EI_z": 5, "EI_y": 4, "GJ": 3}
    return along, {letter: record.simplified(along / C[i, i]) for letter, i in places.items()}


def _is_isotropic(C: Any, block: list[int], record: Record) -> bool:
    at = at_samples(C, record.count)
    others = [j for j in range(6) if j not in block]
    own = at[:, block][:, :, block]
    alike = own[:, :1, :1] * np.eye(3)
    size = np.abs(own[:, 0, 0])[:, None, None]
    return bool(
        np.all(np.abs(own - alike) <= _SAME * size) and np.all(at[:, block][:, :, others] == 0)
    )


def _coupled(C: Any, block: list[int]) -> list[list[int]]:
    """Groups of directions that a compliance couples, each listed where its first one stands."""
    groups: list[set[int]] = []
    for i in range(6):
        own = {i} | {j for j in range(6) if not is_zero(C[i, j])}
        if is_zero(C[i, i]):
            continue
        for other in [g for g in groups if g & own]:
            own |= other
            groups.remove(other)
        groups.append(own)
    return [sorted(g) for g in groups if min(g) in block]
