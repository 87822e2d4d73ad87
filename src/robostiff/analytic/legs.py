"""The passive joints of one leg, eliminated one after the other in axes of its own, eq. (15)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp
from scipy.sparse.csgraph import connected_components

from robostiff.analytic.budget import (
    BUDGET,
    FormulaTooLargeError,
    OutOfTimeError,
    checked_budget,
    within,
)
from robostiff.analytic.calculus import compliance_formula
from robostiff.analytic.chain import Closed, Steps, derive_chain
from robostiff.analytic.derivation import Derivation, LegDerivation
from robostiff.analytic.exact.definition import NamedSteps, Unwritten, count_of, used_definitions
from robostiff.analytic.placement.agreement import numbers_of
from robostiff.analytic.placement.conditions import conditions_of
from robostiff.analytic.placement.robot_placement import PlacedRobot, place_robot
from robostiff.analytic.placement.robot_pose import AtHome, PoseFormula
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.reading.record_reading import StepReading
from robostiff.analytic.reading.rewriting import shortest_trigonometry
from robostiff.analytic.springs.leg_springs import LegReader, recognised_beam, sum_of
from robostiff.analytic.springs.unit_wrenches import WrenchSearch
from robostiff.analytic.vectors.forms import VectorForm, transport
from robostiff.analytic.vectors.vector_form import vector_form
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring, Robot
from robostiff.recorded import RecordedRobot
from robostiff.recorded.elimination import LocalLeg, LocalSpring, WorkingFrame, energy_of, local_leg
from robostiff.recorded.leg import at_samples
from robostiff.spatial import Space

_NOTHING = 1e-12


@frozen
class LegGeometry:
    """A leg in its own axes, as entries of the record."""

    placed: PlacedRobot
    own: PlacedLeg
    frame: WorkingFrame
    local: LocalLeg
    loads: list[list[list[Any]]]  # of each spring under a unit wrench along each row
    # length and products of each spring that is a beam; None otherwise
    beams: list[tuple[Any, dict[str, Any]] | None]

    @classmethod
    def of(cls, leg: PlacedLeg, placed: PlacedRobot) -> LegGeometry:
        """In the axes of one of its parts in which compliance and joints have fewest entries."""
        record, length, space = placed.record, placed.length, placed.entries.space
        rows, count = space.rows, record.count
        scale = np.array([1.0 if row < 3 else length for row in rows])
        best: tuple[Any, WorkingFrame, LocalLeg] | None = None
        frames = WrenchSearch.of(placed).frames(leg)
        for number, frame in enumerate(frames):
            local = local_leg(leg, frame, record, length)
            # J_q and C at the samples; rotations at the characteristic length.
            J = at_samples([[t[i] for i in rows] for t in local.twists], count)
            J = J.reshape(count, len(local.twists), len(rows)) * scale
            energy = energy_of(local, np.eye(len(rows), dtype=int).tolist(), rows)
            C = at_samples(energy, count) / scale[:, None] / scale
            entries = int(np.sum(np.max(np.abs(J), axis=0) > _NOTHING)) if J.size else 0
            entries += int(np.sum(np.max(np.abs(C), axis=0) > _NOTHING * np.max(np.abs(C))))
            cost = (local.entries + entries, -number)
            if best is None or cost < best[0]:  # near the platform if alike
                best = cost, frame, local
        if best is None:
            raise InputError(f"leg {leg.name!r}", expected="axes in the plane of the robot")
        _, frame, local = best
        springs, world = list[LocalSpring](), np.eye(3, dtype=int).astype(object)
        for spring in local.springs:
            # One that is alike in all directions is in the axes of the leg.
            C = at_samples(spring.compliance, count)
            each = np.repeat(C[:, [0, 3], [0, 3]], 3, axis=1)
            is_alike = np.max(np.abs(C - each[:, :, None] * np.eye(6))) <= _NOTHING * np.max(abs(C))
            springs.append(replace(spring, R=world) if is_alike else spring)
        local = replace(local, springs=springs)
        units = [[int(k == row) for k in range(6)] for row in rows]
        loads = [
            [[record.simplify(x, length) for x in spring.wrench(w)] for w in units]
            for spring in local.springs
        ]
        beams = [recognised_beam(spring, record) for spring in leg.springs]
        return cls(placed, leg, frame, local, loads, beams)

    @property
    def arm(self) -> np.ndarray:
        """From the reference point to the origin of the axes (3,)."""
        return self.frame.p - self.placed.reference

    @property
    def entries(self) -> list[Any]:
        """Everything that is read."""
        found = [x for spring in self.loads for w in spring for x in w]
        found += [x for twist in self.local.twists for x in twist]
        found += [x for twist, k in self.local.drives for x in (*twist, k)]
        for spring, beam in zip(self.local.springs, self.beams, strict=True):
            found += [beam[0], *beam[1].values()] if beam else [*spring.compliance.flat]
        return [*found, *self.frame.R.flat, *self.arm]

    @property
    def elastic_directions(self) -> int:
        """In how many directions it yields with its passive joints held."""
        return WrenchSearch.of(self.placed).sampled(self.own).elastic_directions

    def compliance(self, read: Any, most: int | None = None) -> list[list[Any]]:
        """C in names: for each entry what each spring and drive contributes, nothing combined.

        Raises
        ------
        FormulaTooLargeError
            As soon as its different entries have more operations than `most`.
        """
        rows = self.placed.entries.space.rows
        n = len(rows)
        reader = LegReader(WrenchSearch.of(self.placed), read)
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
                        (self.loads[k][i], self.loads[k][j]),
                        self.beams[k],
                        self.local.springs[k].compliance,
                    )
                ]
                for twist, stiffness in self.local.drives:
                    found.append(reader.of_drive((twist[rows[i]], twist[rows[j]]), stiffness))
                entry = sum_of([x for x in found if x[0] != 0])
                plain = sp.expand(entry)
                entry = -written[-plain] if -plain in written else written.setdefault(plain, entry)
                C[i][j] = C[j][i] = entry
                operations[entry] = count_of(entry)
                if most is not None and sum(operations.values()) > most:
                    raise FormulaTooLargeError.beyond(most)
        return C


def _passive_freedoms(leg: PlacedLeg) -> tuple[str, ...]:
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
            names += _passive_freedoms(branch)
    return (*names, *(f"{block.name}.free" for block in leg.blocks[1:]))


def _elastic_parts(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the springs and of the drives with a stiffness."""
    return tuple(
        part.name
        for part in leg.parts
        if isinstance(part, PlacedSpring) or part.stiffness is not None
    )


