"""The hexapod in OpenSees: a model of beam elements at each pose, and six unit loads.

The platform is one node, and its rigid arms are joint offsets of the tubes. OpenSees releases
bending at the ends of a beam but not torsion, so the leg may spin about itself at the base and not
at the platform: nothing but a force along the leg passes either way.
"""

from __future__ import annotations

import ctypes
from importlib.metadata import PackageNotFoundError, files
from typing import Any

import numpy as np
from batched_stiffness import K_ACTUATOR, Hexapod, rotation

from peers.way import PLACES, Way

_PLATFORM = 7


def opensees_model(robot: Hexapod) -> Way:
    """K_C as the inverse of six deflections; ImportError where OpenSees is missing."""
    ops = _opensees()

    def evaluate(rows: np.ndarray) -> np.ndarray:
        return np.array([_stiffness(ops, robot, pose)[PLACES] for pose in rows.T]).T

    return evaluate


def _opensees() -> Any:
    """The module of OpenSees, with the BLAS of its wheel where the system has none."""
    try:
        parts = files("openseespylinux") or []
        blas = [part for part in parts if part.name == "libblas.so.3"]
    except PackageNotFoundError:
        blas = []
    for part in blas:
        ctypes.CDLL(str(part.locate()), mode=ctypes.RTLD_GLOBAL)
    try:
        import openseespy.opensees as ops
    except RuntimeError as error:  # its own way to say that a library of the system is missing
        raise ImportError(str(error)) from error
    return ops


def _stiffness(ops: Any, robot: Hexapod, pose: np.ndarray) -> np.ndarray:
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.node(_PLATFORM, *pose[:3].tolist())
    arms = robot.platform @ rotation(pose[3:]).T
    for leg, (A, first, arm) in enumerate(
        zip(robot.base, robot.first_axis, arms, strict=True), start=1
    ):
        ops.node(leg, *A.tolist())
        ops.fix(leg, 1, 1, 1, 0, 0, 0)
        offsets = [0.0, 0.0, 0.0, *arm.tolist()]
        ops.geomTransf("Linear", leg, *first.tolist(), "-jntOffset", *offsets)
        L = float(np.linalg.norm(pose[:3] + arm - A))
        # the actuator is in series with the tube
        area = 1 / (1 / robot.A + robot.E / (K_ACTUATOR * L))
        section = area, robot.E, robot.G, robot.J, robot.I, robot.I
        releases = "-releasez", 2, "-releasey", 2
        ops.element("elasticBeamColumn", leg, leg, _PLATFORM, *section, leg, *releases)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.integrator("LoadControl", 1.0)
    ops.algorithm("Linear")
    ops.analysis("Static", "-noWarnings")
    ops.timeSeries("Constant", 1)
    compliance = np.empty((6, 6))
    for column, load in enumerate(np.eye(6).tolist()):
        ops.pattern("Plain", 1, 1)
        ops.load(_PLATFORM, *load)
        if ops.analyze(1) != 0:
            raise ArithmeticError("OpenSees found no equilibrium")
        compliance[:, column] = ops.nodeDisp(_PLATFORM)
        ops.remove("loadPattern", 1)
    return np.linalg.inv(compliance)
