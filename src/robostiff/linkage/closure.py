"""Joint coordinates at which the loops of a linkage close, in the assembly mode of home."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.kinematics import freedom_twists, place_chain
from robostiff.kinematics.closure import AssemblyMode, ClosurePart, nearest
from robostiff.kinematics.turn import turn_by_vector, vector_of_turn
from robostiff.linkage.linkage import Connection, JointValues, Linkage
from robostiff.linkage.spanning_tree import SpanningTree, spanning_tree
from robostiff.model import Chain, Joint, JointKind, Locked, Passive, PlacedFreedom
from robostiff.spatial import Frame

# As for legs: the largest gap of a closed loop.
_CLOSED = 1e-7
# Loops with gaps up to this may lack digits rather than length.
_NEARLY = 1e-3


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
    """

    coordinates: Mapping[str, np.ndarray]
    frames: Mapping[str, Frame]
    gaps: Mapping[str, tuple[float, float]]
    length: float
    elsewhere: bool = False

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
    tree = spanning_tree(linkage)
    home = _first_closed(linkage, linkage.held, lambda moving: _nearest_home(tree, linkage, moving))
    if not given:
        return home
    # A joint with a given value may contradict one that keeps its home coordinate.
    if not home.is_closed:
        home = _first_closed(linkage, frozenset(), lambda own: _nearest_home(tree, linkage, own))
    return close_from(linkage, home, given)


def close_from(
    linkage: Linkage, home: Configuration, given: Mapping[str, np.ndarray]
) -> Configuration:
    """Coordinates at which all loops close, as `close` finds them from a configuration at home."""
    tree = spanning_tree(linkage)
    return _first_closed(
        linkage, frozenset(given), lambda moving: _at_values(tree, linkage, home, given, moving)
    )


def _first_closed(
    linkage: Linkage,
    held: frozenset[str],
    attempt: Callable[[tuple[Connection, ...]], Configuration],
) -> Configuration:
    """The attempt with passive joints where that closes, otherwise that with all that may move."""
    movable = tuple(
        c
        for c in linkage.connections
        if isinstance(c.element, Joint)
        and c.name not in held
        and not isinstance(c.element.role, Locked)
    )
    passive = tuple(c for c in movable if _is_passive(c))
    found = attempt(passive)
    return found if found.is_closed or passive == movable else attempt(movable)


def _is_passive(connection: Connection) -> bool:
    return isinstance(connection.element, Joint) and isinstance(connection.element.role, Passive)


def _nearest_home(
    tree: SpanningTree, linkage: Linkage, moving: tuple[Connection, ...]
) -> Configuration:
    """Closed as near to the home coordinates as possible."""
    loops = _Loops.of(tree, linkage, {c.name: c.home for c in linkage.connections}, moving)
    return loops.configuration(nearest(loops, loops.guess[None])[0])


def _at_values(
    tree: SpanningTree,
    linkage: Linkage,
    home: Configuration,
    values: Mapping[str, np.ndarray],
    moving: tuple[Connection, ...],
) -> Configuration:
    """Closed at values of some joints; if home is closed, along the path from home."""
    guess = {c.name: values.get(c.name, c.home) for c in linkage.connections}
    loops = _Loops.of(tree, linkage, guess, moving)
    if home.is_closed:
        start = np.concatenate([home.coordinates[c.name] for c in linkage.connections])
        found = AssemblyMode(loops, start).at(loops.at_values(home, values)[None])
        return replace(loops.configuration(found.x[0]), elsewhere=bool(found.elsewhere[0]))
    return loops.configuration(nearest(loops, loops.guess[None])[0])


