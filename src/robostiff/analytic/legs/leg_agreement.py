"""Comparison of a leg's elimination with the recursion (15) in numbers, stage by stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from robostiff.analytic.derivation import Stage
from robostiff.analytic.exact.numeric_value import values_of
from robostiff.analytic.legs.leg_geometry import transport
from robostiff.analytic.placement.agreement import AGREED, closed_places, matrix_distance
from robostiff.analytic.placement.legs_at_points import redundant_columns
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.elastostatics.recursive import eliminate_joint
from robostiff.errors import DisagreementError
from robostiff.kinematics.jacobians import leg_compliance, passive_jacobian

if TYPE_CHECKING:
    from robostiff.analytic.legs.leg_elimination import LegElimination

_SAME = 1e-9  # of a unit twist
_FLOOR = 1e-3  # of K^0, added on both sides


def check_leg(found: LegElimination, placed: PlacedRobot) -> None:
    """Compare each stage with numbers about the reference point.

    The recursion in numbers takes the columns of the formula, as the axes of a spherical joint are
    free to choose; the columns of a joint must span its freedoms.

    Raises
    ------
    DisagreementError
    """
    rows = list(placed.entries.space.rows)
    for values, result, _ in closed_places(placed, found.where):
        snapshot = result.snapshot()
        own = next(
            one for one in snapshot.legs if f"{one.name} of {placed.robot.name}" == found.leg
        )
        C = leg_compliance(own, snapshot.reference_point)[np.ix_(rows, rows)]
        columns, names = passive_jacobian(own, snapshot.reference_point)
        each = dict(zip(names, columns[rows].T, strict=True))
        for careful in (False, True):
            complaint = _difference(found, values, C, each, placed.length, careful=careful)
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
    C: np.ndarray,
    columns: Mapping[str, np.ndarray],
    length: float,
    *,
    careful: bool,
) -> str:
    """What differs between the stages of a formula and the recursion (15) in numbers.

    `C`, `columns`: compliance of the leg about the reference point, and column of each freedom.
    """
    n, stages = len(C), found.stages
    matrices = [found.K0, *(stage.K for stage in stages), found.K]
    flat = [*found.axes, *found.arm, *(x for s in stages for x in s.J), *chain(*matrices)]
    given = {s: values[s.name] for s in found.given_symbols}
    known = np.array(values_of(flat, given, found.definitions, careful=careful), dtype=float)
    R, v, J, K = np.split(known, np.cumsum([9, 3, n * len(stages)]))
    T = transport(R.reshape(3, 3), v, found.space)
    J = np.linalg.solve(T.T, J.reshape(len(stages), n).T)
    scale = np.where(np.array(found.space.rows) < 3, 1.0, length)[:, None]
    columns = {name: x * scale[:, 0] for name, x in columns.items()}
    complaint = _other_freedoms(stages, J * scale, columns)
    expected = np.linalg.inv(C)
    start = expected
    *each, whole = K.reshape(-1, n, n)
    for number, own in enumerate(each):
        if number and not stages[number - 1].is_redundant:
            expected = eliminate_joint(expected, J[:, number - 1])
        # A part of K^0 on both sides: rounding of what vanishes is not compared.
        floor = _FLOOR * start
        distance = matrix_distance(T @ own @ T.T + floor, expected + floor, length)
        if distance > AGREED:
            complaint = complaint or f"by {distance:.1e} after stage {number}"
    distance = matrix_distance(whole + _FLOOR * start, expected + _FLOOR * start, length)
    return complaint or (f"by {distance:.1e}" if distance > AGREED else "")


def _other_freedoms(
    stages: Sequence[Stage], J: np.ndarray, columns: Mapping[str, np.ndarray]
) -> str:
    """What differs between the freedoms of the stages and those in numbers."""
    if redundant_columns(J) != [stage.is_redundant for stage in stages]:
        return "in which joints are redundant"
    for joint in {_joint_of(name) for name in columns}:
        own = [k for k, stage in enumerate(stages) if _joint_of(stage.joint) == joint]
        wanted = np.array([x for name, x in columns.items() if _joint_of(name) == joint]).T
        both = np.hstack([J[:, own], wanted])
        ranks = {int(np.linalg.matrix_rank(M, tol=_SAME)) for M in (J[:, own], wanted, both)}
        if len(ranks) > 1:
            return f"in the freedoms of {joint!r}"
    return ""


def _joint_of(freedom: str) -> str:
    return freedom.partition("[")[0]
