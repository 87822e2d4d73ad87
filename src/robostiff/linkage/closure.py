"""Bodies of a linkage in the world, and joint coordinates at which its loops close."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics.closure import AssemblyMode, ClosurePart, LoopEquations, nearest
from robostiff.kinematics.closure.assembly_mode import FollowedPosture
from robostiff.kinematics.closure.motion_tree import AT_REST, Fixed, LoopEnd, MotionTree
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.spanning_tree import SpanningTree
from robostiff.linkage.linkage import Connection, JointValues, Linkage, turned_round
from robostiff.model import Joint, JointKind
from robostiff.spatial import Frame
from robostiff.spatial.batch import product, transposed


@dataclass(frozen=True)
class BodyFrame:
    """Axes (..., 3, 3) and origin (..., 3) of a body in the world [m]."""

    R: np.ndarray
    p: np.ndarray

    def at(self, frame: Frame) -> BodyFrame:
        """A frame that is fixed to the body."""
        return BodyFrame(product(self.R, frame.R), self.p + self.R @ frame.p)

    def before(self, across: BodyFrame) -> BodyFrame:
        """The frame from which another one leads here."""
        R = product(self.R, transposed(across.R))
        return BodyFrame(R, self.p - np.einsum("...ij,...j->...i", R, across.p))


_WORLD = BodyFrame(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class Bodies:
    """The bodies of a linkage at coordinates."""

    tree: SpanningTree[Connection]
    # mapping of str to arrays: coordinates of every connection (..., size) [m, rad]; (size,) where
    # they are entries
    q: Mapping[str, np.ndarray]
    frames: Mapping[str, BodyFrame]  # of every body, along the tree
    _elements: dict[str, PlacedChain] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, tree: SpanningTree[Connection], q: Mapping[str, np.ndarray]) -> Bodies:
        """From the base outwards."""
        frames: dict[str, BodyFrame] = {}
        bodies = cls(tree, q, frames)
        for body, way in tree.ways.items():
            if not way:
                frames[body] = _WORLD
                continue
            connection, direction = way[-1]
            if direction > 0:
                frames[body] = bodies.beyond(connection)
            elif connection.rigid is not None:
                frames[body] = frames[connection.b].at(connection.rigid.inverse)
            else:
                across = _end(connection, bodies._placed(connection, _WORLD))
                frames[body] = frames[connection.b].before(across)
        return bodies

    @property
    def in_world(self) -> dict[str, Frame]:
        """Frames of the bodies, at one posture."""
        return {name: Frame(own.R, own.p) for name, own in self.frames.items()}

    @property
    def length(self) -> float:
        """Largest distance of a body or a joint from the base [m]; 1 where all are in one point."""
        frames = self.in_world
        far = [float(np.linalg.norm(frame.p)) for frame in frames.values()]
        for cut in self.tree.cuts:
            far.append(float(np.linalg.norm((frames[cut.a] @ cut.before).p)))
        return max(far) or 1.0

    def beyond(self, connection: Connection) -> BodyFrame:
        """Where body b of a connection is, seen from body a."""
        if connection.rigid is not None:
            return self.frames[connection.a].at(connection.rigid)
        return _end(connection, self.placed(connection))

    def placed(self, connection: Connection) -> PlacedChain:
        """The element of a connection in the world."""
        if connection.name not in self._elements:
            placed = self._placed(connection, self.frames[connection.a])
            self._elements[connection.name] = placed
        return self._elements[connection.name]

    def gap(self, cut: Connection) -> Loop:
        """By how much a connection that closes a loop misses its body."""
        meant, there = self.beyond(cut), self.frames[cut.b]
        return Loop(cut.name, meant.R, meant.p, there.R, there.p, (), ())

    def _placed(self, connection: Connection, a: BodyFrame) -> PlacedChain:
        start = a.at(connection.before)
        return place_chain(connection.chain, self.q[connection.name], start.R, start.p)


def _end(connection: Connection, placed: PlacedChain) -> BodyFrame:
    return BodyFrame(placed.R, placed.p).at(connection.after)


# As for legs: the largest gap of a closed loop.
_CLOSED = 1e-7
# Loops with gaps up to this may lack digits rather than length.
_NEARLY = 1e-3
# Of the largest rate at which coordinates close gaps: rates of motions that are free, and of loops
# that are regular; and of the length, what rounding leaves of a gap.
_FREE, _REGULAR, _ROUNDING = 1e-12, 1e-3, 1e-16
#: A joint that is given may turn so far before screws that follow are closed again [rad]: beyond
#: half a turn, the loop closes on another turn of the nut as well.
PART_OF_A_TURN = 1.0
_FURTHEST = 1_000.0


@dataclass(frozen=True)
class Configuration:
    """A linkage at joint coordinates.

    Attributes
    ----------
    coordinates : mapping of str to (size,) arrays
        Of every joint [m, rad].
    frames : mapping of str to Frame
        Of every body, in the world.
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
    frames: Mapping[str, Frame]
    gaps: Mapping[str, tuple[float, float]]
    length: float
    elsewhere: bool = False
    closes_at_home: bool = False

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