def bare_leg(placed: PlacedLeg, redundant: Sequence[bool] = ()) -> LegDerivation:
    """A leg by its passive freedoms, those that are redundant, and its elastic parts."""
    joints = _passive_freedoms(placed)
    lost = tuple(
        joint
        for joint, is_lost in zip(joints, redundant or [False] * len(joints), strict=True)
        if is_lost
    )
    return LegDerivation(placed.name, joints, lost, _elastic_parts(placed))


def bare_legs(placed: PlacedRobot, recorded: RecordedRobot) -> list[LegDerivation]:
    """Each leg; of legs on a flexible platform one, together with its parts."""
    legs = [placed_leg.leg for placed_leg in placed.legs]
    if placed.robot.platform is None:
        return [bare_leg(leg, x.redundant) for leg, x in zip(legs, recorded.legs, strict=True)]
    joints = tuple(f"{leg.name}/{joint}" for leg in legs for joint in _passive_freedoms(leg))
    redundant = recorded.legs[0].redundant
    lost = tuple(joint for joint, is_lost in zip(joints, redundant, strict=True) if is_lost)
    elastic = [f"{leg.name}/{part}" for leg in legs for part in _elastic_parts(leg)]
    elastic += [f"platform/{part.name}" for part in placed.robot.platform.parts]
    return [LegDerivation("all legs, on the flexible platform", joints, lost, tuple(elastic))]


_WRITTEN_OUT = 3  # coupled directions of a compliance whose inverse is written out
_SHORT = 2  # operations of an entry of C that needs no name, such as 1/k
_SHARE = 0.25  # of the budget, for names and for steps of the geometry each
_QUESTION = "stiffness of a leg"
_LONGEST_AXIS = 100  # operations of an entry whose sines are made sums of angles
_READABLE = 500  # terms of an entry, beyond which a leg is derived in steps


@frozen
class LegElimination(Derivation):
    """The stiffness of one leg, one passive joint after the other.

    K0 and the stages are in axes of its own; K is about the reference point of the platform, in
    world axes, as all others are.
    """

    leg: str = ""  #: its name
    where: str = ""  #: the pose, in words
    elastic: tuple[str, ...] = ()  #: its elastic parts and drives
    #: sympy.ImmutableMatrix: compliance of these with all passive joints held (n x n); K0 = C^-1
    C: Any = None
    axes: Any = None  #: sympy.ImmutableMatrix: columns: the leg's own axes in the world (3 x 3)
    #: sympy.ImmutableMatrix: from the reference point to the origin of these axes (3 x 1) [m],
    #: world axes
    arm: Any = None
    coordinates: tuple[str, ...] = ()  #: names of the symbols of the pose

    @property
    def space(self) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return Space.of_size(self.K.rows)


