"""What carries the wrenches of a leg: a strut between two joints, or a rod that is driven.

The places of a rod follow from those of its joints by equations that are the same for all legs:

* on a slide through a_i along e_i: ``|d_i - q_i e_i| = l``;
* on a crank of length a about e_i, along v_i: ``|d_i - a v_i| = l``;
* on a link of length a that turns on a slide about its direction e_i, with all joints about e_i, as
  in a Tripteron: ``|d_i - q_i e_i - a v_i| = l``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.springs.contributions import summed
from robostiff.analytic.springs.leg_springs import LegReader
from robostiff.analytic.springs.unit_wrenches import UnitWrench
from robostiff.analytic.vectors.leg_table import LegTable
from robostiff.analytic.vectors.vector_expressions import (
    Cross,
    Dot,
    Equation,
    Norm,
    Over,
    Sum,
    Times,
    Vector,
)
from robostiff.kinematics.formula import place_leg_at_joints
from robostiff.model import Leg, PlacedLeg, PlacedSpring, Telescope
from robostiff.record import Entry, square_root
from robostiff.recorded.leg import at_samples as sampled
from robostiff.recorded.working_frame import turned_back

_SAME = 1e-9
_D, _E, _M, _N, _U, _V = map(Vector, ("d_i", "e_i", "m_i", "n_i", "u_i", "v_i"))
_SINE = sp.Symbol("t_i", positive=True)
_LENGTH, _OFF = (sp.Symbol(name, positive=True) for name in ("L_i", "y_i"))
_ALONG, _SHIFT = (sp.Symbol(name, real=True) for name in ("x_i", "q_i"))
_ALONG_CARRIER, _ACROSS, _SIDEWAYS = (sp.Symbol(name, real=True) for name in ("f_i", "h_i", "z_i"))


class Carrier(Enum):
    """What a rod stands on."""

    NOTHING = "nothing: it is a strut"
    SLIDE = "slide"
    CRANK = "crank"
    DYAD = "link on a slide"


@dataclass(frozen=True, eq=False)
class Bar:
    """The straight part of a leg between its outer joints."""

    carrier: Carrier
    # (3,): the joint of a strut, or a point of the slide or of the axis of the crank
    base: np.ndarray
    axis: np.ndarray  # (3,): of the slide or crank; of a strut that of its first joint
    # (3,): axis of the first passive joint of a rod, where it does not turn; of a strut that of the
    # last one, in the platform's axes
    joint: np.ndarray | None
    # start, end: (count, 3): its joints, at the samples
    start: np.ndarray
    end: np.ndarray
    arm: np.ndarray  # (count, 3): the crank or first link, at the samples; zero without
    # crank, length: of the crank or first link, and of the rod [m]; of a strut both are zero
    crank: Any
    length: Any
    side: int  # in which of its two ways it closes
    tip: Any = None  # (3,): its end on the platform, in the platform's axes
    width: Any = 0  # between two parallel rods [m], along the axis of their joints; zero of one rod

    @property
    def unit(self) -> np.ndarray:
        """Unit vectors along it, at the samples (count, 3)."""
        return _units(self.end - self.start)

    @property
    def is_square(self) -> bool:
        """Whether it lies across its axis, or of a rod across the axis of its joint."""
        of = self.axis if self.carrier is Carrier.NOTHING or self.joint is None else self.joint
        return _is_across(of, self.unit)

    @property
    def along(self) -> np.ndarray:
        """Unit vectors along its crank or first link, at the samples (count, 3)."""
        return _units(self.arm)

    @property
    def across(self) -> np.ndarray:
        """Unit vectors across the axis and the line from there to its end (count, 3)."""
        return _units(np.cross(sampled(self.axis, len(self.arm)), self.end - self.start + self.arm))


def rod_of(placed: PlacedRobot, number: int) -> Bar | None:
    """The rod or strut of a leg; None where it has none."""
    chain, own = placed.entries.legs[number], placed.legs[number].leg
    count, close = placed.record.count, _SAME * placed.length
    R, p = sampled(placed.platform.R, count), sampled(placed.platform.p, count)
    end = p + np.einsum("nij,nj->ni", R, sampled(chain.attachment.p, count))
    ends, tip = ends_of(own), chain.attachment.p
    if ends is None:
        return None
    start, first = sampled(ends[0], count), next(own.freedoms)
    of_joints = sampled(ends[1], count)
    if np.max(np.abs(end - of_joints)) > close:
        if own.blocks or _elbow_of(own, count) is not None:
            tip, end = in_the_platform(placed, ends[1] - placed.platform.p), of_joints
        elif np.max(np.abs(start - of_joints)) > close:  # a post has all joints at its base
            return None
    drives = [f for f in own.freedoms if not f.is_passive]
    at_base = np.max(np.abs(start - sampled(chain.base.p, count))) < close
    if first.is_passive and at_base and not own.blocks:
        last = [f for f in own.freedoms if f.is_passive and f.turns][-1].axis
        nothing = Carrier.NOTHING, chain.base.p, first.axis, in_the_platform(placed, last)
        return Bar(*nothing, start, end, np.zeros_like(start), 0, 0, 1, tip)
    telescopes = any(isinstance(element, Telescope) for element, _ in chain.chain.moving)
    if len(drives) != 1 or drives[0] is not first or telescopes:
        return None
    return _carried(chain, own, (start, end, tip), placed)


def _carried(
    chain: Leg, own: PlacedLeg, ends: tuple[np.ndarray, ...], placed: PlacedRobot
) -> Bar | None:
    """A rod on a slide or a crank; None where this has another shape."""
    (start, end, tip), count, close = ends, placed.record.count, _SAME * placed.length
    # Lengths and directions are read where all coordinates are zero: no closure is in them.
    at_zero = place_leg_at_joints(chain, np.zeros(chain.chain.size, dtype=int).astype(object)).leg
    begins, stops = ends_of(at_zero) or ends[:2]
    drive = next(at_zero.freedoms)
    e = sampled(drive.axis, count)
    elbows = [_elbow_of(leg, count) for leg in (at_zero, own)]
    joint, now = (next(f for f in leg.freedoms if f.is_passive).axis for leg in (at_zero, own))
    apart = np.max(np.abs(sampled(joint, count) - sampled(now, count)))
    kept = joint if apart < _SAME else None
    if drive.turns:
        carrier, base = Carrier.CRANK, np.asarray(drive.point, dtype=object)
        arm = start - sampled(base, count)
        across = np.cross(e, end - sampled(base, count))
        way, missed = np.sum(arm * across, axis=1), np.sum(arm * e, axis=1)
        crank = _distance(base, begins, placed)
    elif elbows[0] is not None:
        carrier, base = Carrier.DYAD, begins
        begins, rail, start = elbows[0], start, sampled(elbows[1], count)
        arm, across = start - rail, np.cross(e, end - rail)
        way = np.sum(arm * across, axis=1)
        missed = np.einsum("mni,ni->mn", np.stack([end - rail, arm]), e)
        crank = _distance(base, begins, placed)
    else:
        carrier, base, arm, crank = Carrier.SLIDE, begins, np.zeros_like(start), 0
        way = np.sum((end - start) * e, axis=1)
        missed = np.cross(start - sampled(base, count), e)
    sides = {int(x) for x in np.sign(way)}
    if np.max(np.abs(missed)) > close or len(sides) > 1 or 0 in sides:
        return None
    return Bar(
        carrier,
        base,
        drive.axis,
        kept,
        start,
        end,
        arm,
        crank,
        length=_distance(begins, stops, placed),
        side=sides.pop(),
        tip=tip,
        width=_width(at_zero, kept, placed),
    )


def closure_of(rods: list[Bar], table: LegTable, write: Callable[[Any], Any]) -> list[Equation]:
    """Equations from d_i to u_i, the same for all legs but for what the table has."""
    carrier = rods[0].carrier
    if carrier is Carrier.NOTHING:
        return [Equation("L_i", Norm(_D), is_vector=False), Equation("u_i", Over(_D, _LENGTH))]
    side = table.scalar("sigma_i", [sp.Integer(rod.side) for rod in rods])
    length = table.scalar("l_i", [write(rod.length) for rod in rods])
    y = Equation("y_i", Norm(Cross(_E, _D)), is_vector=False)
    if carrier is Carrier.SLIDE:
        shift = _ALONG - side * sp.sqrt(length**2 - _OFF**2)
        return [
            y,
            Equation("x_i", Dot(_E, _D), is_vector=False),
            Equation("q_i", shift, is_vector=False),
            Equation("u_i", Over(Sum(((1, _D), (-1, Times(_SHIFT, _E)))), length)),
        ]
    a = table.scalar("crank_i", [write(rod.crank) for rod in rods])
    sine: Any = sp.sqrt(1 - _ALONG**2)
    across = int(side) if side.is_Integer else 1, sine if side.is_Integer else side * sine
    far, off, before = _OFF, _OFF, [y]
    left: list[tuple[int, Any]] = [(1, _D), (-1, Times(a, _V))]
    if carrier is Carrier.CRANK:
        far, before = _LENGTH, [Equation("L_i", Norm(_D), is_vector=False)]
        in_plane = all(_is_across(rod.axis, rod.end - rod.start + rod.arm) for rod in rods)
        off, before = (_LENGTH, before) if in_plane else (_OFF, [y, *before])
    else:
        before.append(Equation("q_i", Dot(_E, _D), is_vector=False))
        left.insert(1, (-1, Times(_SHIFT, _E)))
    n: Any = Cross(_M, _E) if carrier is Carrier.CRANK else _N
    v = Sum(((1, Times(_ALONG, n)), (across[0], Times(across[1], _M))))
    return [
        *before,
        Equation("m_i", Over(Cross(_E, _D), off)),
        *([] if carrier is Carrier.CRANK else [Equation("n_i", Cross(_M, _E))]),
        Equation("x_i", (far**2 + a**2 - length**2) / (2 * a * off), is_vector=False),
        Equation("v_i", v),
        Equation("u_i", Over(Sum(tuple(left)), length)),
    ]


def _is_across(axis: Any, along: np.ndarray) -> bool:
    """Whether vectors at the samples (count, 3) are square to an axis."""
    dots = np.sum(sampled(axis, len(along)) * along, axis=1)
    return bool(np.max(np.abs(dots)) < _SAME * np.max(np.abs(along)))


def scalars_of(rod: Bar) -> list[tuple[Any, Dot, np.ndarray]]:
    """What slides and cranks feel of a unit force along the rod: name, equation, and samples.

    Along a slide f; along a crank f, across it h, and along its axis z. Of links on a slide the
    same of directions across the slide.
    """
    u, e = rod.unit, sampled(rod.axis, len(rod.start))
    if rod.carrier in (Carrier.NOTHING, Carrier.SLIDE):
        own: list[Any] = [(_ALONG_CARRIER, Dot(_E, _U), e)] * (rod.carrier is Carrier.SLIDE)
    else:
        v = rod.along
        own = [
            (_ALONG_CARRIER, Dot(_V, _U), v),
            (_ACROSS, Dot(Cross(_E, _V), _U), np.cross(e, v)),
            (_SIDEWAYS, Dot(_E, _U), e),
        ]
    return [(name, written, np.einsum("ni,ni->n", at, u)) for name, written, at in own]


def carrier_scalars(rod: Bar, crank: Any) -> list[tuple[np.ndarray, Any]]:
    """Values at the samples of these scalars and of what follows from them, and their names."""
    found = [(x, name) for name, _, x in scalars_of(rod)]
    if rod.carrier in (Carrier.CRANK, Carrier.DYAD):
        (f, _), (h, _), z = found
        rest = np.sqrt(np.maximum(1 - f**2, 0)), sp.sqrt(1 - _ALONG_CARRIER**2)
        lever = np.linalg.norm(rod.arm, axis=1) * h, crank * _ACROSS
        found = [*found[:2], lever, z, rest]
    if rod.carrier is Carrier.DYAD:
        e = sampled(rod.axis, len(rod.start))
        x = np.einsum("ni,ni->n", rod.along, np.cross(rod.across, e))
        across = np.sqrt(np.maximum(1 - x**2, 0)), sp.sqrt(1 - _ALONG**2)
        found = [(x, _ALONG), across, *found[:2]]
    return [(x, name) for x, name in found if varies(x)]


def scalars_across(
    known: list[tuple[np.ndarray, Any]], t: np.ndarray, width: np.ndarray, name: Any
) -> list[tuple[np.ndarray, Any]]:
    """What cranks and parallel rods feel of a unit couple across their axis e and the rod.

    Cosines and sines over t = |e x u|; in rods that are w apart the force 1/(w t).
    """
    if not varies(t):
        return []
    found = [(x / t, own / _SINE) for x, own in known if own in (_ALONG_CARRIER, _ACROSS)]
    if np.min(width) > 0:
        found.append((1 / (width * t), 1 / (name * _SINE)))
        found.append((np.full_like(t, 0.5), sp.Rational(1, 2)))  # of a force, each rod has half
    return found


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
    apart = [np.max(np.abs(np.cross(sampled(f.axis, count), e))) for f in turns]
    return np.asarray(turns[1].point, dtype=object) if max(apart) < _SAME else None


def _units(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def in_the_platform(placed: PlacedRobot, vector: np.ndarray) -> Any:
    """A vector of the world in the axes of the platform."""
    turned = turned_back(placed.platform.R, vector)
    return tuple(placed.record.simplified(x, placed.length) for x in turned)


def _width(leg: PlacedLeg, axis: np.ndarray | None, placed: PlacedRobot) -> Any:
    """How far two parallel rods are apart along an axis; zero where they are not."""
    if not leg.blocks or len(leg.blocks[0].branches) != 2 or axis is None:
        return 0
    a, b = (np.asarray(next(x.freedoms).point, dtype=object) for x in leg.blocks[0].branches)
    both = sampled(b - a, placed.record.count), sampled(axis, placed.record.count)
    is_along = np.max(np.abs(np.cross(*both))) < _SAME * placed.length
    return _distance(a, b, placed) if is_along else 0


def _distance(a: np.ndarray, b: np.ndarray, placed: PlacedRobot) -> Any:
    square = placed.record.simplified((b - a) @ (b - a))
    length = square_root(square) if isinstance(square, Entry) else sp.sqrt(square)
    return placed.record.simplified(length)


def are_along(own: np.ndarray, other: np.ndarray) -> bool:
    """Whether unit vectors are the same at all samples, up to one sign."""
    return any(bool(np.max(np.abs(own - sign * other)) < _SAME) for sign in (1, -1))


def varies(values: np.ndarray) -> bool:
    """Whether a scalar is no whole number at all samples, which needs no name."""
    return bool(np.max(np.abs(values - np.rint(values))) > _SAME)


@dataclass(frozen=True, eq=False)
class ParallelRods:
    """The rods of a leg."""

    mean: UnitWrench  # the force through their middle
    compliance: Any  # that it meets
    # name and (3,): from the middle to the end of a rod, in the platform's axes; none of one rod
    arms: tuple[tuple[str, Any], ...]
    of_rod: Any  # compliance of a rod


def cluster_of(
    placed: PlacedRobot, number: int, rod: Bar, reader: LegReader
) -> ParallelRods | None:
    """The parallel rods of a leg on a slide; None where it is another leg."""
    own, count = placed.legs[number].leg, placed.record.count
    branches = own.blocks[0].branches if own.blocks else (own,)
    beside = own.blocks and any(isinstance(x, PlacedSpring) for x in own.elements)
    middle = ends_of(own)
    if rod.carrier is not Carrier.SLIDE or beside or middle is None:
        return None
    forces: list[UnitWrench] = []
    for branch in branches:
        basis = reader.search.basis(branch)
        found = () if basis is None else basis.wrenches
        if len(found) != 1 or found[0].point is None:
            return None
        if not are_along(sampled(found[0].direction, count), rod.unit):
            return None
        forces.append(found[0])
    mean, contributions = UnitWrench(forces[0].direction, middle[1]), reader.contributions.of
    if len(branches) == 1:
        return ParallelRods(mean, summed(contributions(own, mean, mean)), (), None)
    each = {summed(contributions(b, f, f)) for b, f in zip(branches, forces, strict=True)}
    if len(each) > 1:
        return None
    (of_rod,) = each
    # Each rod takes the same share of a force through their middle.
    met = summed(contributions(own.without_blocks, mean, mean)) + of_rod / len(branches)
    ends = [ends_of(branch) for branch in branches]
    arms = [in_the_platform(placed, end[1] - middle[1]) for end in ends if end is not None]
    labels = [f"{own.name}, {branch.name.split('/')[-1]}" for branch in branches]
    return ParallelRods(mean, met, tuple(zip(labels, arms, strict=True)), of_rod)


def rods_of(clusters: Sequence[ParallelRods]) -> tuple[tuple[int, str, Any], ...] | None:
    """All rods that are not alone, with the numbers of their legs; None where rods differ."""
    if len({x.of_rod for x in clusters if x.arms}) != 1:
        return None
    return tuple((i, *arm) for i, x in enumerate(clusters) for arm in x.arms)
