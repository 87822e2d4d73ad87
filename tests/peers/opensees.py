"""A network as a model of OpenSees: frame elements, rigid links, and joints by stiff springs.

Beams are `elasticBeamColumn`, bodies `rigidLink`; both are exact. OpenSees has constraints along
world axes only, so a joint is a `zeroLength` element, turned into the joint's axes, whose springs
are stiff where the joint is rigid. The compliance is then a power series in 1 / stiffness, of which
Richardson's extrapolation takes away the first terms.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, files
from itertools import count, pairwise
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.elastostatics import Tolerance
from robostiff.network import BeamElement, JointElement, Network, SpringElement
from robostiff.network.equations import Equations, equations_of
from robostiff.network.mobility import Mechanism, mobility
from robostiff.spatial import Space

# Stiff springs, in units of the stiffness of the network; each ten times the one before.
STIFFEST = 1e5
LEVELS = 4
_ROUNDING = 1e-12


def opensees() -> Any:
    """The module of OpenSees, with the BLAS of its wheel where the system has none."""
    try:
        parts = files("openseespylinux") or []
    except PackageNotFoundError:
        parts = []
    for part in parts:
        if part.name == "libblas.so.3":
            ctypes.CDLL(str(part.locate()), mode=ctypes.RTLD_GLOBAL)
    try:
        import openseespy.opensees as module
    except (ImportError, RuntimeError) as error:  # its own way to miss a library of the system
        raise ImportError(str(error)) from error
    return module


def load_opensees() -> None:
    """Raise an ImportError where OpenSees is missing."""
    opensees()


def silence() -> None:
    """Let this process write nothing, however low the level at which it does."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)


def stiffness_by_opensees(network: Network) -> np.ndarray:
    """Stiffness about the reference point, the inverse of deflections under unit loads (n, n)."""
    equations = equations_of(network, Tolerance())
    pins = mobility(equations, platform_fixed=False).mechanisms
    levels = [STIFFEST / 10.0**i for i in reversed(range(LEVELS))]
    table = [_compliance(equations, pins, level) for level in levels]
    for order in range(1, LEVELS):
        factor = 10.0**order
        table = [(factor * fine - coarse) / (factor - 1) for coarse, fine in pairwise(table)]
    return np.linalg.inv(table[0])


@dataclass
class _Model:
    """What is being built, and its numbers."""

    ops: Any
    network: Network
    stiff: tuple[float, float]
    points: dict[str, np.ndarray]
    tags: Iterator[int] = field(default_factory=lambda: count(1))
    bodies: dict[str, int] = field(default_factory=dict)

    def node(self, point: np.ndarray) -> int:
        tag = next(self.tags)
        self.ops.node(tag, *map(float, point))
        return tag

    def attached(self, body: str, point: np.ndarray) -> int:
        """A node at a point of a body."""
        if np.array_equal(point, self.points[body]):
            return self.bodies[body]
        tag = self.node(point)
        self.ops.rigidLink("beam", self.bodies[body], tag)
        return tag

    def zero_length(
        self,
        a: str,
        b: str,
        point: np.ndarray,
        axes: np.ndarray,
        stiffness: Sequence[float | None],
    ) -> None:
        """Six springs along axes; None for a direction that is free."""
        ends = self.attached(a, point), self.attached(b, point)
        materials, directions = [], []
        for i, k in enumerate(stiffness, start=1):
            if k is not None:
                tag = next(self.tags)
                self.ops.uniaxialMaterial("Elastic", tag, float(k))
                materials.append(tag)
                directions.append(i)
        orient = (*axes[:, 0].tolist(), *axes[:, 1].tolist())
        self.ops.element(
            "zeroLength", next(self.tags), *ends, "-mat", *materials, "-dir", *directions,
            "-orient", *orient,
        )  # fmt: skip


def _compliance(
    equations: Equations, mechanisms: tuple[Mechanism, ...], level: float
) -> np.ndarray:
    ops, network = opensees(), equations.network
    k = level * equations.stiffness
    model = _Model(ops, network, (k, k * equations.length**2), equations.points)
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    for node in network.nodes:
        model.bodies[node.name] = model.node(equations.points[node.name])
    _fix(model, mechanisms)
    for beam in network.beams:
        _add_beam(model, beam, beam.tip_compliance, beam.end, beam.rotation)
    for spring in network.springs:
        _add_spring(model, spring)
    for joint in network.joints:
        _add_joint(model, joint)
    return _deflections(model)


def _fix(model: _Model, mechanisms: tuple[Mechanism, ...]) -> None:
    """Ground, what leaves the plane, and mechanisms, which carry nothing where they are held."""
    held = {name: [0] * 6 for name in model.bodies}
    for name in model.network.fixed:
        held[name] = [1] * 6
    rows = list(model.network.space.rows)
    if model.network.space is Space.PLANAR:
        for flags in held.values():
            for i in set(range(6)) - set(rows):
                flags[i] = 1
    for mechanism in mechanisms:
        for pin in mechanism.pins:
            body, row = divmod(int(pin), len(rows))
            held[mechanism.nodes[body]][rows[row]] = 1
    for name, flags in held.items():
        if any(flags):
            model.ops.fix(model.bodies[name], *flags)


