"""Comparison of a stiffness to first order in the load with equilibria, before it is returned."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analytic.exact.numeric_value import values_of
from robostiff.analytic.placement.agreement import sampled_robots
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.errors import DisagreementError, InputError, NoAnswerError
from robostiff.model import Robot

if TYPE_CHECKING:
    from robostiff.analytic.stiffness_under_load import StiffnessUnderLoad

#: Largest relative difference of the formula and of differences of equilibria.
_AGREED = 1e-6
_DEFLECTION = 3e-5  # of the characteristic length, or rad: of the equilibria that are compared
_ROUNDING = 1e-10  # of K: what equilibria may miss
_SPREADS = (0.02, 0.005, 0.0)  # of the parameters
_SETS = 2
_SEED = 91

#: Stiffness of a robot at a pose under a wrench, by numbers: robot, pose, wrench (n,).
LoadedK = Callable[[Robot, Any, np.ndarray], np.ndarray]


def check_under_load(formula: StiffnessUnderLoad, placed: PlacedRobot, loaded_K: LoadedK) -> None:
    """Compare with differences of equilibria at random parameters, poses and loads.

    Raises
    ------
    DisagreementError
        When they differ.
    InputError
        When no equilibrium was found.
    """
    random = np.random.default_rng(_SEED)
    checked, complaint = 0, ""
    for spread in _SPREADS:
        for _ in range(_SETS):
            try:
                robot, each = sampled_robots(placed, random, spread, 1)
                for values, pose in each:
                    _compare(formula, placed, random, loaded_K, robot, pose, values)
                    checked += 1
            except (InputError, NoAnswerError) as error:
                complaint = str(error)
            if checked >= _SETS:
                return
    if not checked:
        raise InputError(
            f"formula of {formula.name!r} under load",
            got=f"no equilibrium with which it could be compared: {complaint}",
            expected="a robot that carries small loads",
        )


def _compare(
    formula: StiffnessUnderLoad,
    placed: PlacedRobot,
    random: np.random.Generator,
    loaded_K: LoadedK,
    robot: Robot,
    pose: Any,
    values: Mapping[str, float],
) -> None:
    n = formula.K0.rows
    drawn = {x: float(random.uniform(0.5, 1.5)) for x in formula.symbols}
    known = {x: values.get(x.name, drawn[x]) for x in formula.symbols}
    numbers = values_of(
        [*formula.K0, *formula.K1, *formula.wrench], known, formula.definitions, careful=False
    )
    flat = np.array(numbers, dtype=float)
    K0, K1 = flat[: n * n].reshape(n, n), flat[n * n : 2 * n * n].reshape(n, n)
    F = flat[2 * n * n :]
    sizes = np.array([1.0 if row < 3 else 1.0 / placed.length for row in placed.entries.space.rows])
    both = np.outer(sizes, sizes)
    K_even = K0 * both
    twist = np.linalg.lstsq(K_even, F * sizes, rcond=1e-10)[0]
    share = _DEFLECTION * placed.length / float(np.max(np.abs(twist)))
    rates = [
        (loaded_K(robot, pose, s * F) - loaded_K(robot, pose, -s * F)) / (2 * s)
        for s in (share, share / 2)
    ]
    expected = (4 * rates[1] - rates[0]) / 3
    unloaded = loaded_K(robot, pose, 0 * F)
    size = float(np.max(np.abs(K_even)))
    apart = float(np.max(np.abs(K0 - unloaded) * both)) / size
    off = np.abs(K1 - expected) * both
    limit = _AGREED * float(np.max(np.abs(expected) * both)) + _ROUNDING * size / share
    if apart > _AGREED or not np.max(off) <= limit:
        i, j = np.unravel_index(np.argmax(off), off.shape)
        at = ", ".join(f"{x} = {value:.6g}" for x, value in known.items())
        raise DisagreementError(
            "the formula and equilibria under small loads",
            f"by {max(apart, float(np.max(off)) / size):.1e} of K (the change of "
            f"K{i + 1}{j + 1} is {K1[i, j]:.9g} and {expected[i, j]:.9g})",
            f"{formula.name!r} {formula.where}, at {at}",
        )
