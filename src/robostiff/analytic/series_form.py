"""A serial arm as a textbook has it: its compliance, a sum over the springs, and K its inverse.

Entry by entry where that is short, otherwise in vectors: each drive by its twist, each beam by its
compliance about its middle.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.definition import used_definitions
from robostiff.analytic.exact.operation_count import count_of
from robostiff.analytic.exact.trigonometry import shortest_trigonometry
from robostiff.analytic.legs.leg_geometry import LegGeometry
from robostiff.analytic.placement.agreement import check_form
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.placement.robot_pose import exact_angle
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.springs.contributions import BeamProducts, recognised_beam
from robostiff.analytic.vectors.forms import ArmOfSprings, InSeries
from robostiff.analytic.vectors.vector_expressions import (
    Coordinates,
    Cross,
    Equation,
    Stacked,
    Sum,
    Turned,
    Turns,
    Vector,
    VectorExpression,
)
from robostiff.errors import InputError
from robostiff.model import Joint, JointKind, Link, PlacedSpring, Rigid, StiffnessLaw, Telescope
from robostiff.record import Entry
from robostiff.spatial import Screw, exact_number

_PRINTED = 500  # operations of a compliance beyond which it is not printed
_WHOLE = 1e-9


def series_form(placed: PlacedRobot) -> InSeries | ArmOfSprings | None:
    """The compliance of an arm without passive joints; None of others, and where it is rigid.

    Raises
    ------
    DisagreementError
        When it differs from the numerical form at random parameters and poses.
    """
    if not is_arm(placed):
        return None
    own = placed.legs[0].leg
    geometry = LegGeometry.of(own, placed)
    try:
        geometry.check_elastic()
    except InputError:
        return None
    found = _in_entries(geometry) or _Walk(placed).form()
    if found is not None:
        check_form("the sum of springs in series", found.stiffness, placed)
    return found


def is_arm(placed: PlacedRobot, links: int = 0) -> bool:
    """Whether it is an arm without passive joints, of so many elastic links at least."""
    if not placed.robot.is_posed_by_joints:
        return False
    own = placed.legs[0].leg
    passive = any(f.is_passive for f in own.freedoms)
    return not (passive or own.blocks) and len([*own.springs]) >= links


def _in_entries(geometry: LegGeometry) -> InSeries | None:
    """The compliance entry by entry; None where that is long."""
    placed = geometry.placed
    read = NamedReading(placed.record, placed.symbols, placed.springs)
    try:
        C = sp.ImmutableMatrix(geometry.compliance(read, _PRINTED))
        R = sp.ImmutableMatrix(3, 3, [read(x) for x in geometry.frame.R.flat])
        v = sp.ImmutableMatrix([read(x) for x in geometry.arm])
    except FormulaTooLargeError:
        return None
    axes, arm = shortest_trigonometry(R), shortest_trigonometry(v)
    definitions = used_definitions(read.definitions, [*C, *axes, *arm])
    if sum(count_of(x) for x in (*{*C.flat()}, *axes, *arm)) > _PRINTED:
        return None
    return InSeries(definitions, placed.entries.space, C, axes, arm)


class _UnusualPartError(Exception):
    """A part that the vector form of an arm has no equation for."""


class _Walk:
    """Goes along an arm and writes down its rotations, points, twists and beams."""

    def __init__(self, placed: PlacedRobot) -> None:
        self.placed = placed
        self.read = NamedReading(placed.record, placed.symbols, placed.springs)
        self.products = BeamProducts(self.read)
        self.equations: list[Equation] = []
        self.rotation: str | None = None
        self.idle: set[str] = set()  # rotations that turn no vector
        self.terms: list[tuple[int, VectorExpression]] = []
        self.offset = [sp.Integer(0)] * 3
        self.arms: list[tuple[str, VectorExpression]] = []
        self.twists: list[tuple[str, VectorExpression, str | None]] = []
        self.drives: list[tuple[str, str, Any]] = []
        self.beams: list[tuple[str, str, str, tuple[Any, ...]]] = []
        self.counts: dict[str, int] = {}

    def form(self) -> ArmOfSprings | None:
        """The whole arm; None where it has parts that have no equation here."""
        placed = self.placed
        leg = placed.entries.legs[0]
        own = placed.legs[0]
        if leg.chain.couplings or "p" in placed.symbols:
            return None
        try:
            self.go(leg.base.p)
            self.turn(leg.base.R)
            self.along(leg.chain.elements, iter(own.leg.springs), own.coordinate)
            if _turns_of(leg.attachment.R):
                return None
            self.go(-np.array(leg.attachment.p, dtype=object))
            self.go(placed.entries.reference_point)
        except (_UnusualPartError, FormulaTooLargeError):
            return None
        here = self.here()
        # Turns that move neither a spring nor the reference point are left out.
        while self.equations and self.equations[-1].name in self.idle:
            self.equations.pop()
        self.equations.append(Equation("p", here))
        away = (-1, Vector("p"))
        for name, point in self.arms:
            self.equations.append(Equation(name, Sum((*_terms(point), away))))
        for name, e, point in self.twists:
            arm = None if point is None else Cross(Sum(((1, Vector(point)), away)), e)
            self.equations.append(
                Equation(name, Stacked(e, None) if arm is None else Stacked(arm, e))
            )
        of_springs = [c for _, _, c in self.drives] + [x for *_, own in self.beams for x in own]
        used = used_definitions(self.read.definitions, of_springs)
        return ArmOfSprings(
            used,
            placed.entries.space,
            tuple(self.equations),
            tuple(self.drives),
            tuple(self.beams),
        )

    def along(self, elements: Any, springs: Iterator[PlacedSpring], coordinate: Any) -> None:
        """Walk over all elements."""
        place = 0
        for element in elements:
            if isinstance(element, Rigid):
                self.go(element.transform.p)
                self.turn(element.transform.R)
            elif isinstance(element, Link):
                self.beam(next(springs), element.axes, element.to)
            elif isinstance(element, Joint):
                if element.kind is JointKind.SPHERICAL:
                    raise _UnusualPartError
                for screw in element.freedoms:
                    self.freedom(element.name, screw, element.role, coordinate(place))
                    place += 1
            elif isinstance(element, Telescope):
                (screw,) = element.freedoms
                extension = coordinate(place)
                place += 1
                self.freedom(element.name, screw, element.role, extension, slides=not element.beams)
                for beam in element.beams:
                    length = beam.fixed + beam.share * extension
                    self.beam(next(springs), element.axes, element.direction * length)
            else:
                raise _UnusualPartError

    def freedom(self, name: str, screw: Screw, role: Any, q: Any, *, slides: bool = True) -> None:
        """A joint: what it adds to the compliance, and how it moves what follows."""
        if not (screw.is_rotation or screw.is_translation):
            raise _UnusualPartError
        stiffness = getattr(role, "stiffness", None)
        axis = [self.read(x) for x in screw.axis]
        if stiffness is not None:
            if isinstance(stiffness, StiffnessLaw):
                raise _UnusualPartError
            compliance = 1 / self.read(stiffness)
            twist = self.free("t")
            e = self.turned(axis)
            point = self.named_point() if screw.turns else None
            self.twists.append((twist, e, point))
            self.drives.append((name, twist, compliance))
        if screw.turns:
            places = [i for i, x in enumerate(axis) if x != 0]
            if len(places) > 1:
                raise _UnusualPartError
            self.turn_by((("xyz"[places[0]], axis[places[0]] * self.read(q)),))
        elif slides:
            self.go(np.array(screw.axis, dtype=object) * q)

    def beam(self, spring: PlacedSpring, axes: Any, to: Any) -> None:
        """A beam that runs to a point of the present frame."""
        found = recognised_beam(spring, self.placed.record)
        if found is None:
            raise _UnusualPartError
        along, products = found
        named = self.products.of(products)
        value = self.products.value
        turns = _turns_of(axes)
        own = self.free("Q")
        expression: VectorExpression = Turns(turns)
        if self.rotation is not None:
            self.idle.discard(self.rotation)
            expression = Turned(self.rotation, expression) if turns else Vector(self.rotation)
        self.equations.append(Equation(own, expression))
        half = np.array(to, dtype=object) * sp.Rational(1, 2)
        self.go(half)
        middle = self.free("m")
        self.arms.append((middle, self.here()))
        self.go(half)
        of_beam = (
            self.read.length(along),
            *(value(named[x], spring.name) for x in ("EA", "EI_y", "EI_z", "GJ")),
        )
        self.beams.append((spring.name, own, middle, of_beam))

    def go(self, to: Any) -> None:
        """Move to a point of the present frame."""
        self.offset = [a + self.read(b) for a, b in zip(self.offset, to, strict=True)]

    def turn(self, R: Any) -> None:
        """Turn by a constant rotation."""
        self.turn_by(_turns_of(R))

    def turn_by(self, turns: tuple[tuple[str, Any], ...]) -> None:
        """Turn about axes of the present frame."""
        turns = tuple((axis, angle) for axis, angle in turns if angle != 0)
        if not turns:
            return
        self.terms, self.offset = list(_terms(self.here())), [sp.Integer(0)] * 3
        name = self.free("R")
        own = Turns(turns)
        turned = own if self.rotation is None else Turned(self.rotation, own)
        self.equations.append(Equation(name, turned))
        self.rotation = name
        self.idle.add(name)

    def turned(self, vector: list[Any]) -> VectorExpression:
        """A vector of the present frame in the world."""
        own = Coordinates(tuple(vector))
        if self.rotation is None:
            return own
        self.idle.discard(self.rotation)
        return Turned(self.rotation, own)

    def here(self) -> VectorExpression:
        """The present point in the world."""
        moved = any(x != 0 for x in self.offset)
        terms = [*self.terms, *([(1, self.turned(self.offset))] if moved else [])]
        if not terms:
            return Coordinates((sp.Integer(0),) * 3)
        return terms[0][1] if len(terms) == 1 else Sum(tuple(terms))

    def named_point(self) -> str:
        """A name for the present point."""
        here = self.here()
        if isinstance(here, Vector):
            return here.name
        name = self.free("p")
        self.equations.append(Equation(name, here))
        named: list[tuple[int, VectorExpression]] = [(1, Vector(name))]
        self.terms, self.offset = named, [sp.Integer(0)] * 3
        return name

    def free(self, letter: str) -> str:
        """The next name that is no symbol of the robot."""
        while True:
            number = self.counts[letter] = self.counts.get(letter, 0) + 1
            if f"{letter}_{number}" not in self.placed.symbols:
                return f"{letter}_{number}"


def _terms(point: VectorExpression) -> tuple[tuple[int, VectorExpression], ...]:
    return point.terms if isinstance(point, Sum) else ((1, point),)


def _turns_of(R: Any) -> tuple[tuple[str, Any], ...]:
    """A constant rotation as turns about coordinate axes."""
    if any(isinstance(x, Entry) for x in np.ravel(R)):
        raise _UnusualPartError
    A = np.array([float(exact_number(x)) for x in np.ravel(R)]).reshape(3, 3)
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        if abs(A[axis, axis] - 1) < _WHOLE:
            angle = exact_angle(float(np.arctan2(A[j, i], A[i, i])))
            return (("xyz"[axis], angle),) if angle != 0 else ()
    # Rz(a) Ry(b) Rx(c)
    b = float(np.arcsin(np.clip(-A[2, 0], -1, 1)))
    if abs(np.cos(b)) < _WHOLE:
        a, c = float(np.arctan2(-A[0, 1], A[1, 1])), 0.0
    else:
        a, c = float(np.arctan2(A[1, 0], A[0, 0])), float(np.arctan2(A[2, 1], A[2, 2]))
    found = (("z", exact_angle(a)), ("y", exact_angle(b)), ("x", exact_angle(c)))
    return tuple((axis, angle) for axis, angle in found if angle != 0)
