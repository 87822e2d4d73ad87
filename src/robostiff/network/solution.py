"""A network solved: stiffness of its platform, compliance between points, and what loads do."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

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
from robostiff.elastostatics.leg import loads_of_modes, wrenches_of_leg
from robostiff.elastostatics.tolerance import smallest_held_stiffness
from robostiff.errors import InputError, NoAnswerError
from robostiff.frozen import frozen, replace
from robostiff.model import Actuated
from robostiff.network.elements import JointElement, NodeForce
from robostiff.network.equations import Equations, equations_of
from robostiff.network.mobility import Mechanism, mobility
from robostiff.network.network import Network
from robostiff.network.saddle_point import (
    CONVERGED,
    SaddlePointSystem,
    redundancy,
    redundant_freedoms,
    saddle_point_system,
)
from robostiff.spatial import as_floats, move_wrench

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
        K = _of_its_rank(0.5 * (K + K.T), W)
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
        carried = wrenches_of_leg(replace(whole, held=W)).conjugate
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


def _of_its_rank(K: np.ndarray, W: np.ndarray) -> np.ndarray:
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
        if system.mechanism_driven_by(own) is not None:
            node, point = places[column // n if loads is None else 0]
            what = f"at {point.tolist()} of node {node!r}" if loads is None else f"of load {column}"
            raise NoAnswerError(f"no compliance {what}: {Status.FREE_MOTIONS.advice[0]}")
    x, step = system.solve(right)
    if step > CONVERGED:
        raise NoAnswerError(f"no compliance: {Status.ILL_CONDITIONED.advice[0]}")
    C = right.T @ x * equations.stiffness
    C = 0.5 * (C + C.T)
    return C / np.outer(scale, scale) if loads is None else C


#: Wrenches (n,) [N, N m], each with the point (3,) about which it is [m].
Wrenches = Iterable[tuple[np.ndarray, np.ndarray]]
# Of the loads and reactions: what they lack for equilibrium that is no rounding.
_BALANCED = 1e-6
# Of unit motions of the platform: a combination of mechanisms that leaves it at rest.
_STILL = 1e-9


@frozen
class InternalLoads:
    """Loads in the parts of a network.

    Names come in two, before and after the last ``/``; ``network`` is before a name without.

    Attributes
    ----------
    energies : tuple of (str, str, float)
        Of every elastic part, actuator springs among them [J].
    reactions : tuple of (str, str, (6,) array, (3,) array)
        Of every joint: force [N] and moment [N m] of node b on node a about the point that comes
        last [m]. Statically indeterminate reactions among rigid parts have no value, and
        are left out.
    actuators : tuple of (str, str, float, float, str)
        Load along the coordinate [N or N m], and travel [m or rad].
    """

    energies: tuple[tuple[str, str, float], ...]
    reactions: tuple[tuple[str, str, np.ndarray, np.ndarray], ...]
    actuators: tuple[tuple[str, str, float, float, str], ...]


@frozen
class LoadedNetwork:
    """The solution of the equations of a network under a right side."""

    #: ``UNBALANCED`` where the loads drive a motion without stiffness, ``ILL_CONDITIONED`` where
    #: few digits hold: nothing else has a meaning then
    status: Status
    system: SaddlePointSystem
    driven: Mechanism | None  #: the motion that loads drive
    #: right, x (size,): loads; displacements and wrenches. All scaled.
    right: np.ndarray
    x: np.ndarray

    @staticmethod
    def of(
        system: SaddlePointSystem,
        right: np.ndarray,
        given: Wrenches,
        displaced: np.ndarray | None = None,
    ) -> LoadedNetwork:
        """Under a right side (size, 1), where nodes are displaced (size, 1) already.

        The reactions must balance the loads as they are `given`.
        """
        driven = system.mechanism_driven_by(right[:, 0])
        moved = np.zeros(right.shape) if displaced is None else displaced
        x, step = system.solve(right - system.matrix.times(moved))
        status = Status.OK if driven is None else Status.UNBALANCED
        found = LoadedNetwork(status, system, driven, right[:, 0], (x + moved)[:, 0])
        every = [*given, *reactions(found).values()]
        if not status and (step > CONVERGED or not are_balanced(system.equations, every)):
            found = replace(found, status=Status.ILL_CONDITIONED)
        return found

    @property
    def equations(self) -> Equations:
        """Of the network."""
        return self.system.equations

    def work_of(self, forces: Iterable[NodeForce]) -> float:
        """Of forces at bodies on their displacements [J]."""
        rows = list(self.equations.network.space.rows)
        return sum(float(f.wrench[rows] @ self.twist(f.node, f.point)) for f in forces)

    def twist(self, node: str, point: np.ndarray) -> np.ndarray:
        """Twist (n,) of a node about a point (3,) [m, rad]."""
        x = self.x[self.system.matrix.rows_of[node]]
        return self.equations.transport(node, point) @ x / self.equations.scale

    @property
    def motions(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Twist (6,) [m, rad] of every body, and the point (3,) about which it is [m]."""
        found = {}
        for name, point in self.equations.points.items():
            found[name] = np.zeros(6), point
            found[name][0][list(self.equations.network.space.rows)] = self.twist(name, point)
        return found

    def wrench_of(self, k: int) -> np.ndarray:
        """What connection k carries about its point (6,), zero out of a planar network's plane."""
        equations, F = self.equations, np.zeros(6)
        W_T = equations.connections[k].ends[-1][2]
        carried = equations.scale * (self.x[self.system.matrix.wrench_rows[k]] @ W_T)
        F[list(equations.network.space.rows)] = carried * equations.stiffness
        return F

    def loads(self, of_beam_loads: Mapping[int, float] | None = None) -> InternalLoads:
        """Loads in all parts.

        What loads between the ends of beams add to their energies comes by the numbers of these
        beams [J].
        """
        equations, network = self.equations, self.equations.network
        energies: list[tuple[str, str, float]] = []
        reactions: list[tuple[str, str, np.ndarray, np.ndarray]] = []
        actuators: list[tuple[str, str, float, float, str]] = []
        elements = (*network.elements, *network.couplings)
        for k, (element, c) in enumerate(zip(elements, equations.connections, strict=True)):
            if not isinstance(element, JointElement):
                if np.any(c.S):
                    f = self.x[self.system.matrix.wrench_rows[k]]
                    energy = 0.5 * equations.stiffness * float(f @ c.S @ f)
                    before, _, name = c.name.rpartition("/")
                    energy += (of_beam_loads or {}).get(k, 0.0)
                    energies.append((before or "network", name, energy))
                continue
            F, point = self.wrench_of(k), c.ends[-1][1]
            is_determined = k not in self.system.dependent.undetermined
            if is_determined and element.freedoms:
                names = ", ".join(freedom.name for freedom in element.freedoms)
                at = element.freedoms[0].point
                reactions.append((element.name, names, move_wrench(F, at - point), at))
            for freedom in element.freedoms:
                load = float(freedom.twist(point) @ F)
                k_own = freedom.stiffness
                travel = 0.0 if k_own is None else load / k_own
                if k_own is not None:
                    energies.append((element.name, freedom.name, 0.5 * load * travel))
                if isinstance(freedom.role, Actuated) and (is_determined or k_own is not None):
                    actuators.append((element.name, freedom.name, load, travel, freedom.load_unit))
        return InternalLoads(tuple(energies), tuple(reactions), tuple(actuators))


