"""Joint coordinates at which the loops of a linkage close, by damped Newton steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from robostiff.kinematics import freedom_twists, place_chain
from robostiff.kinematics.turn import turn_by_vector, vector_of_turn
from robostiff.linkage.linkage import Connection, JointValues, Linkage
from robostiff.linkage.spanning_tree import SpanningTree, spanning_tree
from robostiff.model import Chain, Joint, JointKind, Locked, Motion, Passive, PlacedFreedom
from robostiff.spatial import Frame

_ITERATIONS = 100
_CONVERGED = 1e-14
_STANDSTILL = 1e-11
# As for legs: what a platform counts as reached by.
_CLOSED = 1e-7
# Loops that close but for this may lack digits rather than length.
_NEARLY = 1e-3
_LARGEST_STEP = 0.5


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
    """

    coordinates: Mapping[str, np.ndarray]
    frames: Mapping[str, Frame]
    gaps: Mapping[str, tuple[float, float]]
    length: float

    @property
    def is_closed(self) -> bool:
        """Whether all loops close."""
        return all(
            shift <= _CLOSED * self.length and turn <= _CLOSED for shift, turn in self.gaps.values()
        )

    @property
    def complaint(self) -> str:
        """The widest gap in words."""
        name, (shift, turn) = self._widest
        return f"a gap of {1e3 * shift:.4g} mm and {np.degrees(turn):.4g} deg at {name!r}"

    @property
    def advice(self) -> str:
        """What to do about loops that do not close."""
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
    q = {c.name: given.get(c.name, c.home) for c in linkage.connections}
    # A joint that is told a value now may contradict what another one holds at home.
    held = frozenset(given) if given else linkage.held
    movable = [
        c
        for c in linkage.connections
        if isinstance(c.element, Joint)
        and c.name not in held
        and not isinstance(c.element.role, Locked)
    ]
    passive = [c for c in movable if _is_passive(c)]
    found = _newton(tree, q, passive)
    return found if found.is_closed else _newton(tree, q, movable)


def _is_passive(connection: Connection) -> bool:
    return isinstance(connection.element, Joint) and isinstance(connection.element.role, Passive)


def _newton(
    tree: SpanningTree, q: Mapping[str, np.ndarray], moving: Iterable[Connection]
) -> Configuration:
    """Levenberg steps damped by the square of the error; the best configuration on the way."""
    coordinates = dict(q)
    length = tree.length(tree.frames(coordinates))
    unknowns = [c for c in moving if c.name in tree.in_loops]
    units = np.array([unit for c in unknowns for unit in _units(c, length)])
    best, least = coordinates, np.inf
    for _ in range(_ITERATIONS):
        frames = tree.frames(coordinates)
        e = _errors(tree, coordinates, frames, length)
        size = float(np.abs(e).max(initial=0.0))
        better = size < least
        if better:
            best, least = coordinates, size
        if least <= _CONVERGED or (not better and least <= _STANDSTILL) or not unknowns:
            break
        J = _jacobian(tree, coordinates, frames, unknowns, length) * units
        A = J @ J.T
        damping = max(min(size, 1.0) ** 2, 1e-15) * np.trace(A) / len(A)
        if damping == 0.0:
            break  # nothing moves a gap
        step = J.T @ np.linalg.solve(A + damping * np.eye(len(A)), e)
        step *= min(1.0, _LARGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        coordinates = _advanced(coordinates, unknowns, step * units)
    frames = tree.frames(best)
    return Configuration(best, frames, tree.gaps(best, frames), length)


def _units(connection: Connection, length: float) -> list[float]:
    """What a step of 1 means: the length for a slide, a radian for a turn."""
    freedoms = connection.element.freedoms if isinstance(connection.element, Joint) else ()
    return [length if f.motion is Motion.TRANSLATION else 1.0 for f in freedoms]


def _errors(
    tree: SpanningTree, q: Mapping[str, np.ndarray], frames: Mapping[str, Frame], length: float
) -> np.ndarray:
    """Gaps of all loops, turns as such and shifts as parts of the length (6 m)."""
    parts = [np.zeros(0)]
    for cut in tree.cuts:
        meant, there = tree.beyond(cut, q, frames[cut.a]), frames[cut.b]
        parts += [(there.p - meant.p) / length, vector_of_turn(there.R @ meant.R.T)]
    return np.concatenate(parts)


def _jacobian(
    tree: SpanningTree,
    q: Mapping[str, np.ndarray],
    frames: Mapping[str, Frame],
    unknowns: list[Connection],
    length: float,
) -> np.ndarray:
    """Rates at which the unknown coordinates close the gaps (6 m, n)."""
    starts = np.cumsum([0, *(c.size for c in unknowns)])
    column = {c.name: start for c, start in zip(unknowns, starts, strict=False)}
    J = np.zeros((6 * len(tree.cuts), int(starts[-1])))
    placed = {c.name: placed_freedoms(c, q[c.name], frames[c.a]) for c in unknowns}
    for i, cut in enumerate(tree.cuts):
        rows, at = slice(6 * i, 6 * i + 6), frames[cut.b].p
        ways = [(1.0, tree.ways[cut.a]), (-1.0, tree.ways[cut.b]), (1.0, ((cut, 1.0),))]
        for sign, way in ways:
            for connection, direction in way:
                if connection.name in column:
                    start = column[connection.name]
                    twists = freedom_twists(placed[connection.name], at)
                    J[rows, start : start + connection.size] += sign * direction * twists
        J[6 * i : 6 * i + 3] /= length
    return J


def placed_freedoms(connection: Connection, q: np.ndarray, frame_a: Frame) -> list[PlacedFreedom]:
    """The elementary joints of a joint in the world, where body a is."""
    if not isinstance(connection.element, Joint):
        return []
    start = frame_a @ connection.before
    return place_chain(Chain((connection.element,)), q, start.R, start.p).freedoms


def _advanced(
    q: Mapping[str, np.ndarray], unknowns: list[Connection], step: np.ndarray
) -> dict[str, np.ndarray]:
    """Coordinates after a step; those of a spherical joint turn it about the axes of body a."""
    moved, start = dict(q), 0
    for c in unknowns:
        delta = step[start : start + c.size]
        start += c.size
        if isinstance(c.element, Joint) and c.element.kind is JointKind.SPHERICAL:
            moved[c.name] = vector_of_turn(turn_by_vector(delta) @ turn_by_vector(q[c.name]))
        else:
            moved[c.name] = q[c.name] + delta
    return moved
