"""A cantilever of corotational beams in OpenSees, bent far."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.peers.opensees import opensees

L, EA, EI, GJ = 0.7, 1e7, 35.0, 20.0


def tip_moves(elements: int, load: Sequence[float], steps: int = 20) -> np.ndarray:
    """Displacement of the tip under a dead force and moment (3,) [m]."""
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    for i in range(elements + 1):
        ops.node(i + 1, L * i / elements, 0.0, 0.0)
    ops.fix(1, 1, 1, 1, 1, 1, 1)
    ops.geomTransf("Corotational", 1, 0, 0, 1)
    for i in range(elements):
        ops.element("elasticBeamColumn", i + 1, i + 1, i + 2, EA, 1.0, GJ, 1.0, EI, EI, 1)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(elements + 1, *map(float, load))
    ops.system("FullGeneral")
    ops.numberer("Plain")
    ops.constraints("Plain")
    ops.test("NormDispIncr", 1e-12, 50)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0 / steps)
    ops.analysis("Static")
    if ops.analyze(steps) != 0:
        raise RuntimeError("OpenSees found no equilibrium")
    return np.array(ops.nodeDisp(elements + 1))[:3]


def extrapolated(load: Sequence[float]) -> np.ndarray:
    """Of ever finer elements: their errors fall with the square of the number."""
    coarse, fine = tip_moves(30, load), tip_moves(60, load)
    return (4 * fine - coarse) / 3