@dataclass(frozen=True)
class _Loops:
    """The loops of a linkage as equations; a posture x has the coordinates of all connections.

    Attributes
    ----------
    tree : SpanningTree
    connections : sequence of Connection
    guess : (size,) array
        Coordinates to start from.
    unknowns : sequence of Connection
        Joints that move.
    length : float
        Characteristic length [m].
    """

    tree: SpanningTree
    connections: Sequence[Connection]
    guess: np.ndarray
    unknowns: Sequence[Connection]
    length: float

    @classmethod
    def of(
        cls,
        tree: SpanningTree,
        linkage: Linkage,
        guess: Mapping[str, np.ndarray],
        moving: Sequence[Connection],
    ) -> _Loops:
        """The loops that some joints may close."""
        return cls(
            tree,
            linkage.connections,
            np.concatenate([guess[c.name] for c in linkage.connections]),
            [c for c in moving if c.name in tree.in_loops],
            tree.length(tree.frames(guess)),
        )

    def at_values(self, home: Configuration, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """The prescribed coordinates: values, and those of other joints at rest as at home."""
        here = {c.name: values.get(c.name, home.coordinates[c.name]) for c in self.connections}
        return np.concatenate([here[c.name] for c in self.connections])[self.given]

    def configuration(self, x: np.ndarray) -> Configuration:
        """The linkage at one posture."""
        q = self._by_name(x)
        frames = self.tree.frames(q)
        return Configuration(q, frames, self.tree.gaps(q, frames), self.length)

    @cached_property
    def given(self) -> np.ndarray:
        """Places of the joints that do not move by themselves."""
        moving = {c.name for c in self.unknowns}
        own = [np.full(c.size, c.name not in moving) for c in self.connections]
        return np.flatnonzero(np.concatenate(own))

    @property
    def parts(self) -> tuple[ClosurePart, ...]:
        """All loops together."""
        count = sum(c.size for c in self.unknowns)
        equations = np.arange(6 * len(self.tree.cuts))
        return (ClosurePart(np.arange(0), equations, np.arange(count)),)

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """Gaps of all loops, turns as such and shifts as parts of the length (N, 6 m)."""
        return np.array([self._gaps(self._by_name(row)) for row in x])

    def rates(self, x: np.ndarray) -> np.ndarray:
        """Rates at which the unknown coordinates close the gaps (N, 6 m, n)."""
        return np.array([self._rates(self._by_name(row)) for row in x])

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
                own[:] = vector_of_turn(turn_by_vector(delta) @ turn_by_vector(own))
            else:
                own += delta
        return x

    def lengths(self, x: np.ndarray) -> np.ndarray:
        """None: a linkage has no telescopes."""
        return np.zeros((len(x), 0))

    def _by_name(self, x: np.ndarray) -> dict[str, np.ndarray]:
        ends = np.cumsum([c.size for c in self.connections])[:-1]
        return dict(zip((c.name for c in self.connections), np.split(x, ends), strict=True))

    def _gaps(self, q: Mapping[str, np.ndarray]) -> np.ndarray:
        frames = self.tree.frames(q)
        parts = [np.zeros(0)]
        for cut in self.tree.cuts:
            meant, there = self.tree.beyond(cut, q, frames[cut.a]), frames[cut.b]
            parts += [(there.p - meant.p) / self.length, vector_of_turn(there.R @ meant.R.T)]
        return np.concatenate(parts)

    def _rates(self, q: Mapping[str, np.ndarray]) -> np.ndarray:
        frames, tree = self.tree.frames(q), self.tree
        starts = np.cumsum([0, *(c.size for c in self.unknowns)])
        column = {c.name: start for c, start in zip(self.unknowns, starts, strict=False)}
        J = np.zeros((6 * len(tree.cuts), int(starts[-1])))
        placed = {c.name: placed_freedoms(c, q[c.name], frames[c.a]) for c in self.unknowns}
        for i, cut in enumerate(tree.cuts):
            rows, at = slice(6 * i, 6 * i + 6), frames[cut.b].p
            for connection, sign in tree.around(cut):
                if connection.name in column:
                    start = column[connection.name]
                    twists = freedom_twists(placed[connection.name], at)
                    J[rows, start : start + connection.size] += sign * twists
            J[6 * i : 6 * i + 3] /= self.length
        return J * self._units

    @cached_property
    def _units(self) -> np.ndarray:
        """Units of the coordinates: the length for a slide, a radian for a turn."""
        joints = [c.element for c in self.unknowns if isinstance(c.element, Joint)]
        freedoms = [screw for joint in joints for screw in joint.freedoms]
        return np.array([1.0 if screw.turns else self.length for screw in freedoms])


def placed_freedoms(connection: Connection, q: np.ndarray, frame_a: Frame) -> list[PlacedFreedom]:
    """The elementary joints of a joint in the world, where body a is."""
    if not isinstance(connection.element, Joint):
        return []
    start = frame_a @ connection.before
    return place_chain(Chain((connection.element,)), q, start.R, start.p).freedoms
