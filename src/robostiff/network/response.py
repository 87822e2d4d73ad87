"""Static response of a network: loads at nodes and on beams, and supports that settle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.errors import InputError, NoAnswerError
from robostiff.frozen import field, frozen
from robostiff.markup import InNotebooks
from robostiff.network.elements import BeamLoad, DistributedForce, ForceOnBeam, beam_load, resultant
from robostiff.network.equations import equations_of
from robostiff.network.network import Network
from robostiff.network.saddle_point import saddle_point_system
from robostiff.network.solution import InternalLoads, LoadedNetwork, reactions
from robostiff.spatial import as_floats, block_rotation, move_wrench

Loads = Mapping[str, Any]
_ON_BEAMS = (DistributedForce, ForceOnBeam)
# Of the largest displacement: a gap between rigid parts that is no rounding.
_GAP = 1e-9


@frozen
class SectionForces:
    """What the part of a beam beyond a section exerts on the part before it, in the beam's axes.

    Attributes
    ----------
    start, end : (6,) arrays
        N, V_y, V_z [N] and T, M_y, M_z [N m] at the ends; N is positive in tension.
    """

    start: np.ndarray
    end: np.ndarray


@frozen(repr=False)
class NetworkResponse(InNotebooks):
    """Displacements, reactions and internal loads of a network under loads.

    Attributes
    ----------
    network : Network
    twists : dict of str to (n,) array
        Displacement [m] and rotation [rad] of each node about its point; without those that can
        move freely, whose displacement has no value.
    reactions : dict of str to (n,) array
        Force [N] and moment [N m] of the support on each fixed node about its point; without those
        that rigid parts leave statically indeterminate.
    beams : dict of str to SectionForces
    loads : InternalLoads
        Energies of parts, reactions of joints, loads of actuators.
    free_nodes : tuple of str
        Nodes that can move without resistance, and are not loaded along these motions.
    shifts : dict of str to (d,) array
        Displacement of the point of each node [m], also of those of which the spin alone is free,
        as in a truss.
    """

    network: Network
    twists: dict[str, np.ndarray]
    reactions: dict[str, np.ndarray]
    beams: dict[str, SectionForces]
    loads: InternalLoads
    free_nodes: tuple[str, ...] = ()
    shifts: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of the network."""
        return self.network.name

    @property
    def energy(self) -> float:
        """Elastic energy of all parts [J]."""
        return sum(energy for _, _, energy in self.loads.energies)

    @property
    def status(self) -> Status:
        """``OK``, or ``FREE_MOTIONS`` where nodes can move without resistance."""
        return Status.FREE_MOTIONS if self.free_nodes else Status.OK

    def __repr__(self) -> str:
        return (
            f"<NetworkResponse of {self.name!r}: {len(self.twists)} nodes, "
            f"energy {self.energy:.4g} J, status {self.status}>"
        )


