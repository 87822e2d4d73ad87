"""Compliance of a flexible platform between its tool and the nodes that hold legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics import Status, Tolerance
from robostiff.errors import NoAnswerError
from robostiff.model import FlexiblePlatform
from robostiff.network.elements import Node, SpringElement
from robostiff.network.equations import Equations, equations_of
from robostiff.network.mobility import Mobility
from robostiff.network.network import Network
from robostiff.network.saddle_point import CONVERGED, freedom_rates, system_of
from robostiff.spatial import Space

_MOVES = 1e-6


@dataclass(frozen=True)
class PlatformFlexibility:
    """Motions of N nodes against the tool, in platform axes, each about its own point.

    Attributes
    ----------
    part_compliances : dict of (n N, n N) arrays
        For each part by its name a matrix E: wrenches F on the nodes store the energy F . E F / 2
        in it [m/N, 1/N, rad/(N m)].
    motions : (n N, k) array
        Motions of the nodes that the platform itself leaves free [m, rad]; zero for motions that
        leave all of them at rest.
    motion_names : tuple of str
        The freedoms of parts that move in each of them.
    """

    part_compliances: dict[str, np.ndarray]
    motions: np.ndarray
    motion_names: tuple[str, ...]

    @property
    def compliance(self) -> np.ndarray:
        """Twists of the nodes for wrenches on them (n N, n N)."""
        return np.sum(list(self.part_compliances.values()), axis=0)


def platform_flexibility(
    platform: FlexiblePlatform,
    nodes: Sequence[str],
    space: Space = Space.SPATIAL,
    tolerance: Tolerance | None = None,
) -> PlatformFlexibility:
    """Flexibility of a platform whose tool is held, as a network of its own.

    Where the platform has motions of its own, the compliance is that for loads that do no work on
    them, with the platform held at as many coordinates.

    Parameters
    ----------
    platform : FlexiblePlatform
    nodes : sequence of str
        Those that hold legs, each once.
    space : Space
    tolerance : Tolerance, optional

    Raises
    ------
    InputError
        When a part of a planar robot leaves the plane.
    NoAnswerError
        When rounding leaves few digits.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.model import PlatformNode, platform_beam
    >>> hub, rim = PlatformNode("hub", np.zeros(3)), PlatformNode("rim", np.array([1.0, 0, 0]))
    >>> arm = platform_beam(hub, rim, material("steel"), circle(0.02), name="arm")
    >>> platform = FlexiblePlatform((hub, rim), (arm,), "hub")
    >>> C = platform_flexibility(platform, ["rim"]).compliance
    >>> round(1 / C[0, 0].item())
    65973446
    """
    tolerance = tolerance or Tolerance()
    equations = equations_of(_network(platform, space), tolerance)
    system, mobile, _ = system_of(equations)
    n = equations.size
    transports = [equations.transport(name, platform.point_of(name)) for name in nodes]
    loads = np.zeros((system.size, n * len(nodes)))
    for i, (name, D) in enumerate(zip(nodes, transports, strict=True)):
        if name != platform.tool:
            loads[system.rows_of[name], n * i : n * (i + 1)] = D.T
    x, step = system.solve(loads)
    if step > CONVERGED:
        raise NoAnswerError(f"no stiffness of the platform: {Status.ILL_CONDITIONED.advice[0]}")
    s = np.tile(equations.scale, len(nodes))
    unit = np.outer(s, s) * equations.stiffness
    parts = {}
    for c, rows in zip(equations.connections, system.wrench_rows, strict=True):
        carried = x[rows]
        parts[c.name] = carried.T @ c.S @ carried / unit
    motions, names = _motions(equations, mobile, nodes, transports)
    return PlatformFlexibility(parts, motions / s[:, None], names)


def _network(platform: FlexiblePlatform, space: Space) -> Network:
    """The platform in its own frame, its tool held."""
    other = next(node.name for node in platform.nodes if node.name != platform.tool)
    springs = (
        SpringElement(part.name, part.a, part.b, part.point, part.axes, part.elasticity)
        for part in platform.parts
    )
    return Network(
        "flexible platform",
        tuple(Node(node.name, node.at) for node in platform.nodes),
        (platform.tool,),
        other,
        platform.point_of(platform.tool),
        springs=tuple(springs),
        space=space,
    )


def _motions(
    equations: Equations, mobile: Mobility, nodes: Sequence[str], transports: list[np.ndarray]
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Scaled unit motions of the nodes (n N, k), and which freedoms move in each.

    A motion that leaves all these nodes at rest is exactly zero.
    """
    n = equations.size
    freedoms = [name for c in equations.connections for name in c.freedom_names]
    columns, names = [np.zeros((n * len(nodes), 0))], []
    for mechanism in mobile.mechanisms:
        own = np.zeros((n * len(nodes), mechanism.motions.shape[-1]))
        for i, (name, D) in enumerate(zip(nodes, transports, strict=True)):
            if name in mechanism.nodes:
                own[n * i : n * (i + 1)] = D @ mechanism.motions[mechanism.nodes.index(name)]
        U, values, Vt = np.linalg.svd(own)
        kept = np.zeros_like(own)
        for k in np.flatnonzero(values > equations.tolerance.independence):
            kept[:, k] = U[:, k]
        columns.append(kept)
        for rates in (freedom_rates(equations, mechanism) @ Vt.T).T:
            moving = np.flatnonzero(np.abs(rates) > _MOVES)
            names.append(" + ".join(freedoms[i] for i in moving))
    return np.hstack(columns), tuple(names)
