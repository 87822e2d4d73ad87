"""A robot frozen at a pose: its joints and springs in world coordinates.

This is what a model becomes once its pose is known, and what can be written from a CAD model
down directly. Every array may have leading batch axes: many poses of one robot.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from typing import Any, ClassVar

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.frozen import frozen, replace
from robostiff.model.batched import BatchedPart
from robostiff.model.body_spring import refuse_springs
from robostiff.model.chain import block_in_words
from robostiff.model.flexible_platform import PlacedPlatform
from robostiff.model.joint import Passive, Role
from robostiff.model.mass import PlacedMass
from robostiff.model.stiffness_law import StiffnessLaw
from robostiff.model.subject import FrozenSubject
from robostiff.spatial import Screw, Space

_ROUNDING = 1e-12  # of a coordinate: closer points are one
_POINT = 1e-6  # of the size with its beams: a robot that small is a point


@frozen
class PlacedFreedom(BatchedPart, Screw):
    """A freedom of a joint in the world: a unit screw with a name and a role.

    Attributes
    ----------
    axis : (..., 3) array
        Unit vector.
    point : (..., 3) array
        A point of the axis [m].
    pitch : float, formula or None
        Advance per turn angle [m/rad]: 0 of a revolute joint, None of a prismatic one.
    name : str
        Of the joint, with the number of the freedom where it has several.
    role : Passive, Actuated or Locked
    coordinate : (...) array, formula or None
        Of a drive whose stiffness depends on it [m or rad].
    """

    name: str
    role: Role
    coordinate: Any = None

    @property
    def is_passive(self) -> bool:
        """Whether it moves without resistance."""
        return isinstance(self.role, Passive)

    @property
    def stiffness(self) -> Any:
        """Stiffness of its drive or lock [N/m or N m/rad]; None when passive or rigid."""
        k = None if isinstance(self.role, Passive) else self.role.stiffness
        if not isinstance(k, StiffnessLaw):
            return k
        k = k.at(self.coordinate)
        if not isinstance(k, np.ndarray | np.generic) or k.dtype == object:
            return k
        # Out of reach, it may be negative: a status reports it, and the other poses continue.
        k = np.maximum(k, np.finfo(float).tiny ** 0.25)
        return k if k.ndim else float(k)


@frozen
class CoupledFreedom(PlacedFreedom):
    """A coordinate of coupled joints in the world: it moves several joints of its leg.

    Axis, point and pitch are those of the joint at its place; its `twist` is the sum of what it
    moves, the column ``J_q T``.
    """

    joint: str = ""  #: the one at its place
    #: joints that it moves, each with its motion for one of the coordinate: a column of T
    moves: tuple[tuple[str, Any, Screw], ...] = ()
    #: joints whose sum it is, with their factors: a row of A; of a joint by itself that alone
    sum: tuple[tuple[str, Any], ...] = ()

    @property
    def alone(self) -> PlacedFreedom:
        """The joint at its place, without what couples it: passive where a coupling holds it."""
        led = len(self.sum) > 1
        role = Passive() if led else self.role
        return PlacedFreedom(
            self.axis, self.point, self.pitch, self.joint, role, None if led else self.coordinate
        )

    def twist(self, at: np.ndarray) -> np.ndarray:
        """Twist of the point `at` per unit of the coordinate, sum of t (17) over its joints."""
        (_, first, screw), *others = self.moves
        whole = screw.twist(at) * first
        for _, share, screw in others:
            whole = whole + screw.twist(at) * share
        return whole


@frozen
class PlacedSpring(BatchedPart):
    """An elastic part in the world."""

    name: str
    point: np.ndarray  #: (..., 3): where its far end is [m]
    rotation: np.ndarray  #: (..., 3, 3): columns are its own axes
    elasticity: Elasticity  #: about its far end, in its own axes; it may have batch axes


@frozen
class PlacedBlock(BatchedPart):
    """Branches in parallel inside a leg; each runs from the body before them to the body after."""

    name: str
    branches: tuple[PlacedLeg, ...]


@frozen
class PlacedBodySpring(BatchedPart):
    """A spring between points of two bodies, in the world.

    Its tension at the distance l is ``tension + stiffness (l - length)``.
    """

    name: str
    #: ``base``, ``platform``, or ``leg/part`` for the body behind that part
    bodies: tuple[str, str]
    points: tuple[np.ndarray, np.ndarray]  #: two of (..., 3): where it is held [m]
    stiffness: float  #: [N/m]
    length: float  #: [m]
    tension: float = 0.0  #: at that length; negative where it pushes [N]
    is_cable: bool = False  #: whether it only pulls, with that tension under gravity or not


PlacedElement = PlacedFreedom | PlacedSpring | PlacedBlock


@frozen
class PlacedLeg(BatchedPart):
    """A chain in the world, base to platform; whatever lies between its elements is rigid.

    Attributes
    ----------
    name : str
    elements : tuple of PlacedFreedom, PlacedSpring or PlacedBlock
    end : (..., 3) array
        Point where it meets the platform [m].
    masses : tuple of PlacedMass
        Those of its parts, as far as they have been placed.
    """

    name: str
    elements: tuple[PlacedElement, ...]
    end: np.ndarray
    masses: tuple[PlacedMass, ...] = ()

    def in_words(self, prefix: str = "") -> list[str]:
        """Its elements by name, without what their names begin with, and what is in a block.

        Examples
        --------
        >>> from robostiff.kinematics import find_posture
        >>> from robostiff.robots import load
        >>> find_posture(load("planar-link")).snapshot.legs[0].in_words()
        ['beam', 'tip']
        """
        words = []
        for element in self.elements:
            name = element.name.removeprefix(prefix)
            if isinstance(element, PlacedBlock):
                branches = [(b.name, b.in_words(f"{b.name}/")) for b in element.branches]
                insides = {b.removeprefix(f"{element.name}/"): inside for b, inside in branches}
                name = block_in_words(name, insides)
            words.append(name)
        return words

    @property
    def parts(self) -> Iterator[PlacedFreedom | PlacedSpring]:
        """Its joints and elastic parts, those of its parallel blocks included."""
        for element in self.elements:
            if isinstance(element, PlacedBlock):
                for branch in element.branches:
                    yield from branch.parts
            else:
                yield element

    @property
    def blocks(self) -> tuple[PlacedBlock, ...]:
        """Its parallel blocks."""
        return tuple(e for e in self.elements if isinstance(e, PlacedBlock))

    @property
    def all_masses(self) -> Iterator[PlacedMass]:
        """Those of the branches of its parallel blocks, then its own."""
        for block in self.blocks:
            for branch in block.branches:
                yield from branch.all_masses
        yield from self.masses

    @property
    def own_parts(self) -> tuple[PlacedFreedom | PlacedSpring, ...]:
        """Its joints and elastic parts, those of its parallel blocks left out."""
        return tuple(e for e in self.elements if not isinstance(e, PlacedBlock))

    @property
    def without_blocks(self) -> PlacedLeg:
        """The same leg, its parallel blocks left out."""
        elements = self.own_parts
        return self if len(elements) == len(self.elements) else replace(self, elements=elements)

    @property
    def freedoms(self) -> Iterator[PlacedFreedom]:
        """Its joints, those of its parallel blocks included."""
        return (e for e in self.parts if isinstance(e, PlacedFreedom))

    @property
    def springs(self) -> Iterator[PlacedSpring]:
        """Its elastic parts without actuator springs."""
        return (e for e in self.parts if isinstance(e, PlacedSpring))


@frozen
class Snapshot(BatchedPart, FrozenSubject):
    """A robot at one pose, or at a batch of poses.

    Attributes
    ----------
    name : str
    legs : tuple of PlacedLeg
    reference_point : (..., 3) array
        Point of the platform about which stiffness is given [m].
    space : Space
    description : str
    platform : PlacedPlatform or None
        What bends between the legs and the reference point; None for a rigid platform.
    springs : tuple of PlacedBodySpring
        Between bodies, as far as they have been placed; those of finite loads alone have them.
    masses : tuple of PlacedMass
        On the platform, as far as they have been placed.
    gravity : (3,) array or None
        Acceleration of free fall, as the robot has it [m/s^2].
    """

    kind: ClassVar[str] = "snapshot"
    name: str
    legs: tuple[PlacedLeg, ...]
    reference_point: np.ndarray
    space: Space = Space.SPATIAL
    description: str = ""
    platform: PlacedPlatform | None = None
    springs: tuple[PlacedBodySpring, ...] = ()
    masses: tuple[PlacedMass, ...] = ()
    gravity: np.ndarray | None = None

    def __post_init__(self) -> None:
        batches = {leg.end.shape[:-1] for leg in self.legs}
        for leg in self.legs:
            for e in leg.parts:
                batches.add(e.point.shape[:-1])
                shape = e.axis.shape[:-1] if isinstance(e, PlacedFreedom) else e.rotation.shape[:-2]
                batches.add(shape)
        batch = np.broadcast_shapes(self.reference_point.shape[:-1], *batches)
        if batch != self.reference_point.shape[:-1]:
            reference = np.broadcast_to(self.reference_point, (*batch, 3))
            object.__setattr__(self, "reference_point", reference)

    def __repr__(self) -> str:
        return f"<Snapshot {self.name!r}, legs {', '.join(leg.name for leg in self.legs)}>"

    def one(self, index: int) -> Snapshot:
        """The robot at one pose of a batch along one axis."""
        return self.at(index)

    @property
    def named_masses(self) -> Iterator[tuple[str, PlacedMass]]:
        """All masses at one pose, by the names of their legs, or ``platform``."""
        for leg in self.legs:
            yield from ((leg.name, mass) for mass in leg.all_masses)
        of_parts = () if self.platform is None else self.platform.masses.values()
        yield from (("platform", mass) for masses in (self.masses, *of_parts) for mass in masses)

    def moving_masses(self, nodes: Container[str]) -> Iterator[PlacedMass]:
        """All masses, whatever nodes of a network move."""
        del nodes
        yield from (mass for _, mass in self.named_masses)

    @property
    def is_coupled(self) -> bool:
        """Whether any of its joints are coupled."""
        return any(isinstance(e, CoupledFreedom) for leg in self.legs for e in leg.parts)

    def check_has_no_springs(self, subject: str) -> None:
        """Raise an InputError if there are springs between its bodies; see `Robot`."""
        refuse_springs(self.name, self.springs, subject)

    @property
    def characteristic_length(self) -> np.ndarray:
        """RMS distance of springs, leg ends and joints but slides from their mean (...) [m].

        Where these nearly meet in a point, the starts of beams are among them. It does not depend
        on the reference point, scales with the unit of length, and is 0 for a robot that is all in
        one point.
        """
        points = [leg.end for leg in self.legs]
        for leg in self.legs:
            # Where on its axis a slide is drawn means nothing.
            points += [e.point for e in leg.parts if isinstance(e, PlacedSpring) or e.turns]
        length = self._spread(points)
        springs = [e for leg in self.legs for e in leg.parts if isinstance(e, PlacedSpring)]
        starts = []  # of the beams that bend as springs do; of other springs their points
        for spring in springs:
            C = np.asarray(spring.elasticity.compliance, dtype=float)
            turn = C[..., 5, 5, None]
            along = 2.0 * C[..., 1, 5, None] / np.where(turn > 0, turn, np.inf)
            starts.append(spring.point - along * spring.rotation[..., 0])
        whole = self._spread([*points, *starts])
        length = np.where((length > 0) & (length < _POINT * whole), whole, length)
        return np.broadcast_to(length, self.reference_point.shape[:-1])

    def _spread(self, points: list[np.ndarray]) -> np.ndarray:
        """RMS distance of points from their mean (...) [m]; 0 where it is rounding."""
        together = _together(points)
        furthest = np.max(np.abs(together), axis=(0, -1))
        # Of joints that meet in the origin rounding remains.
        furthest = np.maximum(furthest, np.max(np.abs(self.reference_point), axis=-1))
        # From the first point on: a robot that is all in one point gets an exact zero.
        together = together - together[0]
        apart = together - np.mean(together, axis=0)
        length = np.sqrt(np.einsum("k...i,k...i->...", apart, apart) / len(points))
        return np.where(length > _ROUNDING * furthest, length, 0.0)

    @property
    def centre(self) -> np.ndarray:
        """Mean of the leg ends (..., 3) [m]."""
        ends = _together([leg.end for leg in self.legs])
        return np.broadcast_to(np.mean(ends, axis=0), self.reference_point.shape)


def _together(points: list[np.ndarray]) -> np.ndarray:
    """Points that may or may not have batch axes, as one array (points, ..., 3)."""
    alike = len({point.shape for point in points}) == 1
    return np.array(points if alike else np.broadcast_arrays(*points))
