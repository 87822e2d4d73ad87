"""A robot: legs between a fixed base and a platform. A serial arm is a robot with one leg."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen, replace
from robostiff.model.body_spring import BodySpring, refuse_springs
from robostiff.model.chain import Chain
from robostiff.model.checks import check_distinct, vector3
from robostiff.model.entries import Symbolic
from robostiff.model.flexible_platform import FlexiblePlatform
from robostiff.model.joint import Passive
from robostiff.model.mass import Mass, gravity_vector, masses_of
from robostiff.model.stiffness_law import ForceLaw, StiffnessLaw
from robostiff.model.subject import ALL_COORDINATES, Coordinate, Subject
from robostiff.spatial import Frame, Space


class Elbow(Enum):
    """Which of the two ways a leg with a crank or a slide takes to its end (working mode).

    ``PLUS`` and ``MINUS`` are the signs of the square root in the closed form: for a slide, the
    larger and the smaller coordinate; for a crank, the rod on the positive or negative side of the
    line from crank centre to leg end, seen along the crank axis. ``HOME`` is that of the home
    configuration.
    """

    HOME = "home"
    PLUS = "plus"
    MINUS = "minus"


@frozen
class Leg:
    """A chain from a frame of the base to a frame of the platform.

    It may be rigid where it has passive joints, as a leg that guides the platform: in the wrenches
    that it transmits the robot is rigid then.

    Attributes
    ----------
    name : str
    base : Frame
        Where the chain begins, in the world.
    chain : Chain
    attachment : Frame
        Where the chain ends, in the platform frame.
    elbow : Elbow
        Working mode, for a leg that has two.
    node : str or None
        Node of a flexible platform that holds it; None for the node at its attachment.
    """

    name: str
    base: Frame
    chain: Chain
    attachment: Frame
    elbow: Elbow = Elbow.HOME
    node: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "base", Frame.of(self.base))
        object.__setattr__(self, "attachment", Frame.of(self.attachment))
        if not any(isinstance(role, Passive) for role in self.chain.roles):
            self.check_has_compliance()

    def check_has_compliance(self) -> None:
        """Raise InputError for a leg in which everything is rigid."""
        if not self.chain.has_compliance:
            raise InputError(
                f"leg {self.name!r}",
                got=Words("no compliance at all"),
                expected="an elastic link, or a joint with a stiffness",
                hint="a rigid leg is infinitely stiff: give its actuator or a link elasticity",
            )


@frozen(repr=False)
class Robot(Symbolic, Subject):
    """A serial or parallel robot.

    Its dimensions, elastic constants and home coordinates are numbers or SymPy formulas.

    Attributes
    ----------
    name : str
    legs : tuple of Leg
        One for a serial arm.
    home : Frame or None
        Platform pose in the home configuration; None to take it from the first leg's home
        coordinates, as for a serial arm.
    reference_point : (3,) array
        Point of the platform about which stiffness is given, in the platform frame [m].
    coordinates : tuple of Coordinate
        The pose coordinates that can be chosen freely; the legs fix the others. Empty for a serial
        arm that is posed by its joints alone, and for a structure without mobility.
    space : Space
        Planar for a robot in the x-y plane that is computed with 3 x 3 matrices.
    title, source : str
        What it is, and where its numbers come from.
    nominal : mapping of str to float
        The values in SI units that a model file gives to its symbols.
    meanings : mapping of str to str
        What the symbols of a model file stand for, such as "length, 0.35 m in the model".
    units : mapping of str to str
        The SI unit of each symbol of a model file, such as "N/m"; "" for a plain number.
    platform : FlexiblePlatform or None
        What bends between the legs and the reference point; None for a rigid platform.
    platform_masses : tuple of Mass
        Of the platform and of what it carries, in the platform frame.
    gravity : (3,) array, axis such as ``"-z"``, or None
        Acceleration of free fall in the world [m/s^2]; None for none.
    springs : tuple of BodySpring
        Between points of its bodies, such as gravity compensators.
    laws : mapping of str to ForceLaw
        Under finite loads, how the force of the drive of ``leg/joint`` follows from its motion; its
        stiffness is that of the law without motion.
    """

    kind: ClassVar[str] = "robot"
    name: str
    legs: tuple[Leg, ...]
    home: Frame | None = None
    reference_point: np.ndarray = field(default_factory=lambda: np.zeros(3))
    coordinates: tuple[Coordinate, ...] = ALL_COORDINATES
    space: Space = Space.SPATIAL
    title: str = ""
    source: str = ""
    nominal: Mapping[str, float] = field(default_factory=dict)
    meanings: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    platform: FlexiblePlatform | None = None
    platform_masses: tuple[Mass, ...] = ()
    gravity: Any = None
    springs: tuple[BodySpring, ...] = ()
    laws: Mapping[str, ForceLaw] = field(default_factory=dict)

    def __post_init__(self) -> None:
        point = vector3(f"reference point of {self.name!r}", self.reference_point)
        object.__setattr__(self, "reference_point", point)
        for name in ("nominal", "meanings", "units", "laws"):
            object.__setattr__(self, name, dict(getattr(self, name)))
        object.__setattr__(self, "platform_masses", masses_of(self.platform_masses))
        if self.gravity is not None:
            gravity = gravity_vector(f"gravity of {self.name!r}", self.gravity)
            object.__setattr__(self, "gravity", gravity)
        if self.home is not None:
            object.__setattr__(self, "home", Frame.of(self.home))
        if not self.legs:
            subject = f"robot {self.name!r}"
            raise InputError(subject, got=Words("no leg"), expected="at least one leg")
        check_distinct("names of the legs", [leg.name for leg in self.legs])
        if not any(leg.chain.has_compliance for leg in self.legs) and not self.springs:
            self.legs[0].check_has_compliance()
        parts = [f"{leg.name}/{name}" for leg in self.legs for name in leg.chain.part_names]
        check_distinct("names of the parts, leg/part", parts)
        legs: list[Leg] = []  # those with equal chains have one: what is asked of it is found once
        for leg in self.legs:
            equal = (other.chain for other in legs if other.chain == leg.chain)
            chain = next(equal, leg.chain)
            legs.append(leg if chain is leg.chain else replace(leg, chain=chain))
        object.__setattr__(self, "legs", tuple(legs))
        object.__setattr__(self, "springs", tuple(self.springs))
        check_distinct("names of the springs", [spring.name for spring in self.springs])
        if self.home is None and (len(self.legs) > 1 or any(x.chain.has_blocks for x in self.legs)):
            raise InputError(
                f"home pose of {self.name!r}",
                got=Words("none"),
                expected="the pose of the platform of a robot with several legs or parallel blocks",
                hint="write home: {at: [0, 0, 800 mm]}, home=Frame(np.eye(3), [0, 0, 0.8]) in "
                "Python",
            )
        if self.platform is not None:
            _ = self.holds

    @property
    def is_coupled(self) -> bool:
        """Whether joints of a leg are coupled."""
        return any(leg.chain.is_coupled for leg in self.legs)

    @property
    def drives_with_laws(self) -> tuple[str, ...]:
        """``leg/part`` of the drives whose force or stiffness follows a law, those of sums too."""
        varying = {
            f"{leg.name}/{name}"
            for leg in self.legs
            for name, role in zip(leg.chain.coordinate_names, leg.chain.roles, strict=True)
            if isinstance(getattr(role, "stiffness", None), StiffnessLaw)
        }
        return tuple(sorted(varying.union(self.laws)))

    @cached_property
    def holds(self) -> tuple[str, ...]:
        """The node of its flexible platform that holds each leg; none with a rigid platform.

        Raises
        ------
        InputError
            When a leg ends at no node, or names one that is not there.
        """
        if self.platform is None:
            return ()
        return tuple(self.platform.node_of(leg.node, leg.attachment.p) for leg in self.legs)

    def check_platform_is_rigid(self, subject: str) -> None:
        """Raise an InputError if a `subject`, such as ``formula``, needs a rigid platform."""
        if self.platform is not None:
            raise InputError(
                f"{subject} of {self.name!r}",
                got=Words("a flexible platform"),
                expected="a rigid one",
                hint="rs.stiffness, rs.compile, rs.derive and rs.equilibrium take flexible ones",
            )

    def check_has_no_springs(self, subject: str) -> None:
        """Raise an InputError if a `subject`, such as ``kernel``, would leave out its springs."""
        refuse_springs(self.name, self.springs, subject)

    def with_springs(self, springs: Sequence[BodySpring] = ()) -> Robot:
        """The same robot with other springs between its bodies, or with none."""
        return replace(self, springs=tuple(springs))

    @property
    def is_serial(self) -> bool:
        """Whether it has one leg."""
        return len(self.legs) == 1

    @property
    def is_posed_by_joints(self) -> bool:
        """Whether the joints alone define its pose: a serial arm without a home of its platform."""
        return self.is_serial and self.home is None

    def __repr__(self) -> str:
        legs = "1 leg" if self.is_serial else f"{len(self.legs)} legs"
        free = " ".join(coordinate.value for coordinate in self.coordinates)
        posed = f"free in {free}" if free else "without mobility"
        posed = "posed by its joints" if self.is_posed_by_joints else posed
        symbols = f", symbols {', '.join(map(str, self.symbols))}" if self.symbols else ""
        return f"<Robot {self.name!r}, {legs}, {posed}{symbols}>"

    def with_elbows(self, elbows: Elbow | Mapping[str, Elbow]) -> Robot:
        """The same robot in another working mode.

        Parameters
        ----------
        elbows : Elbow, or mapping of leg names to Elbow
            For all legs, or for those named.

        Raises
        ------
        InputError
            When a name is no leg's.
        """
        if isinstance(elbows, Elbow):
            elbows = {leg.name: elbows for leg in self.legs}
        names = [leg.name for leg in self.legs]
        for name in elbows:
            if name not in names:
                raise InputError("leg of the working mode", got=name, expected=", ".join(names))
        legs = tuple(replace(leg, elbow=elbows.get(leg.name, leg.elbow)) for leg in self.legs)
        return replace(self, legs=legs)
