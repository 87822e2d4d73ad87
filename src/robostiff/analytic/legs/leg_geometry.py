"""A leg in axes of its own, in which its joints are simplest, and its compliance there in names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.definition import Definition, used_definitions
from robostiff.analytic.exact.operation_count import count_of
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.reading.record_reading import StepReading
from robostiff.analytic.springs.contributions import (
    BeamProducts,
    ContributionReader,
    recognised_beam,
    summed,
)
from robostiff.analytic.springs.unit_wrenches import SampledLeg, WrenchSearch
from robostiff.errors import InputError
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry
from robostiff.recorded import RecordedLeg, RecordedRobot
from robostiff.recorded.leg import at_samples
from robostiff.recorded.working_frame import (
    LocalLeg,
    LocalSpring,
    WorkingFrame,
    energy_of,
    local_leg,
    working_frames,
)
from robostiff.spatial import Space

_NOTHING = 1e-12


@dataclass(frozen=True)
class LegGeometry:
    """A leg in its own axes, as entries of the record."""

    placed: PlacedRobot
    own: PlacedLeg
    frame: WorkingFrame
    local: LocalLeg
    felt: list[list[list[Any]]]  # what each spring feels of a unit wrench along each row
    # length and products of each spring that is a beam; None otherwise
    beams: list[tuple[Any, dict[str, Any]] | None]

    @classmethod
    def of(cls, own: PlacedLeg, placed: PlacedRobot) -> LegGeometry:
        """In the axes of one of its parts in which compliance and joints have fewest entries."""
        record, length = placed.record, placed.length
        frame, local = _simplest(own, placed)
        local = replace(local, springs=[_unturned(x, record.count) for x in local.springs])
        units = [[int(k == row) for k in range(6)] for row in placed.entries.space.rows]
        felt = [
            [[record.simplified(x, length) for x in spring.wrench(w)] for w in units]
            for spring in local.springs
        ]
        beams = [recognised_beam(spring, record) for spring in own.springs]
        return cls(placed, own, frame, local, felt, beams)

    @property
    def arm(self) -> np.ndarray:
        """From the reference point to the origin of the axes (3,)."""
        return self.frame.p - self.placed.reference

    @property
    def entries(self) -> list[Any]:
        """Everything that is read."""
        found = [x for spring in self.felt for w in spring for x in w]
        found += [x for twist in self.local.twists for x in twist]
        found += [x for twist, k in self.local.drives for x in (*twist, k)]
        for spring, beam in zip(self.local.springs, self.beams, strict=True):
            found += [beam[0], *beam[1].values()] if beam else [*spring.compliance.flat]
        return [*found, *self.frame.R.flat, *self.arm]

    def check_elastic(self) -> None:
        """Raise `InputError` where the leg is rigid in a direction."""
        placed, n = self.placed, self.placed.entries.space.size
        around = WrenchSearch(placed.record, placed.reference, placed.entries.space, placed.length)
        sample = SampledLeg.of(self.own, around)
        rank = n if sample is None else sample.elastic_directions
        if rank < n:
            raise InputError(
                f"K^0 of leg {self.own.name!r}",
                got=f"springs that yield in {rank} of {n} directions with the passive joints held",
                expected="elastic parts in all directions: K^0 is the inverse of their compliance",
                hint="write derive(robot), which needs no inverse; "
                "or give the links as beams, as gough-stewart-b-beams has them",
            )

    def compliance(self, read: Any, most: int | None = None) -> list[list[Any]]:
        """C in names: for each entry what each spring and drive contributes, nothing combined.

        Raises
        ------
        FormulaTooLargeError
            As soon as its different entries have more operations than `most`.
        """
        rows = self.placed.entries.space.rows
        n = len(rows)
        record, length = self.placed.record, self.placed.length
        reader = ContributionReader(record, length, read, BeamProducts(read))
        for beam in filter(None, self.beams):
            read.length(beam[0])  # named before anything is written with it
        C: list[list[Any]] = [[sp.Integer(0)] * n for _ in range(n)]
        operations: dict[Any, int] = {}
        written: dict[Any, Any] = {}  # by what they are multiplied out, each up to its sign
        for i in range(n):
            for j in range(i, n):
                found = [
                    one
                    for k, spring in enumerate(self.own.springs)
                    for one in reader.of_spring(
                        spring.name,
                        (self.felt[k][i], self.felt[k][j]),
                        self.beams[k],
                        self.local.springs[k].compliance,
                    )
                ]
                for twist, stiffness in self.local.drives:
                    found.append(
                        reader.of_drive("drive", (twist[rows[i]], twist[rows[j]]), stiffness)
                    )
                entry = summed([x for x in found if x.felt != 0])
                plain = sp.expand(entry)
                entry = -written[-plain] if -plain in written else written.setdefault(plain, entry)
                C[i][j] = C[j][i] = entry
                operations[entry] = count_of(entry)
                if most is not None and sum(operations.values()) > most:
                    raise FormulaTooLargeError.beyond(most)
        return C


class LegInSteps:
    """Reads the entries of a leg in named steps, which are never long."""

    def __init__(self, geometry: LegGeometry) -> None:
        placed = geometry.placed
        self._read = StepReading(placed.record, placed.symbols, geometry.entries)
        self.definitions: list[Definition] = [*placed.springs, *self._read.definitions]
        self._taken = {*placed.symbols, *(d.symbol.name for d in self.definitions)}

    def __call__(self, value: Any) -> Any:
        """The expression of an entry."""
        return self._read(value)

    def fraction(self, expression: Any) -> Any:
        """An expression of what was read, as it is."""
        return expression

    def length(self, value: Any) -> Any:
        """A length; it has a name where it is used twice."""
        return self._read(value)

    def are_free(self, names: Iterable[str]) -> bool:
        """Whether names stand for nothing else."""
        return self._taken.isdisjoint(names)

    def define(self, letter: str, expression: Any, own: str | None = None, part: str = "") -> Any:
        """A further name."""
        symbol = sp.Symbol(own or letter, positive=True)
        if all(d.symbol != symbol for d in self.definitions):
            self.definitions.append(Definition(symbol, expression, (part,) if part else ()))
        return symbol


def _simplest(own: PlacedLeg, placed: PlacedRobot) -> tuple[WorkingFrame, LocalLeg]:
    """The axes in which compliance and joints have fewest entries, near the platform if alike."""
    space, record = placed.entries.space, placed.record
    world = WorkingFrame(np.eye(3, dtype=int).astype(object), placed.reference)
    best: tuple[Any, WorkingFrame, LocalLeg] | None = None
    for number, one in enumerate(working_frames(own, world)):
        frame = one
        if space is Space.PLANAR:
            if record.simplified(one.R[2, 2]) != 1:
                continue
            in_plane = np.array([*one.p[:2], placed.reference[2]], dtype=object)
            frame = WorkingFrame(one.R, in_plane)
        local = local_leg(own, frame, record, placed.length)
        J, C = _sampled_leg(local, placed)
        entries = int(np.sum(np.max(np.abs(J), axis=0) > _NOTHING)) if J.size else 0
        entries += int(np.sum(np.max(np.abs(C), axis=0) > _NOTHING * np.max(np.abs(C))))
        cost = (local.entries + entries, -number)
        if best is None or cost < best[0]:
            best = cost, frame, local
    if best is None:
        raise InputError(f"leg {own.name!r}", expected="axes in the plane of the robot")
    return best[1], best[2]


def _unturned(spring: LocalSpring, count: int) -> LocalSpring:
    """A spring that is alike in all directions, in the axes of the leg."""
    C = at_samples(spring.compliance, count)
    each = np.repeat(C[:, [0, 3], [0, 3]], 3, axis=1)
    if np.max(np.abs(C - each[:, :, None] * np.eye(6))) > _NOTHING * np.max(np.abs(C)):
        return spring
    return replace(spring, R=np.eye(3, dtype=int).astype(object))


def _sampled_leg(local: LocalLeg, placed: PlacedRobot) -> tuple[np.ndarray, np.ndarray]:
    """J_q and C in the leg's axes at the samples; rotations at the characteristic length."""
    rows = placed.entries.space.rows
    count = placed.record.count
    scale = np.array([1.0 if row < 3 else placed.length for row in rows])
    J = at_samples([[t[i] for i in rows] for t in local.twists], count)
    J = J.reshape(count, len(local.twists), len(rows)) * scale
    energy = energy_of(local, np.eye(len(rows), dtype=int).tolist(), rows)
    return J, at_samples(energy, count) / scale[:, None] / scale