def network_response(
    network: Network,
    loads: Loads | None = None,
    *,
    settlements: Mapping[str, ArrayLike] | None = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> NetworkResponse:
    """Response of a network to loads at its nodes and on its beams, and to moved supports.

    All loads act together, and are so small that the geometry does not change. With the loads of
    the beams the equations of the network become ``W^T d = S f + d_0``, where d_0 is the
    deflection of the end of a loaded beam whose start is clamped.

    Parameters
    ----------
    network : Network
    loads : mapping of str to load or sequence of loads, optional
        At a node a force (3,), in space, or a wrench (n,) about the node's point [N, N m]; on a
        beam a `DistributedForce` or a `ForceOnBeam`. World axes.
    settlements : mapping of str to (n,) array, optional
        Displacement [m] and rotation [rad] of fixed nodes about their points, world axes.
    tolerance : Tolerance

    Raises
    ------
    InputError
        When a name is not there, or a load or displacement does not fit.
    NoAnswerError
        When a load does work on a motion without stiffness, when rigid parts cannot follow the
        supports, or when rounding leaves few digits.

    Examples
    --------
    A clamped rod under its own weight, and the same rod with a foot that sinks by 1 mm:

    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02), name="rod")
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> bent = network_response(network, {"rod": DistributedForce([0, 0, -24.2])})
    >>> round(1e3 * float(bent.twists["tip"][2]), 3), round(float(bent.reactions["wall"][2]), 1)
    (-1.834, 24.2)
    >>> sunk = network_response(network, settlements={"wall": [0, 0, -1e-3, 0, 0, 0]})
    >>> round(1e3 * float(sunk.twists["tip"][2]), 3), round(sunk.energy, 9)
    (-1.0, 0.0)
    """
    equations = equations_of(network, tolerance)
    loads = {} if loads is None else loads
    at_nodes, on_beams = _sorted_loads(network, loads)
    space = network.space
    expected = f"{space.size} numbers {' '.join(space.twist_order)} [m, rad]"
    moved: dict[str, np.ndarray] = {}
    for name, value in (settlements or {}).items():
        if name not in network.fixed:
            raise InputError(
                "node that settles",
                got=name,
                expected=f"a fixed node: {', '.join(network.fixed[:12])}",
                hint="a node that is not fixed moves under the loads",
            )
        subject = f"displacement of node {name!r}"
        moved[name] = as_floats(subject, value, expected, space.twist_units, (space.size,))
    points = {node.name: node.point for node in network.nodes}
    system = saddle_point_system(equations, platform_fixed=False)
    rows, d = list(space.rows), space.translations
    right = system.forces([(name, F, points[name]) for name, F in at_nodes.items()])
    given = [(points[name], F) for name, F in at_nodes.items()]
    for k, (name, load) in on_beams.items():
        beam, W_T = network.beams[k], equations.connections[k].ends[-1][2]
        axes = block_rotation(beam.rotation)
        total, tip = (axes @ load.at_start)[rows], (axes @ load.tip_twist)[rows]
        right += system.forces([(beam.a, total, beam.start)])
        right[system.matrix.wrench_rows[k], 0] += W_T @ (equations.scale * tip)
        for one in _as_sequence(loads[name]):
            s, force = resultant(beam, one)
            given.append((beam.start + s * axes[:3, 0], (axes[:, :3] @ force)[rows]))
    displaced = np.zeros(right.shape)
    for name, t in moved.items():
        D = equations.between(points[name], equations.points[name])
        displaced[system.matrix.rows_of[name], 0] = D @ (equations.scale * t)
    found = LoadedNetwork.of(system, right, given, displaced)
    _check_holds(found)
    beams = {}
    for k, beam in enumerate(network.beams):
        end = block_rotation(beam.rotation).T @ found.wrench_of(k)
        start = move_wrench(end, np.array([-beam.length, 0.0, 0.0]))
        start += on_beams[k][1].at_start if k in on_beams else 0.0
        beams[beam.name] = SectionForces(start, end)
    extra = {k: load.energy(beams[name].end) for k, (name, load) in on_beams.items()}
    each = [equations.connections[k] for k in system.dependent.undetermined]
    undetermined = {end for own in each for end, _, _ in own.ends}
    free = {name for mechanism in system.mobility.mechanisms for name in mechanism.moving}
    twists = {name: found.twist(name, own) for name, own in points.items()}
    shifting = set[str]()  # nodes whose point moves in some mechanism; others spin about it
    for mechanism in system.mobility.mechanisms:
        least = _GAP * np.abs(mechanism.motions).max(initial=0.0)
        for name, motions in zip(mechanism.nodes, mechanism.motions, strict=True):
            shift = (equations.transport(name, points[name]) @ motions)[:d]
            if np.abs(shift).max(initial=0.0) > least:
                shifting.add(name)
    return NetworkResponse(
        network,
        {name: own for name, own in twists.items() if name not in free},
        {
            name: move_wrench(F, (points[name] - at)[:d])
            for name, (at, F) in reactions(found).items()
            if name not in undetermined
        },
        beams,
        found.loads(extra),
        tuple(node.name for node in network.nodes if node.name in free),
        {name: t[:d] for name, t in twists.items() if name not in shifting},
    )


def _check_holds(found: LoadedNetwork) -> None:
    """Raise a NoAnswerError unless a network is in equilibrium, and its rigid parts connected."""
    name, system = f"no response of {found.equations.network.name!r}", found.system
    if found.driven is not None:
        raise NoAnswerError(
            f"{name}: the loads drive a motion without stiffness, of "
            f"{', '.join(found.driven.moving[:6])}; {Status.FREE_MOTIONS.advice[0]}"
        )
    gap = system.matrix.times(found.x[:, None])[:, 0] - found.right
    shifts = system.matrix.rows_of.values()
    # rigid parts that hold every node leave rounding alone
    size = max(np.abs(found.right).max(), *(np.abs(found.x[rows]).max() for rows in shifts))
    for k, numbers in system.dependent.dropped.items():  # constraints left out hold, too
        if np.any(np.abs(gap[system.matrix.wrench_rows[k][numbers]]) > _GAP * size):
            raise NoAnswerError(
                f"{name}: rigid parts cannot follow the supports, at "
                f"{found.equations.connections[k].name!r}; give an elasticity to a part between"
            )
    if found.status:
        raise NoAnswerError(
            f"{name}: the reactions do not balance the loads; {Status.ILL_CONDITIONED.advice[0]}"
        )


def _sorted_loads(
    network: Network, loads: Loads
) -> tuple[dict[str, np.ndarray], dict[int, tuple[str, BeamLoad]]]:
    """Wrenches by the names of nodes, and loads of beams by the numbers of their connections."""
    if not isinstance(loads, Mapping):
        raise InputError("loads", got=loads, expected='loads by names: {"tip": [0, 0, -80]}')
    nodes = {node.name for node in network.nodes}
    numbers = {beam.name: k for k, beam in enumerate(network.beams)}
    space, n = network.space, network.space.size
    shapes = f"{n} numbers {' '.join(space.wrench_order)} [N, N m]"
    shapes = f"3 numbers [N], or {shapes}" if n == 6 else shapes
    wrenches: dict[str, np.ndarray] = {}
    on_beams: dict[int, tuple[str, BeamLoad]] = {}
    for name, value in loads.items():
        own = _as_sequence(value)
        if own and all(isinstance(load, _ON_BEAMS) for load in own):
            if name not in numbers:
                raise _unknown("beam of a load", name, numbers)
            k = numbers[name]
            on_beams[k] = (name, beam_load(network.beams[k], own))
        else:
            if name not in nodes:
                raise _unknown("node of a load", name, nodes)
            subject = f"load at node {name!r}"
            F = as_floats(subject, value, shapes, {3: ("N",) * 3, n: space.wrench_units})
            if F.shape not in ((n,), (3,)):
                raise InputError(subject, got=value, expected=shapes)
            wrenches[name] = np.concatenate([F, np.zeros(n - len(F))])
    return wrenches, on_beams


def _as_sequence(value: Any) -> tuple[Any, ...]:
    if isinstance(value, _ON_BEAMS):
        return (value,)
    return tuple(value) if isinstance(value, Sequence) else ()


def _unknown(subject: str, name: str, names: Any) -> InputError:
    known = ", ".join(sorted(names)[:12]) or "none: the network has no beams"
    hint = "loads on beams are DistributedForce or ForceOnBeam, those at nodes are numbers"
    return InputError(subject, got=name, expected=f"one of {known}", hint=hint)