def derive_leg(
    robot: Robot,
    leg: str,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
) -> LegElimination:
    """Stiffness of a leg as in Section VI: K^0 = C^-1, then one passive joint after the other.

    The axes are those of a part of the leg in which its joints are simplest, so that many of them
    are trivial or quasi-trivial, eq. (18)-(20); these come first, as the order is arbitrary.

    Parameters
    ----------
    robot : Robot
    leg : str
        Name of the leg.
    pose : AtHome, AtSymbols or AtCoordinates
        Home when left out.
    form : Closed or Steps
        As for `derive_chain`; when left out, closed where that is short, and steps otherwise.
    budget : float or None
        Seconds of computing for a closed form.

    Raises
    ------
    InputError
        When there is no such leg, it has a parallel block, or it is rigid in a direction, so that
        C has no inverse.
    DisagreementError
        When a stage differs from the recursion in numbers at random parameters.
    FormulaTooLargeError
        When a closed form would exceed its limit.
    """
    names = [model.name for model in robot.legs]
    if leg not in names:
        raise InputError(f"leg of {robot.name!r}", got=leg, expected=", ".join(names))
    if budget is not None:
        checked_budget(budget)
    placed = place_robot(robot, AtHome() if pose is None else pose)
    if placed.given is not None:  # before anything is closed that does not reach
        numbers_of(placed)
    placed_leg = placed.legs[names.index(leg)].leg
    if placed_leg.blocks:
        raise InputError(
            f"leg {leg!r}",
            got=Words(f"the parallel block {placed_leg.blocks[0].name!r}"),
            expected="joints and springs in series: K^0 is the inverse of their compliance",
            hint="write derive(robot), which supports blocks",
        )
    geometry = LegGeometry.of(placed_leg, placed)
    n, found = placed.entries.space.size, geometry.elastic_directions
    if found < n:
        raise InputError(
            f"K^0 of leg {leg!r}",
            got=Words(
                f"springs that yield in {found} of {n} directions with the passive joints held"
            ),
            expected="elastic parts in all directions: K^0 is the inverse of their compliance",
            hint="write derive(robot), which needs no inverse; "
            "or give the links as beams, as gough-stewart-b-beams has them",
        )
    closed, share = Closed(_READABLE) if form is None else form, budget and _SHARE * budget

    def in_names() -> LegElimination:
        read = NamedReading(placed.record, placed.symbols, placed.springs)
        return _derivation(geometry, read, closed)

    def in_steps(closed: Closed | Steps = closed) -> LegElimination:
        read = StepReading(placed.record, placed.symbols, geometry.entries, placed.springs)
        return _derivation(geometry, read, closed)

    # The first form that ends: names for lengths, then steps for the geometry, then for all.
    found = None
    for derive in () if isinstance(form, Steps) else (in_names, in_steps):
        try:
            found = within(share, derive, _QUESTION)
            break
        except (FormulaTooLargeError, OutOfTimeError):
            if form is not None and derive is in_steps:
                raise
    found = found or in_steps(Steps())
    # `derive_chain` has compared what is before it.
    numbers_of(placed).check(found.K, found.definitions, names.index(leg))

    def in_vectors() -> VectorForm | None:
        again = place_robot(robot, placed.pose).knowing(found.definitions)
        whole = None if robot.platform else vector_form(again)
        if whole is not None:
            numbers_of(placed).check(whole.K, whole.definitions)
        return whole and whole.of_leg(leg)

    return replace(found, at_vector_level=Unwritten(in_vectors))


def _derivation(geometry: LegGeometry, read: Any, form: Closed | Steps) -> LegElimination:
    placed, local, leg = geometry.placed, geometry.local, geometry.own
    rows = placed.entries.space.rows
    found = geometry.compliance(read)
    twists = zip(_passive_freedoms(leg), local.twists, strict=True)
    joints = dict(
        sorted(
            ((name, [read(twist[i]) for i in rows]) for name, twist in twists),
            key=lambda joint: sum(x != 0 for x in joint[1]),
        )
    )
    R = sp.Matrix(3, 3, [read(x) for x in geometry.frame.R.flat])
    axes = shortest_trigonometry(R, _LONGEST_AXIS)
    arm = shortest_trigonometry(sp.Matrix([read(x) for x in geometry.arm]))
    C = sp.ImmutableMatrix(found)
    steps = NamedSteps(map(str, C.free_symbols), read.definitions)
    if any(entry.is_Add for entry in C.flat()):  # a single beam needs no names
        C = steps.entries(C, "C_", _SHORT)
    # K^0 is written out where few directions are coupled, in named steps otherwise
    pattern = np.array([[int(C[i, j] != 0) for j in range(C.rows)] for i in range(C.rows)])
    coupled = connected_components(pattern, directed=False)[1]
    is_short = np.max(np.bincount(coupled)) <= _WRITTEN_OUT
    K0 = compliance_formula(C) if is_short else steps.inverse(C, "S_", "K_0_")
    chain = derive_chain(K0, joints, form)
    used = used_definitions(
        steps.definitions,
        [sp.sympify(x) for part in (C, K0, axes, arm, *joints.values()) for x in part],
    )
    T = transport(axes, arm, placed.entries.space)
    return LegElimination(
        name=f"K_{leg.name}" if leg.name.isidentifier() else "K_leg",
        K0=chain.K0,
        stages=chain.stages,
        K=sp.ImmutableMatrix(T * chain.K * T.T),
        definitions=(*used, *chain.definitions),
        leg=f"{leg.name} of {placed.robot.name}",
        where=placed.where,
        elastic=_elastic_parts(leg),
        C=C,
        axes=axes,
        arm=arm,
        coordinates=placed.coordinates,
        conditions=Unwritten(lambda: conditions_of(placed, leg.name)),
        meanings=placed.meanings,
    )
