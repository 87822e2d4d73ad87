"""Elements of snapshot files: pydantic models of their keys, what they make, and their writing.

Shapes, words and signs are checked when a file is read; directions, matrices and lengths
when its elements are placed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from robostiff.elasticity import (
    BeamTheory,
    CrossSection,
    Elasticity,
    EulerBernoulli,
    Material,
    Timoshenko,
    beam_compliance,
    elasticity_from_compliance,
    elasticity_from_stiffness,
    with_segments,
)
from robostiff.elastostatics import chain_stiffness
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.io.document import DocumentPlace
from robostiff.io.units import Dimension, question
from robostiff.model import (
    Actuated,
    Mass,
    Passive,
    PlacedFreedom,
    PlacedMass,
    PlacedSpring,
    Role,
    Snapshot,
    beam_axes,
)
from robostiff.model.checks import rotation_matrix, unit_vector
from robostiff.network import Network
from robostiff.network.elements import uniform_mass
from robostiff.spatial import Screw, Space, full_turn

# Part of its size by which a compliance may change when it is written as a stiffness.
_READS_BACK = 1e-12
_LARGEST = 1e30  # far beyond any robot, and far from overflow
Number = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST)]
Point = Annotated[list[Number], Field(min_length=3, max_length=3)]
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Matrix3 = Annotated[list[Vector], Field(min_length=3, max_length=3)]
Row6 = Annotated[list[Number], Field(min_length=6, max_length=6)]
Matrix6 = Annotated[list[Row6], Field(min_length=6, max_length=6)]
Name = Annotated[str, Field(min_length=1)]
Positive = Annotated[float, Field(gt=0, le=_LARGEST)]
Share = Annotated[float, Field(ge=0, le=1)]
Informative = Annotated[Any, Field(description="any value; for people, not read")]


class FilePart(BaseModel):
    """Settings that all parts of the file share."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        extra="forbid", strict=True, allow_inf_nan=False, frozen=True, defer_build=True
    )


class Chained(FilePart):
    """Common keys of the elements of a chain."""

    name: Name | None = Field(
        None, description="unique in the leg; by default the type and a number"
    )
    note: Informative = None