def passive_freedoms(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the passive freedoms of a leg, those of its springs and blocks included.

    Blocks after the first add one for what they leave free together with it.
    """
    names = []
    for element in leg.own_parts:
        if isinstance(element, PlacedFreedom):
            if element.is_passive:
                names.append(element.name)
        else:
            count = element.elasticity.freedoms.shape[1]
            names += [f"{element.name}.free[{i}]" for i in range(count)]
    for block in leg.blocks:
        for branch in block.branches:
            names += passive_freedoms(branch)
    return (*names, *(f"{block.name}.free" for block in leg.blocks[1:]))


def elastic_parts(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the springs and of the drives with a stiffness."""
    return tuple(
        part.name
        for part in leg.parts
        if isinstance(part, PlacedSpring) or part.stiffness is not None
    )


def shared_out(
    definitions: Sequence[Definition], parts: Sequence[Iterable[sp.Expr]]
) -> list[tuple[Definition, ...]]:
    """For each part the definitions that it is the first to need, in order.

    Examples
    --------
    >>> a, b, c = sp.symbols("a b c")
    >>> definitions = (Definition(b, a + 1), Definition(c, b**2))
    >>> [[str(d.symbol) for d in own] for own in shared_out(definitions, [[b], [c], [a]])]
    [['b'], ['c'], []]
    """
    shared: list[tuple[Definition, ...]] = []
    for results in parts:
        before = {d.symbol for own in shared for d in own}
        own = used_definitions(definitions, results)
        shared.append(tuple(d for d in own if d.symbol not in before))
    return shared


def give_names(leg: RecordedLeg, number: int) -> None:
    """Names for wrenches w and compliances c."""
    several = len(leg.wrenches) > 1
    for k, (w, mu) in enumerate(zip(leg.wrenches, leg.mu, strict=True), start=1):
        own = f"{number}_{k}" if several else f"{number}"
        if isinstance(mu, Entry):
            mu.named(f"c_{own}")
        for i, x in enumerate(w, start=1):
            if isinstance(x, Entry):
                x.named(f"w_{own}_{i}")


def facts_of(placed: PlacedLeg, redundant: Sequence[bool]) -> dict[str, Any]:
    """Names of a leg, its passive freedoms, which of them are redundant, and its elastic parts."""
    return _facts(placed.name, passive_freedoms(placed), redundant, elastic_parts(placed))


def facts_of_robot(placed: PlacedRobot, recorded: RecordedRobot) -> list[dict[str, Any]]:
    """Facts of each leg; of legs on a flexible platform together with its parts."""
    legs = [own.leg for own in placed.legs]
    if placed.robot.platform is None:
        return [facts_of(leg, own.redundant) for leg, own in zip(legs, recorded.legs, strict=True)]
    (whole,) = recorded.legs
    joints = tuple(f"{leg.name}/{joint}" for leg in legs for joint in passive_freedoms(leg))
    parts = [f"platform/{part.name}" for part in placed.robot.platform.parts]
    elastic = (f"{leg.name}/{part}" for leg in legs for part in elastic_parts(leg))
    name = "all legs, on the flexible platform"
    return [_facts(name, joints, whole.redundant, (*elastic, *parts))]


def _facts(
    name: str, joints: tuple[str, ...], redundant: Sequence[bool], elastic: tuple[str, ...]
) -> dict[str, Any]:
    lost = tuple(joint for joint, own in zip(joints, redundant, strict=True) if own)
    return {"name": name, "joints": joints, "redundant": lost, "elastic": elastic}
