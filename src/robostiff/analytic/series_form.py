"""A serial arm as a textbook has it: its compliance, a sum over the springs, and K its inverse."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.agreement import AGREED, closed_places, matrix_distance
from robostiff.analytic.derivation import used_definitions
from robostiff.analytic.leg_geometry import LegGeometry, transport
from robostiff.analytic.named_reading import NamedReading
from robostiff.analytic.numeric_value import values_of
from robostiff.analytic.products import FormulaTooLargeError
from robostiff.analytic.robot_derivation import InSeries
from robostiff.analytic.robot_placement import PlacedRobot
from robostiff.analytic.trigonometry import shortest_trigonometry
from robostiff.errors import DisagreementError, InputError

_PRINTED = 500  # operations of a compliance beyond which nobody reads it


def series_form(placed: PlacedRobot) -> InSeries | None:
    """The compliance of an arm without passive joints; None of others, and where it is too long.

    Raises
    ------
    DisagreementError
        When it differs from the numerical form at random parameters and poses.
    """
    own = placed.legs[0].leg
    passive = any(f.is_passive for f in own.freedoms)
    if not placed.robot.is_posed_by_joints or passive or own.blocks:
        return None
    geometry = LegGeometry.of(own, placed)
    read = NamedReading(placed.record, placed.symbols)
    try:
        geometry.check_elastic()
        C = sp.ImmutableMatrix(geometry.compliance(read, _PRINTED))
    except (InputError, FormulaTooLargeError):
        return None
    R = sp.ImmutableMatrix(3, 3, [read(x) for x in geometry.frame.R.flat])
    v = sp.ImmutableMatrix([read(x) for x in geometry.arm])
    axes, arm = shortest_trigonometry(R), shortest_trigonometry(v)
    definitions = used_definitions(read.definitions, [*C, *axes, *arm])
    if sum(int(x.count_ops()) for x in (*{*C.flat()}, *axes, *arm)) > _PRINTED:
        return None
    found = InSeries(C, axes, arm, definitions)
    check_series(found, placed)
    return found


def check_series(found: InSeries, placed: PlacedRobot) -> None:
    """Compare it with the numerical form at random parameters and poses.

    Raises
    ------
    DisagreementError
    """
    for values, result, _ in closed_places(placed, placed.where):
        K = stiffness_of(found, {placed.symbols[name]: x for name, x in values.items()}, placed)
        distance = matrix_distance(K, result.K, placed.length)
        if distance > AGREED:
            where = f"{placed.robot.name!r} {placed.where}"
            raise DisagreementError("the springs in series and the numerical form", distance, where)


def stiffness_of(found: InSeries, values: dict[Any, float], placed: PlacedRobot) -> np.ndarray:
    """K (n, n) in numbers, about the reference point in world axes."""
    axes, arm, C = (
        np.array(values_of(x.flat(), values, found.definitions), dtype=float).reshape(x.shape)
        for x in (found.axes, found.arm, found.C)
    )
    T = transport(axes, arm.ravel(), placed.entries.space)
    return T @ np.linalg.inv(C) @ T.T
