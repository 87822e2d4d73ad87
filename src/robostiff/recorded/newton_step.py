"""One Newton step of the closure of a whole robot on recorded entries.

Its sparse equations are solved with pivots that are chosen once.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add, mul
from typing import Any

import numpy as np

from robostiff.frozen import frozen
from robostiff.kinematics.closure.body import tidy_numbers, tidy_point
from robostiff.kinematics.closure.loops import tree_of_leg
from robostiff.kinematics.closure.motion_tree import MotionTree, PlacedTree
from robostiff.kinematics.formula import FormulaPose
from robostiff.kinematics.turn import rotvec_rate, vector_of_turn_near
from robostiff.model import Joint, JointKind, Leg, Telescope
from robostiff.record import Entry, cosine, is_number, is_zero, most_size, sine, square_root
from robostiff.spatial import Screw, cross, skew

_LOST = 1e-8  # of an entry at all samples: what is left of it is rounding
# A pivot is safe that at no sample falls below this part of the largest in its column, and of its
# own mean over the samples.
_OF_COLUMN, _OF_ITSELF = 0.15, 0.3


@dataclass(eq=False)
class LinearEquation:
    """One equation, sum of rates times unknowns = right side."""

    rates: dict[str, Any]  # without zeros
    right: Any
    weight: float = 1.0  # of its numbers, where they are compared with those of others


@dataclass
class SparseElimination:
    """Gaussian elimination of equations that share few unknowns, group after group.

    The order of pivots is chosen at the samples: safe ones first, and among those the one that
    fills in least (Markowitz). Where a chosen pivot vanishes elsewhere, so does the determinant of
    its group.
    """

    # Of each group, in the order of elimination
    pivots: list[list[Any]] = field(default_factory=list)
    undetermined: list[str] = field(default_factory=list)  # unknowns that no equation determines
    _solved_for: list[tuple[str, LinearEquation]] = field(default_factory=list)
    _sizes: dict[int, tuple[float, float]] = field(default_factory=dict)

    def eliminate(
        self, equations: Iterable[LinearEquation], unknowns: Iterable[str]
    ) -> list[LinearEquation]:
        """The equations that are left when unknowns are eliminated where they stand."""
        rest, open_ = list(equations), list(unknowns)
        pivots = []
        while (found := self._next(rest, open_)) is not None:
            chosen, name = found
            rest.remove(chosen)
            open_.remove(name)
            pivot = chosen.rates.pop(name)
            pivots.append(pivot)
            chosen = LinearEquation(
                {other: rate / pivot for other, rate in chosen.rates.items()}, chosen.right / pivot
            )
            self._solved_for.append((name, chosen))
            for equation in rest:
                if name in equation.rates:
                    factor = equation.rates.pop(name)
                    for other, rate in chosen.rates.items():
                        value = equation.rates.pop(other, 0) - factor * rate
                        if self._size(value)[1] * equation.weight > _LOST:
                            equation.rates[other] = value
                    equation.right = equation.right - factor * chosen.right
        self.pivots.append(pivots)
        self.undetermined += open_
        return rest

    def solution(self) -> dict[str, Any]:
        """Every unknown; 0 for those that no equation determines."""
        found: dict[str, Any] = dict.fromkeys(self.undetermined, 0)
        for name, equation in reversed(self._solved_for):
            value = equation.right
            for other, rate in equation.rates.items():
                if not is_zero(found[other]):
                    value = value - rate * found[other]
            found[name] = value
        return found

    def determinants(self) -> list[Any]:
        """Of each group of which pivots were taken, but for a constant sign."""
        return [reduce(mul, pivots) for pivots in self.pivots if pivots]

    def _next(
        self, equations: list[LinearEquation], unknowns: list[str]
    ) -> tuple[LinearEquation, str] | None:
        open_ = set(unknowns)
        counts = dict.fromkeys(unknowns, 0)
        largest = dict.fromkeys(unknowns, 0.0)
        for equation in equations:
            for name in open_ & equation.rates.keys():
                counts[name] += 1
                size = self._size(equation.rates[name])[1] * equation.weight
                largest[name] = max(largest[name], size)
        best: tuple[Any, ...] = ()
        for number, equation in enumerate(equations):
            names = [name for name in unknowns if name in equation.rates]
            most = max((self._size(equation.rates[name])[1] for name in names), default=0.0)
            entries = sum(isinstance(rate, Entry) for rate in equation.rates.values())
            for name in names:
                rate = equation.rates[name]
                least, usual = self._size(rate)
                part = least * equation.weight / largest[name]
                safe = part > _OF_COLUMN and least > _OF_ITSELF * usual
                fill = (len(equation.rates) - 1) * (counts[name] - 1) + (not is_number(rate))
                order = (0, fill, entries) if safe else (1, 0, 0)
                key = (*order, -part * least / most, number, name)
                best = min(best, key) if best else key
        return None if not best else (equations[best[-2]], best[-1])

    def _size(self, value: Any) -> tuple[float, float]:
        """Least and mean size over the samples."""
        if not isinstance(value, Entry):
            return abs(float(value)), abs(float(value))
        if value.step not in self._sizes:
            size = np.abs(value.sample)
            self._sizes[value.step] = float(np.min(size)), float(np.mean(size))
        return self._sizes[value.step]


_TINY = 1e-300  # keeps the square root of a vanishing angle regular
# Largest rate that counts as none: of an entry at closed postures, which are so but for rounding.
_STILL, _NO_NUMBER = 1e-8, 1e-14


@frozen
class LegAtGuess:
    """A leg of a robot at coordinates that need not close it."""

    leg: Leg  # of floats and recorded entries
    names: Sequence[str]  # of its coordinates, as unknowns
    # (size,) of entries and numbers: coordinates [m, rad], locked ones as numbers; 0 of those that
    # follow
    q: np.ndarray
    # Places of the coordinates of ball joints that follow from the others, three by three
    following: tuple[int, ...] = ()
    # (size,): coordinates near which these are looked for [rad]
    home: np.ndarray = field(default_factory=lambda: np.zeros(0))
    # Those that are no unknowns: a factor times another one; or a number
    same: Mapping[str, tuple[str | None, float]] = field(default_factory=dict)
    # Axes (3, 3) behind these ball joints in the frame of the base, by their first place
    turned: Mapping[int, np.ndarray] = field(default_factory=dict)

    @property
    def moving(self) -> dict[int, dict[str, float]]:
        """Unknowns with which each joint moves, by its place, and how fast."""
        chain = self.leg.chain
        T = np.eye(chain.size, dtype=int) if chain.joint_motions is None else chain.joint_motions
        found: dict[int, dict[str, float]] = {}
        for i in np.flatnonzero(chain.free).tolist():
            name, factor = self.same.get(self.names[i], (self.names[i], 1))
            if name is not None and i not in self.following:
                for joint in np.flatnonzero(T[:, i]).tolist():
                    found.setdefault(joint, {})[name] = int(factor) * T[joint, i]
        return found

    @property
    def free(self) -> list[str]:
        """Names of the unknown coordinates."""
        free = np.flatnonzero(self.leg.chain.free).tolist()
        names = [self.names[i] for i in free if i not in self.following]
        return [name for name in names if name not in self.same]


@frozen
class NewtonStep:
    """One Newton step from a guess."""

    steps: dict[str, Any]  # by how much each unknown moves [m, rad]
    size: Any  # sum of the squares of all steps, as parts of the length and radians
    # Sum of the squares of what the guess leaves open: shifts as parts of the length, and chords of
    # turns
    gap: Any
    # Of each leg, and of what couples them; their signs are those of the assembly mode
    determinants: list[Any]
    undetermined: list[str]  # unknowns that may have any value
    # Coordinates that follow from the others [rad]
    following: dict[str, Any] = field(default_factory=dict)


def newton_step(
    legs: Sequence[LegAtGuess],
    pose: FormulaPose,
    r: np.ndarray,
    open_: dict[int, str],
    length: float,
) -> NewtonStep:
    """One step towards postures in which all legs meet the platform, and branches one another.

    What stays open is seen from the base of each leg: a shift as a part of the length, and a turn D
    as vee(D - D^T)/2. Rates are those of closed postures, so that steps converge quadratically:
    what vanishes at all samples is left out of them. The coordinates of each leg are eliminated
    first, then what couples the legs: pose coordinates that are open, by number and name. `r` is
    the rotation vector of the platform [rad].
    """
    turning = rotvec_rate(r) if any(k >= 3 for k in open_) else None
    groups: list[ClosureGroup] = []
    following: dict[str, Any] = {}
    joints: list[JointAtGuess] = []
    for guess in legs:
        openings, turns = _openings(guess, pose, open_, turning, length)
        for ball, turn in turns.items():
            where = slice(ball, ball + 3)
            turned = vector_of_turn_near(turn, guess.home[where])
            following |= zip(guess.names[where], turned, strict=True)
        groups.append((openings, guess.free))
        freedoms = guess.leg.chain.freedoms
        for element, place in guess.leg.chain.moving:
            joints.append((element, guess.names[place], guess.q[place], freedoms[place]))
    shared = {name: length if k < 3 else 1.0 for k, name in open_.items()}
    return replace(step_of_groups(groups, shared, joints, length), following=following)


@frozen
class Opening:
    """What is open in a loop: by how much, and the twists by which unknowns close it.

    Turns D are vee(D - D^T)/2; unknowns that slide are parts of the length.
    """

    shift: np.ndarray  # (3,) [m]
    turn: np.ndarray  # (3,), or none of it
    rates: dict[str, np.ndarray]  # twists (6,)
    gaps: np.ndarray  # (3,) [m], and
    chords: np.ndarray  # (9,), or none of them: vanish where the loop is closed, and only there
    outer: int  # number of the loop that surrounds it, or its own
    center: np.ndarray  # (3,): where it is to be closed [m]
    ball: int | None  # the joint there that follows, by its first place

    def add(self, name: str, twist: np.ndarray) -> None:
        """Add a twist (6,) by which an unknown closes it."""
        self.rates[name] = self.rates[name] + twist if name in self.rates else twist


def openings(
    tree: MotionTree,
    placed: PlacedTree,
    moving: Mapping[int, Mapping[str, float]],
    length: float,
    balls: Collection[int] = (),
) -> Iterator[Opening]:
    """What is open at each end of a tree on entries.

    Unknowns move joints, by their places, each so fast. A ball joint that follows turns as the
    bodies before and behind it do: its center alone has to meet its place. Behind a ball of the
    path to the platform, branches end where the platform has them: their paths are closed with the
    platform as well, without the first branch.
    """
    shifts = placed.p_wanted - placed.p
    for k, end in enumerate(tree.ends):
        way, path = [k], list(end.moving)
        while crossed := [ball for ball in balls if ball in tree.ends[way[-1]].leading]:
            inner = tree.ends[way[-1]]
            way.append(next(i for i, other in enumerate(tree.ends) if crossed[0] in other.moving))
            path += [i for i in tree.ends[way[-1]].moving if i not in inner.leading]
        ball = next((ball for ball in balls if ball in end.moving), None)
        center = placed.p[k] if ball is None else placed.points[ball]
        shift = reduce(add, [shifts[i] for i in way])
        turn = chords = np.zeros(0)
        if ball is None:
            D = placed.R_wanted[k] @ placed.R[k].T
            turn = np.array([(D[i, j] - D[j, i]) * 0.5 for i, j in ((2, 1), (0, 2), (1, 0))])
            chords = (placed.R_wanted[k] - placed.R[k]).reshape(-1)
        found = Opening(shift, turn, {}, shifts[k], chords, way[-1], center, ball)
        wanted = placed.p_wanted[k] - (placed.p[k] - center)
        for sign, at, places in ((1, center, path), (-1, wanted, tree.ends[way[-1]].leading)):
            for i in places:
                if i not in moving:
                    continue
                screw = Screw(placed.axes[i], placed.points[i], tree.screws[i].pitch)
                twist = screw.twist(at) * (sign if screw.turns else sign * length)
                for name, factor in moving[i].items():
                    found.add(name, twist * factor)
        yield found


#: Loops that are closed together, and names of the unknowns that stand in no other group.
ClosureGroup = tuple[Sequence[Opening], Sequence[str]]
#: A joint, the names of its coordinates, these coordinates, and its freedoms.
JointAtGuess = tuple[Joint | Telescope, Sequence[str], np.ndarray, Sequence[Screw]]


def step_of_groups(
    groups: Sequence[ClosureGroup],
    shared: Mapping[str, float],
    joints: Iterable[JointAtGuess],
    length: float,
) -> NewtonStep:
    """One step that closes all gaps, group by group, then by the unknowns that they share.

    Those come with their units, the length or a radian. A spherical joint turns about the axes
    before it.
    """
    elimination = SparseElimination()
    coupled: list[LinearEquation] = []
    shifts: list[Any] = []
    chords: list[Any] = []
    for openings, unknowns in groups:
        shifts += (x * x for opening in openings for x in opening.gaps if not is_zero(x))
        chords += (x * x for opening in openings for x in opening.chords if not is_zero(x))
        equations = []
        for opening in openings:
            for row, missing in enumerate((*opening.shift, *opening.turn)):
                weight = 1 / length if row < 3 else 1.0
                rates = {name: rate[row] for name, rate in opening.rates.items()}
                for name, x in [*rates.items()]:  # what moves nothing is left out
                    least = _STILL if isinstance(x, Entry) else _NO_NUMBER
                    if most_size(x) * weight <= least:
                        del rates[name]
                if rates:
                    equations.append(LinearEquation(rates, missing, weight))
        coupled += elimination.eliminate(equations, unknowns)
    elimination.eliminate(coupled, shared)
    found = elimination.solution()
    moved = [x for x in found.values() if not is_zero(x)]
    steps = {name: found.get(name, 0) * unit for name, unit in shared.items()}
    for element, names, q, freedoms in joints:
        if found.keys().isdisjoint(names):
            continue
        turn = [found.get(name, 0) for name in names]
        if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
            # dr/dt = J_l^-1(r) w, J_l^-1 = I - (r x)/2 + (1 - (a/2) cot(a/2))/a^2 (r x)^2, regular
            # for a = |r| below a full turn; by 1/a and sin(a/2)/a, as the rotation has them.
            a, X = square_root(q @ q + _TINY), skew(q)
            cot = cosine(a * 0.5) / (sine(a * 0.5) / a)
            J = np.eye(3, dtype=int) - X * 0.5 + X @ X * ((1 - cot * 0.5) / a / a)
            turn = list(J @ np.array(turn, dtype=object))
        each = zip(names, turn, freedoms, strict=True)
        steps |= {name: x if screw.turns else x * length for name, x, screw in each}
    return NewtonStep(
        steps=steps,
        size=reduce(add, (x * x for x in moved), 0),
        gap=reduce(add, [*chords, reduce(add, shifts, 0) * (1 / length**2)]),
        determinants=[x for x in elimination.determinants() if isinstance(x, Entry)],
        undetermined=elimination.undetermined,
    )


def _openings(
    guess: LegAtGuess,
    pose: FormulaPose,
    open_: dict[int, str],
    turning: np.ndarray | None,
    length: float,
) -> tuple[list[Opening], dict[int, np.ndarray]]:
    """What is open in a leg, seen from its base, and turns (3, 3) of the balls that follow."""
    leg, tree = guess.leg, tree_of_leg(guess.leg, np.eye(3))
    R_base, p_base = tidy_numbers(leg.base.R), tidy_point(leg.base.p)
    arm = R_base.T @ (pose.R @ tidy_point(leg.attachment.p))
    placed = tree.placed(guess.q, guess.turned)
    placed.R_wanted[0] = R_base.T @ pose.R @ tidy_numbers(leg.attachment.R)
    placed.p_wanted[0] = R_base.T @ (pose.p - p_base) + arm
    found = [*openings(tree, placed, guess.moving, length, guess.turned)]
    for opening in found:
        if opening.outer == 0:
            arm_now = arm + (opening.center - placed.p[0])
            for k, name in open_.items():  # by which open pose coordinates close it
                w = R_base[k] * 0 if turning is None or k < 3 else R_base.T @ turning[:, k - 3]
                v = R_base[k] * length if k < 3 else cross(w, arm_now)
                opening.add(name, np.array([*v, *w], dtype=object) * -1)
    balls = [opening.ball for opening in found if opening.ball is not None]
    return found, {i: placed.axes[i : i + 3] @ guess.turned[i] for i in balls}
