"""A cable robot: a rigid platform held by cables, which can only pull."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.model.checks import check_distinct, vector3
from robostiff.model.subject import Coordinate, Subject, pose_coordinates
from robostiff.spatial import Frame, Space, refuse_quantities

_IN_PLANE = 1e-9  # [m]


@frozen
class Cable:
    """A cable from an eyelet of the base to a point of the platform, with its winch.

    Attributes
    ----------
    name : str
    exit_point : (3,) array
        Where it leaves the base, in the world [m]: an ideal eyelet, which does not move.
    attachment : (3,) array
        Attachment point in the platform frame [m].
    EA : float or None
        Axial rigidity, Young's modulus times section [N]; None for one that does not stretch.
    guide_length : float
        Length between winch and exit point, which stretches too [m].
    winch_stiffness : float or None
        Of winch, gear and frame, along the cable [N/m]; None for a rigid winch.
    least_tension, greatest_tension : float
        Limits of the tension [N]; infinite if unknown.
    tension : float or None
        Tension at the given pose, if it is given rather than computed [N].

    Raises
    ------
    InputError
        When a number is out of its range, or the cable is rigid.

    Examples
    --------
    >>> Cable("rope", [0, 0, 3], [0, 0, 0], EA=2e5).greatest_tension
    inf
    """

    name: str
    exit_point: Any
    attachment: Any
    EA: float | None = None
    guide_length: float = 0.0
    winch_stiffness: float | None = None
    least_tension: float = 0.0
    greatest_tension: float = np.inf
    tension: float | None = None

    def __post_init__(self) -> None:
        for attribute in ("exit_point", "attachment"):
            point = vector3(f"{attribute} of cable {self.name!r}", getattr(self, attribute))
            object.__setattr__(self, attribute, _numbers(self.name, point))
        if self.EA is None and self.winch_stiffness is None:
            raise InputError(
                f"cable {self.name!r}",
                got=Words("no elasticity"),
                expected="EA or winch_stiffness, or both",
                hint="without them the cable is infinitely stiff",
            )
        for attribute in ("EA", "winch_stiffness", "guide_length", "least_tension", "tension"):
            value, positive = getattr(self, attribute), attribute in ("EA", "winch_stiffness")
            if isinstance(value, int | float | np.number) and not isinstance(value, bool):
                fits = np.isfinite(value) and (value > 0 if positive else value >= 0)
            else:
                fits = value is None and attribute not in ("guide_length", "least_tension")
            if not fits:
                raise InputError(
                    f"{attribute.replace('_', ' ')} of cable {self.name!r}",
                    got=value,
                    expected="a positive number" if positive else "zero or a positive number",
                )
        subject = f"greatest tension of cable {self.name!r}"
        refuse_quantities(subject, self.greatest_tension, "newtons")
        if not self.greatest_tension > self.least_tension:
            expected = f"more than the least, {self.least_tension:g} N"
            raise InputError(subject, got=self.greatest_tension, expected=expected)


@frozen
class Weight:
    """A force that keeps its direction in the world and acts at a point of a body.

    Attributes
    ----------
    force : (3,) array
        In world axes [N].
    point : (3,) array
        In the frame of the body, mostly the platform [m]: the centre of mass.
    """

    force: Any
    point: Any = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for attribute in ("force", "point"):
            vector = vector3(f"{attribute} of the weight", getattr(self, attribute))
            object.__setattr__(self, attribute, _numbers("weight", vector))


@frozen
class CableRobot(Subject):
    """A rigid platform suspended in cables, or tensioned by them.

    Attributes
    ----------
    name : str
    cables : tuple of Cable
    home : Frame
        Platform pose in the home configuration.
    weight : Weight or None
        Of the platform with its payload.
    reference_point : (3,) array
        Point of the platform about which stiffness is given, in the platform frame [m].
    tension_level : float
        Where between the least (0) and the greatest (1) tension of each cable the tensions aim,
        where they are computed.
    space : Space
        Planar for a robot in the x-y plane that is computed with 3 x 3 matrices.
    title, source : str
        What it is, and where its numbers come from.

    Raises
    ------
    InputError
        When names recur, tensions are given for some cables only, or a planar robot leaves its
        plane.
    """

    kind: ClassVar[str] = "cable robot"
    #: It has numbers alone.
    symbols: ClassVar[tuple[()]] = ()
    name: str
    cables: tuple[Cable, ...]
    home: Frame
    weight: Weight | None = None
    reference_point: Any = field(default_factory=lambda: np.zeros(3))
    tension_level: float = 0.0
    space: Space = Space.SPATIAL
    title: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        subject = f"reference point of {self.name!r}"
        point = _numbers(self.name, vector3(subject, self.reference_point))
        object.__setattr__(self, "reference_point", point)
        object.__setattr__(self, "home", Frame.of(self.home))
        object.__setattr__(self, "cables", tuple(self.cables))
        if not self.cables:
            expected = "at least one"
            raise InputError(f"cable robot {self.name!r}", got=Words("no cable"), expected=expected)
        names = self.cable_names
        check_distinct("names of the cables", names)
        if not 0 <= self.tension_level <= 1:
            raise InputError("tension level", got=self.tension_level, expected="0 to 1")
        unbounded = [c.name for c in self.cables if not np.isfinite(c.greatest_tension)]
        if self.tension_level > 0 and unbounded:
            raise InputError(
                "tension level",
                got=Words(f"{self.tension_level:g}, and no greatest tension of {unbounded[0]!r}"),
                expected="a greatest tension of every cable, between which and the least it lies",
            )
        without = [cable.name for cable in self.cables if cable.tension is None]
        if 0 < len(without) < len(self.cables):
            raise InputError(
                "given tensions",
                got=Words(f"none of {', '.join(without)}"),
                expected="a tension of every cable, or of none",
            )
        if self.space is not Space.PLANAR:
            return
        z = self.home.p[2]
        for cable in self.cables:
            ends = cable.exit_point[2], (self.home.R @ cable.attachment + self.home.p)[2]
            if max(abs(end - z) for end in ends) > _IN_PLANE:
                raise InputError(
                    f"cable {cable.name!r} of a planar robot",
                    got=Words(f"from z = {ends[0]:g} to {ends[1]:g} m"),
                    expected=f"a cable in the plane z = {z:g} m",
                    hint="leave planar: out for a robot in space",
                )
        if self.weight is not None and self.weight.force[2] != 0:
            raise InputError(
                f"weight of the planar robot {self.name!r}",
                got=self.weight.force,
                expected="a force in the x-y plane, such as [0, -100 N, 0]",
            )

    def __repr__(self) -> str:
        free = " ".join(coordinate.value for coordinate in self.coordinates)
        return f"<CableRobot {self.name!r}, {len(self.cables)} cables, free in {free}>"

    @property
    def numeric(self) -> CableRobot:
        """Itself: it has numbers alone."""
        return self

    @property
    def cable_names(self) -> list[str]:
        """Names of the cables."""
        return [cable.name for cable in self.cables]

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The pose coordinates that can be chosen freely."""
        return pose_coordinates(self.space)

    @property
    def given_tensions(self) -> np.ndarray | None:
        """Tensions of all cables (m,) [N], where they are given."""
        if self.cables[0].tension is None:
            return None
        return np.array([cable.tension for cable in self.cables], dtype=float)

    @property
    def tension_limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest tensions of all cables, twice (m,) [N]."""
        least = np.array([cable.least_tension for cable in self.cables], dtype=float)
        return least, np.array([cable.greatest_tension for cable in self.cables], dtype=float)


def _numbers(owner: str, vector: np.ndarray) -> np.ndarray:
    if vector.dtype == object:
        got, expected = ", ".join(map(str, vector)), "numbers: cables take no formulas"
        raise InputError(f"numbers of {owner!r}", got=got, expected=expected)
    return vector