def _add_beam(
    model: _Model,
    element: BeamElement | SpringElement,
    C: np.ndarray,
    end: np.ndarray,
    axes: np.ndarray,
) -> None:
    """A frame element, its length and section found from the compliance of its tip."""
    L = 2 * C[1, 5] / C[5, 5]
    EA, GJ, EIy, EIz = (L / C[i, i] for i in (0, 3, 4, 5))
    start = end - L * axes[:, 0]
    nodes = model.attached(element.a, start), model.attached(element.b, end)
    transformation, tag = next(model.tags), next(model.tags)
    model.ops.geomTransf("Linear", transformation, *axes[:, 2].tolist())
    shear = C[1, 1] - L**3 / (3 * EIz), C[2, 2] - L**3 / (3 * EIy)
    if max(shear[0] / C[1, 1], shear[1] / C[2, 2]) < _ROUNDING:
        model.ops.element(
            "elasticBeamColumn", tag, *nodes, EA, 1.0, 1.0, GJ, EIy, EIz, transformation
        )
        return
    areas = L / shear[0], L / shear[1]
    model.ops.element(
        "ElasticTimoshenkoBeam", tag, *nodes, 1.0, 1.0, EA, GJ, EIy, EIz, *areas, transformation
    )


def _is_beam(elasticity: Elasticity) -> bool:
    C = elasticity.compliance
    return elasticity.freedoms.shape[1] == 0 and C[1, 5] > 0 and bool(np.all(np.diagonal(C) > 0))


def _add_spring(model: _Model, spring: SpringElement) -> None:
    if _is_beam(spring.elasticity):
        C = spring.elasticity.compliance
        _add_beam(model, spring, C, spring.point, spring.rotation)
        return
    C = spring.elasticity.compliance
    if np.any(C - np.diag(np.diagonal(C))) or spring.elasticity.freedoms.shape[1]:
        raise NotImplementedError(f"spring {spring.name!r} is no beam and not along its own axes")
    stiff = np.repeat(model.stiff, 3)
    values = [1 / c if c > 0 else k for c, k in zip(np.diagonal(C), stiff, strict=True)]
    model.zero_length(spring.a, spring.b, spring.point, spring.rotation, values)


def _add_joint(model: _Model, joint: JointElement) -> None:
    """Springs along perpendicular axes through one point, as joints of robots have them."""
    axes = _axes([freedom.axis for freedom in joint.freedoms])
    values: list[float | None] = [*_stiff(model)]
    for freedom in joint.freedoms:
        (axis,) = np.flatnonzero(np.abs(axes.T @ freedom.axis) > 1 - _ROUNDING)
        values[axis + 3 * freedom.turns] = freedom.stiffness
    at = {tuple(f.point) for f in joint.freedoms if f.turns}
    if len(at) > 1:
        raise NotImplementedError(f"axes of joint {joint.name!r} do not meet")
    point = np.array(at.pop()) if at else model.points[joint.a]
    model.zero_length(joint.a, joint.b, point, axes, values)


def _axes(directions: list[np.ndarray]) -> np.ndarray:
    """Right-handed axes, two of them along the first two directions that are not parallel."""
    x = directions[0] if directions else np.eye(3)[0]
    others = [d for d in directions if abs(d @ x) < 1 - _ROUNDING]
    across = others[0] if others else np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    y = across / np.linalg.norm(across)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _stiff(model: _Model) -> list[float]:
    return [*[model.stiff[0]] * 3, *[model.stiff[1]] * 3]


def _deflections(model: _Model) -> np.ndarray:
    """Twists of the reference point under unit loads (n, n)."""
    ops, network = model.ops, model.network
    tip = model.attached(network.platform, network.reference_point)
    rows = list(network.space.rows)
    # Exact; "Transformation" goes wrong, without a word, where a body is held in some directions.
    ops.constraints("Lagrange")
    ops.numberer("Plain")
    ops.system("UmfPack")
    ops.integrator("LoadControl", 1.0)
    ops.algorithm("Linear")
    ops.analysis("Static", "-noWarnings")
    ops.timeSeries("Constant", 1)
    twists = []
    for load in np.eye(6)[rows].tolist():
        ops.pattern("Plain", 1, 1)
        ops.load(tip, *load)
        if ops.analyze(1) != 0:
            raise ArithmeticError("OpenSees found no equilibrium")
        twists.append(np.array(ops.nodeDisp(tip))[rows])
        ops.remove("loadPattern", 1)
    C = np.array(twists).T
    return 0.5 * (C + C.T)
