"""Pydantic models of the snapshot file: its keys and their values.

Shapes, words and signs are checked here; directions, matrices and lengths are
checked where the robot is built.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from robostiff.errors import InputError
from robostiff.io.suggest import Words
from robostiff.spatial import Screw, full_turn

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

    model_config = ConfigDict(
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

    model_config = ConfigDict(
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

    @staticmethod
    def of(screw: Screw) -> dict[str, Any]:
        """The keys of a screw but for its place."""
        if not screw.turns:
            return {"kind": "P"}
        return (
            {"kind": "H", "pitch": float(screw.pitch_per_turn)} if screw.slides else {"kind": "R"}
        )


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
        given = [key for key, factor in factors.items() if factor is not None]
        if len(given) == 1:
            raise InputError(
                "shear factors",
                got=Words(f"{given[0]} alone"),
                expected="shear_factor_y and shear_factor_z, or neither",
            )
        return self


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
            raise InputError("place of the mass", got=Words(self._given), expected=expected)
        return self

    @property
    def _given(self) -> str:
        keys = ("at", "inertia", "start", "span")
        return ", ".join(key for key in keys if getattr(self, key) is not None)


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

    model_config = ConfigDict(
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

    @model_validator(mode="after")
    def _one_matrix(self) -> Self:
        if (self.K is None) == (self.compliance is None):
            raise InputError(
                "matrix of the spring",
                got=Words("neither" if self.K is None else "both"),
                expected="one of K and compliance",
            )
        return self


class Spring6Part(Chained, Spring6Data):
    """An elastic part given by its 6 x 6 matrix, about a point and in axes of its own."""

    type: Literal["spring6"]


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


class BranchPart(FilePart):
    """A chain from the body before a parallel block to the body after it."""

    name: Name = Field(description="the name of the branch, unique in the block")
    end: Point = Field(description="where the branch meets the body after the block [m]")
    chain: list[ElementPart] = Field(
        description="the elements from body to body, none for a rigid branch; all else is rigid"
    )
    couplings: list[CouplingPart] = Field(default=[], description="of joints in the chain")
    masses: list[LegMass] = Field(default=[], description="of its parts, beside their densities")
    note: Informative = None


class ParallelPart(Chained):
    """Branches side by side, such as the bars of a parallelogram."""

    type: Literal["parallel"]
    branches: list[BranchPart] = Field(
        min_length=2, description="two or more chains between the same two bodies"
    )


ElementPart = Annotated[
    PassivePart | SpringPart | BeamPart | Spring6Part | ParallelPart, Field(discriminator="type")
]


class LegPart(BranchPart):
    """A chain from the base to the platform."""

    name: Name = Field(description="the name of the leg, unique in the file")
    end: Point = Field(description="where the leg meets the platform [m]")
    chain: list[ElementPart] = Field(
        min_length=1, description="the elements from base to platform; all else is rigid"
    )


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


class SnapshotFile(FileHead):
    """A robot frozen at a pose: world axes, metres, newtons and radians."""

    legs: list[LegPart] = Field(min_length=1, description="the chains that hold the platform")
    masses: list[MassData] = Field(default=[], description="on the platform")


class BetweenPart(FilePart):
    """Common keys of elements between two nodes."""

    name: Name | None = Field(
        None, description="unique among its kind; by default the kind and a number"
    )
    a: Name = Field(description="the node at its start")
    b: Name = Field(description="the node at its end")
    note: Informative = None


class BeamBetween(BetweenPart, BeamData):
    """A straight flexible link of constant cross-section, rigidly attached to two nodes."""


class SpringBetween(BetweenPart, Spring6Data):
    """An elastic part given by its 6 x 6 matrix, of node b against node a."""

    masses: list[MassData] = Field(
        default=[], description="along it; without a start on the body of node b"
    )


class FreedomPart(ScrewData):
    """An elementary motion of a joint."""

    k: Positive | None = Field(
        description="the stiffness, N m/rad for R and H, N/m for P; null for a passive motion"
    )
    inertia: Positive | None = Field(None, description="of the drive, kg m^2 for R and H, kg for P")


class JointBetween(BetweenPart):
    """A joint between two nodes: all motions that are not listed are rigid."""

    dofs: list[FreedomPart] = Field(description="its motions; none for a weld")


class GraphCoupling(CouplingPart):
    """A gear or differential between joints anywhere."""

    sum: Annotated[dict[Name, Number], Field(min_length=1)] = Field(
        description="joints with their factors; ``joint/dof2`` for the second motion of a joint"
    )


class GraphPart(FilePart):
    """Rigid bodies and what is between them."""

    nodes: Annotated[dict[Name, Point], Field(min_length=2)] = Field(
        description="the rigid bodies by name, each with a point of its own [m]"
    )
    fixed: list[Name] = Field(min_length=1, description="the nodes that do not move")
    platform: Name = Field(description="the node whose stiffness is computed")
    beams: list[BeamBetween] = Field(default=[], description="beams between nodes")
    springs: list[SpringBetween] = Field(default=[], description="springs between nodes")
    joints: list[JointBetween] = Field(default=[], description="joints between nodes")
    couplings: list[GraphCoupling] = Field(default=[], description="of joints")
    masses: list[NodeMass] = Field(default=[], description="masses of nodes")
    note: Informative = None


class NetworkFile(FileHead):
    """A network frozen at a pose: world axes, metres, newtons and radians."""

    graph: GraphPart = Field(description="the bodies and what is between them")
