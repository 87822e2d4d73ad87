"""A network under loads at its bodies: displacements, and loads in its parts and supports."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.kinematics import freedom_twist
from robostiff.model import Actuated
from robostiff.network.elements import JointElement, NodeForce
from robostiff.network.equations import Equations, RelativeMotion, equations_of
from robostiff.network.mobility import Mobility
from robostiff.network.network import Network
from robostiff.network.saddle_point import CONVERGED, SaddlePointSystem, driven_mechanism, system_of
from robostiff.spatial import move_wrench

# Of the loads and reactions: what they lack for equilibrium that is no rounding.
_BALANCED = 1e-6
# Of unit motions of the platform: a combination of mechanisms that leaves it at rest.
_STILL = 1e-9


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class NetworkUnderLoads:
    """A network under a wrench on its platform and forces at its bodies.

    Attributes
    ----------
    status : Status
        ``UNBALANCED`` where they drive a motion without stiffness, ``ILL_CONDITIONED`` where few
        digits hold: nothing else has a meaning then.
    equations, system : Equations, SaddlePointSystem
    x : (size,) array
        Displacements and wrenches, scaled; of the displacements that are possible those with the
        least of the platform. Mechanisms inside, which it does not feel, are held somewhere.
    of_forces : (size,) array
        Right side of the forces at bodies alone.
    undetermined : frozenset of int
        Numbers of the connections whose loads are statically indeterminate among rigid parts.
    """

    status: Status
    equations: Equations
    system: SaddlePointSystem
    x: np.ndarray
    of_forces: np.ndarray
    undetermined: frozenset[int]

    @cached_property
    def loads(self) -> InternalLoads:
        """Loads in all parts."""
        return loads_of_parts(self.equations, self.system, self.x, self.undetermined)

    @property
    def work(self) -> float:
        """Of the forces at bodies on their displacements [J]."""
        return self.equations.stiffness * float(self.of_forces @ self.x)

    def twist(self, node: str, point: np.ndarray) -> np.ndarray:
        """Twist (n,) of a node about a point (3,) [m, rad]."""
        return self.system.twist(self.equations, self.x, node, point)


def network_under_loads(
    network: Network,
    wrench: np.ndarray,
    forces: Iterable[NodeForce] = (),
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> NetworkUnderLoads:
    """A network under a wrench (n,) on the platform about its reference point, and forces.

    Also where a direction is rigid.

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
    >>> round(1e3 * float(bent.twist("b", b.point)[2]), 4), round(1e3 * bent.work, 4)
    (-1.6168, 12.9345)
    """
    equations = equations_of(network, tolerance)
    system, mobile, dependent = system_of(equations)
    rows = list(network.space.rows)
    each = [(f.node, np.append(f.force, np.zeros(3))[rows], f.point) for f in forces]
    of_forces = system.forces(equations, each)
    on_platform = network.platform, wrench, network.reference_point
    right = of_forces + system.forces(equations, [on_platform])
    x, step = system.solve(right)
    status = Status.OK
    if driven_mechanism(equations, mobile, system, right) is not None:
        status = Status.UNBALANCED
    applied = [(point, F) for _, F, point in (on_platform, *each)]
    carried = reactions(equations, system, x[:, 0], right[:, 0]).values()
    if not status and (step > CONVERGED or not are_balanced(equations, [*applied, *carried])):
        status = Status.ILL_CONDITIONED
    least = _with_least_displacement(network.platform, mobile, system, x[:, 0])
    return NetworkUnderLoads(
        status, equations, system, least, of_forces[:, 0], dependent.undetermined
    )


def _with_least_displacement(
    platform: str, mobile: Mobility, system: SaddlePointSystem, x: np.ndarray
) -> np.ndarray:
    """A solution (size,) without what free motions of the platform add to its displacement."""
    x = x.copy()
    for mechanism in mobile.mechanisms:
        if platform in mechanism.nodes:
            own = mechanism.motions[mechanism.nodes.index(platform)]
            free = np.linalg.pinv(own, rcond=_STILL) @ x[system.rows_of[platform]]
            for name, motions in zip(mechanism.nodes, mechanism.motions, strict=True):
                x[system.rows_of[name]] -= motions @ free
    return x


def reactions(
    equations: Equations, system: SaddlePointSystem, x: np.ndarray, right: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The points of fixed nodes in the equations, and what these lack for equilibrium (n,).

    Under a right side (size,), with the solution x (size,): the reactions of the supports. What
    is statically indeterminate among them has one of its possible values.
    """
    missing = (system.matrix @ x - right) * equations.stiffness
    return {
        name: (equations.points[name], missing[system.rows_of[name]] * equations.scale)
        for name in equations.network.fixed
    }


