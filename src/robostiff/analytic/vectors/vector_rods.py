"""What carries the wrenches of a leg: a strut between two joints, or a rod that is driven.

The places of a rod follow from those of its joints by equations that are the same for all legs:

* on a slide through a_i along e_i: ``|d_i - q_i e_i| = l``;
* on a crank of length a about e_i, along v_i: ``|d_i - a v_i| = l``;
* on a link of length a that turns on a slide about its direction e_i, with all joints about e_i, as
  in a Tripteron: ``|d_i - q_i e_i - a v_i| = l``.

What all vectors are at the samples follows from the same equations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.vectors.vector_expressions import (
    Cross,
    Dot,
    Equation,
    Norm,
    Over,
    Sum,
    Times,
    Turned,
    Vector,
    VectorExpression,
    value_of,
)
from robostiff.frozen import frozen
from robostiff.kinematics.formula import place_leg_at_joints
from robostiff.model import PlacedLeg, Telescope
from robostiff.record import Entry, square_root
from robostiff.recorded.elimination import turned_back
from robostiff.recorded.leg import at_samples as sampled

SAME = 1e-9
P, R0, A, B, D, E, G, J, M, N, U, V = map(
    Vector, ("p", "r_0", "a_i", "b_i", "d_i", "e_i", "g_i", "j_i", "m_i", "n_i", "u_i", "v_i")
)
LENGTH, _OFF = (sp.Symbol(name, positive=True) for name in ("L_i", "y_i"))
COSINE, SINE = (sp.Symbol(name, positive=True) for name in ("s_i", "t_i"))
_ALONG, _SHIFT = (sp.Symbol(name, real=True) for name in ("x_i", "q_i"))
_F, _H, _Z = (sp.Symbol(name, real=True) for name in ("f_i", "h_i", "z_i"))
#: Scalars of a leg, in which its compliances are written.
SCALARS = {_F, _H, _ALONG, _Z, LENGTH, COSINE, SINE}


@frozen
class Platform:
    """How vectors of the platform are written in the world."""

    rotation: str | None  # its name; None where it is not turned
    is_shifted: bool  # whether the reference point is not its origin
    at: dict[str, np.ndarray]  # its point, rotation and reference point at the samples

    def turned(self, vector: VectorExpression) -> VectorExpression:
        """A vector of the platform in the world."""
        return vector if self.rotation is None else Turned(self.rotation, vector)

    @property
    def end(self) -> VectorExpression:
        """From the reference point to the joint of a leg."""
        return self.turned(Sum((1, B), (-1, R0)) if self.is_shifted else B)

    @property
    def base(self) -> VectorExpression:
        """From the reference point to the base of a leg."""
        shift = ((-1, self.turned(R0)),) if self.is_shifted else ()
        return Sum((1, A), (-1, P), *shift)


class Carrier(Enum):
    """What a rod stands on."""

    NOTHING = "nothing: it is a strut"
    SLIDE = "slide"
    CRANK = "crank"
    DYAD = "link on a slide"


@frozen
class Numbers:
    """Vectors and scalars of a leg at the samples, by name, found by their equations."""

    count: int
    known: dict[str, np.ndarray]  # components first

    def give(self, e: Equation) -> None:
        """One more."""
        self.known[e.name] = np.moveaxis(self.of(e.expression), 0, -1)

    def of(self, x: Any) -> Any:
        """A vector (count, 3), a wrench (count, 6) or a scalar (count,)."""

        def scalar(expression: Any) -> Any:
            at = {s: self.known[s.name] for s in expression.free_symbols}
            return np.broadcast_to(values_of([expression], at)[0], self.count)

        with np.errstate(all="ignore"):
            return np.moveaxis(value_of(x, self.known, scalar), -1, 0)


@frozen(eq=False)
class Bar:
    """The straight part of a leg between its outer joints."""

    carrier: Carrier
    # (3,) by letter: a, the joint of a strut, or a point of the slide or of the axis of the crank;
    # b, its end on the platform, in the platform's axes; e, axis of the slide or crank, of a strut
    # that of its first joint; j, axis of the first passive joint of a rod, where it does not turn,
    # of a strut that of the last one, in the platform's axes
    vectors: dict[str, Any]
    # crank, length: of the crank or first link, and of the rod [m]; of a strut both are zero
    crank: Any
    length: Any
    width: Any  # between two parallel rods [m], along the axis of their joints; zero of one rod
    at: Numbers
    side: int = 1  # in which of its two ways it closes

    @property
    def first(self) -> Vector:
        """The axis of the first joint: that of its carrier, or its own."""
        if self.carrier is Carrier.NOTHING or "j" not in self.vectors:
            return E
        return E if are_along(self.at.of(J), self.at.of(E)) else J

    @property
    def directions(self) -> list[VectorExpression]:
        """Unit vectors that a person would name, those of the rod first."""
        is_dyad = self.carrier is Carrier.DYAD
        found = [U, self.first, *((M, N, V, G, Cross(E, V)) if is_dyad else (G, N))]
        found += [J] * (self.carrier is Carrier.NOTHING)
        return [x for x in found if np.all(np.isfinite(self.at.of(x)))]

    def scalars(self) -> list[Any]:
        """What slides and cranks feel of a unit force along the rod, and what follows from it.

        Along a slide f; along a crank f, across it h, and along its axis z. Of links on a slide the
        same of directions across the slide.
        """
        across = sp.sqrt(1 - _F**2)
        return {
            Carrier.NOTHING: [LENGTH, LENGTH / 2],
            Carrier.SLIDE: [_F],
            Carrier.CRANK: [_F, _H, self.crank * _H, _Z, across],
            Carrier.DYAD: [_ALONG, sp.sqrt(1 - _ALONG**2), _F, _H],
        }[self.carrier]

    def scalars_across(self) -> list[Any]:
        """What cranks and parallel rods feel of a unit couple across their axis e and the rod.

        Cosines and sines over t = |e x u|; in rods that are w apart the force 1/(w t).
        """
        if not varies(self.at.of(SINE)):
            return []
        in_rods = [] if self.width == 0 else [1 / (self.width * SINE), sp.S.Half]
        of_carrier = [x for x in self.scalars() if x in (_F, _H) and varies(self.at.of(x))]
        return [*(x / SINE for x in of_carrier), *in_rods]  # of a force, each rod has half

    def give_angle(self, used: Sequence[Any]) -> list[Any]:
        """Cosine and sine of its angle to what lies across it, of the directions that are used.

        That is the axis of the joint, or what is square to it; none of links.
        """
        across = [x for x in used if x not in (U, G)] or [self.first] * (G in used)
        if self.carrier is Carrier.DYAD or not across:
            return []
        for e in angle_of(self, N if N in used else self.first):
            self.at.give(e)
        return across

    def named(self, scalars: list[Any]) -> list[tuple[np.ndarray, Any]]:
        """Some of them with their values; whole numbers need no name."""
        each = [(self.at.of(x), x) for x in scalars]
        return [(at, x) for at, x in each if varies(at) or x == sp.S.Half]


def rod_of(
    placed: PlacedRobot, number: int, platform: Platform, write: Callable[[Any], Any]
) -> Bar | None:
    """The rod or strut of a leg; None where it has none. `write`: reads entries as formulas."""
    chain, leg = placed.entries.legs[number], placed.legs[number].leg
    count, ends = placed.record.count, ends_of(leg)
    if ends is None:
        return None
    R, first, tip = sampled(placed.platform.R, count), next(leg.freedoms), chain.attachment.p
    end = platform.at["p"] + np.einsum("nij,nj->ni", R, sampled(tip, count))
    start, stop = (sampled(x, count) for x in ends)
    elbow: Any = _elbow_of(leg, count)
    if np.max(np.abs(end - stop)) > SAME * placed.length and (leg.blocks or elbow is not None):
        tip, end = in_the_platform(placed, ends[1] - placed.platform.p), stop
    vectors: dict[str, Any] = {"a": chain.base.p, "b": tip, "e": first.axis}
    crank: Any = 0
    length: Any = 0
    width: Any = 0
    carrier = Carrier.NOTHING
    if first.is_passive and not leg.blocks:
        last = [f for f in leg.freedoms if f.is_passive and f.turns][-1]
        vectors["j"] = in_the_platform(placed, last.axis)
    else:
        drives = [f for f in leg.freedoms if not f.is_passive]
        telescopes = any(isinstance(element, Telescope) for element, _ in chain.chain.moving)
        if len(drives) != 1 or drives[0] is not first or telescopes:
            return None
        # Lengths and directions are read where all coordinates are zero: no closure is in them.
        zero = np.zeros(chain.chain.size, dtype=int).astype(object)
        at_zero = place_leg_at_joints(chain, zero).leg
        begins, stops = ends_of(at_zero) or ends
        drive, elbow_at_zero = next(at_zero.freedoms), _elbow_of(at_zero, count)
        carrier, base = Carrier.SLIDE, begins
        if drive.turns:
            carrier, base = Carrier.CRANK, np.asarray(drive.point, dtype=object)
        elif elbow_at_zero is not None and elbow is not None:
            carrier, begins, start = Carrier.DYAD, elbow_at_zero, sampled(elbow, count)
        vectors |= {"a": base, "e": drive.axis}
        joint, now = (next(f for f in x.freedoms if f.is_passive).axis for x in (at_zero, leg))
        if np.max(np.abs(sampled(joint, count) - sampled(now, count))) < SAME:
            vectors["j"] = joint
        crank, length = _distance(base, begins, placed), _distance(begins, stops, placed)
        width = _width(at_zero, vectors.get("j"), placed)
    known = {name: placed.record.input(name).sample for name in placed.symbols} | platform.at
    known |= {f"{letter}_i": sampled(x, count) for letter, x in vectors.items()}
    if carrier is Carrier.NOTHING:
        known["j_i"] = np.einsum("nij,nj->ni", R, known["j_i"])
    with np.errstate(all="ignore"):
        along = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
    crank, length, width = map(write, (crank, length, width))
    known = {name: np.moveaxis(x, 0, -1) for name, x in known.items()}
    divisors = {Carrier.NOTHING: (), Carrier.SLIDE: (length,)}.get(carrier, (crank, length))
    for side in (1, -1) if all(x != 0 for x in divisors) else ():
        bar = Bar(carrier, vectors, crank, length, width, Numbers(count, dict(known)), side)
        closure = closure_of(bar, platform, bar.length, bar.crank, side)
        for e in (*closure, *across_of(bar, is_unit=False)):
            bar.at.give(e)
        if np.max(np.abs(bar.at.of(U) - along)) < SAME:
            return bar
    return None


def closure_of(
    bar: Bar, platform: Platform, l: Any, a: Any, side: Any, *, in_plane: bool = False
) -> list[Equation]:
    """Equations from d_i to u_i, the same for all legs but for what the table has.

    `l`, `a`, `side`: length of the rod and of its crank, and how it closes, 1 or -1 or a symbol;
    `in_plane`: whether d_i is square to e_i.
    """
    carrier, root = bar.carrier, sp.sqrt(1 - _ALONG**2)
    d = Equation("d_i", Sum((1, P), (1, platform.turned(B)), (-1, A)))
    size, off = Equation("L_i", Norm(D)), Equation("y_i", Norm(Cross(E, D)))
    if carrier is Carrier.NOTHING:
        return [d, size, Equation("u_i", Over(D, LENGTH))]
    if carrier is Carrier.SLIDE:
        shift = Equation("q_i", _ALONG - side * sp.sqrt(l**2 - _OFF**2))
        u = Over(Sum((1, D), (-1, Times(_SHIFT, E))), l)
        return [d, off, Equation("x_i", Dot(E, D)), shift, Equation("u_i", u)]
    across = (int(side), root) if side in (1, -1) else (1, side * root)
    terms: list[tuple[int, Any]] = [(1, D), (-1, Times(a, V))]
    if carrier is Carrier.CRANK:
        far, near = LENGTH, LENGTH if in_plane else _OFF
        before, n, named = [size] if in_plane else [off, size], Cross(M, E), []
    else:
        far = near = _OFF
        before, n = [off, Equation("q_i", Dot(E, D))], N
        named = [Equation("n_i", Cross(M, E))]
        terms.insert(1, (-1, Times(_SHIFT, E)))
    v = Sum((1, Times(_ALONG, n)), (across[0], Times(across[1], M)))
    return [
        d,
        *before,
        Equation("m_i", Over(Cross(E, D), near)),
        *named,
        Equation("x_i", (far**2 + a**2 - l**2) / (2 * a * near)),
        Equation("v_i", v),
        Equation("u_i", Over(Sum(*terms), l)),
    ]


def across_of(bar: Bar, *, is_unit: bool) -> list[Equation]:
    """Directions across a rod, and scalars of its carrier; `is_unit`: whether |e x u| = 1."""
    across = Cross(bar.first, U)
    found = [Equation("g_i", across if is_unit else Over(across, Norm(across)))]
    if bar.carrier is not Carrier.DYAD:
        found.append(Equation("n_i", Cross(G, bar.first)))
    of_crank = {"f_i": Dot(V, U), "h_i": Dot(Cross(E, V), U), "z_i": Dot(E, U)}
    scalars = {Carrier.NOTHING: {}, Carrier.SLIDE: {"f_i": Dot(E, U)}}.get(bar.carrier, of_crank)
    return [*found, *(Equation(name, x) for name, x in scalars.items())]


def angle_of(bar: Bar, other: Vector) -> list[Equation]:
    """Cosine and sine of the angle between a rod and a direction."""
    is_strut = bar.carrier is Carrier.NOTHING and other == N
    sine = Dot(E, U) if is_strut else Norm(Cross(other, U))  # the same but for its sign
    cosine = Equation("s_i", Dot(other, U))
    return [cosine, Equation("t_i", sine)]


def ends_of(leg: PlacedLeg) -> tuple[np.ndarray, np.ndarray] | None:
    """The outer passive joints of a leg; of parallel rods the middles of their joints."""
    if len(leg.blocks) > 1:
        return None
    branches = leg.blocks[0].branches if leg.blocks else (leg,)
    both = []
    for branch in branches:
        points = [f.point for f in branch.freedoms if f.is_passive and f.turns]
        if not points:
            return None
        both.append((np.asarray(points[0], dtype=object), np.asarray(points[-1], dtype=object)))
    if len(both) == 1:
        return both[0]
    share = sp.Rational(1, len(both))
    begins, stops = (np.sum(np.stack(points), axis=0) * share for points in zip(*both, strict=True))
    return begins, stops


def _elbow_of(leg: PlacedLeg, count: int) -> Any:
    """The joint between two links that turn about a slide's direction; None where this differs."""
    first, *others = leg.freedoms
    turns = [f for f in others if f.is_passive and f.is_rotation]
    if leg.blocks or not first.is_translation or len(turns) != len(others) or len(turns) != 3:
        return None
    e = sampled(first.axis, count)
    is_elbow = all(are_along(sampled(f.axis, count), e) for f in turns)
    return np.asarray(turns[1].point, dtype=object) if is_elbow else None


