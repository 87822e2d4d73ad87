"""Legs by their springs in series, as a textbook has them, and arms, which are one such leg.

The compliance of an arm is a sum over its springs, and K its inverse: entry by entry where that is
short, otherwise in vectors. Legs that have one chain are one generic leg and a table, in their own
joint coordinates, or by the axes of their joints where the pose gives these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.definition import count_of, used_definitions
from robostiff.analytic.legs import LegGeometry
from robostiff.analytic.placement.robot_placement import PlacedRobot, as_step
from robostiff.analytic.placement.robot_pose import exact_angle
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.reading.record_reading import ClosedReading
from robostiff.analytic.reading.rewriting import shortest_trigonometry
from robostiff.analytic.springs.unit_wrenches import WrenchSearch
from robostiff.analytic.substitution import Substitution, at_values
from robostiff.analytic.vectors.forms import InSeries, LegTable, VectorForm, inner_level
from robostiff.analytic.vectors.vector_expressions import (
    Coordinates,
    Cross,
    Equation,
    Norm,
    Over,
    Sum,
    Turned,
    Turns,
    Vector,
    VectorExpression,
)
from robostiff.analytic.vectors.vector_rods import in_the_platform
from robostiff.analytic.vectors.walk import (
    UnusualPartError,
    Walk,
    columns_of,
    rotations_of,
    terms_of,
    turning_angles,
    turns_of,
)
from robostiff.frozen import are_equal
from robostiff.kinematics.formula import PlacedFormula, place_leg_at_joints
from robostiff.kinematics.jacobians import in_groups
from robostiff.model import ParallelBlock, Telescope
from robostiff.record import Entry
from robostiff.recorded.leg import at_samples as sampled

_PRINTED = 500  # operations of a compliance beyond which it is not printed
_SAME = 1e-9


def series_form(placed: PlacedRobot) -> VectorForm | None:
    """The springs of an arm, or of legs with one chain; None of others, and where one is rigid."""
    try:
        if is_arm(placed):
            geometry = LegGeometry.of(placed.legs[0].leg, placed)
            if geometry.elastic_directions < placed.entries.space.size:
                return None
            return _in_entries(geometry) or arm_in_vectors(placed)
        return _legs(placed)
    except (UnusualPartError, FormulaTooLargeError):
        return None


def is_arm(placed: PlacedRobot, links: int = 0) -> bool:
    """Whether it is an arm without passive joints, of so many elastic links at least."""
    if not placed.robot.is_posed_by_joints:
        return False
    leg = placed.legs[0].leg
    passive = any(f.is_passive for f in leg.freedoms)
    return not (passive or leg.blocks) and len([*leg.springs]) >= links


def _in_entries(geometry: LegGeometry) -> InSeries | None:
    """The compliance entry by entry; None where that is long."""
    placed = geometry.placed
    read = NamedReading(placed.record, placed.symbols, placed.springs)
    try:
        C = sp.ImmutableMatrix(geometry.compliance(read, _PRINTED))
        R = sp.ImmutableMatrix(3, 3, [read(x) for x in geometry.frame.R.flat])
        v = sp.ImmutableMatrix([read(x) for x in geometry.arm])
    except FormulaTooLargeError:
        return None
    axes, arm = shortest_trigonometry(R), shortest_trigonometry(v)
    definitions = used_definitions(read.definitions, [*C, *axes, *arm])
    if sum(count_of(x) for x in (*{*C.flat()}, *axes, *arm)) > _PRINTED:
        return None
    return InSeries(definitions, placed.entries.space, C=C, axes=axes, arm=arm)


def arm_in_vectors(
    placed: PlacedRobot, robots: Mapping[str, Any] | None = None
) -> VectorForm | None:
    """The whole arm by its rotations, points and twists; `robots`: in a machine, by their names."""
    (leg,), (placed_leg,) = placed.entries.legs, placed.legs
    if leg.chain.couplings or {"p", "p_C"} & placed.symbols.keys():
        return None
    read = NamedReading(placed.record, placed.symbols, placed.springs)
    p = "p_C" if robots else "p"
    walk = Walk(placed, read, Vector(p))
    walk.robots = robots or {}
    walk.go(leg.base.p)
    walk.turn(turns_of(leg.base.R))
    if robots:
        placed_leg = _at_home(placed)
    own = placed_leg.leg.without_blocks.springs
    walk.along(leg.chain.elements, own, placed_leg.coordinate)
    if turns_of(leg.attachment.R):
        return None
    walk.go(-np.array(leg.attachment.p, dtype=object))
    walk.go(placed.entries.reference_point)
    walk.equations.append(Equation(p, walk.here()))
    return _form(walk, (), walk.finish(), {}, (leg.name,))


def _at_home(placed: PlacedRobot) -> PlacedFormula:
    """The leg of a machine, of which joints that are in no module stand at home."""
    (leg,), place = placed.entries.legs, 0
    q = np.array(placed.closed.get(0, leg.chain.home), dtype=object)
    for element in leg.chain.elements:
        if isinstance(element, ParallelBlock):
            place += sum(branch.chain.size for branch in element.branches)
            continue
        for screw in getattr(element, "freedoms", ()):
            q[place] = at = leg.chain.home[place]
            if screw.turns and not isinstance(at, Entry):
                q[place] = as_step(exact_angle(at), placed.record)
            place += 1
    return place_leg_at_joints(leg, q)


def _form(
    walk: Walk, pose: Any, equations: Any, columns: dict[str, Any], legs: tuple[str, ...]
) -> VectorForm:
    of_springs = [c for _, _, c in walk.drives] + [x for *_, of_beam in walk.beams for x in of_beam]
    of_springs += [sp.Tuple(*inner_level(module).free_symbols) for *_, module in walk.modules]
    of_springs += [e.expression for e in equations]
    return VectorForm(
        names=used_definitions(walk.read.definitions, of_springs),
        space=walk.placed.entries.space,
        pose=pose,
        leg=equations,
        columns=columns,
        legs=legs,
        drives=tuple(walk.drives),
        beams=tuple(walk.beams),
        passive=tuple(walk.passive),
        modules=tuple(walk.modules),
    )


def _legs(placed: PlacedRobot) -> VectorForm | None:
    """Legs with one chain, or some of them, away from home; None where one is rigid."""
    chains = [leg.chain for leg in placed.robot.legs]
    at_home = placed.given is None and not placed.follows.at_joints
    is_other = at_home or placed.robot.is_posed_by_joints or placed.robot.platform is not None
    if is_other or any(name == "p" or "_i_" in f"{name}_" for name in placed.symbols):
        return None
    kinds = [*map(list, in_groups(chains, are_equal))]
    if len(kinds) == len(chains):
        return None
    read = NamedReading(placed.record, placed.symbols, placed.springs)
    forms = [_kind_of_leg(placed, kind, read) for kind in sorted(kinds, key=len, reverse=True)]
    found = [form for form in forms if form is not None]
    return replace(found[0], others=tuple(found[1:])) if len(found) == len(forms) else None


def _kind_of_leg(placed: PlacedRobot, numbers: list[int], read: NamedReading) -> VectorForm | None:
    """Legs of the same chain, by their numbers."""
    chain, leg = placed.robot.legs[numbers[0]].chain, placed.legs[numbers[0]].leg
    has_freedoms = any(s.elasticity.freedoms.shape[1] for s in leg.springs)
    if chain.couplings or chain.has_blocks or has_freedoms:
        return None
    sample = WrenchSearch.of(placed).sampled(leg)
    if sample.elastic_directions < sample.C.shape[1]:
        return None
    found = (_by_angles if placed.follows.at_joints else _by_axes)(placed, numbers, read)
    if found is None or not found.passive:
        return None
    # A passive joint that depends on those before it takes nothing.
    lost = {x for x, is_lost in zip(found.passive, sample.redundant, strict=True) if is_lost}
    return replace(
        found,
        passive=tuple(x for x in found.passive if x not in lost),
        leg=tuple(e for e in found.leg if e.name not in lost),
    )


def _by_angles(placed: PlacedRobot, numbers: list[int], read: NamedReading) -> VectorForm | None:
    """Legs by their own coordinates; the table has their bases and their ends as well."""
    legs, first = [placed.entries.legs[i] for i in numbers], placed.legs[numbers[0]]
    plain = ClosedReading(placed.record, placed.symbols)
    table = LegTable(dict(placed.robot.nominal))
    walk = Walk(placed, read, Vector("p_i"), "_i")

    def place(letter: str, angle: str, each: list[Any]) -> bool:
        points = [tuple(map(plain, point)) for point in each]
        if not any(x != 0 for point in points for x in point):
            return False
        walk.equations += table.equations(letter, angle, points)
        return True

    def angles(R: np.ndarray) -> tuple[Any, Any, Any]:
        if plain(R[2, 2]) == 1:  # about z, perhaps by a symbol
            found = table.polar(sp.sympify(plain(R[0, 0])), sp.sympify(plain(R[1, 0])))
            if found is not None:
                return found[1], sp.S.Zero, sp.S.Zero
        return turning_angles(R)

    def turn(names: tuple[str, str, str], each: list[Any]) -> None:
        of_all = zip(names, zip(*map(angles, each), strict=True), strict=True)
        walk.turn(tuple(zip("zyx", (table.angle(*x) for x in of_all), strict=True)))

    if place("a", "phi", [leg.base.p for leg in legs]):
        walk.terms = [(1, Vector("a_i"))]
    turn(("gamma", "beta", "alpha"), [np.asarray(leg.base.R) for leg in legs])
    walk.along(legs[0].chain.elements, iter(first.leg.springs), first.coordinate)
    last = walk.rotation
    turn(("nu", "mu", "lambda"), [np.asarray(leg.attachment.R).T for leg in legs])
    if walk.rotation is not None:  # that of the platform
        turned = Vector(walk.rotation) if walk.rotation == last else walk.equations.pop().expression
        walk.equations.append(Equation("R_i", turned))
        walk.rotation = "R_i"
    at, r0 = walk.here(), placed.entries.reference_point
    if place("b", "psi", [np.array(leg.attachment.p) - r0 for leg in legs]):
        at = Sum(*terms_of(at), (-1, walk.turned(Vector("b_i"))))
    walk.equations.append(Equation("p_i", at))
    form = _form(walk, (), walk.finish(), {}, tuple(leg.name for leg in legs))
    # Written in the coordinates of the first leg: in those of leg i now.
    each = [[sp.sympify(plain(x)) for x in placed.closed[i]] for i in numbers]
    symbols: dict[Any, Any] = {}
    for k, screw in enumerate(legs[0].chain.freedoms):
        if each[0][k].is_Symbol and each[0][k] not in symbols:
            name = f"{'theta' if screw.turns else 's'}_i_{k + 1}"
            symbols[each[0][k]] = sp.Symbol(name, real=True)
            table.columns[name] = [q[k] for q in each]
    for i, q in enumerate(each):
        known = {s: table.columns[x.name][i] for s, x in symbols.items()}
        if any(sp.expand(a.xreplace(known) - b) != 0 for a, b in zip(each[0], q, strict=True)):
            return None
    if any(d.expression.free_symbols & symbols.keys() for d in form.names):
        return None
    form = at_values(form, Substitution(symbols), with_numbers=True)
    return replace(form, columns={name: tuple(x) for name, x in table.columns.items()})


def _by_axes(placed: PlacedRobot, numbers: list[int], read: NamedReading) -> VectorForm | None:
    """Legs of two or three turns; one between two others is square to them.

    The axis of the first one is fixed in the base, that of the last one in the platform.
    """
    legs, first = [placed.entries.legs[i] for i in numbers], placed.legs[numbers[0]]
    freedoms = [[*placed.legs[i].leg.freedoms] for i in numbers]
    turns, count = placed.rotation.factors(placed.given or {}), placed.record.count
    if not (2 <= len(freedoms[0]) <= 3 and all(f.is_rotation for leg in freedoms for f in leg)):
        return None
    if any(isinstance(x, Telescope) for x, _ in legs[0].chain.moving) or not turns:
        return None
    plain = ClosedReading(placed.record, placed.symbols)
    table = LegTable(dict(placed.robot.nominal))
    rotation = "Q" if "R" in placed.symbols else "R"
    pose, equations = [Equation(rotation, Turns(*turns))], list[Equation]()
    e, u, p = Vector("e_i"), Vector("u_i"), tuple(map(plain, placed.reference))
    pose.append(Equation("p", Coordinates(*p)))
    points = [tuple(map(plain, leg.base.p)) for leg in legs]
    each = {
        ("e", "theta"): [f[0].axis for f in freedoms],
        ("j", "chi"): [in_the_platform(placed, f[-1].axis) for f in freedoms],
    }
    vectors = {letters: [tuple(map(plain, v)) for v in axes] for letters, axes in each.items()}
    if any(x != 0 for point in points for x in point):
        vectors["a", "phi"] = points
    for (letter, angle), at_legs in vectors.items():
        equations += table.equations(letter, angle, at_legs)
    equations.append(Equation("u_i", Turned(rotation, Vector("j_i"))))
    axes: list[VectorExpression] = [e, u]
    if len(freedoms[0]) == 3:
        at = np.array([[sampled(f.axis, count) for f in leg] for leg in freedoms])
        motor, middle, last = at.transpose(1, 0, 2, 3)
        along = np.cross(motor, last)
        apart = [np.max(np.abs(np.sum(middle * x, axis=-1))) for x in (motor, last)]
        sides = np.sign(np.sum(middle * along, axis=-1))
        if max(apart) > _SAME or np.ptp(sides) or np.min(np.abs(sides)) == 0:
            return None
        across = Cross(e, u) if sides.flat[0] > 0 else Cross(u, e)
        equations.append(Equation("v_i", Over(across, Norm(across))))
        axes.insert(1, Vector("v_i"))
    known = [(x, sampled(f.axis, count)) for x, f in zip(axes, freedoms[0], strict=True)]
    elements, springs = legs[0].chain.elements, [*first.leg.springs]
    bodies = rotations_of(elements, iter(springs), count)
    rotations = {k: columns_of(R, known) for k, R in bodies.items()}
    known_rotations = {k: x for k, x in rotations.items() if x is not None}
    reference = Vector("p") if any(x != 0 for x in p) else None
    walk = Walk(placed, read, reference, "_i", axes, known_rotations)
    walk.terms = [(1, Vector("a_i"))] if ("a", "phi") in vectors else []
    walk.along(elements, iter(springs), first.coordinate)
    columns = {name: tuple(x) for name, x in table.columns.items()}
    leg = (*equations, *walk.finish())
    return _form(walk, tuple(pose), leg, columns, tuple(leg.name for leg in legs))
