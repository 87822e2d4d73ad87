"""Rigid bodies, and the joints and elastic parts that connect them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elasticity import moved
from robostiff.errors import InputError
from robostiff.kinematics.spanning_tree import SpanningTree, spanning_tree
from robostiff.model import Chain, Joint, JointKind, Link, Locked, Mass, Passive
from robostiff.model.checks import finite_coordinates
from robostiff.model.entries import Symbolic
from robostiff.model.subject import Coordinate, Subject
from robostiff.spatial import Frame, Screw, Space, refuse_quantities

JointValues = Mapping[str, float | Sequence[float]]
"""Coordinates of joints by their names [m, rad]; a list for a joint with several."""
DriveValues = ArrayLike | Mapping[str, ArrayLike]
"""Coordinates of driven joints: all of them in the last axis, or numbers for each by name."""


@dataclass(frozen=True)
class Connection:
    """A connection of two bodies: a joint, an elastic part, or a weld.

    The frame of body b is ``before``, then the motion of the element, then ``after``, seen from the
    frame of body a.

    Attributes
    ----------
    name : str
        Different from all others of the linkage.
    a, b : str
        Names of the bodies.
    before : Frame
        Where the element begins, in the frame of body a.
    element : Joint, Link or None
    after : Frame
        Frame of body b, seen from where the element ends.
    """

    name: str
    a: str
    b: str
    before: Frame
    element: Joint | Link | None
    after: Frame

    @cached_property
    def chain(self) -> Chain:
        """Its element alone; a weld has none."""
        return Chain(() if self.element is None else (self.element,))

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of its coordinates: the joint's, with a number where it has several."""
        return self.chain.coordinate_names if isinstance(self.element, Joint) else ()

    @property
    def freedoms(self) -> tuple[Screw, ...]:
        """Those of a joint."""
        return self.element.freedoms if isinstance(self.element, Joint) else ()

    @property
    def may_move(self) -> bool:
        """Whether it is a joint that is not locked."""
        return isinstance(self.element, Joint) and not isinstance(self.element.role, Locked)

    @property
    def is_passive(self) -> bool:
        """Whether it is a passive joint."""
        return isinstance(self.element, Joint) and isinstance(self.element.role, Passive)

    @property
    def is_screw(self) -> bool:
        """Whether a freedom of it turns and slides at once."""
        return any(screw.turns and screw.slides for screw in self.freedoms)

    @property
    def home(self) -> np.ndarray:
        """Its coordinates to start from (size,) [m, rad]."""
        return np.array(self.element.home if isinstance(self.element, Joint) else (), dtype=float)