class ScrewData(FilePart):
    """About or along which axis a joint moves."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {
                    "properties": {"kind": {"const": "H"}, "pitch": {"type": "number"}},
                    "required": ["pitch"],
                },
                {"properties": {"kind": {"enum": ["R", "P"]}, "pitch": {"type": "null"}}},
            ]
        }
    )

    kind: Literal["R", "P", "H"] = Field(
        description="R to turn about the axis, P to slide along it, H for both, as a nut on a screw"
    )
    point: Point = Field(description="a point of the axis [m]")
    axis: Vector = Field(description="the direction of the axis, of any length but zero")
    pitch: Number | None = Field(
        None,
        description="of kind H: the advance along the axis in one full turn [m], not zero; "
        "negative for a left-handed screw",
    )

    @model_validator(mode="after")
    def _pitch_of_a_screw(self) -> Self:
        wanted = (
            "an advance per turn [m], not zero" if self.kind == "H" else "none, as kind is not H"
        )
        if (self.kind == "H") != bool(self.pitch) or (self.kind != "H" and self.pitch is not None):
            got = Words("none") if self.pitch is None else self.pitch
            raise InputError(f"pitch of a joint of kind {self.kind}", got=got, expected=wanted)
        return self

    @property
    def advance(self) -> float | None:
        """Pitch of its screw [m/rad]."""
        per_turn = {"R": 0.0, "P": None}.get(self.kind, self.pitch)
        return None if per_turn is None else per_turn / full_turn(per_turn)

    @property
    def role(self) -> Role:
        """Actuated with its stiffness, if it has one."""
        k = getattr(self, "k", None)
        return Passive() if k is None else Actuated(k, inertia=getattr(self, "inertia", None))

    def placed(self, name: str, place: DocumentPlace) -> PlacedFreedom:
        """The joint about or along an axis in the world."""
        with place.at("axis").complaints():
            axis = _direction("axis", self.axis)
        return PlacedFreedom(axis, np.array(self.point, dtype=float), self.advance, name, self.role)


class PassivePart(Chained, ScrewData):
    """A joint that turns or slides without resistance."""

    type: Literal["passive"]


class SpringPart(Chained, ScrewData):
    """An actuator, or another joint, that is elastic along or about its axis."""

    type: Literal["spring"]
    k: Positive = Field(description="the stiffness, N m/rad for R and H, N/m for P")
    inertia: Positive | None = Field(None, description="of the drive, kg m^2 for R and H, kg for P")


class BeamData(FilePart):
    """Ends, section and material of a beam."""

    start: Point = Field(description="the end towards the base, or at node a [m]")
    end: Point = Field(description="the end towards the platform, or at node b [m]")
    y_axis: Vector = Field(
        description="the direction of the section's y axis; its part along the beam does not matter"
    )
    E: Positive = Field(description="Young's modulus [Pa]")
    G: Positive = Field(description="the shear modulus [Pa]")
    A: Positive = Field(description="the area of the section [m^2]")
    Iy: Positive = Field(description="the second moment about y [m^4]: bending in the x-z plane")
    Iz: Positive = Field(description="the second moment about z [m^4]: bending in the x-y plane")
    J: Positive = Field(description="the Saint-Venant torsion constant [m^4]")
    shear_factor_y: Positive | None = Field(
        None, description="the shear correction factor of a force along y, for Timoshenko's theory"
    )
    shear_factor_z: Positive | None = Field(
        None, description="the shear correction factor of a force along z, for Timoshenko's theory"
    )
    density: Positive | None = Field(None, description="of its material [kg/m^3], for its mass")

    @model_validator(mode="after")
    def _both_shear_factors(self) -> Self:
        factors = {"shear_factor_y": self.shear_factor_y, "shear_factor_z": self.shear_factor_z}
        written = [key for key, factor in factors.items() if factor is not None]
        if len(written) == 1:
            expected = "shear_factor_y and shear_factor_z, or neither"
            raise InputError("shear factors", got=Words(f"{written[0]} alone"), expected=expected)
        return self

    def placed(self, name: str, place: DocumentPlace) -> PlacedSpring:
        """The beam in the world, about its end."""
        end = np.array(self.end, dtype=float)
        along = end - np.array(self.start, dtype=float)
        if not along.any():
            got = place.at("end").value
            expected = "a point other than its start"
            raise place.at("end").error("beam of no length", got=got, expected=expected)
        with place.at("end").complaints():
            length = float(np.hypot.reduce(along))
            x = _direction("direction of the beam", along)
        with place.at("y_axis").complaints():
            rotation = beam_axes(x, _direction("y axis of the section", self.y_axis))
        theory: BeamTheory = EulerBernoulli() if self.shear_factor_y is None else Timoshenko()
        with place.complaints():
            section = CrossSection(
                self.A, self.Iy, self.Iz, self.J, self.shear_factor_y, self.shear_factor_z
            )
            material = Material(name, self.E, self.G)
            compliance = beam_compliance(length, material, section, theory)
        if not np.isfinite(compliance).all():
            hint = "check the units of the beam"
            raise place.error("compliance of the beam", expected="finite numbers", hint=hint)
        where = place.document.location
        question(length, Dimension.LENGTH, where, place.at("end").path, in_si=True)
        question(self.E, Dimension.MODULUS, where, place.at("E").path, in_si=True)
        return PlacedSpring(name, end, rotation, Elasticity(compliance, segments=()))

    def placed_masses(self, name: str, after: int = 0) -> tuple[PlacedMass, ...]:
        """Its mass, from its density."""
        start, end = np.array(self.start, dtype=float), np.array(self.end, dtype=float)
        value = None if self.density is None else self.density * self.A
        if value is not None:
            value *= float(np.linalg.norm(end - start))
        return tuple(replace(mass, after=after) for mass in uniform_mass(name, value, start, end))


class MassData(FilePart):
    """A mass in one place, or along an elastic part."""

    name: Name | None = Field(None, description="what it is")
    mass: Annotated[float, Field(ge=0, le=_LARGEST)] = Field(description="[kg]")
    at: Point | None = Field(None, description="where it is [m]")
    inertia: Vector | Matrix3 | None = Field(
        None,
        description="three moments of inertia, or a matrix, about `at` and in world axes [kg m^2]",
    )
    start: Point | None = Field(
        None,
        description="where the elastic part begins along which the mass is, and both ends of which "
        "carry it [m]",
    )
    span: Annotated[list[Share], Field(min_length=2, max_length=2)] | None = Field(
        None,
        description="beside `start`: from which to which part of the length it is spread; all of "
        "it where neither this nor `at` is given",
    )
    note: Informative = None

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        first, last = self.span or (0.0, 1.0)
        expected = None
        if self.span is not None and (self.start is None or self.at is not None or first >= last):
            expected = "start and two rising parts of the length, without at"
        elif self.inertia is not None and self.start is not None:
            expected = "no inertia: an elastic part moves its masses by both its ends"
        if expected is not None:
            keys = ("at", "inertia", "start", "span")
            written = ", ".join(key for key in keys if getattr(self, key) is not None)
            raise InputError("place of the mass", got=Words(written), expected=expected)
        return self

    def placed(
        self, place: DocumentPlace, carrier: str, usual: np.ndarray, after: int = 0
    ) -> Iterator[PlacedMass]:
        """The mass in the world, as one or, with an inertia, as six.

        What carries it has a name and a `usual` place (3,) [m]: where the mass is if the file does
        not say so, or where the elastic part ends.
        """
        at = None if self.at is None else np.array(self.at, dtype=float)
        if self.start is None:
            with place.complaints():
                mass = Mass(self.mass, inertia=self.inertia, name=self.name or carrier)
            yield from mass.placed(mass.name, np.eye(3), usual if at is None else at, after)
            return
        start, span = np.array(self.start, dtype=float), None
        if at is None:
            span = (0.0, 1.0) if self.span is None else (self.span[0], self.span[1])
            at = start + 0.5 * sum(span) * (usual - start)
        yield PlacedMass(carrier, np.asarray(self.mass), at, after, start, span)


class LegMass(MassData):
    """A mass that a leg or a branch carries."""

    after: Name | None = Field(
        None,
        description="the element of the chain before the body that carries it, or the elastic part "
        "along which it is; none for the body at which the chain begins",
    )


class NodeMass(MassData):
    """A mass that a node of a graph carries."""

    on: Name = Field(description="the node")


class BeamPart(Chained, BeamData):
    """A straight flexible link of constant cross-section."""

    type: Literal["beam"]


class Spring6Data(FilePart):
    """A 6 x 6 matrix about a point and in axes of its own."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {"properties": {key: {"type": "array"}}, "required": [key]}
                for key in ("K", "compliance")
            ]
        }
    )

    point: Point = Field(description="the point about which the matrix is given [m]")
    rotation: Matrix3 = Field(description="the rotation matrix whose columns are the spring's axes")
    K: Matrix6 | None = Field(None, description="the stiffness, wrench for a twist [N/m, N, N m]")
    compliance: Matrix6 | None = Field(
        None,
        description="the compliance, twist for a wrench [m/N, 1/N, rad/(N m)]; zero where rigid",
    )
    segments: list[Matrix6] | None = Field(
        None, description="of a beam along x: compliances of its uniform segments from its start on"
    )

    @model_validator(mode="after")
    def _one_matrix(self) -> Self:
        if (self.K is None) == (self.compliance is None):
            got = Words("neither" if self.K is None else "both")
            raise InputError("matrix of the spring", got=got, expected="one of K and compliance")
        return self

    def placed(self, name: str, place: DocumentPlace) -> PlacedSpring:
        """The spring in the world, from its matrix."""
        with place.at("rotation").complaints():
            rotation = rotation_matrix("rotation", self.rotation)
        if self.K is not None:
            with place.at("K").complaints():
                elasticity = elasticity_from_stiffness(self.K)
        else:
            with place.at("compliance").complaints():
                elasticity = elasticity_from_compliance(self.compliance or [])
        if self.segments:
            with place.at("segments").complaints():
                elasticity = with_segments(elasticity, self.segments)
        return PlacedSpring(name, np.array(self.point, dtype=float), rotation, elasticity)


