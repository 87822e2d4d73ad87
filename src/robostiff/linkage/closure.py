"""Bodies of a linkage in the world, and joint coordinates at which its loops close."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics import freedom_twists
from robostiff.kinematics.closure import AssemblyMode, ClosurePart, nearest
from robostiff.kinematics.closure.assembly_mode import FollowedPosture
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.spanning_tree import SpanningTree
from robostiff.kinematics.turn import turn_by_vector
from robostiff.linkage.linkage import Connection, JointValues, Linkage
from robostiff.model import Joint, JointKind
from robostiff.spatial import Frame
from robostiff.spatial.batch import product, transposed
from robostiff.spatial.rotation import vector_of_rotation


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
    near_home = partial(_nearest, linkage, {})
    home = _first_closed(linkage, linkage.held, near_home)
    if not given:
        return home
    # A joint with a given value may contradict one that keeps its home coordinate.
    if not home.is_closed:
        home = _first_closed(linkage, frozenset(), near_home)
    if home.is_closed:
        each = {name: own[None] for name, own in given.items()}
        return PathsFromHome(linkage, home, tuple(given)).to(each)[0]
    return _first_closed(linkage, frozenset(given), partial(_nearest, linkage, given))


@dataclass(frozen=True)
class PathsFromHome:
    """Paths from a closed home to values of some joints, as those of `close`."""

    linkage: Linkage
    home: Configuration
    given: tuple[str, ...]  # names of these joints

    def to(self, values: Mapping[str, np.ndarray]) -> list[Configuration]:
        """Configurations at values (N, size) of each, closed or as near as they came."""
        passive, movable = _movable(self.linkage, frozenset(self.given))
        found = self._path(all_follow=False).to(values)
        for i, one in enumerate(found):
            if not one.is_closed and len(passive) < len(movable):
                here = {name: own[i : i + 1] for name, own in values.items()}
                (found[i],) = self._path(all_follow=True).to(here)
        return found

    @kept
    def _path(self, *, all_follow: bool) -> _PathOfLoops:
        """Along which passive joints keep the loops closed, or all that may move."""
        moving = _movable(self.linkage, frozenset(self.given))[all_follow]
        return _PathOfLoops.of(self.linkage, self.home, moving)


@dataclass(frozen=True)
class _PathOfLoops:
    """Paths from a closed home along which some joints keep the loops closed."""

    loops: _Loops
    home: Configuration
    mode: AssemblyMode  # of home

    @classmethod
    def of(
        cls, linkage: Linkage, home: Configuration, moving: tuple[Connection, ...]
    ) -> _PathOfLoops:
        loops = _Loops.of(linkage, home.coordinates, moving)
        return cls(loops, home, AssemblyMode(loops, loops.guess))

    def to(self, values: Mapping[str, np.ndarray]) -> list[Configuration]:
        """As `PathsFromHome.to`."""
        given = self.loops.at_values(self.home, values)
        if any(c.is_screw for c in self.loops.unknowns):
            return [self._turn_by_turn(row) for row in given]
        return self._configurations(self.mode.at(given))

    def _configurations(self, found: FollowedPosture, lost: bool = False) -> list[Configuration]:
        return [
            replace(
                self.loops.configuration(x),
                elsewhere=lost or bool(elsewhere),
                closes_at_home=True,
            )
            for x, elsewhere in zip(found.x, found.elsewhere, strict=True)
        ]

    def _turn_by_turn(self, given: np.ndarray) -> Configuration:
        """Along the path from home in parts in which no joint that is given turns far."""
        loops, mode, lost = self.loops, self.mode, False
        begin = loops.guess[loops.given]
        turned = np.max(np.abs(given - begin)[loops.turning], initial=0.0)
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
            mode = AssemblyMode(loops, found.x[0])
        (found,) = self._configurations(mode.at(given[None]), lost)
        return found


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


def _first_closed(
    linkage: Linkage,
    held: frozenset[str],
    attempt: Callable[[tuple[Connection, ...]], Configuration],
) -> Configuration:
    """The attempt with passive joints where that closes, otherwise that with all that may move."""
    passive, movable = _movable(linkage, held)
    found = attempt(passive)
    return found if found.is_closed or passive == movable else attempt(movable)


def _movable(
    linkage: Linkage, held: frozenset[str]
) -> tuple[tuple[Connection, ...], tuple[Connection, ...]]:
    """The passive joints, and all that may move."""
    movable = tuple(c for c in linkage.connections if c.may_move and c.name not in held)
    return tuple(c for c in movable if c.is_passive), movable


def _nearest(
    linkage: Linkage, values: Mapping[str, np.ndarray], moving: tuple[Connection, ...]
) -> Configuration:
    """Closed at values of some joints, as near to the home coordinates of the others as it goes."""
    guess = {c.name: values.get(c.name, c.home) for c in linkage.connections}
    loops = _Loops.of(linkage, guess, moving)
    return loops.configuration(nearest(loops, loops.guess[None])[0])


@dataclass(frozen=True)
class _Loops:
    """The loops of a linkage as equations; a posture x has the coordinates of all connections."""

    tree: SpanningTree[Connection]
    connections: Sequence[Connection]
    guess: np.ndarray  # (size,): coordinates to start from
    unknowns: Sequence[Connection]  # joints that move
    length: float  # characteristic length [m]

    @classmethod
    def of(
        cls, linkage: Linkage, guess: Mapping[str, np.ndarray], moving: Sequence[Connection]
    ) -> _Loops:
        """The loops that some joints may close."""
        tree = linkage.tree
        return cls(
            tree,
            linkage.connections,
            np.concatenate([guess[c.name] for c in linkage.connections]),
            [c for c in moving if c.name in tree.in_loops],
            Bodies.of(tree, guess).length,
        )

    def at_values(self, home: Configuration, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """The prescribed coordinates (N, g): values (N, size), other joints as at home."""
        count = len(next(iter(values.values())))
        still = {name: np.tile(own, (count, 1)) for name, own in home.coordinates.items()}
        here = [values.get(c.name, still[c.name]) for c in self.connections]
        return np.concatenate(here, axis=-1)[:, self.given]

    def configuration(self, x: np.ndarray) -> Configuration:
        """The linkage at one posture."""
        q = self._by_name(x)
        bodies, gaps = Bodies.of(self.tree, q), {}
        for cut in self.tree.cuts:
            shift, turn = bodies.gap(cut).missed
            gaps[cut.name] = float(shift), float(turn)
        return Configuration(q, bodies.in_world, gaps, self.length)

    @cached_property
    def given(self) -> np.ndarray:
        """Places of the joints that do not move by themselves."""
        moving = {c.name for c in self.unknowns}
        own = [np.full(c.size, c.name not in moving) for c in self.connections]
        return np.flatnonzero(np.concatenate(own))

    @cached_property
    def turning(self) -> np.ndarray:
        """Which of the given coordinates turn a joint (g,)."""
        own = [screw.turns for c in self.connections for screw in c.freedoms]
        return np.array(own, dtype=bool)[self.given]

    @property
    def parts(self) -> tuple[ClosurePart, ...]:
        """All loops together."""
        count = sum(c.size for c in self.unknowns)
        equations = np.arange(6 * len(self.tree.cuts))
        return (ClosurePart(np.arange(0), equations, np.arange(count)),)

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """Gaps of all loops, turns as such and shifts as parts of the length (N, 6 m)."""
        return self._gaps_of(len(x), Bodies.of(self.tree, self._by_name(x)))

    def _gaps_of(self, count: int, bodies: Bodies) -> np.ndarray:
        parts = [np.zeros((count, 0))]
        for cut in self.tree.cuts:
            gap = bodies.gap(cut)
            turn = vector_of_rotation(product(gap.R_wanted, transposed(gap.R)))
            parts += [(gap.p_wanted - gap.p) / self.length, turn]
        return np.concatenate([np.broadcast_to(p, (count, p.shape[-1])) for p in parts], axis=-1)

    def rates(self, x: np.ndarray) -> np.ndarray:
        """Rates at which the unknown coordinates close the gaps (N, 6 m, n)."""
        return self.gaps_and_rates(x)[1]

    def gaps_and_rates(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Both, of bodies that are placed once."""
        count, tree = len(x), self.tree
        bodies = Bodies.of(tree, self._by_name(x))
        starts = np.cumsum([0, *(c.size for c in self.unknowns)])
        column = {c.name: start for c, start in zip(self.unknowns, starts, strict=False)}
        J = np.zeros((count, 6 * len(tree.cuts), int(starts[-1])))
        placed = {c.name: bodies.placed(c) for c in self.unknowns}
        for i, cut in enumerate(tree.cuts):
            rows, at = slice(6 * i, 6 * i + 6), bodies.frames[cut.b].p
            for connection, sign in tree.around(cut):
                own = placed.get(connection.name)
                if own is not None:
                    start = column[connection.name]
                    twists = freedom_twists(own.freedoms, at)
                    J[:, rows, start : start + connection.size] += sign * twists
            J[:, 6 * i : 6 * i + 3] /= self.length
        return self._gaps_of(count, bodies), J * self._units

    def moved(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Postures after steps; coordinates of a spherical joint turn it about axes of body a."""
        x, start, at = x.copy(), 0, 0
        step = step * self._units
        moving = {c.name for c in self.unknowns}
        for c in self.connections:
            own = x[:, at : at + c.size]
            at += c.size
            if c.name not in moving:
                continue
            delta = step[:, start : start + c.size]
            start += c.size
            if isinstance(c.element, Joint) and c.element.kind is JointKind.SPHERICAL:
                own[:] = vector_of_rotation(turn_by_vector(delta) @ turn_by_vector(own))
            else:
                own += delta
        return x

    def lengths(self, x: np.ndarray) -> np.ndarray:
        """None: a linkage has no telescopes."""
        return np.zeros((len(x), 0))

    def _by_name(self, x: np.ndarray) -> dict[str, np.ndarray]:
        ends = np.cumsum([c.size for c in self.connections])[:-1]
        parts = np.split(x, ends, axis=-1)
        return dict(zip((c.name for c in self.connections), parts, strict=True))

    @cached_property
    def _units(self) -> np.ndarray:
        """Units of the coordinates: the length for a slide, a radian for a turn."""
        joints = [c.element for c in self.unknowns if isinstance(c.element, Joint)]
        freedoms = [screw for joint in joints for screw in joint.freedoms]
        return np.array([1.0 if screw.turns else self.length for screw in freedoms])