def close(linkage: Linkage, values: JointValues | None = None) -> Configuration:
    """Coordinates at which all loops close.

    Passive joints move first. Only where they cannot close the loops, other joints move too, as
    little as it takes. Joints among `values`, held joints and locked ones keep their coordinates.
    Values are reached along the straight path from home, in its assembly mode.

    Parameters
    ----------
    linkage : Linkage
    values : mapping of str to float or sequence of float, optional
        Coordinates of joints that keep them [m, rad].

    Returns
    -------
    Configuration
        Closed, or as near as it came.

    Raises
    ------
    InputError
        When a name in `values` is no joint's, or its numbers do not fit.
    """
    given = linkage.checked(values or {})
    home = _nearest(linkage, linkage.held, {})
    if not given:
        return home
    # A joint with a given value may contradict one that keeps its home coordinate.
    if not home.is_closed:
        home = _nearest(linkage, frozenset(), {})
    if home.is_closed:
        each = {name: own[None] for name, own in given.items()}
        return PathsFromHome(linkage, home, tuple(given)).to(each)[0]
    return _nearest(linkage, frozenset(given), given)


@dataclass(frozen=True)
class PathsFromHome:
    """Paths from a closed home to values of some joints, as those of `close`."""

    linkage: Linkage
    home: Configuration
    given: tuple[str, ...]  # names of these joints

    def to(self, values: Mapping[str, np.ndarray]) -> list[Configuration]:
        """Configurations at values (N, size) of each, closed or as near as they came."""
        passive, movable = _movable(self.linkage, frozenset(self.given))
        found = self._loops(all_follow=False).followed(values)
        for i, one in enumerate(found):
            if not one.is_closed and len(passive) < len(movable):
                here = {name: own[i : i + 1] for name, own in values.items()}
                (found[i],) = self._loops(all_follow=True).followed(here)
        return found

    @kept
    def _loops(self, *, all_follow: bool) -> _Loops:
        """Loops that passive joints keep closed, or all that may move."""
        moving = _movable(self.linkage, frozenset(self.given))[all_follow]
        return _Loops.of(self.linkage, self.home.coordinates, moving)


def as_rounded(linkage: Linkage, found: Configuration, given: frozenset[str]) -> Configuration:
    """A closed configuration moved by rounding along the motion that its loops hold least.

    Loops near a singular configuration do not decide all coordinates to their last digits.
    Motions that they leave free, as the spin of a rod, are no such. The configuration itself where
    its loops are regular.
    """
    passive, _ = _movable(linkage, given)
    loops = _Loops.of(linkage, found.coordinates, passive)
    _, values, Vt = np.linalg.svd(loops.rates(loops.guess[None])[0])
    held = np.flatnonzero(values > _FREE * values.max(initial=0.0))
    if not held.size or values[held[-1]] > _REGULAR * values[0]:
        return found
    step = Vt[held[-1]] * _ROUNDING / values[held[-1]]
    return loops.configuration(loops.moved(loops.guess[None], step[None])[0])


def _movable(
    linkage: Linkage, held: frozenset[str]
) -> tuple[tuple[Connection, ...], tuple[Connection, ...]]:
    """The passive joints, and all that may move."""
    movable = tuple(c for c in linkage.connections if c.may_move and c.name not in held)
    return tuple(c for c in movable if c.is_passive), movable


def _nearest(
    linkage: Linkage, held: frozenset[str], values: Mapping[str, np.ndarray]
) -> Configuration:
    """Closed at values of some joints, as near to the home coordinates of the others as it goes.

    Passive joints move, or all that may and are not held, where only these close the loops.
    """
    guess = {c.name: values.get(c.name, c.home) for c in linkage.connections}
    passive, movable = _movable(linkage, held)

    def found(moving: tuple[Connection, ...]) -> Configuration:
        loops = _Loops.of(linkage, guess, moving)
        return loops.configuration(nearest(loops, loops.guess[None])[0])

    first = found(passive)
    return first if first.is_closed or len(passive) == len(movable) else found(movable)


