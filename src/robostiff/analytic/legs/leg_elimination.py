"""The passive joints of one leg, eliminated one after the other: K^0 to K^n, eq. (15)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
import sympy as sp
from scipy.sparse.csgraph import connected_components

from robostiff.analytic.budget import (
    BUDGET,
    FormulaTooLargeError,
    OutOfTimeError,
    checked_budget,
    within,
)
from robostiff.analytic.chain import Closed, Steps, derive_chain
from robostiff.analytic.derivation import Derivation
from robostiff.analytic.exact.definition import Definition, Unwritten, used_definitions
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.exact.trigonometry import shortest_trigonometry
from robostiff.analytic.inverse import compliance_formula
from robostiff.analytic.legs.leg_geometry import (
    LegGeometry,
    LegInSteps,
    elastic_parts,
    passive_freedoms,
)
from robostiff.analytic.placement.agreement import AGREED, closed_places, matrix_distance
from robostiff.analytic.placement.conditions import conditions_of
from robostiff.analytic.placement.robot_placement import PlacedRobot, place_robot
from robostiff.analytic.placement.robot_pose import AtHome, PoseFormula
from robostiff.analytic.questions.rank import matrix_by_entries
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.vectors.forms import inverse_in_steps, transport
from robostiff.elastostatics.recursive import eliminate_joint
from robostiff.errors import DisagreementError, InputError
from robostiff.model import Robot
from robostiff.spatial import Space

_WRITTEN_OUT = 3  # coupled directions of a compliance whose inverse is written out
_SHORT = 2  # operations of an entry of C that needs no name, such as 1/k
_SHARE = 0.25  # of the budget, for names and for steps of the geometry each
_QUESTION = "stiffness of a leg"
_READABLE = 500  # terms of an entry, beyond which a leg is derived in steps


@dataclass(frozen=True)
class LegElimination(Derivation):
    """The stiffness of one leg, one passive joint after the other.

    K0 and the stages are in axes of its own; K is about the reference point of the platform, in
    world axes, as all others are.

    Attributes
    ----------
    leg : str
        Its name.
    where : str
        The pose, in words.
    elastic : tuple of str
        Its elastic parts and drives.
    C : sympy.ImmutableMatrix
        Compliance of these with all passive joints held (n x n); K0 = C^-1.
    axes : sympy.ImmutableMatrix
        Columns: the leg's own axes in the world (3 x 3).
    arm : sympy.ImmutableMatrix
        From the reference point to the origin of these axes (3 x 1) [m], world axes.
    coordinates : tuple of str
        Names of the symbols of the pose.
    """

    leg: str = ""
    where: str = ""
    elastic: tuple[str, ...] = ()
    C: Any = None
    axes: Any = None
    arm: Any = None
    coordinates: tuple[str, ...] = ()

    @property
    def space(self) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return Space.of_size(self.K.rows)

    @property
    def given_symbols(self) -> tuple[Any, ...]:
        """The given symbols of all stages, some of which cancel in K."""
        parts = [self.K0, self.C, self.axes, self.arm, *(d.expression for d in self.definitions)]
        parts += [M for stage in self.stages for M in (stage.J, stage.K)]
        found = set().union(*(part.free_symbols for part in parts))
        return tuple(sorted(found - {d.symbol for d in self.definitions}, key=str))


def derive_leg(
    robot: Robot,
    leg: str,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
) -> LegElimination:
    """Stiffness of a leg as in Section VI: K^0 = C^-1, then one passive joint after the other.

    The axes are those of a part of the leg in which its joints are simplest, so that many of them
    are trivial or quasi-trivial, eq. (18)-(20); these come first, as the order is arbitrary.

    Parameters
    ----------
    robot : Robot
    leg : str
        Name of the leg.
    pose : AtHome, AtSymbols or AtCoordinates
        Home when left out.
    form : Closed or Steps
        As for `derive_chain`; when left out, closed where that is short, and steps otherwise.
    budget : float or None
        Seconds of computing for a closed form.

    Raises
    ------
    InputError
        When there is no such leg, it has a parallel block, or it is rigid in a direction, so that
        C has no inverse.
    DisagreementError
        When a stage differs from the recursion in numbers at random parameters.
    FormulaTooLargeError
        When a closed form would exceed its limit.

    Examples
    --------
    >>> import robostiff as rs
    >>> leg = derive_leg(rs.load("gough-stewart-b-beams", symbols=("h",)), "leg1")
    >>> for stage in leg.stages[:3]:
    ...     print(stage.rule)
    rotation about x at the reference point: trivial joint (19), row and column 4 vanish
    rotation about y at the reference point: trivial joint (19), row and column 5 vanish
    rotation about z at the reference point: trivial joint (19), row and column 6 vanish
    >>> sum(x != 0 for x in leg.stages[-1].K)
    1
    """
    names = [own.name for own in robot.legs]
    if leg not in names:
        raise InputError(f"leg of {robot.name!r}", got=leg, expected=", ".join(names))
    if budget is not None:
        checked_budget(budget)
    placed = place_robot(robot, AtHome() if pose is None else pose)
    own = placed.legs[names.index(leg)].leg
    if own.blocks:
        raise InputError(
            f"leg {leg!r}",
            got=f"the parallel block {own.blocks[0].name!r}",
            expected="joints and springs in series: K^0 is the inverse of their compliance",
            hint="write derive(robot), which supports blocks",
        )
    geometry = LegGeometry.of(own, placed)
    geometry.check_elastic()
    found = _shortest(geometry, form, budget)
    check_leg(found, placed)
    return found


def _shortest(
    geometry: LegGeometry, form: Closed | Steps | None, budget: float | None
) -> LegElimination:
    """The first form that ends: names for lengths, then steps for the geometry, then for all."""
    own, closed = geometry.placed, Closed(_READABLE) if form is None else form
    share = None if budget is None else _SHARE * budget

    def in_names() -> LegElimination:
        return _derived(geometry, NamedReading(own.record, own.symbols, own.springs), closed)

    def in_steps() -> LegElimination:
        return _derived(geometry, LegInSteps(geometry), closed)

    for derive in () if isinstance(form, Steps) else (in_names, in_steps):
        try:
            return within(share, derive, _QUESTION)
        except (FormulaTooLargeError, OutOfTimeError):
            if form is not None and derive is in_steps:
                raise
    return _derived(geometry, LegInSteps(geometry), Steps())


def _derived(geometry: LegGeometry, read: Any, form: Closed | Steps) -> LegElimination:
    placed, local, own = geometry.placed, geometry.local, geometry.own
    rows = placed.entries.space.rows
    found = geometry.compliance(read)
    twists = zip(passive_freedoms(own), local.twists, strict=True)
    joints = dict(
        sorted(
            ((name, [read(twist[i]) for i in rows]) for name, twist in twists),
            key=lambda joint: sum(x != 0 for x in joint[1]),
        )
    )
    axes = shortest_trigonometry(sp.Matrix(3, 3, [read(x) for x in geometry.frame.R.flat]))
    arm = shortest_trigonometry(sp.Matrix([read(x) for x in geometry.arm]))
    C, before = sp.ImmutableMatrix(found), tuple(read.definitions)
    if any(entry.is_Add for entry in C.flat()):  # a single beam needs no names
        C, before = matrix_by_entries(C, before, "C_", _SHORT)
    K0, inverted = _inverse(C)
    chain = derive_chain(K0, joints, form)
    used = used_definitions(
        (*before, *inverted),
        [sp.sympify(x) for part in (C, K0, axes, arm, *joints.values()) for x in part],
    )
    T = transport(axes, arm, placed.entries.space)
    return LegElimination(
        name="K_C",
        K0=chain.K0,
        stages=chain.stages,
        K=sp.ImmutableMatrix(T * chain.K * T.T),
        definitions=(*used, *chain.definitions),
        leg=f"{own.name} of {placed.robot.name}",
        where=placed.where,
        elastic=elastic_parts(own),
        C=C,
        axes=axes,
        arm=arm,
        coordinates=placed.coordinates,
        conditions=Unwritten(lambda: conditions_of(placed, own.name)),
        meanings=placed.meanings,
    )


def _inverse(C: Any) -> tuple[sp.ImmutableMatrix, tuple[Definition, ...]]:
    """K^0 = C^-1: written out where few directions are coupled, in named steps otherwise."""
    n = C.rows
    pattern = np.array([[int(C[i, j] != 0) for j in range(n)] for i in range(n)])
    coupled = connected_components(pattern, directed=False)[1]
    if np.max(np.bincount(coupled)) <= _WRITTEN_OUT:
        return compliance_formula(C), ()
    definitions: list[Definition] = []

    def given(k: int, i: int, j: int, entry: Any) -> Any:
        # After the last step the inverse is the negative.
        sign = -1 if k == n - 1 else 1
        if entry.is_Atom or (-entry).is_Atom:
            return entry
        name = f"{'K_0' if k == n - 1 else f'S_{k + 1}'}_{i + 1}{j + 1}"
        definitions.append(Definition(sp.Symbol(name, real=True), sign * entry))
        return sign * definitions[-1].symbol

    return inverse_in_steps(C, given), tuple(definitions)


_FLOOR = 1e-3  # of K^0, added on both sides: rounding of what vanishes is not compared


def check_leg(found: LegElimination, placed: PlacedRobot) -> None:
    """Compare each stage with the recursion (15) in numbers, and K with that of the wrench basis.

    Raises
    ------
    DisagreementError
    """
    names = [f"{own.name} of {placed.robot.name}" for own in placed.robot.legs]
    number = names.index(found.leg)
    for values, result, _ in closed_places(placed):
        expected = result.leg_stiffness[number]
        for careful in (False, True):
            complaint = _difference(found, values, expected, placed.length, careful=careful)
            if not complaint:
                break
        else:
            at = ", ".join(f"{name} = {value:.6g}" for name, value in values.items())
            raise DisagreementError(
                "the formula and the numerical recursion", complaint, f"{found.leg}, at {at}"
            )


def _difference(
    found: LegElimination,
    values: Mapping[str, float],
    expected: np.ndarray,
    length: float,
    *,
    careful: bool,
) -> str:
    """What differs between a formula and numbers; `expected`: K about the reference point."""
    n, stages = len(expected), found.stages
    flat = [*chain(*(s.J for s in stages)), *found.K0, *chain(*(s.K for s in stages)), *found.K]
    given = {s: values[s.name] for s in found.given_symbols}
    known = np.array(values_of(flat, given, found.definitions, careful=careful), dtype=float)
    columns = known[: n * len(stages)].reshape(len(stages), n)
    start, *each, whole = known[columns.size :].reshape(-1, n, n)
    K = start
    for number, (J, own, stage) in enumerate(zip(columns, each, stages, strict=True), start=1):
        K = K if stage.is_redundant else eliminate_joint(K, J)
        distance = matrix_distance(own + _FLOOR * start, K + _FLOOR * start, length)
        if distance > AGREED:
            return f"by {distance:.1e} after stage {number}"
    sizes = np.where(np.array(found.space.rows) < 3, 1.0, length**2)
    floor = _FLOOR * np.max(np.abs(start) / np.sqrt(np.outer(sizes, sizes))) * np.diag(sizes)
    distance = matrix_distance(whole + floor, expected + floor, length)
    return f"by {distance:.1e}" if distance > AGREED else ""
