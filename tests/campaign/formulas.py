"""Derived formulas, exported to Python and C, at the poses of a robot."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.analytic.export import c_function, python_function
from robostiff.errors import RobostiffError

if TYPE_CHECKING:
    from tests.campaign.posed_ways import Case

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def formula(symbols: bool) -> Callable[[Case], None]:
    """Derived at a general pose in steps, or at home in closed form; exported and called."""

    def ask(case: Case) -> None:
        if not case.good().size or case.posed.shipped in ("h4", "gantry-tau", "capaman"):
            return
        robot = case.robot
        name = "formula in steps" if symbols else "formula at home"
        if symbols:
            pose: Any = rs.AtSymbols()
            rows = [int(r) for r in case.good()]
        else:
            pose = rs.AtHome()
            rows = [0] if 0 in case.good() else []
        if not rows:
            return
        form = rs.Steps() if symbols or case.rng.uniform() < 0.5 else rs.Closed()
        try:
            derivation = rs.derive(robot, pose=pose, form=form)
        except RobostiffError as error:
            if "one that is a dou" in str(error):
                raise
            return  # refused with words
        names = [s.name for s in derivation.symbols]
        for language in ("Python", "C"):
            if language == "C" and (COMPILER is None or case.rng.uniform() < 0.5):
                continue
            call = _python(derivation) if language == "Python" else _c(derivation, names)
            for row in rows:
                known = coordinates_of(case, row, derivation)
                K = np.asarray(call({n: known[n] for n in names}), dtype=float)
                if int(case.batch.rank[row]) == 0:
                    continue
                off = case.off(K, case.K(row))
                if not off <= 1e-8:
                    what = (
                        "not a number"
                        if not np.isfinite(K).all()
                        else "another K than in the batch"
                    )
                    case.say(f"{name}, {language}", what, f"row {row}: {off:.2e}; {known}")

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
    if posed.by_joints:
        return known | dict(zip(names, map(float, posed.rows[row]), strict=True))
    six = case.posture.pose[row]
    values = [*six[:3], *Rotation.from_rotvec(six[3:]).as_euler("xyz")]
    of_pose = dict(zip(("x", "y", "z", "alpha", "beta", "gamma"), map(float, values), strict=True))
    return known | {n: of_pose[n] for n in names if n in of_pose}


def _python(derivation: Any) -> Callable[[dict[str, float]], Any]:
    space: dict[str, Any] = {}
    exec(python_function(derivation), space)  # noqa: S102
    return lambda values: space["stiffness"](**values)


def _c(derivation: Any, names: list[str]) -> Callable[[dict[str, float]], Any]:
    folder = tempfile.mkdtemp()
    source, library = Path(folder, "f.c"), Path(folder, "f.so")
    source.write_text(c_function(derivation))
    assert COMPILER is not None
    command = [COMPILER, "-O1", "-shared", "-fPIC", str(source), "-o", str(library), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    function = ctypes.CDLL(str(library)).stiffness
    shutil.rmtree(folder)
    n = derivation.K.rows

    def call(values: dict[str, float]) -> np.ndarray:
        K = (ctypes.c_double * (n * n))()
        given = (ctypes.c_double * max(len(names), 1))(*(values[name] for name in names))
        if function(K, given):
            return np.full((n, n), np.nan)  # the formula does not hold
        return np.array(K).reshape(n, n)

    return call