@dataclass(frozen=True)
class _Loops(LoopEquations):
    """The loops of a linkage as equations; a posture x has the coordinates of its motion tree."""

    linkage: Linkage
    start: Mapping[str, np.ndarray]  # coordinates of all connections to start from
    moving: Sequence[Connection]  # joints that may move
    length: float

    @classmethod
    def of(
        cls, linkage: Linkage, start: Mapping[str, np.ndarray], moving: Sequence[Connection]
    ) -> _Loops:
        """The loops that some joints may close."""
        in_loops = linkage.tree.in_loops
        own = [c for c in moving if c.name in in_loops]
        return cls(linkage, start, own, Bodies.of(linkage.tree, start).length)

    def followed(self, values: Mapping[str, np.ndarray]) -> list[Configuration]:
        """Configurations at values (N, size) of joints, on paths from where all loops close."""
        given = self._row({**self.start, **values})[:, self.given]
        if any(c.is_screw for c in self.moving):
            return [self._turn_by_turn(row) for row in given]
        return self._arrived(self.mode.at(given))

    def _arrived(self, found: FollowedPosture, lost: bool = False) -> list[Configuration]:
        each = zip(map(self.configuration, found.x), found.elsewhere, strict=True)
        return [
            replace(one, elsewhere=lost or bool(elsewhere), closes_at_home=True)
            for one, elsewhere in each
        ]

    def _turn_by_turn(self, given: np.ndarray) -> Configuration:
        """Along the path from home in parts in which no joint that is given turns far."""
        begin, mode, lost = self.guess[self.given], self.mode, False
        turned = np.max(np.abs(given - begin)[self.tree.turns[self.given]], initial=0.0)
        if turned > _FURTHEST:
            most = f"at most {_FURTHEST:g} rad from home"
            raise InputError(
                "turn of a joint that screws follow", got=f"{turned:.6g} rad", expected=most
            )
        parts = max(1, math.ceil(turned / PART_OF_A_TURN))
        for k in range(1, parts):
            found = mode.at((begin + (given - begin) * (k / parts))[None])
            if lost := not found.kept[0]:
                break
            mode = AssemblyMode(self, found.x[0])
        (arrived,) = self._arrived(mode.at(given[None]), lost)
        return arrived

    def configuration(self, x: np.ndarray) -> Configuration:
        """The linkage at one posture."""
        q = dict(self.start)
        for name, (places, sign) in self._read[1].items():
            q[name] = sign * x[places]
        bodies, gaps = Bodies.of(self.linkage.tree, q), {}
        for cut in self.linkage.tree.cuts:
            shift, turn = bodies.gap(cut).missed
            gaps[cut.name] = float(shift), float(turn)
        return Configuration(q, bodies.in_world, gaps, self.length)

    @cached_property
    def guess(self) -> np.ndarray:
        """Coordinates to start from (size,)."""
        return self._row(self.start)[0]

    @cached_property
    def mode(self) -> AssemblyMode:
        """The assembly mode where they start."""
        return AssemblyMode(self, self.guess)

    def _row(self, q: Mapping[str, np.ndarray]) -> np.ndarray:
        """Postures (N, size) at coordinates of connections (size,) or (N, size)."""
        own = {name: sign * np.atleast_2d(q[name]) for name, (_, sign) in self._read[1].items()}
        x = np.empty((max(map(len, own.values()), default=1), self.tree.size))
        for name, (places, _) in self._read[1].items():
            x[:, places] = own[name]
        return x

    @cached_property
    def given(self) -> np.ndarray:
        """Places of the joints that do not move by themselves."""
        return np.setdiff1d(np.arange(self.tree.size), self.unknowns)

    @cached_property
    def unknowns(self) -> np.ndarray:
        """Places of the joints that move."""
        return np.array([i for c in self.moving for i in self._read[1][c.name][0]], dtype=int)

    @cached_property
    def parts(self) -> tuple[ClosurePart, ...]:
        """All loops together."""
        equations = np.arange(6 * len(self.tree.ends))
        return (ClosurePart(np.arange(0), equations, np.arange(len(self.unknowns))),)

    @cached_property
    def tree(self) -> MotionTree:
        """Frames of the bodies along the spanning tree, and of the connections that close loops."""
        return self._read[0]

    @cached_property
    def _read(self) -> tuple[MotionTree, dict[str, tuple[list[int], float]]]:
        """The tree, and the places of the coordinates of each connection, with their sign."""
        tree, own = MotionTree(), self.linkage.tree
        frames = {self.linkage.base: AT_REST}
        led: dict[str, tuple[int, ...]] = {self.linkage.base: ()}
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

        for body, way in own.ways.items():
            if way:
                frames[body], led[body] = beyond(*way[-1])
        for cut in own.cuts:
            end, moving = beyond(cut)
            leading = led[cut.b]
            tree.ends.append(
                LoopEnd(
                    end,
                    frames[cut.b],
                    tuple(i for i in moving if i not in leading),
                    tuple(i for i in leading if i not in moving),
                )
            )
        return tree, places
