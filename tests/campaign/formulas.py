"""Derived formulas, exported to Python and C, at the poses of a robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.errors import RobostiffError
from tests.analytic.export.programs import READERS
from tests.other_programs import is_there

if TYPE_CHECKING:
    from tests.campaign.posed_ways import Case

_LONG = ("h4", "gantry-tau", "capaman")  # formulas of minutes


def formula(at_home: bool) -> Callable[[Case], None]:
    """Derived in closed form at home, or at a general pose in steps; exported and called.

    Of parameters of a shipped robot and coordinates, half get their values first.
    """

    def ask(case: Case) -> None:
        posed, rng = case.posed, case.rng
        rows = [int(row) for row in case.good() if int(case.batch.rank[row])]
        rows = [row for row in rows if row == 0] if at_home else rows
        if not rows or posed.shipped in _LONG:
            return
        row, given = rows[rng.integers(len(rows))], dict(posed.parameters)
        robot = rs.load(posed.shipped, symbols=tuple(given)) if given else case.robot
        pose: Any = rs.AtHome() if at_home else rs.AtSymbols()
        form = rs.Closed() if at_home and rng.uniform() < 0.5 else rs.Steps()
        try:
            derivation: Any = rs.derive(robot, pose=pose, form=form)
        except RobostiffError as error:
            if "one that is a dou" in str(error):
                raise
            return  # refused with words
        values = {**coordinates_of(case, row, derivation), **given}
        known = {str(s): values[str(s)] for s in derivation.symbols}
        first = [name for name in known if rng.uniform() < 0.5]
        name = "formula at home" if at_home else "formula in steps"
        try:
            rest = derivation.subs({own: known.pop(own) for own in first}) if first else derivation
        except rs.InputError as error:
            case.say(name, "values are refused", str(error))
            return
        for language in ("python", "c"):
            if language == "c" and (not is_there("a C compiler") or rng.uniform() < 0.5):
                continue
            with TemporaryDirectory() as folder:
                call = READERS[language](rest, Path(folder))
            K = np.asarray(call(*known.values()), dtype=float)
            off = case.off(K, case.K(row))
            if not off <= 1e-8:
                what = "another K than in the batch" if np.isfinite(K).all() else "not a number"
                case.say(f"{name}, {language}", what, f"row {row}: {off:.2e}; {first} of {values}")

    return ask


def coordinates_of(case: Case, row: int, derivation: Any) -> dict[str, float]:
    """Values of the symbols of a general pose."""
    posed, robot = case.posed, case.robot
    names = [c if isinstance(c, str) else c.name for c in derivation.coordinates]
    closed = {
        f"q_{leg.name.replace(' ', '_')}_{j + 1}": float(q[row, j])
        for leg, q in zip(robot.legs, case.posture.coordinates, strict=True)
        for j in range(leg.chain.size)
    }
    # Joint coordinates that close by iteration are symbols.
    known = {n: closed[n] for n in derivation.following if n in closed}
    if posed.by_joints:  # at home none has a name
        values = map(float, posed.rows[row] if names else ())
        return known | dict(zip(names, values, strict=True))
    six = case.posture.pose[row]
    values = [*six[:3], *Rotation.from_rotvec(six[3:]).as_euler("xyz")]
    of_pose = dict(zip(("x", "y", "z", "alpha", "beta", "gamma"), map(float, values), strict=True))
    return known | {n: of_pose[n] for n in names if n in of_pose}
