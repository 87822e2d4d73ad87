"""Rigid bodies, the joints and elastic parts that connect them, and how their loops close."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elasticity import in_element_axes
from robostiff.errors import InputError
from robostiff.frozen import field, frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.closure import AssemblyMode, ClosurePart, Loops, follow, nearest
from robostiff.kinematics.closure.assembly_mode import Followed
from robostiff.kinematics.closure.motion_tree import AT_REST, Fixed, LoopEnd, MotionTree
from robostiff.kinematics.frames import Loop
from robostiff.kinematics.spanning_tree import SpanningTree, spanning_tree
from robostiff.model import Chain, Joint, JointKind, Link, Locked, Mass, Passive
from robostiff.model.checks import check_distinct, finite_coordinates
from robostiff.model.entries import Symbolic
from robostiff.model.subject import Coordinate, Subject
from robostiff.spatial import Frame, Screw, Space, refuse_quantities

JointValues = Mapping[str, float | Sequence[float]]
"""Coordinates of joints by their names [m, rad]; a list for a joint with several."""
DriveValues = ArrayLike | Mapping[str, ArrayLike]
"""Coordinates of driven joints: all of them in the last axis, or numbers for each by name."""


@frozen
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


@frozen
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
        names = [connection.name for connection in self.connections]
        check_distinct("name of the connection", names)
        for connection in self.connections:
            if connection.a == connection.b:
                subject = f"bodies of {connection.name!r}"
                raise InputError(subject, got=connection.a, expected="two different bodies")
        for what, body in (("base", self.base), ("platform", self.platform)):
            if body not in self.bodies:
                expected = "a body that is connected with others"
                hint = "floating joints connect nothing"
                raise InputError(what, got=body, expected=expected, hint=hint)
        if strange := sorted(self.held.difference(names)):
            raise InputError("held joints", got=strange, expected="joints of the linkage")

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

    def checked(self, values: Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
        """Coordinates by joint as arrays.

        Raises
        ------
        InputError
            For a name that is no joint's, and for numbers that are not finite or too many or few.
        """
        self.check_names(values)
        found, sizes = {}, {joint.name: joint.size for joint in self.joints}
        for name, value in values.items():
            subject = f"coordinates of {name!r}"
            refuse_quantities(subject, value, "finite numbers [m, rad]")
            numbers = finite_coordinates(subject, np.atleast_1d(value).tolist(), sizes[name])
            found[name] = np.array(numbers, dtype=float)
        return found


_ROUND = np.diag([-1, 1, -1])  # half a turn about y


def turned_round(connection: Connection) -> Connection:
    """The same connection from body b to body a; home coordinates give the same configuration.

    A joint keeps its coordinates, in reverse order, for its axes are reversed.
    """
    c, element = connection, connection.element
    if isinstance(element, Link):  # by energy: the wrench is the same, taken about the other end
        to, own = np.asarray(element.to), element.elasticity
        axes = element.axes @ _ROUND  # a beam is one along x from the other end, too
        elasticity = in_element_axes(own, _ROUND, axes.T @ -to)
        if own.segments is not None:
            elasticity = replace(elasticity, segments=own.segments[::-1])
        masses = tuple(
            replace(
                mass,
                centre=None if mass.centre is None else mass.centre - to,
                span=None if mass.span is None else (1 - mass.span[1], 1 - mass.span[0]),
            )
            for mass in element.masses
        )
        element = Link(-to, elasticity, axes, element.name, masses)
    elif element is not None and element.kind is JointKind.SPHERICAL:
        element = replace(element, home=tuple(-x for x in element.home))  # a rotation vector
    elif element is not None:
        freedoms = tuple(replace(screw, axis=-screw.axis) for screw in reversed(element.freedoms))
        element = replace(element, freedoms=freedoms, home=element.home[::-1])
    return Connection(c.name, c.b, c.a, c.after.inverse, element, c.before.inverse)


# As for legs: the largest gap of a closed loop.
_CLOSED = 1e-7
# Loops with gaps up to this may lack digits rather than length.
_NEARLY = 1e-3
#: A joint that is given may turn so far before screws that follow are closed again [rad]: beyond
#: half a turn, the loop closes on another turn of the nut as well.
PART_OF_A_TURN = 1.0
_FURTHEST = 1_000.0


@frozen
class Configuration:
    """A linkage at joint coordinates.

    Attributes
    ----------
    coordinates : mapping of str to (size,) arrays
        Of every joint [m, rad].
    places : mapping of str to ((3, 3) array, (3,) array)
        Axes and origin of every body, in the world [m].
    gaps : mapping of str to (float, float)
        For each connection that closes a loop: by how much it misses, as a shift [m] and a turn
        [rad].
    length : float
        Characteristic length [m] that weighs turns against shifts.
    elsewhere : bool
        Whether no path without singularity was found that leads there from home.
    closes_at_home : bool
        Whether this was reached from a home at which all loops close.
    """

    coordinates: Mapping[str, np.ndarray]
    places: Mapping[str, tuple[np.ndarray, np.ndarray]]
    gaps: Mapping[str, tuple[float, float]]
    length: float
    elsewhere: bool = False
    closes_at_home: bool = False

    @cached_property
    def frames(self) -> dict[str, Frame]:
        """The same as frames."""
        return {name: Frame(*place) for name, place in self.places.items()}

    @property
    def is_closed(self) -> bool:
        """Whether all loops close, in the assembly mode of home."""
        return self._has_no_gap and not self.elsewhere

    @property
    def _has_no_gap(self) -> bool:
        return all(
            shift <= _CLOSED * self.length and turn <= _CLOSED for shift, turn in self.gaps.values()
        )

    @property
    def complaint(self) -> str:
        """Why it is not closed: its assembly mode, or the widest gap."""
        if self._has_no_gap:
            return (
                "they do in another assembly mode only, behind a singularity on the way from home"
            )
        name, (shift, turn) = self._widest
        return f"a gap of {1e3 * shift:.4g} mm and {np.degrees(turn):.4g} deg at {name!r}"

    @property
    def advice(self) -> str:
        """Advice about loops that do not close."""
        if self._has_no_gap:
            return "give joint values nearer to home, or another home"
        _, (shift, turn) = self._widest
        if max(shift / self.length, turn) < _NEARLY and self.closes_at_home:
            return "give joint values nearer to home: the loops close there, and nearly do here"
        if max(shift / self.length, turn) < _NEARLY:
            return "give its lengths and angles more digits, for the loops nearly close"
        return "give other joint values, or leave more joints free to follow"

    @property
    def _widest(self) -> tuple[str, tuple[float, float]]:
        return max(self.gaps.items(), key=lambda gap: max(gap[1][0] / self.length, gap[1][1]))


@frozen
class MovedBodies:
    """The bodies of a linkage as moving frames; a posture x has the coordinates of its tree."""

    tree: MotionTree
    frames: Mapping[str, Fixed]  # of the bodies, along the spanning tree
    joints: tuple[Fixed, ...]  # of the joints that close loops
    # Places of the coordinates of each connection, and their sign
    places: Mapping[str, tuple[list[int], float]]

    def row(self, q: Mapping[str, np.ndarray]) -> np.ndarray:
        """Postures (..., size) at coordinates (..., size) of each connection."""
        arrays = {name: np.asarray(q[name]) for name in self.places}
        batch = np.broadcast_shapes(*(x.shape[:-1] for x in arrays.values()))
        row = np.empty((*batch, self.tree.size), np.result_type(float, *arrays.values()))
        for name, (places, sign) in self.places.items():
            row[..., places] = sign * arrays[name]
        return row


@kept
def moved_bodies(linkage: Linkage) -> MovedBodies:
    """Frames of the bodies along the spanning tree, and of the connections that close loops."""
    tree, frames = MotionTree(), {linkage.base: AT_REST}
    led: dict[str, tuple[int, ...]] = {linkage.base: ()}
    places: dict[str, tuple[list[int], float]] = {}

    def beyond(c: Connection, direction: float = 1.0) -> tuple[Fixed, tuple[int, ...]]:
        """Where the body behind a connection is, and the coordinates that lead there."""
        way = c if direction > 0 else turned_round(c)
        start = frames[way.a].to(way.before.R, way.before.p)
        end, moved = (start, ()) if way.element is None else tree.along(way.chain, start)
        is_ball = isinstance(c.element, Joint) and c.element.kind is JointKind.SPHERICAL
        turned = (moved, direction) if is_ball else (moved[:: int(direction)], 1.0)
        places[c.name] = list(turned[0]), turned[1]
        return end.to(way.after.R, way.after.p), (*led[way.a], *moved)

    for body, way in linkage.tree.ways.items():
        if way:
            frames[body], led[body] = beyond(*way[-1])
    joints = []
    for cut in linkage.tree.cuts:
        joints.append(frames[cut.a].to(cut.before.R, cut.before.p))
        end, moving = beyond(cut)
        pairs = (moving, led[cut.b]), (led[cut.b], moving)
        moving, leading = (tuple(i for i in x if i not in y) for x, y in pairs)
        tree.ends.append(LoopEnd(end, frames[cut.b], moving, leading))
    return MovedBodies(tree, frames, tuple(joints), places)


@frozen
class LoopsOfLinkage:
    """The loops of a linkage that some of its joints may close."""

    linkage: Linkage
    start: Mapping[str, np.ndarray]  # coordinates of all connections to start from
    moving: Sequence[Connection]
    loops: Loops

    @classmethod
    def of(
        cls, linkage: Linkage, start: Mapping[str, np.ndarray], moving: Sequence[Connection]
    ) -> LoopsOfLinkage:
        """The loops that some joints may close."""
        bodies, in_loops = moved_bodies(linkage), linkage.tree.in_loops
        closing, tree = [c for c in moving if c.name in in_loops], bodies.tree
        unknowns = np.array([i for c in closing for i in bodies.places[c.name][0]], dtype=int)
        x = bodies.row(start)
        placed = tree.placed(x[None])
        points = (placed.at(one)[1] for one in (*bodies.frames.values(), *bodies.joints))
        equations = np.arange(6 * len(tree.ends))
        loops = Loops(
            tree=tree,
            start=x,
            unknowns=unknowns,
            given=np.setdiff1d(np.arange(tree.size), unknowns),
            parts=(ClosurePart(np.arange(0), equations, np.arange(unknowns.size)),),
            length=float(max(map(np.linalg.norm, points))) or 1.0,
        )
        return cls(linkage, start, closing, loops)

    @property
    def nearest(self) -> Configuration:
        """The configuration that Newton's method finds from the start."""
        return self.configurations(nearest(self.loops, self.loops.start[None]))[0]

    def path_to(self, values: Mapping[str, np.ndarray]) -> list[Configuration]:
        """Configurations at values (N, size) of joints, on paths from where all loops close."""
        loops = self.loops
        given = moved_bodies(self.linkage).row({**self.start, **values})[..., loops.given]
        if any(c.is_screw for c in self.moving):
            return [self._turn_by_turn(row) for row in given]
        return self._where_closed(follow(loops, loops.start, given))

    def _where_closed(self, found: Followed, lost: bool = False) -> list[Configuration]:
        pairs = zip(self.configurations(found.x), found.elsewhere, strict=True)
        return [replace(one, elsewhere=lost or bool(x), closes_at_home=True) for one, x in pairs]

    def _turn_by_turn(self, given: np.ndarray) -> Configuration:
        """Along the path from home in parts in which no joint that is given turns far."""
        loops, mode, lost = self.loops, AssemblyMode(self.loops, self.loops.start), False
        begin = loops.start[loops.given]
        turned = np.max(np.abs(given - begin)[loops.tree.turns[loops.given]], initial=0.0)
        if turned > _FURTHEST:
            most = f"at most {_FURTHEST:g} rad from home"
            subject = "turn of a joint that screws follow"
            raise InputError(subject, got=f"{turned:.6g} rad", expected=most)
        parts = max(1, math.ceil(turned / PART_OF_A_TURN))
        for k in range(1, parts):
            found = mode.at((begin + (given - begin) * (k / parts))[None])
            if lost := not found.closed[0]:
                break
            mode = AssemblyMode(loops, found.x[0])
        (arrived,) = self._where_closed(mode.at(given[None]), lost)
        return arrived

    def configurations(self, x: np.ndarray) -> list[Configuration]:
        """The linkage at postures (N, size)."""
        bodies, cuts = moved_bodies(self.linkage), self.linkage.tree.cuts
        placed = bodies.tree.placed(x)
        frames = {name: placed.at(fixed) for name, fixed in bodies.frames.items()}
        ends = Loop("", placed.R, placed.p, placed.R_wanted, placed.p_wanted)
        shift, turn = ends.gap
        found = []
        for i, row in enumerate(x):
            moved = {name: sign * row[places] for name, (places, sign) in bodies.places.items()}
            of_bodies = {name: (R[i], p[i]) for name, (R, p) in frames.items()}
            gaps = {c.name: (float(shift[i, k]), float(turn[i, k])) for k, c in enumerate(cuts)}
            found.append(Configuration({**self.start, **moved}, of_bodies, gaps, self.loops.length))
        return found
