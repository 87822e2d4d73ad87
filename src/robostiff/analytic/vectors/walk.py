"""A walk along the springs and joints of a leg in series: its rotations, points, twists and beams.

Turns are by the angles of the joints. Where the closure gives the axes of all joints in the world,
the axes of a body are those of its joints instead: no angle is needed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.placement.robot_pose import exact_angle
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.springs.leg_springs import recognised_beam
from robostiff.analytic.vectors.vector_expressions import (
    Columns,
    Coordinates,
    Cross,
    Equation,
    Stacked,
    Sum,
    Turned,
    Turns,
    Vector,
    VectorExpression,
    names_in,
)
from robostiff.model import (
    Joint,
    JointKind,
    Link,
    ParallelBlock,
    Passive,
    PlacedSpring,
    Rigid,
    StiffnessLaw,
    Telescope,
)
from robostiff.record import Entry
from robostiff.recorded.leg import at_samples
from robostiff.spatial import Screw, exact_number

_WHOLE = 1e-9
_ZERO = Coordinates(0, 0, 0)
_Turns = tuple[tuple[str, Any], ...]


class UnusualPartError(Exception):
    """A part that the vector form of a leg in series has no equation for."""


class Walk:
    """Goes along a leg and writes it down.

    `reference`: the reference point, None for the world's origin; `index`: behind the letters of
    names, such as ``_i``; `axes`: those of the joints, one after the other, and what is a rotation
    behind them, by the number of joints passed; none where turns are by angles.
    """

    def __init__(
        self,
        placed: PlacedRobot,
        read: NamedReading,
        reference: VectorExpression | None,
        index: str = "",
        axes: Sequence[VectorExpression] = (),
        rotations: Mapping[int, Columns] | None = None,
    ) -> None:
        self.placed = placed
        self.read = read
        self.equations: list[Equation] = []
        self.rotation: str | None = None
        self.terms: list[tuple[int, VectorExpression]] = []
        self.offset: list[Any] = [sp.Integer(0)] * 3
        self.drives: list[tuple[str, str, Any]] = []
        self.passive: list[str] = []
        self.beams: list[tuple[str, str, str, tuple[Any, ...]]] = []
        self.modules: list[tuple[str, str, str, Any]] = []
        self.robots: Mapping[str, Any] = {}  # in a machine their stiffness, by the names of blocks
        self._index, self._axes, self._rotations = index, list(axes), rotations or {}
        self._away = [] if reference is None else [(-1, reference)]
        self._turns: set[str] = set()  # names of rotations on the way
        self._arms: list[Equation] = []
        self._twists: list[Equation] = []
        self._passed = 0
        self._counts: dict[str, int] = {}

    def finish(self) -> tuple[Equation, ...]:
        """All equations; arms and twists about the reference point are the last."""
        used, kept = set[str](), []
        for equation in reversed([*self.equations, *self._arms, *self._twists]):
            # Turns that move neither a spring nor the reference point are left out.
            if equation.name not in self._turns or equation.name in used:
                used |= names_in(equation.expression)
                kept.append(equation)
        return tuple(reversed(kept))

    def along(self, elements: Any, springs: Iterator[PlacedSpring], coordinate: Any) -> None:
        """Walk over all elements."""
        place = 0
        for element in elements:
            if isinstance(element, Rigid):
                self.go(element.transform.p)
                self.turn(turns_of(element.transform.R))
            elif isinstance(element, Link):
                self.beam(next(springs), element.axes, element.to)
            elif isinstance(element, Joint):
                if element.kind is JointKind.SPHERICAL:
                    raise UnusualPartError
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
            elif isinstance(element, ParallelBlock) and element.name in self.robots:
                place += sum(branch.chain.size for branch in element.branches)
                self._module(element.name, (), element.robot.home.p, self.robots[element.name])
                self.turn(turns_of(element.robot.home.R))
            else:
                raise UnusualPartError

    def freedom(self, name: str, screw: Screw, role: Any, q: Any, *, slides: bool = True) -> None:
        """A joint: its twist, and how it moves what follows."""
        if not (screw.is_rotation or screw.is_translation):
            raise UnusualPartError
        stiffness, axis = getattr(role, "stiffness", None), [self.read(x) for x in screw.axis]
        if isinstance(stiffness, StiffnessLaw):
            raise UnusualPartError
        is_across = any(x != 0 for x in sp.Matrix(self.offset).cross(sp.Matrix(axis)))
        if isinstance(role, Passive) or stiffness is not None:  # others are held rigidly
            point = None
            if screw.turns:
                # Along its axis a joint is anywhere.
                point = self.named_point() if not self._axes or is_across else _sum(self.terms)
            self._twist(name, axis, point, stiffness)
        self._passed += 1
        if self._axes:
            if not screw.turns or is_across:
                raise UnusualPartError
            self.rotation = None
            found = self._rotations.get(self._passed)
            if found is not None:
                self._new_rotation(found)
        elif screw.turns:
            places, angle = [i for i, x in enumerate(axis) if x != 0], self.read(q)
            if len(places) == 1:
                self.turn((("xyz"[places[0]], axis[places[0]] * angle),))
            else:  # there, about x, and back
                if any(x.free_symbols for x in map(sp.sympify, axis)):
                    raise UnusualPartError
                e = np.array(axis, dtype=float)
                across = np.cross(e, np.eye(3)[np.argmin(np.abs(e))])
                across /= np.linalg.norm(across)
                there = np.stack([e, across, np.cross(e, across)], axis=1)
                self.turn(turns_of(there))
                self.turn((("x", angle),))
                self.turn(turns_of(there.T))
        elif slides:
            self.go(np.array(screw.axis, dtype=object) * q)

    def _twist(self, name: str, axis: Any, point: VectorExpression | None, stiffness: Any) -> None:
        """The twist of a passive joint, of which the stiffness is None, or of a drive."""
        twist = self._free("j" if stiffness is None else "t")
        e = self._axes[self._passed] if self._axes else self.turned(Coordinates(*axis))
        terms = [] if point is None else [*terms_of(point), *self._away]
        moment = Cross(_sum(terms), e) if terms else 0
        self._twists.append(Equation(twist, Stacked(e, 0) if point is None else Stacked(moment, e)))
        if stiffness is None:
            self.passive.append(twist)
        else:
            self.drives.append((name, twist, 1 / self.read(stiffness)))

    def beam(self, spring: PlacedSpring, axes: Any, to: Any) -> None:
        """A beam that runs to a point of the present frame."""
        found, turns = recognised_beam(spring, self.placed.record), turns_of(axes)
        if found is None:
            if not self.robots or spring.elasticity.freedoms.shape[1]:
                raise UnusualPartError
            C = sp.ImmutableMatrix(6, 6, [self.read(x) for x in spring.elasticity.compliance.flat])
            self._module(spring.name, turns, to, C)
            return
        along, products = found
        axes_of_beam = self._given("Q", self._turned_axes(turns))
        half = np.array(to, dtype=object) * sp.Rational(1, 2)
        self.go(half)
        middle = self._arm("m")
        self.go(half)
        of_beam = (
            self.read.length(along),
            *(self.read(products[x]) for x in ("EA", "EI_y", "EI_z", "GJ")),
        )
        self.beams.append((spring.name, axes_of_beam, middle, of_beam))

    def _module(self, name: str, turns: _Turns, to: Any, found: Any) -> None:
        """A robot, or a link that has a compliance, which ends at a point of the present frame."""
        axes = self._turned_axes(turns)
        axes = "1" if axes == Turns() else self._given("B", axes)
        self.go(to)
        if not isinstance(found, sp.MatrixBase):
            named = replace(found, name=f"K_{len(self.modules) + 1}")
            each = (x for *_, x in self.modules if getattr(x, "K", None) is named.K)
            found = next(each, named)
        self.modules.append((name, axes, self._arm("v"), found))

    def _turned_axes(self, turns: _Turns) -> VectorExpression:
        """Axes in the present frame, as a rotation in the world."""
        if self.rotation is None and self._axes:
            raise UnusualPartError
        if self.rotation is None:
            return Turns(*turns)
        return Turned(self.rotation, Turns(*turns)) if turns else Vector(self.rotation)

    def _given(self, letter: str, expression: VectorExpression) -> str:
        """The name of an equation that is added."""
        self.equations.append(Equation(self._free(letter), expression))
        return self.equations[-1].name

    def _arm(self, letter: str) -> str:
        """The name of the vector from the reference point to the present point."""
        arm = Equation(self._free(letter), _sum([*terms_of(self.here()), *self._away]))
        self._arms.append(arm)
        return arm.name

    def go(self, to: Any) -> None:
        """Move to a point of the present frame."""
        self.offset = [a + self.read(b) for a, b in zip(self.offset, to, strict=True)]

    def turn(self, turns: _Turns) -> None:
        """Turn about axes of the present frame."""
        turns = tuple((axis, angle) for axis, angle in turns if angle != 0)
        if turns and self._axes:
            raise UnusualPartError
        if turns:
            self.terms, self.offset = list(terms_of(self.here())), [sp.Integer(0)] * 3
            turn = Turns(*turns)
            self._new_rotation(turn if self.rotation is None else Turned(self.rotation, turn))

    def _new_rotation(self, expression: VectorExpression) -> None:
        self.rotation = self._given("R", expression)
        self._turns.add(self.rotation)

    def turned(self, vector: VectorExpression) -> VectorExpression:
        """A vector of the present frame in the world."""
        if self.rotation is None:
            if self._axes:
                raise UnusualPartError
            return vector
        return Turned(self.rotation, vector)

    def here(self) -> VectorExpression:
        """The present point in the world."""
        moved = any(x != 0 for x in self.offset)
        terms = [(1, self.turned(Coordinates(*self.offset)))] if moved else []
        return _sum([*self.terms, *terms])

    def named_point(self) -> VectorExpression:
        """The present point, which has a name."""
        here = self.here()
        if isinstance(here, Vector):
            return here
        name = self._given("p", here)
        self.terms, self.offset = [(1, Vector(name))], [sp.Integer(0)] * 3
        return Vector(name)

    def _free(self, letter: str) -> str:
        """The next name that is no symbol of the robot."""
        while True:
            number = self._counts[letter] = self._counts.get(letter, 0) + 1
            name = f"{letter}{self._index}_{number}"
            if name not in self.placed.symbols:
                return name


def terms_of(point: VectorExpression) -> tuple[tuple[int, VectorExpression], ...]:
    """The terms of a sum; none of zero."""
    if point == _ZERO:
        return ()
    return point.parts if isinstance(point, Sum) else ((1, point),)


def _sum(terms: Sequence[tuple[int, VectorExpression]]) -> VectorExpression:
    if not terms:
        return _ZERO
    return terms[0][1] if len(terms) == 1 and terms[0][0] > 0 else Sum(*terms)


def turns_of(R: Any) -> _Turns:
    """A constant rotation as turns Rz(a) Ry(b) Rx(c)."""
    found = turning_angles(R)
    return tuple((axis, angle) for axis, angle in zip("zyx", found, strict=True) if angle != 0)


def turning_angles(R: Any) -> tuple[Any, Any, Any]:
    """Angles a, b and c of a constant rotation Rz(a) Ry(b) Rx(c)."""
    entries = [x.sample if isinstance(x, Entry) else float(exact_number(x)) for x in np.ravel(R)]
    if any(np.ptp(x) > _WHOLE for x in entries):
        raise UnusualPartError
    A = np.array([np.mean(x) for x in entries]).reshape(3, 3)
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        if abs(A[axis, axis] - 1) < _WHOLE:
            found = [sp.Integer(0)] * 3
            found[2 - axis] = exact_angle(float(np.arctan2(A[j, i], A[i, i])))
            return found[0], found[1], found[2]
    b = float(np.arcsin(np.clip(-A[2, 0], -1, 1)))
    if abs(np.cos(b)) < _WHOLE:
        a, c = float(np.arctan2(-A[0, 1], A[1, 1])), 0.0
    else:
        a, c = float(np.arctan2(A[1, 0], A[0, 0])), float(np.arctan2(A[2, 1], A[2, 2]))
    return exact_angle(a), exact_angle(b), exact_angle(c)


def columns_of(
    R: np.ndarray, axes: Sequence[tuple[VectorExpression, np.ndarray]]
) -> Columns | None:
    """Rotations at the samples (count, 3, 3) as unit vectors side by side, two of which are known.

    `axes`: vectors with their values at the samples (count, 3).
    """
    known: dict[int, VectorExpression] = {}
    for vector, at in axes:
        local = np.einsum("nij,ni->nj", R, at)
        for k, sign in ((k, sign) for k in range(3) for sign in (1, -1)):
            if np.max(np.abs(local - sign * np.eye(3)[k])) < _WHOLE:
                known.setdefault(k, vector if sign > 0 else Sum((-1, vector)))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        if k not in known and {i, j} <= known.keys():
            known[k] = Cross(known[i], known[j])
    return Columns(known[0], known[1], known[2]) if len(known) == 3 else None


def rotations_of(
    elements: Any, springs: Iterator[PlacedSpring], count: int
) -> dict[int, np.ndarray]:
    """Rotations at the samples of the bodies of a leg that have a beam, by joints before them."""
    found: dict[int, np.ndarray] = {}
    passed = 0
    for element in elements:
        if isinstance(element, Link):
            rotation = np.asarray(next(springs).rotation, dtype=object)
            found[passed] = at_samples(rotation, count) @ at_samples(element.axes, count).mT
        elif not isinstance(element, Rigid):
            passed += len(element.freedoms)
    return found