def are_balanced(equations: Equations, wrenches: Iterable[tuple[np.ndarray, np.ndarray]]) -> bool:
    """Whether wrenches (n,) about points (3,) are in equilibrium, forces and moments."""
    about, d = equations.network.reference_point, equations.network.space.translations
    each = [move_wrench(F, (about - point)[:d]) for point, F in wrenches]
    scaled = np.array(each).reshape(-1, equations.size) / equations.scale
    size = np.sum(np.linalg.norm(scaled, axis=1))
    return bool(np.linalg.norm(scaled.sum(axis=0)) <= _BALANCED * size)


def motions_under(
    network: Network,
    wrench: np.ndarray,
    forces: Iterable[NodeForce] = (),
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Twist (6,) [m, rad] of every body, and the point (3,) about which it is [m].

    Under loads as in `network_under_loads`.
    """
    found, moved = network_under_loads(network, wrench, forces, tolerance), {}
    for name, point in found.equations.points.items():
        t = np.zeros(6)
        t[list(network.space.rows)] = found.twist(name, point)
        moved[name] = (t, point)
    return moved


def loads_of_parts(
    equations: Equations,
    system: SaddlePointSystem,
    x: np.ndarray,
    undetermined: frozenset[int],
    of_beam_loads: Mapping[int, float] | None = None,
) -> InternalLoads:
    """Loads in all parts from a solution x (size,) of the scaled system.

    What loads between the ends of beams add to their energies comes by the numbers of these beams
    [J].
    """
    network = equations.network
    energies: list[tuple[str, str, float]] = []
    reactions: list[tuple[str, str, np.ndarray, np.ndarray]] = []
    actuators: list[tuple[str, str, float, float, str]] = []
    elements = (*network.elements, *network.couplings)
    for k, (element, c) in enumerate(zip(elements, equations.connections, strict=True)):
        f = x[system.wrench_rows[k]]
        if not (isinstance(element, JointElement) and isinstance(c, RelativeMotion)):
            if np.any(c.S):
                energy = 0.5 * equations.stiffness * float(f @ c.S @ f)
                before, _, name = c.name.rpartition("/")
                energy += (of_beam_loads or {}).get(k, 0.0)
                energies.append((before or "network", name, energy))
            continue
        F = carried_wrench(equations, c, f)
        is_determined = k not in undetermined
        if is_determined and element.freedoms:
            names = ", ".join(freedom.name for freedom in element.freedoms)
            at = element.freedoms[0].point
            reactions.append((element.name, names, move_wrench(F, at - c.point), at))
        for freedom in element.freedoms:
            load = float(freedom_twist(freedom, c.point) @ F)
            k_own = freedom.stiffness
            travel = 0.0 if k_own is None else load / k_own
            if k_own is not None:
                energies.append((element.name, freedom.name, 0.5 * load * travel))
            if isinstance(freedom.role, Actuated) and (is_determined or k_own is not None):
                actuators.append((element.name, freedom.name, load, travel, freedom.load_unit))
    return InternalLoads(tuple(energies), tuple(reactions), tuple(actuators))


def carried_wrench(equations: Equations, c: RelativeMotion, f: np.ndarray) -> np.ndarray:
    """Force and moment about the connection's point (6,), zero out of the plane of a planar one."""
    F = np.zeros(6)
    F[list(equations.network.space.rows)] = equations.scale * (c.W @ f) * equations.stiffness
    return F
