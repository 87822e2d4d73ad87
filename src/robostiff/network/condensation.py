"""Condensation of a network to its platform."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics import DEFAULT_TOLERANCE, CartesianStiffness, Status, Tolerance
from robostiff.elastostatics.conditioning import smallest_held_stiffness
from robostiff.network.equations import equations_of
from robostiff.network.mobility import mobility
from robostiff.network.network import Network
from robostiff.network.redundancy import redundancy, redundant_freedoms
from robostiff.network.saddle_point import CONVERGED, saddle_point_system


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
    held, rank, doubtful = _held(mobile.held, tolerance)
    rigid = _range(dependent.on_platform, tolerance)
    redundant, names = redundant_freedoms(equations, mobile)
    status = (
        (rank < n) * Status.FREE_MOTIONS
        | bool(redundant.any()) * Status.REDUNDANT_JOINTS
        | bool(rigid.shape[1]) * Status.RIGID_DIRECTION
    )
    K = np.zeros((n, n))
    if not rigid.shape[1]:
        still = {*network.fixed, network.platform}
        system = saddle_point_system(equations, still, mobile, dependent)
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
        status_codes=np.array(int(status), dtype=np.uint8),
        rank=np.array(rank),
        held=held,
        redundant=redundant,
        length=np.array(equations.length),
        rigid=rigid,
        tolerance=tolerance,
    )
    return NetworkStiffness(whole, names, equations.points[network.platform])


def _held(wrenches: np.ndarray, tolerance: Tolerance) -> tuple[np.ndarray, int, bool]:
    """Unit wrenches as few columns, how many are independent, and whether that is in doubt."""
    U, values, _ = np.linalg.svd(wrenches, full_matrices=False)
    rank = int(np.count_nonzero(values > tolerance.independence))
    return U * values, rank, bool(np.any(tolerance.leaves_in_doubt(values)))


def _range(wrenches: np.ndarray, tolerance: Tolerance) -> np.ndarray:
    U, values, _ = np.linalg.svd(wrenches, full_matrices=False)
    return U[:, values > tolerance.independence]


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
