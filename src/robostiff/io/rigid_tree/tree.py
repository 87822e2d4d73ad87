"""A tree of rigid links and joints, from a robot description file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import Any, cast

import numpy as np

from robostiff.errors import FileError, InputError, Location, Words, warn_of_slip
from robostiff.io.plausibility import question
from robostiff.io.suggest import listing
from robostiff.io.units import Dimension
from robostiff.linkage import Linkage
from robostiff.model import Actuated, Joint, Link, Mass, Role
from robostiff.model.entries import free_symbols
from robostiff.spatial import Frame

MOST_LINKS = 2000
"""Of a description; robots have a hundred at most."""


class JointType(Enum):
    """Kinds of joint in robot description files."""

    FIXED = "fixed"
    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    SPHERICAL = "spherical"
    PLANAR = "planar"
    FLOATING = "floating"


@dataclass(frozen=True)
class Mimic:
    """A joint whose coordinate is ``multiplier`` times that of another one plus ``offset``."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class TreeJoint:
    """A joint between a link and its child.

    Attributes
    ----------
    name : str
    type : JointType
    parent, child : str
        Names of the links.
    before : Frame
        Of the joint at coordinate zero, in the parent's frame.
    axis : (3,) array
        Of a revolute or prismatic joint, or the normal of a planar one, in the joint's frame.
    after : Frame
        Of the child, seen from the joint's frame once it has moved.
    role : Passive, Actuated or Locked
        Role in the description; a stiffness is that of its drive.
    spring : float
        Stiffness of a spring of the joint, beside its drive [N m/rad or N/m]; 0 for none.
    inertia : float
        Of the rotor of its drive, at the joint [kg m^2 or kg]; 0 for none.
    home : float
        Coordinate in the configuration in which the description draws it.
    mimic : Mimic or None
    """

    name: str
    type: JointType
    parent: str
    child: str
    before: Frame
    axis: np.ndarray
    after: Frame = field(default_factory=Frame.identity)
    role: Role = field(default_factory=Actuated)
    spring: float = 0.0
    inertia: float = 0.0
    home: float = 0.0
    mimic: Mimic | None = None

    @property
    def drawn_at(self) -> np.ndarray:
        """Point of the joint in the description, in the parent's frame (3,) [m].

        A slide is drawn at its own coordinate, which need not be zero; a link ends there.
        """
        slides = self.type is JointType.PRISMATIC
        return self.before.p + self.before.R @ (self.home * self.axis * slides)


@dataclass(frozen=True)
class TreeLoop:
    """A loop closure: frames on two links that coincide up to the motion of what is between them.

    Attributes
    ----------
    name : str
    links : (str, str)
    frames : (Frame, Frame)
        One in the frame of each link.
    element : Joint, Link or None
        A joint, a spring, or nothing for links that are welded.
    """

    name: str
    links: tuple[str, str]
    frames: tuple[Frame, Frame]
    element: Joint | Link | None


