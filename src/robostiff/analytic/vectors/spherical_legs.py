"""Legs of a spherical robot: motor, elbow and platform joint turn about axes through one centre.

The axis v of the elbow is square to that of the motor, e, and to that of the platform joint, u, as
in an Agile Eye: ``v = (e x u)/|e x u|``. Both passive joints leave forces through the centre, and
the couple about g = v x u. What the inner link feels of them is that of its own axes e, v and
k = e x v, by ``u = z e + h k`` and ``g = h e - z k``; the compliance of either link in its own axes
is the same at all poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.operation_count import count_of
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.springs.contributions import summed
from robostiff.analytic.springs.leg_springs import LegReader
from robostiff.analytic.springs.unit_wrenches import UnitWrench
from robostiff.analytic.vectors.vector_expressions import (
    Cross,
    Equation,
    Norm,
    Over,
    Stacked,
    Vector,
    VectorExpression,
)
from robostiff.analytic.vectors.vector_rods import Bar, Carrier, in_the_platform
from robostiff.analytic.vectors.vector_wrenches import LegInVectors
from robostiff.kinematics.formula import place_leg_at_joints
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.recorded.leg import at_samples as sampled
from robostiff.recorded.working_frame import cross
from robostiff.spatial import Space

_SAME = 1e-9
_E, _U, _V, _G, _B = map(Vector, ("e_i", "u_i", "v_i", "g_i", "b_i"))
_ALONG, _ACROSS = (sp.Symbol(name, real=True) for name in ("z_i", "h_i"))


def spherical_bar(placed: PlacedRobot, number: int) -> Bar | None:
    """The axes of a leg whose joints turn about one centre; None where it is another leg."""
    chain, own, count = placed.entries.legs[number], placed.legs[number].leg, placed.record.count
    freedoms = [*own.freedoms]
    is_alike = len(freedoms) == 3 and all(f.is_rotation for f in freedoms)
    is_other = placed.entries.space is not Space.SPATIAL or own.blocks or chain.chain.is_coupled
    if is_other or not is_alike:
        return None
    if [f.is_passive for f in freedoms] != [False, True, True] or _links_of(own) is None:
        return None
    e, v, u = (sampled(f.axis, count) for f in freedoms)
    centre = sampled(own.end, count)
    away = [np.cross(sampled(f.point, count) - centre, sampled(f.axis, count)) for f in freedoms]
    square = [np.sum(v * other, axis=1) for other in (e, u)]
    sides = {int(x) for x in np.sign(np.sum(v * np.cross(e, u), axis=1))}
    apart = max(np.max(np.abs(x)) for x in away) / placed.length
    if max(apart, *(np.max(np.abs(x)) for x in square)) > _SAME or len(sides) > 1 or 0 in sides:
        return None
    joint = np.array(in_the_platform(placed, freedoms[2].axis), dtype=object)
    side, tip = sides.pop(), chain.attachment.p
    return Bar(
        Carrier.CENTRE, own.end, freedoms[0].axis, joint, centre - u, centre, v, 1, 1, side, tip
    )


def axes_of(rods: Sequence[Bar]) -> list[Equation]:
    """Equations from the axes of motor and platform joint to that of the elbow."""
    across = Cross(_E, _U) if rods[0].side > 0 else Cross(_U, _E)
    return [Equation("v_i", Over(across, Norm(across))), Equation("g_i", Cross(_V, _U))]


def spherical_leg(
    placed: PlacedRobot, number: int, reader: LegReader, moved: VectorExpression | None
) -> LegInVectors | None:
    """Its wrenches, and what pairs of them meet; None where other wrenches are transmitted.

    `moved`: the centre, from the reference point.
    """
    chain, own = placed.entries.legs[number], placed.legs[number].leg
    _, elbow, last = own.freedoms
    v, u = elbow.axis, last.axis
    g = np.array([placed.record.simplified(x) for x in cross(v, u)], dtype=object)
    units = (
        UnitWrench(v, own.end),
        UnitWrench(u, own.end),
        UnitWrench(g, own.end),
        UnitWrench(g, None),
    )
    if reader.search.of_wrenches(own, units) is None:
        return None
    zero = place_leg_at_joints(chain, np.zeros(chain.chain.size, dtype=int).astype(object)).leg
    links = _links_of(zero)
    if links is None:
        return None
    inner, outer = links
    e, v, u = (np.asarray(f.axis, dtype=object) for f in zero.freedoms)
    k, g = (np.array(cross(a, b), dtype=object) for a, b in ((e, v), (v, u)))

    def wrenches(*directions: Any) -> list[UnitWrench]:
        forces = [UnitWrench(d, zero.end) for d in directions]
        return [*forces, *(UnitWrench(d, None) for d in directions)]

    of_inner, of_outer = wrenches(e, v, k), wrenches(v, u, g)
    z, h = _ALONG, _ACROSS
    # Forces along v, u and g, and the couple about g, by unit wrenches of the two links
    in_inner = ({1: 1}, {0: z, 2: h}, {0: h, 2: -z}, {3: h, 5: -z})
    in_outer = ({0: 1}, {1: 1}, {2: 1}, {5: 1})

    def met(i: int, j: int) -> Any:
        terms: dict[Any, Any] = {}  # what multiplies each, of unit wrenches of the links
        for link, pool, shares in ((inner, of_inner, in_inner), (outer, of_outer, in_outer)):
            for (a, x), (b, y) in ((p, q) for p in shares[i].items() for q in shares[j].items()):
                own = summed(reader.contributions.of(link, pool[a], pool[b]))
                for term in sp.Add.make_args(own):
                    sign, size = _signed(term)
                    terms[size] = terms.get(size, 0) + sign * x * y
        return _shortest_sum({term: sp.factor(sp.sympify(share)) for term, share in terms.items()})

    forces = [Stacked(d, None if moved is None else Cross(moved, d)) for d in (_V, _U, _G)]
    pairs = [(i, j, met(i, j)) for i in range(4) for j in range(i + 1, 4)]
    return LegInVectors(
        (*forces, Stacked(None, _G)),
        tuple(met(i, i) for i in range(4)),
        tuple(pair for pair in pairs if pair[2] != 0),
    )


def _shortest_sum(terms: dict[Any, Any]) -> Any:
    """A sum of products, as it stands or with what shares a factor in one bracket."""
    apart, of_share = [], dict[Any, Any]()
    for term, share in terms.items():
        sign, size = _signed(share)
        apart.append(sp.Mul(size, sign * term))
        of_share[size] = of_share.get(size, 0) + sign * term
    signed = ((share, *_signed(own)) for share, own in of_share.items())
    together = sp.Add(*(sp.Mul(sign, share, own) for share, sign, own in signed))
    return min(sp.Add(*apart), together, key=count_of)


def _signed(expression: Any) -> tuple[int, Any]:
    """The sign of an expression, and what it is without."""
    return (-1, -expression) if expression.could_extract_minus_sign() else (1, expression)


def _links_of(leg: PlacedLeg) -> tuple[PlacedLeg, PlacedLeg] | None:
    """Motor and inner link, and outer link; None where springs lie outside of them."""
    places = [i for i, part in enumerate(leg.elements) if isinstance(part, PlacedFreedom)]
    springs = [i for i, part in enumerate(leg.elements) if isinstance(part, PlacedSpring)]
    if any(not places[0] < i < places[2] for i in springs):
        return None
    parts = leg.elements[: places[1]], leg.elements[places[1] : places[2]]
    inner, outer = (replace(leg, elements=own) for own in parts)
    return inner, outer