def reactions(found: LoadedNetwork) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The points of fixed nodes in the equations, and what these lack for equilibrium (n,).

    The reactions of the supports. What is statically indeterminate among them has one of its
    possible values.
    """
    equations, system = found.equations, found.system
    loads = system.matrix.times(found.x[:, None])[:, 0]
    missing = (loads - found.right) * equations.stiffness
    return {
        name: (equations.points[name], missing[system.matrix.rows_of[name]] * equations.scale)
        for name in equations.network.fixed
    }


def are_balanced(equations: Equations, wrenches: Wrenches) -> bool:
    """Whether wrenches are in equilibrium, forces and moments."""
    about, d = equations.network.reference_point, equations.network.space.translations
    each = [move_wrench(F, (about - point)[:d]) for point, F in wrenches]
    scaled = np.array(each).reshape(-1, equations.size) / equations.scale
    size = np.sum(np.linalg.norm(scaled, axis=1))
    return bool(np.linalg.norm(scaled.sum(axis=0)) <= _BALANCED * size)


def network_under_loads(
    network: Network,
    wrench: np.ndarray,
    forces: Iterable[NodeForce] = (),
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> LoadedNetwork:
    """A network under a wrench (n,) on the platform about its reference point, and forces.

    Of the displacements that are possible those with the least of the platform; also where a
    direction is rigid.

    Examples
    --------
    A rod of 2 m under a force in its middle:

    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, NodeForce, beam_between
    >>> a, b, c = (Node(name, np.array([x, 0, 0])) for name, x in zip("abc", (0, 1.0, 2.0)))
    >>> rods = [beam_between(*ends, material("steel"), circle(0.02)) for ends in ((a, b), (b, c))]
    >>> network = Network("rod", (a, b, c), ("a",), "c", c.point, beams=tuple(rods))
    >>> force = NodeForce("b", np.array([0, 0, -8.0]), b.point)
    >>> bent = network_under_loads(network, np.zeros(6), [force])
    >>> round(1e3 * float(bent.twist("b", b.point)[2]), 4)
    -1.6168
    """
    system = saddle_point_system(equations_of(network, tolerance), platform_fixed=False)
    rows = list(network.space.rows)
    each = [(network.platform, wrench, network.reference_point)]
    each += [(f.node, f.wrench[rows], f.point) for f in forces]
    found = LoadedNetwork.of(system, system.forces(each), [(point, F) for _, F, point in each])
    # Without what free motions of the platform add to its displacement; motions of mechanisms that
    # leave it at rest stay as they were found.
    x, rows_of, platform = found.x.copy(), system.matrix.rows_of, network.platform
    for mechanism in system.mobility.mechanisms:
        if platform in mechanism.nodes:
            own = mechanism.motions[mechanism.nodes.index(platform)]
            part = _STILL / max(np.linalg.norm(own, 2), _STILL)  # motions of bodies are unit ones
            free = np.linalg.pinv(own, rcond=float(part)) @ x[rows_of[platform]]
            for name, motions in zip(mechanism.nodes, mechanism.motions, strict=True):
                x[rows_of[name]] -= motions @ free
    return replace(found, x=x)