class Spring6Part(Chained, Spring6Data):
    """An elastic part given by its 6 x 6 matrix, about a point and in axes of its own."""

    type: Literal["spring6"]


def _direction(subject: str, value: Sequence[float] | np.ndarray) -> np.ndarray:
    """Unit vector of components of any size, which would overflow or vanish when squared."""
    vector = np.array(value, dtype=float)
    largest = np.abs(vector).max()
    return unit_vector(subject, vector / largest if 0 < largest < np.inf else value)


class CouplingPart(FilePart):
    """A gear or differential: a sum of coordinates of joints, which is held."""

    name: Name | None = Field(None, description="by default the names of the joints")
    sum: Annotated[dict[Name, Number], Field(min_length=2)] = Field(
        description="joints of the chain with their factors, at least one of them passive"
    )
    k: Positive | None = Field(
        description="the stiffness against the sum, N m/rad or N/m as for the first joint; null "
        "where it is rigid"
    )
    note: Informative = None


class FileHead(FilePart):
    """Common keys of snapshot files with legs and of those with a graph."""

    name: Name = Field(description="the name of the robot")
    description: str = Field("", description="a line about it")
    reference_point: Point = Field(
        description="the point of the platform about which stiffness is given [m]"
    )
    planar: bool = Field(False, description="true for a robot that moves in the x-y plane alone")
    gravity: Vector | None = Field(
        None, description="the acceleration of free fall [m/s^2], for finite loads; none by default"
    )
    schema_: str | None = Field(None, alias="$schema", description="for editors, not read")
    units: str | None = Field(None, description="for people, not read: units are always SI")
    frame: str | None = Field(None, description="for people, not read: axes are the world's")
    order: str | None = Field(None, description="for people, not read: (x, y, z, rx, ry, rz)")
    params: Informative = None
    oracle: Informative = None
    peers: Informative = None
    note: Informative = None
    notes: Informative = None

    @property
    def shared(self) -> dict[str, Any]:
        """What a snapshot and a network have in common."""
        return {
            **{"name": self.name, "description": self.description},
            "reference_point": np.array(self.reference_point, dtype=float),
            "space": Space.PLANAR if self.planar else Space.SPATIAL,
            "gravity": None if self.gravity is None else np.array(self.gravity, dtype=float),
        }