@dataclass(frozen=True)
class Linkage(Symbolic, Subject):
    """Bodies connected in any way, one of which is fixed.

    Attributes
    ----------
    name : str
    connections : tuple of Connection
    base : str
        The body that stands still; its frame is the world.
    platform : str
        The body whose stiffness is computed.
    reference_point : (3,) array
        Point of the platform about which stiffness is given, in the platform's frame [m].
    held : frozenset of str
        Joints that keep their home coordinates while loops are closed; locked ones always do.
    title, source : str
        What it is, and where its numbers come from.
    nominal : mapping of str to float
        The values in SI units that a side file gives to the symbols of its stiffnesses.
    masses : mapping of str to tuple of Mass
        Of bodies, by their names and in their frames.

    Raises
    ------
    InputError
        Two connections of one name, a connection from a body to itself, or a base, platform or held
        joint that is not there.

    Examples
    --------
    >>> from robostiff.model import revolute
    >>> hinge = revolute([0, 0, 1], Passive(), name="hinge")
    >>> weld = Connection("hinge", "wall", "door", Frame.identity(), hinge, Frame.identity())
    >>> Linkage("door", (weld,), "wall", "door", np.zeros(3)).bodies
    ('wall', 'door')
    """

    kind: ClassVar[str] = "linkage"
    coordinates: ClassVar[tuple[Coordinate, ...]] = ()  # pyright: ignore[reportIncompatibleVariableOverride]
    name: str
    connections: tuple[Connection, ...]
    base: str
    platform: str
    reference_point: np.ndarray
    held: frozenset[str] = field(default_factory=frozenset)
    title: str = ""
    source: str = ""
    nominal: Mapping[str, float] = field(default_factory=dict)
    masses: Mapping[str, tuple[Mass, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for connection in self.connections:
            if connection.name in seen:
                raise InputError(
                    "name of the connection", got=connection.name, expected="each name once"
                )
            seen.add(connection.name)
            if connection.a == connection.b:
                raise InputError(
                    f"bodies of {connection.name!r}",
                    got=connection.a,
                    expected="two different bodies",
                )
        for what, body in (("base", self.base), ("platform", self.platform)):
            if body not in self.bodies:
                raise InputError(
                    what,
                    got=body,
                    expected="a body that is connected with others",
                    hint="floating joints connect nothing",
                )
        if self.held - seen:
            raise InputError(
                "held joints", got=sorted(self.held - seen), expected="joints of the linkage"
            )

    def __repr__(self) -> str:
        return f"<Linkage {self.name!r}, {len(self.bodies)} bodies, {len(self.joints)} joints>"

    @property
    def space(self) -> Space:
        """Spatial: all of its bodies have six freedoms."""
        return Space.SPATIAL

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies, in the order of the connections."""
        return tuple(dict.fromkeys(body for c in self.connections for body in (c.a, c.b)))

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Its joints, in the order of the connections."""
        return tuple(c.element for c in self.connections if isinstance(c.element, Joint))

    @cached_property
    def tree(self) -> SpanningTree[Connection]:
        """Ways to its bodies, and the connections that close loops."""
        return spanning_tree(self.base, self.connections)

    def check_names(self, joints: Iterable[str]) -> None:
        """Raise for a name that is no joint's."""
        known = [joint.name for joint in self.joints]
        for name in joints:
            if name not in known:
                raise InputError("joint", got=name, expected=f"one of {', '.join(known)}")

    def checked(self, values: JointValues) -> dict[str, np.ndarray]:
        """Coordinates by joint as arrays.

        Raises
        ------
        InputError
            For a name that is no joint's, and for numbers that are not finite or too many or few.
        """
        self.check_names(values)
        sizes = {joint.name: joint.size for joint in self.joints}
        for name, value in values.items():
            refuse_quantities(f"coordinates of {name!r}", value, "finite numbers [m, rad]")
        return {
            name: np.array(
                finite_coordinates(
                    f"coordinates of {name!r}", np.atleast_1d(value).tolist(), sizes[name]
                ),
                dtype=float,
            )
            for name, value in values.items()
        }


def turned_round(connection: Connection) -> Connection:
    """The same connection from body b to body a; home coordinates give the same configuration.

    A joint keeps its coordinates, in reverse order, for its axes are reversed.
    """
    c, element = connection, connection.element
    if isinstance(element, Link):  # by energy: the wrench is the same, taken about the other end
        to = np.asarray(element.to)
        elasticity = moved(element.elasticity, element.axes, -to)
        masses = tuple(
            replace(
                own,
                centre=None if own.centre is None else own.centre - to,
                span=None if own.span is None else (1 - own.span[1], 1 - own.span[0]),
            )
            for own in element.masses
        )
        element = Link(-to, elasticity, np.eye(3), element.name, masses)
    elif element is not None and element.kind is JointKind.SPHERICAL:
        element = replace(element, home=tuple(-x for x in element.home))  # a rotation vector
    elif element is not None:
        freedoms = tuple(replace(screw, axis=-screw.axis) for screw in reversed(element.freedoms))
        element = replace(element, freedoms=freedoms, home=element.home[::-1])
    return Connection(c.name, c.b, c.a, c.after.inverse, element, c.before.inverse)
