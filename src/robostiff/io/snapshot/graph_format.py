"""The graph form of the snapshot file, as its models: bodies, and what is between them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from robostiff.io.snapshot.format import (
    BeamData,
    FileHead,
    Informative,
    Name,
    Part,
    Point,
    Positive,
    Spring6Data,
    Vector,
)


class BetweenPart(Part):
    """What every element between two nodes has."""

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


class FreedomPart(Part):
    """An elementary motion of a joint."""

    kind: Literal["R", "P"] = Field(description="R to turn about the axis, P to slide along it")
    point: Point = Field(description="a point of the axis [m]")
    axis: Vector = Field(description="the direction of the axis, of any length but zero")
    k: Positive | None = Field(
        description="the stiffness, N m/rad for R and N/m for P; null for a passive motion"
    )


class JointBetween(BetweenPart):
    """A joint between two nodes: all motions that are not listed are rigid."""

    dofs: list[FreedomPart] = Field(description="its motions; none for a weld")


class GraphPart(Part):
    """Rigid bodies and what is between them."""

    nodes: Annotated[dict[Name, Point], Field(min_length=2)] = Field(
        description="the rigid bodies by name, each with a point of its own [m]"
    )
    fixed: list[Name] = Field(min_length=1, description="the nodes that do not move")
    platform: Name = Field(description="the node whose stiffness is asked for")
    beams: list[BeamBetween] = Field(default=[], description="beams between nodes")
    springs: list[SpringBetween] = Field(default=[], description="springs between nodes")
    joints: list[JointBetween] = Field(default=[], description="joints between nodes")
    note: Informative = None


class NetworkFile(FileHead):
    """A network frozen at a pose: world axes, metres, newtons and radians."""

    graph: GraphPart = Field(description="the bodies and what is between them")
