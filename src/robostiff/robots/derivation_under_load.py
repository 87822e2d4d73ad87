"""The stiffness of a robot to first order in its load, as a formula."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analytic import Closed, Steps
from robostiff.analytic.budget import BUDGET
from robostiff.analytic.stiffness_under_load import StiffnessUnderLoad, stiffness_under_load
from robostiff.errors import InputError, NoAnswerError
from robostiff.model import Robot
from robostiff.robots.derivation import symbolic_robot
from robostiff.statics import Bowing, Linear, equilibrium
from robostiff.statics.beam_bowing import uniform_beam

if TYPE_CHECKING:
    from robostiff.analytic.robot_pose import PoseFormula
    from robostiff.io.model_file.symbols import Symbols

_ONE = Bowing(1)


def derive_under_load(
    robot: Robot | str | Path,
    wrench: Sequence[Any] | str | None = None,
    *,
    symbols: Symbols | None = None,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
    beams: Bowing | Linear = _ONE,
) -> StiffnessUnderLoad:
    """Stiffness of a robot to first order in a wrench on its platform, K = K0 + K1.

    K is the rate of the wrench by the twist, about the reference point that moves along, as
    `equilibrium(...).K`: under the load times s, K is K0 + s K1 + O(s^2). K1 has a part from the
    geometry, ``-X^T H X``, and one from the motion to the loaded posture. Before it is returned it
    is compared with differences of equilibria at random parameters.

    Parameters
    ----------
    robot : Robot, str or Path
        As for `derive`; its legs are joints and elastic parts in series.
    wrench : sequence or str, optional
        Its components at the reference point in world axes, six, or three in the plane: numbers,
        names of symbols such as ``"-F"``, or formulas; ``"0 -F 0"`` in one string. When left
        out, a symbol for each.
    symbols, pose, form, budget
        As for `derive`. In steps where a closed form would be long, or not end in time.
    beams : Bowing or Linear
        `Bowing(1)`, one element a beam, has the shortening of beams by bending; `Linear()` has
        elastic parts as linear springs.

    Returns
    -------
    StiffnessUnderLoad

    Raises
    ------
    InputError
        When there is no such robot, a leg has more than joints and elastic parts of constant
        stiffness in series or joints that the platform does not hold, or the load does work on a
        free motion of the platform.
    FormulaTooLargeError
        When `Closed()` was asked for and exceeds its limit, or its budget of time.

    Examples
    --------
    A cantilever, on the way to the load at which it buckles:

    >>> loaded = derive_under_load("planar-link", ["-P", 0, 0])
    >>> loaded.K1[1, 1]
    -6*P/(5*L)
    >>> loaded.lambdify("L", "P")(0.5, [0.0, 1e3]).shape
    (2, 3, 3)
    """
    own = symbolic_robot(robot, symbols)
    if isinstance(beams, Bowing) and beams.elements not in (None, 1):
        raise InputError(
            "beams of a formula under load",
            got=f"{beams.elements} elements",
            expected="Bowing(1), or Linear()",
            hint="cut the beam in the model",
        )
    numeric = _ONE if isinstance(beams, Bowing) else beams

    def loaded_K(twin: Robot, at: Any, F: np.ndarray) -> np.ndarray:
        found = equilibrium(twin, at, F, beams=numeric)
        if found.K is None:
            raise NoAnswerError(f"no stiffness under load: {found.status}")
        return found.K

    def is_beam(C: np.ndarray) -> bool:
        return numeric is _ONE and uniform_beam(C) is not None

    return stiffness_under_load(own, loaded_K, is_beam, wrench, pose, form, budget)