@dataclass(frozen=True)
class RigidTree:
    """Links connected to one root.

    Attributes
    ----------
    name : str
    file : str
        For messages.
    links : tuple of str
    joints : tuple of TreeJoint
    loops : tuple of TreeLoop
    masses : mapping of str to Mass
        Of links, in their frames.

    Raises
    ------
    FileError
        When links and joints are no tree with one root, or too many.
    """

    name: str
    file: str
    links: tuple[str, ...]
    joints: tuple[TreeJoint, ...]
    loops: tuple[TreeLoop, ...] = ()
    masses: Mapping[str, Mass] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if len(self.links) > MOST_LINKS:
            raise self.error("links", got=len(self.links), expected=f"at most {MOST_LINKS}")
        for child, count in Counter(joint.child for joint in self.joints).items():
            if count > 1:
                raise self.error(
                    f"joints that lead to the link {child!r}",
                    got=Words(", ".join(j.name for j in self.joints if j.child == child)),
                    expected="one",
                    hint="write what closes a loop under loops: in the side file",
                )
        roots = [link for link in self.links if self.joint_into(link) is None]
        if len(roots) != 1:
            raise self.error(
                "links without a parent",
                got=Words(listing(roots) or "none"),
                expected="one root of the tree",
            )
        reached = set(self.below(roots[0]))
        if len(reached) < len(self.links):
            rest = [link for link in self.links if link not in reached]
            raise self.error(
                "links that are connected in a circle",
                got=Words(listing(rest, 12)),
                expected="a tree",
            )

    @cached_property
    def root(self) -> str:
        """The link without a parent."""
        return next(link for link in self.links if self.joint_into(link) is None)

    @cached_property
    def leaves(self) -> tuple[str, ...]:
        """The links without a child."""
        parents = {joint.parent for joint in self.joints}
        return tuple(link for link in self.links if link not in parents)

    def joint_into(self, link: str) -> TreeJoint | None:
        """The joint between a link and its parent; None for the root."""
        return self._into.get(link)

    def joints_from(self, link: str) -> tuple[TreeJoint, ...]:
        """The joints between a link and its children."""
        return tuple(self._out.get(link, ()))

    def below(self, link: str) -> Iterator[str]:
        """A link and all its descendants."""
        waiting = [link]
        while waiting:
            here = waiting.pop()
            yield here
            waiting += [joint.child for joint in self.joints_from(here)]

    @cached_property
    def _into(self) -> dict[str, TreeJoint]:
        return {joint.child: joint for joint in self.joints}

    @cached_property
    def _out(self) -> dict[str, list[TreeJoint]]:
        out: dict[str, list[TreeJoint]] = {}
        for joint in self.joints:
            out.setdefault(joint.parent, []).append(joint)
        return out

    def error(
        self, subject: str, *, got: Any = None, expected: str | None = None, hint: str | None = None
    ) -> FileError:
        """An error in the description."""
        return FileError(Location(self.file), subject, got=got, expected=expected, hint=hint)


@dataclass(frozen=True)
class Reader:
    """Reads descriptions of robots.

    Attributes
    ----------
    kind : str
        What is read, in words: ``"a model of MuJoCo"``.
    read : callable
        From a path, str or `Path`, or an object of another program, to its tree of rigid links.
    """

    kind: str
    read: Callable[[Any], RigidTree]


def question_place(place: np.ndarray, location: Location) -> None:
    """Warn when a place (3,) [m] is so far away that it is probably in another unit."""
    far = float(np.max(np.abs(place)))
    question(far, Dimension.LENGTH, lambda _: location, in_si=True)


def mass_of_body(
    name: str, value: float, centre: np.ndarray, inertia: np.ndarray, place: Location
) -> Mass | None:
    """The mass of a link in its frame, None of none; warns where its moments are of no body.

    The moments of inertia (3, 3) [kg m^2] are about the centre (3,) [m], in the axes of the link.
    """
    if value == 0:
        if np.any(inertia):
            warn_of_slip(f"{place}: link {name!r} has moments of inertia and no mass: not read")
        return None
    try:
        return Mass(value, centre, name=name, inertia=inertia if np.any(inertia) else None)
    except InputError as error:
        warn_of_slip(f"{place}: {error}; its mass of {value:g} kg is taken without them")
        return Mass(value, centre, name=name)


def with_symbols(
    known: Linkage, build: Callable[[], Linkage], nominal: Mapping[str, float]
) -> Linkage:
    """The linkage of numbers with the stiffnesses of the same one built with symbols.

    Raises InputError when a dimension depends on a symbol.
    """
    refusal = InputError(
        f"symbols of linkage {known.name!r}",
        got=tuple(nominal),
        expected="parameters of stiffnesses, elastic parts and masses alone",
        hint="give values to parameters of dimensions: load_linkage(path, {NAME: ...})",
    )
    try:
        symbolic = build()
    except (InputError, TypeError):  # a dimension that is computed with a symbol is no number
        raise refusal from None
    connections = []
    for own, other in zip(known.connections, symbolic.connections, strict=True):
        element, given = own.element, other.element
        if isinstance(element, Joint) and isinstance(given, Joint):
            k = getattr(given.role, "stiffness", None)
            if free_symbols(k):
                element = replace(element, role=replace(element.role, stiffness=k))
        elif isinstance(element, Link) and free_symbols(given):
            given = cast("Link", given)
            element = replace(element, elasticity=given.elasticity, masses=given.masses)
        connections.append(replace(own, element=element))
    plain = [(c.before, c.after, getattr(c.element, "to", None)) for c in symbolic.connections]
    homes = [getattr(c.element, "home", None) for c in symbolic.connections]
    if free_symbols((tuple(plain), tuple(homes), symbolic.reference_point)):
        raise refusal
    return replace(known, connections=tuple(connections), nominal=nominal)
