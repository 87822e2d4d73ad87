"""Loads in beams, springs and joints of a network under a displacement of its platform."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.kinematics import freedom_twist
from robostiff.model import Actuated
from robostiff.network.elements import JointElement, NodeForce
from robostiff.network.equations import Equations, RelativeMotion, equations_of
from robostiff.network.network import Network
from robostiff.network.saddle_point import (
    CONVERGED,
    Redundancy,
    SaddlePointSystem,
    driven_mechanism,
    system_of,
)
from robostiff.spatial import move_twist, move_wrench

_MISSED = 1e-9  # of the displacement of the platform
# Of the loads and reactions: what they lack for equilibrium that is no rounding.
_BALANCED = 1e-6


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
    work : float
        Of forces at bodies on their displacements [J].
    balanced : bool
        Whether loads and reactions of the supports are in equilibrium, forces and moments.
    """

    energies: tuple[tuple[str, str, float], ...]
    reactions: tuple[tuple[str, str, np.ndarray, np.ndarray], ...]
    actuators: tuple[tuple[str, str, float, float, str], ...]
    work: float = 0.0
    balanced: bool = True


@dataclass(frozen=True)
class HeldUnderLoads:
    """A network under forces at its bodies while its platform is held.

    Attributes
    ----------
    status : Status
        ``UNBALANCED`` where they drive a motion without stiffness, ``ILL_CONDITIONED`` where few
        digits hold: nothing else has a meaning then.
    wrench : (n,) array
        What they are worth at the platform, about ``condense(network).origin`` [N, N m].
    forces : tuple of NodeForce
        As they were given.
    right, x : (size,) arrays
        These, and the displacements and wrenches under them, scaled.
    undetermined : frozenset of int
        Numbers of the connections whose loads are statically indeterminate among rigid parts.
    """

    status: Status
    wrench: np.ndarray
    forces: tuple[NodeForce, ...]
    right: np.ndarray
    x: np.ndarray
    undetermined: frozenset[int]


def held_under(
    network: Network, forces: Iterable[NodeForce], tolerance: Tolerance = DEFAULT_TOLERANCE
) -> HeldUnderLoads:
    """A network under forces at its bodies while its platform is held.

    Examples
    --------
    A clamped rod of 2 m holds half of a force in its middle, and that moment besides:

    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, NodeForce, beam_between
    >>> a, b, c = (Node(name, np.array([x, 0, 0])) for name, x in zip("abc", (0, 1.0, 2.0)))
    >>> rods = [beam_between(*ends, material("steel"), circle(0.02)) for ends in ((a, b), (b, c))]
    >>> network = Network("rod", (a, b, c), ("a",), "c", c.point, beams=tuple(rods))
    >>> held = held_under(network, [NodeForce("b", np.array([0, 0, -8.0]), b.point)])
    >>> held.wrench.round(9) + 0.0
    array([ 0.,  0., -4.,  0., -2.,  0.])
    """
    equations = equations_of(network, tolerance)
    system, mobile, dependent = system_of(equations, platform_fixed=True)
    given = tuple(forces)
    right = system.forces(equations, _wrenches(equations, given))
    x, step = system.solve(right)
    status = Status.OK
    if driven_mechanism(equations, mobile, system, right) is not None:
        status = Status.UNBALANCED
    elif step > CONVERGED:
        status = Status.ILL_CONDITIONED
    platform = system.rows_of[network.platform]
    worth = (right - system.matrix @ x)[platform, 0] * equations.scale * equations.stiffness
    return HeldUnderLoads(status, worth, given, right[:, 0], x[:, 0], dependent.undetermined)


def loads_under(
    network: Network,
    wrench: np.ndarray,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
    held: HeldUnderLoads | None = None,
) -> InternalLoads:
    """Loads in all parts under a wrench on the platform about ``condense(network).origin``.

    Also where a direction is rigid. The wrench does no work on motions without stiffness.

    Parameters
    ----------
    network : Network
    wrench : (n,) array
        [N, N m].
    tolerance : Tolerance
    held : HeldUnderLoads, optional
        Of forces at bodies that act too; the wrench has what they are worth at the platform.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02), name="rod")
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> ((_, name, energy),) = loads_under(network, np.array([100.0, 0, 0, 0, 0, 0])).energies
    >>> name, round(1e6 * energy, 3)
    ('rod', 75.788)
    """
    equations = equations_of(network, tolerance)
    system, right, x, dependent = _under(equations, wrench)
    undetermined, work, forces = dependent.undetermined, 0.0, ()
    if held is not None:
        x, right, forces = x + held.x, right + held.right, held.forces
        undetermined, work = undetermined | held.undetermined, float(held.right @ x)
        wrench = wrench - held.wrench
    found = loads_of_parts(equations, system, x, undetermined)
    own = equations.points[network.platform]
    applied = [(own, wrench), *((at, F) for _, F, at in _wrenches(equations, forces))]
    carried = reactions(equations, system, x, right).values()
    balanced = are_balanced(equations, [*applied, *carried])
    return replace(found, work=equations.stiffness * work, balanced=balanced)


def _wrenches(
    equations: Equations, forces: Iterable[NodeForce]
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Nodes, wrenches (n,) and the points about which they are, of forces."""
    rows = list(equations.network.space.rows)
    for own in forces:
        yield own.node, np.append(own.force, np.zeros(3))[rows], own.point


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
    twist: np.ndarray,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """How every body moves under a wrench on the platform.

    Parameters
    ----------
    network : Network
    wrench : (n,) array
        About the reference point [N, N m].
    twist : (n,) array
        Of the platform under it, about the reference point [m, rad]. Where the platform is free it
        says which of the possible displacements is meant; the bodies follow.
    tolerance : Tolerance

    Returns
    -------
    dict of str to ((6,) array, (3,) array)
        Of each node: its twist [m, rad], and the point about which it is [m]. Mechanisms inside
        the network, which the platform does not feel, are held somewhere.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02), name="rod")
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> t = np.array([1.5158e-9, 0, 0, 0, 0, 0])
    >>> moved, _ = motions_under(network, np.array([1.0, 0, 0, 0, 0, 0]), t)["tip"]
    >>> round(1e9 * float(moved[0]), 4)
    1.5158
    """
    equations = equations_of(network, tolerance)
    own = equations.points[network.platform]
    to_own = (own - network.reference_point)[: network.space.translations]
    system, _, x, _ = _under(equations, move_wrench(wrench, to_own))
    rows = system.rows_of[network.platform]
    missing = equations.scale * move_twist(twist, to_own) - x[rows]
    if np.linalg.norm(missing) > _MISSED * np.linalg.norm(x[rows] + missing):  # a free motion
        held, _, _ = system_of(equations, platform_fixed=True)
        x += held.solve(-(held.matrix[:, rows] @ missing)[:, None])[0][:, 0]
        x[rows] += missing
    twists = {}
    for name, point in equations.points.items():
        t = np.zeros(6)
        t[list(network.space.rows)] = system.twist(equations, x, name, point)
        twists[name] = (t, point)
    return twists


def _under(
    equations: Equations, wrench: np.ndarray
) -> tuple[SaddlePointSystem, np.ndarray, np.ndarray, Redundancy]:
    """Right side, displacements and wrenches, scaled, of a wrench about the platform's point."""
    system, _, dependent = system_of(equations)
    platform = equations.network.platform
    right = system.forces(equations, [(platform, wrench, equations.points[platform])])
    return system, right[:, 0], system.solve(right)[0][:, 0], dependent


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