def in_the_platform(placed: PlacedRobot, vector: np.ndarray) -> Any:
    """A vector of the world in the axes of the platform."""
    turned = turned_back(placed.platform.R, vector)
    return tuple(placed.record.simplify(x, placed.length) for x in turned)


def _width(leg: PlacedLeg, axis: np.ndarray | None, placed: PlacedRobot) -> Any:
    """How far two parallel rods are apart along an axis; zero where they are not."""
    if not leg.blocks or len(leg.blocks[0].branches) != 2 or axis is None:
        return 0
    a, b = (np.asarray(next(x.freedoms).point, dtype=object) for x in leg.blocks[0].branches)
    both = sampled(b - a, placed.record.count), sampled(axis, placed.record.count)
    is_along = np.max(np.abs(np.cross(*both))) < SAME * placed.length
    return _distance(a, b, placed) if is_along else 0


def _distance(a: np.ndarray, b: np.ndarray, placed: PlacedRobot) -> Any:
    square = placed.record.simplify((b - a) @ (b - a))
    length = square_root(square) if isinstance(square, Entry) else sp.sqrt(square)
    return placed.record.simplify(length)


def are_along(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether unit vectors are the same at all samples, up to one sign."""
    return any(bool(np.max(np.abs(one - sign * other)) < SAME) for sign in (1, -1))


def varies(values: np.ndarray) -> bool:
    """Whether a scalar is no whole number at all samples, which needs no name."""
    return bool(np.max(np.abs(values - np.rint(values))) > SAME)
