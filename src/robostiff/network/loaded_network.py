"""The equations of a network under loads solved: displacements, loads in its parts and supports."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.kinematics import freedom_twist
from robostiff.model import Actuated
from robostiff.network.elements import JointElement, NodeForce
from robostiff.network.equations import Equations, equations_of
from robostiff.network.mobility import Mechanism
from robostiff.network.network import Network
from robostiff.network.saddle_point import CONVERGED, SaddlePointSystem, saddle_point_system
from robostiff.spatial import move_wrench

#: Wrenches (n,) [N, N m], each with the point (3,) about which it is [m].
Wrenches = Iterable[tuple[np.ndarray, np.ndarray]]
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
class LoadedNetwork:
    """The solution of the equations of a network under a right side.

    Attributes
    ----------
    status : Status
        ``UNBALANCED`` where the loads drive a motion without stiffness, ``ILL_CONDITIONED`` where
        few digits hold: nothing else has a meaning then.
    system : SaddlePointSystem
    driven : Mechanism or None
        The motion that loads drive.
    right, x : (size,) arrays
        Loads; displacements and wrenches. All scaled.
    """

    status: Status
    system: SaddlePointSystem
    driven: Mechanism | None
    right: np.ndarray
    x: np.ndarray

    @staticmethod
    def of(
        system: SaddlePointSystem,
        right: np.ndarray,
        given: Wrenches,
        settled: np.ndarray | None = None,
    ) -> LoadedNetwork:
        """Under a right side (size, 1), with nodes displaced by `settled` (size, 1).

        The reactions must balance the loads as they are `given`.
        """
        driven = system.driven(right[:, 0])
        moved = np.zeros(right.shape) if settled is None else settled
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

    def with_least_displacement(self) -> LoadedNetwork:
        """Without what free motions of the platform add to its displacement.

        Mechanisms inside, which it does not feel, are held somewhere.
        """
        x, platform = self.x.copy(), self.equations.network.platform
        for mechanism in self.system.mobility.mechanisms:
            if platform in mechanism.nodes:
                own = mechanism.motions[mechanism.nodes.index(platform)]
                free = np.linalg.pinv(own, rcond=_STILL) @ x[self.system.matrix.rows_of[platform]]
                for name, motions in zip(mechanism.nodes, mechanism.motions, strict=True):
                    x[self.system.matrix.rows_of[name]] -= motions @ free
        return replace(self, x=x)

    def work_of(self, forces: Iterable[NodeForce]) -> float:
        """Of forces at bodies on their displacements [J]."""
        d = self.equations.network.space.translations
        return sum(float(f.force[:d] @ self.twist(f.node, f.point)[:d]) for f in forces)

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

    def carried(self, k: int) -> np.ndarray:
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
            F, point = self.carried(k), c.ends[-1][1]
            is_determined = k not in self.system.dependent.undetermined
            if is_determined and element.freedoms:
                names = ", ".join(freedom.name for freedom in element.freedoms)
                at = element.freedoms[0].point
                reactions.append((element.name, names, move_wrench(F, at - point), at))
            for freedom in element.freedoms:
                load = float(freedom_twist(freedom, point) @ F)
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
    each = [
        (network.platform, wrench, network.reference_point),
        *((f.node, np.append(f.force, np.zeros(3))[rows], f.point) for f in forces),
    ]
    found = LoadedNetwork.of(system, system.forces(each), [(point, F) for _, F, point in each])
    return found.with_least_displacement()