def refuse_twins(names: Sequence[str | None], place: DocumentPlace, what: str) -> None:
    """Raise a FileError at the second of two elements of one name, in their list at a place."""
    for i, name in enumerate(names):
        if name is not None and name in names[:i]:
            raise place.at(i, "name").error(
                f"name of the {what}", got=name, expected="a name that no other has"
            )


def head_data(robot: Snapshot | Network, name: str) -> dict[str, Any]:
    """The keys of a file of either form but for legs and graph."""
    data: dict[str, Any] = {"name": robot.name or name}
    if robot.description:
        data["description"] = robot.description
    data["units"] = "SI: m, N, rad"
    if robot.space is Space.PLANAR:
        data["planar"] = True
    data["reference_point"] = one_pose(robot.reference_point, 1)
    return data if robot.gravity is None else {**data, "gravity": one_pose(robot.gravity, 1)}


def mass_data(mass: PlacedMass) -> dict[str, Any]:
    """What `placed_masses` reads back."""
    data = {"name": mass.name, "mass": float(mass.value)}
    if mass.span is None:
        data["at"] = one_pose(mass.centre, 1)
    else:
        data["span"] = [float(part) for part in mass.span]
    return data if mass.start is None else {**data, "start": one_pose(mass.start, 1)}


def drive_data(element: PlacedFreedom) -> dict[str, Any]:
    """Stiffness of a freedom, None of a passive one, and the inertia of its drive."""
    inertia = getattr(element.role, "inertia", None)
    return {"k": element.stiffness, **({} if inertia is None else {"inertia": inertia})}


def screw_data(screw: Screw) -> dict[str, Any]:
    """About or along which axis a joint moves."""
    data: dict[str, Any] = {"kind": "R" if screw.turns else "P"}
    if screw.turns and screw.slides:
        data = {"kind": "H", "pitch": float(screw.pitch_per_turn)}
    return {**data, "point": one_pose(screw.point, 1), "axis": one_pose(screw.axis, 1)}


def spring6_data(
    name: str, point: np.ndarray, rotation: np.ndarray, elasticity: Elasticity
) -> dict[str, Any]:
    """A spring by its stiffness if this says all there is to say, else by its compliance.

    Of a beam that its matrix alone would not show it has those of the segments besides.
    """
    place = {"point": one_pose(point, 1), "rotation": one_pose(rotation, 2)}
    own = elasticity.one(0)
    if own.segments or (own.beams and not replace(own, segments=None).beams):
        place["segments"] = [one_pose(C, 2) for C in own.pieces]
    compliance, freedoms = one_pose(elasticity.compliance, 2), elasticity.freedoms
    with suppress(NoAnswerError, InputError):
        K = chain_stiffness(C := np.array(compliance), freedoms).K
        back = elasticity_from_stiffness(K)
        allowed = _READS_BACK * np.sqrt(np.outer(np.diagonal(C), np.diagonal(C)))
        same = back.freedoms.shape == freedoms.shape
        if same and (freedoms.size or np.all(np.abs(back.compliance - C) <= allowed)):
            return {**place, "K": K.tolist()}
    if freedoms.size:
        raise InputError(
            f"spring {name} with directions both free and rigid",
            expected="a spring that is given by one matrix",
            hint="write its free directions as passive joints beside it",
        )
    return {**place, "compliance": compliance}


def one_pose(array: np.ndarray, axes: int) -> list[Any]:
    """The array as lists, without batch axes."""
    value = np.asarray(array, dtype=float)
    shape = value.shape[value.ndim - axes :]
    if value.size != np.prod(shape):
        got = value.shape[: value.ndim - axes]
        hint = "a snapshot file holds one pose: write a file for each"
        raise InputError("shape of the batch of poses", got=got, expected="one pose", hint=hint)
    return value.reshape(shape).tolist()
