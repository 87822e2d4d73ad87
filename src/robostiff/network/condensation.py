"""Stiffness of the platform of a network, compliance between points, flexible platforms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import DEFAULT_TOLERANCE, CartesianStiffness, Status, Tolerance
from robostiff.elastostatics.conditioning import smallest_held_stiffness
from robostiff.errors import InputError, NoAnswerError
from robostiff.model import FlexiblePlatform
from robostiff.network.elements import Node, SpringElement
from robostiff.network.equations import Equations, equations_of
from robostiff.network.mobility import Mobility, mobility
from robostiff.network.network import Network
from robostiff.network.saddle_point import (
    CONVERGED,
    driven_mechanism,
    freedom_rates,
    redundancy,
    redundant_freedoms,
    saddle_point_system,
    system_of,
)
from robostiff.spatial import Space, as_floats


@dataclass(frozen=True)
class NetworkStiffness:
    """Stiffness of the platform of a network.

    Attributes
    ----------
    whole : CartesianStiffness
        About `origin`.
    freedom_names : tuple of str
        ``element/freedom`` of every column of ``whole.redundant``.
    origin : (3,) array
        The network's reference point, or the middle of the platform where that is far away [m].
    """

    whole: CartesianStiffness
    freedom_names: tuple[str, ...]
    origin: np.ndarray


def condense(network: Network, tolerance: Tolerance = DEFAULT_TOLERANCE) -> NetworkStiffness:
    """Stiffness of the platform of a network: the wrench it takes to move it by each twist.

    The platform is moved with the fixed nodes at rest; the saddle-point system gives where all
    other bodies go and what everything carries. Rank and free motions come from geometry alone.

    Parameters
    ----------
    network : Network
    tolerance : Tolerance

    Returns
    -------
    NetworkStiffness
        Mechanisms that leave the platform at rest count as redundant joints. Rigid parts that
        support one another are legal.

    Raises
    ------
    InputError
        When the network has no element, or leaves the plane of a planar network.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02))
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> round(condense(network).whole.K[0, 0].item())
    65973446
    """
    equations = equations_of(network, tolerance)
    n, scale = equations.size, equations.scale
    mobile = mobility(equations, platform_fixed=True)
    dependent = redundancy(equations, platform_fixed=True)
    U, values, _ = np.linalg.svd(mobile.held, full_matrices=False)
    held, rank = U * values, int(np.count_nonzero(values > tolerance.independence))
    doubtful = bool(np.any(tolerance.leaves_in_doubt(values)))
    U, values, _ = np.linalg.svd(dependent.on_platform, full_matrices=False)
    rigid = U[:, values > tolerance.independence]
    redundant, names = redundant_freedoms(equations, mobile)
    status = (
        (rank < n) * Status.FREE_MOTIONS
        | bool(redundant.any()) * Status.REDUNDANT_JOINTS
        | bool(rigid.shape[1]) * Status.RIGID_DIRECTION
    )
    K = np.zeros((n, n))
    if not rigid.shape[1]:
        system = saddle_point_system(equations, platform_fixed=True)
        platform = system.rows_of[network.platform]
        M_p = system.matrix[:, platform].toarray()
        # The platform moves by each unit displacement; the reactions are the columns of K.
        x, step = system.solve(M_p)
        K = M_p[platform] - M_p.T @ x
        K = _on_held(0.5 * (K + K.T), held, rank)
        doubtful |= step > CONVERGED
        doubtful |= bool(smallest_held_stiffness(K, np.array(rank)) <= tolerance.near_rigidity)
    if doubtful or mobile.doubtful or dependent.doubtful:
        status |= Status.ILL_CONDITIONED
    whole = CartesianStiffness(
        matrix=K * np.outer(scale, scale) * equations.stiffness,
        status_codes=np.array(int(status), dtype=np.uint16),
        rank=np.array(rank),
        held=held,
        redundant=redundant,
        length=np.array(equations.length),
        rigid=rigid,
        tolerance=tolerance,
    )
    return NetworkStiffness(whole, names, equations.points[network.platform])


def _on_held(K: np.ndarray, held: np.ndarray, rank: int) -> np.ndarray:
    """K of its rank: rounding must not stiffen free motions.

    ``K W (W^T K W)^-1 W^T K`` is K where K has the rank of W, and an error of W, the wrenches that
    hold the platform, changes it in second order only. W itself has the digits of its largest
    entries, and small blocks of K have more.
    """
    if rank in (0, len(K)):
        return K if rank else np.zeros(K.shape)
    W = np.linalg.svd(held, full_matrices=False)[0][:, :rank]
    felt = K @ W
    try:
        L = np.linalg.cholesky(W.T @ felt)
    except np.linalg.LinAlgError:  # parts too different in size: few digits, as the status says
        return W @ (W.T @ felt) @ W.T
    X = np.linalg.solve(L, felt.T)
    return X.T @ X


def compliance_between(
    network: Network,
    points: Sequence[tuple[str, ArrayLike]],
    *,
    loads: ArrayLike | None = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> np.ndarray:
    """Compliance between points of a network: all their twists for wrenches at any of them.

    Where a point can move freely, there are no twists for all wrenches, but there is the work of
    those `loads` that do none on the free motions.

    Parameters
    ----------
    network : Network
    points : sequence of (str, (3,) array)
        N points in the world [m], each with the name of the node that carries it.
    loads : (n N, k) array, optional
        Loads in columns, each a wrench at every point [N, N m]; all unit wrenches when left out.
    tolerance : Tolerance

    Returns
    -------
    (n N, n N) or (k, k) array
        Block (i, j) is the twist of point i for a wrench at point j [m/N, 1/N, rad/(N m)], n = 6 or
        3 in the plane; with `loads`, entry (i, j) is the work of load i on the displacements under
        load j [J]. Symmetric (Maxwell and Betti), and zero where rigid.

    Raises
    ------
    InputError
        When a node is not there, or a point is no point.
    NoAnswerError
        When a load does work on a motion without stiffness, or rounding leaves few digits.

    Examples
    --------
    The middle and the tip of a rod of 1 m:

    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> a, b, c = (Node(name, np.array([x, 0, 0])) for name, x in zip("abc", (0, 0.5, 1.0)))
    >>> rods = [beam_between(*ends, material("steel"), circle(0.02)) for ends in ((a, b), (b, c))]
    >>> network = Network("rod", (a, b, c), ("a",), "c", c.point, beams=tuple(rods))
    >>> C = compliance_between(network, [("b", b.point), ("c", c.point)])
    >>> float(round(C[7, 7] / C[1, 1], 9)), float(round(C[1, 7] / C[1, 1], 9))
    (8.0, 2.5)
    """
    places = [_checked(network, node, point) for node, point in points]
    if not places:
        raise InputError("points", got=points, expected="at least one (node, [x, y, z])")
    equations = equations_of(network, tolerance)
    n = equations.size
    transports = [equations.transport(node, point) for node, point in places]
    scale = np.tile(equations.scale, len(places))
    given, size = np.diag(scale), len(scale)
    if loads is not None:
        given = as_floats("loads", loads, f"numbers ({size}, k), a load in each column [N, N m]")
        if given.ndim != 2 or given.shape[0] != size:
            expected = f"a shape ({size}, k): a wrench at every point, a load in each column"
            raise InputError("loads", got=given.shape, expected=expected)
    F = given / scale[:, None]
    system, mobile, _ = system_of(equations)
    right = np.zeros((system.size, F.shape[1]))
    for i, ((node, _), D) in enumerate(zip(places, transports, strict=True)):
        right[system.rows_of[node]] += D.T @ F[n * i : n * (i + 1)]
    for column in range(F.shape[1]):
        if driven_mechanism(equations, mobile, system, right[:, [column]]) is not None:
            node, point = places[column // n if loads is None else 0]
            what = f"at {point.tolist()} of node {node!r}" if loads is None else f"of load {column}"
            raise NoAnswerError(f"no compliance {what}: {Status.FREE_MOTIONS.advice[0]}")
    x, step = system.solve(right)
    if step > CONVERGED:
        raise NoAnswerError(f"no compliance: {Status.ILL_CONDITIONED.advice[0]}")
    C = right.T @ x / equations.stiffness
    C = 0.5 * (C + C.T)
    return C / np.outer(scale, scale) if loads is None else C


def _checked(network: Network, node: str, point: ArrayLike) -> tuple[str, np.ndarray]:
    names = [known.name for known in network.nodes]
    if node not in names:
        raise InputError(
            "node of a point", got=node, expected=f"the name of a node: {', '.join(names[:12])}"
        )
    subject = f"point of node {node!r}"
    return node, as_floats(subject, point, "three numbers x y z [m]", "m", (3,))


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
