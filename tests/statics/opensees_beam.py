"""Frames of corotational beams in OpenSees, with hinges between them, moved far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from tests.peers.opensees import opensees

_STEP = 1e-3  # of the load, in differences
#: EA, EI alike in all directions, GJ.
Section = tuple[float, float, float]


@dataclass(frozen=True)
class BeamFrame:
    """Beams between nodes; what is loaded is the last of these.

    Attributes
    ----------
    nodes : mapping of str to point [m]
        Several names are nodes at one place, on a pin about z of the first.
    fixed : sequence of str
    beams : sequence of (start, end, section)
    rods : sequence of (start, end, EA)
        Between balls.
    sprung : mapping of str to float
        Stiffness of the pin of a node [N m/rad].
    in_plane : bool
    """

    nodes: Mapping[str, Sequence[float]]
    fixed: Sequence[str]
    beams: Sequence[tuple[str, str, Section]]
    rods: Sequence[tuple[str, str, float]] = ()
    sprung: Mapping[str, float] = field(default_factory=dict)
    in_plane: bool = True

    @property
    def points(self) -> dict[str, np.ndarray]:
        """Of every node (3,) [m]."""
        return {name: np.array(p, float) for own, p in self.nodes.items() for name in own.split()}

    @property
    def pins(self) -> list[tuple[str, str, float | None]]:
        """Two nodes each, and the stiffness."""
        groups = [names.split() for names in self.nodes]
        return [(own[0], name, self.sprung.get(name)) for own in groups for name in own[1:]]


def moves(frame: BeamFrame, elements: int, load: Sequence[float], steps: int = 20) -> np.ndarray:
    """Displacement of the last node under a dead load, each beam of so many elements.

    In the plane x, y, rz; in space x, y, z: the turns of OpenSees are no rotation vector. In the
    columns after it its rates by each component of the load, by differences.
    """
    ops = opensees()
    ops.wipe()
    d, n = (2, 3) if frame.in_plane else (3, 6)
    ops.model("basic", "-ndm", d, "-ndf", n)
    points = {name: at[:d] for name, at in frame.points.items()}
    tags = {name: i for i, name in enumerate(points, start=1)}
    for name, at in points.items():
        ops.node(tags[name], *at.tolist())
    for name in frame.fixed:
        ops.fix(tags[name], *[1] * n)
    node, part = len(tags), 0
    for a, b, (EA, EI, GJ) in frame.beams:
        inner = range(node + 1, node + elements)
        node += elements - 1
        along = points[b] - points[a]
        for i, tag in enumerate(inner, start=1):
            ops.node(tag, *(points[a] + along * i / elements).tolist())
        chosen = np.eye(3)[np.argmin(np.abs(along))].tolist() if d == 3 else ()
        section = (EA, 1.0, GJ, 1.0, EI, EI) if d == 3 else (EA, 1.0, EI)
        ops.geomTransf("Corotational", part + 1, *chosen)
        transf = part + 1
        for one, other in pairwise([tags[a], *inner, tags[b]]):
            part += 1
            ops.element("elasticBeamColumn", part, one, other, *section, transf)
    for i, (a, b, EA) in enumerate(frame.rods, start=1):
        ops.uniaxialMaterial("Elastic", i, EA)
        part += 1
        ops.element("corotTruss", part, tags[a], tags[b], 1.0, i)
    for i, (a, b, k) in enumerate(frame.pins, start=len(frame.rods) + 1):
        ops.equalDOF(tags[a], tags[b], *range(1, d + 1))
        if k is not None:
            ops.uniaxialMaterial("Elastic", i, k)
            part += 1
            ops.element("zeroLength", part, tags[a], tags[b], "-mat", i, "-dir", 6)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(len(tags), *map(float, load))
    ops.system("UmfPack")
    ops.numberer("RCM")
    ops.constraints("Transformation")
    ops.test("NormDispIncr", 1e-11, 50)
    ops.algorithm("Newton")
    ops.analysis("Static", "-noWarnings")

    def moved(part: float, times: int = 1) -> np.ndarray:
        ops.integrator("LoadControl", part)
        if ops.analyze(times) != 0:
            raise RuntimeError("OpenSees found no equilibrium")
        return np.array(ops.nodeDisp(len(tags)))[:3]

    found = [moved(1.0 / steps, steps)]
    h = _STEP * float(np.abs(load).max())
    for more in h * np.eye(n):
        ops.loadConst("-time", 0.0)
        ops.pattern("Plain", 2, 1)
        ops.load(len(tags), *more.tolist())
        ahead, behind = moved(1.0), moved(-2.0)
        found.append((ahead - behind) / (2 * h))
        moved(1.0)
        ops.remove("loadPattern", 2)
    return np.array(found).T


def extrapolated(frame: BeamFrame, elements: int, load: Sequence[float]) -> np.ndarray:
    """Of so many elements and twice as many: errors fall with the square of the number."""
    coarse, fine = (moves(frame, n, load) for n in (elements, 2 * elements))
    return (4 * fine - coarse) / 3
