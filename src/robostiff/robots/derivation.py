"""The stiffness of any robot as a formula, by its name, its file, or as an object."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, cast, overload

from robostiff.analytic import (
    CableFormula,
    Closed,
    LegElimination,
    RobotDerivation,
    Steps,
    derive_cables,
    derive_leg,
    derive_robot,
)
from robostiff.analytic.budget import BUDGET
from robostiff.errors import InputError, Words
from robostiff.io.model_file import ParameterChoice
from robostiff.model import Robot
from robostiff.model.cable import CableRobot
from robostiff.robots import load, robot_of_formula

if TYPE_CHECKING:
    from robostiff.analytic.placement.robot_pose import PoseFormula
    from robostiff.io.model_file.symbols import Symbols


@overload
def derive(
    robot: CableRobot, *, pose: PoseFormula | None = None, form: Closed | Steps | None = None
) -> CableFormula: ...


@overload
def derive(
    robot: Robot | str | Path,
    *,
    symbols: Symbols | None = None,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
    leg: None = None,
) -> RobotDerivation: ...


@overload
def derive(
    robot: Robot | str | Path,
    *,
    symbols: Symbols | None = None,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
    leg: str,
) -> LegElimination: ...


def derive(
    robot: Robot | CableRobot | str | Path,
    *,
    symbols: Symbols | None = None,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
    leg: str | None = None,
) -> RobotDerivation | LegElimination | CableFormula:
    """Stiffness matrix of a robot as a formula, eq. (12), about its reference point, world axes.

    The legs are closed in formulas, in the working modes of home, and each leg transmits wrenches
    w that meet compliances c: K = sum of w w^T / c.

    Parameters
    ----------
    robot : Robot, CableRobot, str or Path
        A robot, with or without symbols; or the name of a shipped robot or a model file. A cable
        robot has its tensions as symbols, t_1, t_2 and so on, and no symbols of parameters.
    symbols : iterable of str, or ALL_PARAMETERS
        Parameters of the model file that are symbols of the formula; all of them when left out. A
        mapping such as ``{"cylinder": "c"}`` gives some of all symbols another name.
        For a name or file alone: a `Robot` brings its own.
    pose : AtHome, AtSymbols, AtCoordinates or AtJoints
        Home (the default), a general pose in symbols, given coordinates, or the joint coordinates
        of all legs in symbols.
    form : Closed or Steps
        One expression an entry, or named steps, which never explode. When left out, closed at home
        as long as that can be read, and steps otherwise.
    budget : float or None
        Seconds of computing for a closed form; None for no limit. When it does not end in time,
        the answer is in steps, and its `remark` says so; with `Closed()` it is an error.
    leg : str, optional
        Name of a leg, to derive its own stiffness as in Section VI: K^0 to K^n, one passive joint
        after the other.

    Returns
    -------
    RobotDerivation, LegElimination of a leg, or CableFormula of a cable robot
        With K, the legs, and the definitions of named steps. `robostiff.analytic.export` writes it
        as text, LaTeX, Markdown, PDF, JSON, Python, C, Julia and MATLAB.

    Raises
    ------
    InputError
        When there is no such robot, a leg has no closed form away from home, or a leg is rigid.
    FormulaTooLargeError
        When a closed form would exceed its limit, or its budget of time.

    Examples
    --------
    Eq. (28), case B of the paper, and the same platform at a general pose:

    >>> derivation = derive("gough-stewart-b")
    >>> derivation.K[2, 2]
    6*h**2*k/(R**2 - R*r + h**2 + r**2)
    >>> from robostiff.analytic import AtSymbols
    >>> general = derive("gough-stewart-b", pose=AtSymbols())
    >>> general.where
    'at x, y, z, alpha, beta, gamma'

    A leg with its five passive joints, of which traction alone is left:

    >>> leg = derive("gough-stewart-b-beams", leg="leg1")
    >>> left = leg.stages[-1].K
    >>> len(leg.stages), left[0, 0] == leg.K0[0, 0], left.rank()
    (5, True, 1)
    """
    if isinstance(robot, str | Path):
        if symbols is None:
            symbols = ParameterChoice.ALL
        elif isinstance(symbols, Iterable) and not isinstance(symbols, str | Mapping):
            symbols = tuple(symbols) or ParameterChoice.NONE
        robot = robot_of_formula(load(robot, symbols=symbols), str(robot))
    elif not isinstance(robot, Robot | CableRobot):
        raise InputError(
            "robot of a formula",
            got=type(robot).__name__,
            expected="a Robot or CableRobot, the name of a shipped robot, or a model file",
            hint="a snapshot of formulas is derived by robostiff.analytic.snapshot_formula",
        )
    elif symbols is not None:
        raise InputError(
            "symbols of a formula",
            got=Words(f"names beside the loaded robot {robot.name!r}"),
            expected="a robot that was loaded with its symbols",
            hint='write derive(load("NAME", symbols=(...))), or derive("NAME", symbols=(...))',
        )
    if hasattr(robot, "cables"):
        if leg is not None:
            subject = f"leg of the cable robot {robot.name!r}"
            raise InputError(subject, got=leg, expected="none: its formula has one generic cable")
        return derive_cables(cast("CableRobot", robot), pose, form)
    of_legs = cast("Robot", robot)
    if leg is None:
        return derive_robot(of_legs, pose, form, budget)
    return derive_leg(of_legs, leg, pose, form, budget)
