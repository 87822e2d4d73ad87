"""Stiffness of the platform of a network, and compliance between points of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import (
    DEFAULT_TOLERANCE,
    CartesianStiffness,
    ConjugateWrenches,
    Details,
    Status,
    Tolerance,
)
from robostiff.elastostatics.conjugate_wrenches import conjugate_wrenches
from robostiff.elastostatics.leg import loads_of_modes, transmitted
from robostiff.elastostatics.tolerance import smallest_held_stiffness
from robostiff.errors import InputError, NoAnswerError
from robostiff.network.equations import Equations, equations_of
from robostiff.network.mobility import mobility
from robostiff.network.network import Network
from robostiff.network.saddle_point import (
    CONVERGED,
    redundancy,
    redundant_freedoms,
    saddle_point_system,
)
from robostiff.spatial import as_floats

_NONE = 1e-6  # of the softness of the parts


def condense(network: Network, tolerance: Tolerance = DEFAULT_TOLERANCE) -> Details:
    """Stiffness of the platform of a network: the wrench it takes to move it by each twist.

    The platform is moved with the fixed nodes at rest; the saddle-point system gives where all
    other bodies go and what everything carries. Rank and free motions come from geometry alone.

    Parameters
    ----------
    network : Network
    tolerance : Tolerance

    Returns
    -------
    Details
        About the reference point, or the middle of the platform where that is far away. Mechanisms
        that leave the platform at rest count as redundant joints. Rigid parts that support one
        another are legal.

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
    >>> round(condense(network).K[0, 0].item())
    65973446
    """
    equations = equations_of(network, tolerance)
    n, scale = equations.size, equations.scale
    mobile = mobility(equations, platform_fixed=True)
    dependent = redundancy(equations, platform_fixed=True)
    U, values, _ = np.linalg.svd(mobile.held, full_matrices=False)
    held, W = U * values, U[:, values > tolerance.independence]
    rank = W.shape[1]
    doubtful = bool(np.any(tolerance.leaves_in_doubt(values)))
    U, values, _ = np.linalg.svd(dependent.on_platform, full_matrices=False)
    rigid = U[:, values > tolerance.independence]
    redundant, names = redundant_freedoms(equations, mobile)
    status = (
        (rank < n) * Status.FREE_MOTIONS
        | bool(redundant.any()) * Status.REDUNDANT_JOINTS
        | bool(rigid.shape[1]) * Status.RIGID_DIRECTION
    )
    K, smallest = np.zeros((n, n)), 0.0
    if not rigid.shape[1]:
        system = saddle_point_system(equations, platform_fixed=True)
        platform = system.matrix.rows_of[network.platform]
        unit = np.zeros((system.matrix.size, n))
        unit[platform] = np.eye(n)
        M_p = system.matrix.times(unit)
        # The platform moves by each unit displacement; the reactions are the columns of K.
        x, step = system.solve(M_p)
        K = M_p[platform] - M_p.T @ x
        K = _on_held(0.5 * (K + K.T), W)
        doubtful |= step > CONVERGED
        smallest = float(smallest_held_stiffness(K, np.array(rank)))
        doubtful |= smallest <= tolerance.near_rigidity
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
    if rigid.shape[1]:
        carried = _among_rigid(network, W, equations)
    elif smallest > tolerance.rigidity:
        carried = transmitted(replace(whole, held=W)).conjugate
    else:
        carried = ConjugateWrenches.none(n)
    return Details.of(
        replace(whole, carried=carried),
        origin=equations.points[network.platform],
        reference_point=network.reference_point,
        passive_joint_names=names,
    )


def _among_rigid(network: Network, W: np.ndarray, equations: Equations) -> ConjugateWrenches:
    """Wrenches W (n, m) that hold the platform, some rigid, by the compliance under them."""
    tool, tolerance = (network.platform, equations.points[network.platform]), equations.tolerance
    loads = W * equations.scale[:, None]
    try:
        C = compliance_between(network, [tool], loads=loads, tolerance=tolerance)
    except NoAnswerError:
        return ConjugateWrenches.none(len(W))
    soft = np.diagonal(C) > tolerance.rigidity * max(np.trace(C), _NONE / equations.stiffness)
    size = np.sqrt(np.where(soft, np.diagonal(C), 1.0))
    values, V = np.linalg.eigh(np.where(np.outer(soft, soft), C / np.outer(size, size), 0.0))
    modes = (size[:, None] * V * np.sqrt(np.maximum(values, 0.0)))[:, values > tolerance.rigidity]
    return conjugate_wrenches(W, *loads_of_modes(modes.T)(np.eye(len(C))), tolerance)


def _on_held(K: np.ndarray, W: np.ndarray) -> np.ndarray:
    """K of its rank: rounding must not stiffen free motions.

    ``K W (W^T K W)^-1 W^T K`` is K where K has the rank of W, and an error of W, the wrenches that
    hold the platform, changes it in second order only. W itself has the digits of its largest
    entries, and small blocks of K have more.
    """
    if W.shape[1] in (0, len(K)):
        return K if W.size else np.zeros(K.shape)
    KW = K @ W
    try:
        L = np.linalg.cholesky(W.T @ KW)
    except np.linalg.LinAlgError:  # parts too different in size: few digits, as the status says
        return W @ (W.T @ KW) @ W.T
    X = np.linalg.solve(L, KW.T)
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
    places, names = [], [known.name for known in network.nodes]
    for node, point in points:
        if node not in names:
            expected = f"the name of a node: {', '.join(names[:12])}"
            raise InputError("node of a point", got=node, expected=expected)
        subject = f"point of node {node!r}"
        places.append((node, as_floats(subject, point, "three numbers x y z [m]", "m", (3,))))
    if not places:
        raise InputError("points", got=points, expected="at least one (node, [x, y, z])")
    equations = equations_of(network, tolerance)
    n = equations.size
    scale = np.tile(equations.scale, len(places))
    given, size = np.diag(scale), len(scale)
    if loads is not None:
        given = as_floats("loads", loads, f"numbers ({size}, k), a load in each column [N, N m]")
        if given.ndim != 2 or given.shape[0] != size:
            expected = f"a shape ({size}, k): a wrench at every point, a load in each column"
            raise InputError("loads", got=given.shape, expected=expected)
    system = saddle_point_system(equations, platform_fixed=False)
    at_points = given.reshape(len(places), n, -1)
    right = system.forces([(node, F, at) for (node, at), F in zip(places, at_points, strict=True)])
    for column, own in enumerate(right.T):
        if system.driven(own) is not None:
            node, point = places[column // n if loads is None else 0]
            what = f"at {point.tolist()} of node {node!r}" if loads is None else f"of load {column}"
            raise NoAnswerError(f"no compliance {what}: {Status.FREE_MOTIONS.advice[0]}")
    x, step = system.solve(right)
    if step > CONVERGED:
        raise NoAnswerError(f"no compliance: {Status.ILL_CONDITIONED.advice[0]}")
    C = right.T @ x * equations.stiffness
    C = 0.5 * (C + C.T)
    return C / np.outer(scale, scale) if loads is None else C
