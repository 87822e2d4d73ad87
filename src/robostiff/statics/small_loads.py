"""Deflection under small loads, at bodies too: the limit of the equations of finite loads."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis import ActuatorLoad, Deflection, JointReaction, Stiffness, stiffness
from robostiff.analysis import deflection as deflection_under_wrench
from robostiff.analysis.deflection_under_load import (
    LoadedElements,
    loaded_elements,
    where_loads_are_known,
)
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose
from robostiff.linkage import DriveValues, Linkage
from robostiff.model import Actuated, Robot, Snapshot
from robostiff.model.mass import gravity_vector
from robostiff.network import Network, NodeForce
from robostiff.spatial import move_twist, move_wrench
from robostiff.statics.chains.beam_bowing import Linear
from robostiff.statics.chains.equilibrated import LOST
from robostiff.statics.equations.problem import EquilibriumProblem, Linearised, LoadCase
from robostiff.statics.loaded_parts import CarriedLoads, shares_of
from robostiff.statics.loading.given_loads import (
    Acting,
    Gravity,
    Loads,
    acting_gravity,
    given_forces,
    load_vector,
)
from robostiff.statics.loading.loaded_posture import one_loaded_posture, postures_of

# Of the terms of an equation of a leg: what is left says that a load drives a free motion in it.
_DRIVEN = 1e-6
# Of the largest stiffness of the platform, and of a load: none.
_FREE, _PULLS = 1e-12, 1e-9


def deflection(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    wrench: ArrayLike | None = None,
    *,
    loads: Loads | None = None,
    gravity: Gravity = None,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> Deflection:
    """Deflection of the platform under small loads, and how the parts of the robot share in it.

    The loads are so small that the geometry does not change, and all is proportional to them. It
    is the limit of `equilibrium`, whose unloaded posture it has. Springs between bodies resist with
    their stiffness along them; the tension that they have without load counts with `gravity`, as
    both act on the robot always.

    Parameters
    ----------
    robot : Robot, Snapshot, Network or Linkage
        The parts of a network are reported by name; joints of it whose reaction is not determined,
        because rigid parts hold one another, are left out.
    pose : RigidTransform, array, JointCoordinates or None
        One pose or a batch, as for `stiffness`; one pose with `loads` or `gravity`.
    wrench : (6,) or (..., 6) array, or (3,) or (..., 3) for a planar robot
        Force [N] and moment [N m] of the environment on the platform, about `at`, world axes; one
        for all poses, or one a pose. May be left out beside `loads` or `gravity`.
    loads : mapping of str to force, DeadForce, Mass or a sequence of them, optional
        Forces at bodies of the legs, by the name of the part before them, or at nodes of a network,
        by their names, as for `equilibrium`.
    gravity : (3,) array or str, optional
        Acceleration of free fall [m/s^2], or an axis such as ``"-z"``, which makes weights of the
        masses of the robot. None when left out, also where the robot has a gravity of its own: a
        deflection is what the given loads add.
    at : (3,) or (..., 3) array, optional
        Point of the platform in the world [m]; the robot's reference point when left out.
    near : joint coordinates, optional
        Those that choose the posture, as for `stiffness`.
    tolerance : Tolerance

    Returns
    -------
    Deflection
        Of one pose, or of a batch. With `loads`, `gravity` or springs between bodies, rigid drives
        are not listed, and the `stiffness` of a robot with such springs is that of its legs.

    Raises
    ------
    InputError
        When a load or the pose does not fit; when there are `loads`, `gravity` or springs between
        bodies for several poses.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("gough-stewart-b")
    >>> bent = rs.deflection(robot, wrench=[0, 0, -1000, 0, 0, 0])
    >>> round(1e6 * float(bent.twist[2]), 3), round(bent.parts[0].share, 3)
    (-2.161, 0.167)
    >>> sunk = rs.deflection(rs.load("six-joint-arm"), gravity="-z")
    >>> round(1e6 * float(sunk.twist[2]), 1), sunk.parts[0].part
    (-110.9, 'joint2')
    >>> bent = rs.deflection(rs.load("3-puu"), [[0, 0, 0.3], [1, 0, 0.3]], [0, 0, -100, 0, 0, 0])
    >>> print((1e6 * bent.twist[:, 2]).round(1), bent[0].parts[0].part)
    [-2.4 --] drive
    """
    options: dict[str, Any] = {"at": at, "near": near, "tolerance": tolerance}
    has_springs = isinstance(robot, Robot | Snapshot) and bool(robot.springs)
    if loads is None and gravity is None and not has_springs:
        return deflection_under_wrench(robot, pose, wrench, **options)
    none = np.zeros(3) if gravity is None else gravity_vector("gravity", gravity)
    if isinstance(robot, Linkage | Network):
        network = postures_of(robot, pose, near).robot
        given = np.zeros(network.space.size) if wrench is None else wrench
        return _of_network(cast("Network", network), given, loads, none, at, tolerance)
    if not isinstance(robot, Robot | Snapshot):
        raise InputError(
            "robot of a deflection under loads at bodies",
            got=robot,
            expected="a robot without cables, a snapshot, a network or a linkage",
            hint="cables have cable_response(robot, pose, wrench=...), or 'robostiff cables'",
        )
    # about its own point, so that what rigid legs carry among them does not depend on `at`
    loaded, F, _ = one_loaded_posture(
        robot, pose, wrench, near, Acting(loads, none, beams=Linear())
    )
    problem, answer = loaded.problem, stiffness(replace(robot, springs=()), pose, **options)
    if not np.any(none):  # springs between its bodies are relaxed
        relaxed = (replace(s, constant=-s.stiffness * s.length) for s in problem.legs.springs)
        problem = replace(problem, legs=replace(problem.legs, springs=tuple(relaxed)))
    return Deflection(F, answer, _at_bodies(problem, F, answer))


def _of_network(
    network: Network,
    wrench: ArrayLike,
    loads: Loads | None,
    gravity: np.ndarray,
    at: ArrayLike | None,
    tolerance: Tolerance,
) -> Deflection:
    """A network under loads at its nodes and its own weight."""
    rest = deflection_under_wrench(network, None, wrench, at=at, tolerance=tolerance)
    pull = acting_gravity(network, gravity, loads)
    points = {n.name: n.point for n in network.nodes if n.name not in network.fixed}
    points = {"platform": network.reference_point} | points
    forces = list(network.weights(pull)) if np.any(pull) else []
    frame_of = {name: (np.eye(3), at) for name, at in points.items()}.get
    for name, several in given_forces(loads, pull, network.space, frame_of).items():
        if name not in points:
            known = ", ".join(list(network.free_nodes)[:5])
            raise InputError("loads", got=name, expected=f"a node that moves, or platform: {known}")
        node = name if name in network.free_nodes else network.platform
        for one in several:
            point = points[name] if one.point is None else one.point
            forces.append(NodeForce(node, load_vector("force", name, one.force), point))
    elements = loaded_elements(rest.stiffness, rest.wrench, tuple(forces))
    return Deflection(rest.wrench, rest.stiffness, elements)


def _at_bodies(problem: EquilibriumProblem, F: np.ndarray, stiffness: Stiffness) -> LoadedElements:
    """A robot under small loads at its bodies and a wrench, from its stiffness at that pose."""

    def none(status: Status) -> LoadedElements:
        return LoadedElements(stiffness.status | status)

    is_known = Status.UNREACHABLE not in stiffness.status and where_loads_are_known(stiffness)
    if not is_known or problem.at_rest.lacks_digits:
        return none(Status.ILL_CONDITIONED if stiffness.status.has_stiffness else Status.OK)
    placed: Any = stiffness.placed()
    nothing, at_rest = np.zeros(problem.size), problem.unloaded
    F = move_wrench(F, -stiffness.offset)
    known = problem.linear_equations(at_rest, LoadCase(F), 0.0, 2)
    if _drives_legs(problem, known):
        return none(Status.UNBALANCED)
    # what the loads at bodies are worth at the platform: legs bend under them while it is held
    deflected = _of_platform(problem, known, int(stiffness.rank))
    if deflected is None:
        return none(Status.UNBALANCED)
    t, is_free = deflected
    status = stiffness.status if is_free else stiffness.status & ~Status.FREE_MOTIONS
    step = known.factor_steps + known.by_twist @ t
    legs, forces, stored = problem.legs, None, ()
    if legs.springs:  # tension among them, as the bodies move
        pulls = legs.pulls(at_rest, 0.0)
        motion = step[: legs.numbers.total]
        forces = np.einsum("sij,sjt,t->si", pulls.D, pulls.J, motion) + pulls.rate
        stored = legs.spring_energies(pulls, motion)
    loaded = CarriedLoads(
        problem, legs.after_step(at_rest, nothing, step), small=True, forces=forces
    )
    if not loaded.are_balanced(F):
        return none(Status.ILL_CONDITIONED)
    parts, rates = loaded.parts(), known.equations.r_share
    on_platform, _ = problem.dead.acting(np.eye(3))  # the wrench left out
    # nodes of a flexible platform are where they are without load
    wrenches, _ = loaded.by_leg(known.by_twist, placed.platform)
    joints = [(part, part.load) for part in parts if part.load is not None]
    freedoms = ((leg.name, joint) for leg in placed.legs for joint in leg.freedoms)
    driven = {(leg, joint.name) for leg, joint in freedoms if isinstance(joint.role, Actuated)}
    return LoadedElements(
        status,
        move_twist(t, stiffness.offset),
        parts=shares_of(parts, stored),
        reactions=tuple(JointReaction(p.leg, p.part, p.wrench, p.point) for p, _ in joints),
        actuators=tuple(
            ActuatorLoad(part.leg, part.part, load, float(part.motion[0]), part.unit)
            for part, load in joints
            if (part.leg, part.part) in driven
        ),
        leg_wrenches=wrenches,
        work_of_loads=float(on_platform[list(problem.rows)] @ t - rates @ step[: len(rates)]),
    )


def _of_platform(
    problem: EquilibriumProblem, known: Linearised, rank: int
) -> tuple[np.ndarray, bool] | None:
    """Twist of the platform, and whether it has free motions; None where one is driven.

    The legs hold it in as many directions as their rank says; springs between bodies in more.
    """
    scale = problem.scale
    K = known.K / np.outer(scale, scale)
    values, V = np.linalg.eigh(0.5 * (K + K.T))
    along = V.T @ (known.by_factor / scale)
    free = np.arange(len(values)) < len(values) - rank
    if problem.legs.springs:
        free = values <= _FREE * values[-1]
    if np.any(np.abs(along[free]) > _PULLS * np.max(np.abs(along), initial=0.0)):
        return None
    t = V @ np.where(free, 0.0, along / np.where(free, 1.0, values)) / scale
    return t, bool(np.any(free))


def _drives_legs(problem: EquilibriumProblem, known: Linearised) -> bool:
    """Whether loads at bodies drive a motion in a leg that nothing resists, the platform held."""
    for block, whole in zip(problem.blocks, known.equations.A, strict=True):
        m, units = block.free, problem.units[block.at][:, None]
        step, driven = (v[block.at] for v in (known.factor_steps, known.equations.r_share))
        A, across = np.abs(whole[:, :m]), np.abs(whole[:, :m, m:] * units[..., m:])
        rest = np.abs(np.einsum("nij,nj->ni", whole[:, :m], step) + driven[:, :m])
        terms = np.einsum("nij,nj->ni", A, np.abs(step)) + np.abs(driven[:, :m])
        # rigid parts may carry much where all terms are rounding
        carried = np.abs(step[:, None] / units)[..., m:].max(axis=-1, initial=0.0)
        carried = carried * across.max(axis=(1, 2), initial=0.0)[:, None]
        largest = np.max(terms, axis=-1, initial=0.0)[:, None] + carried
        if np.any(rest > _DRIVEN * terms + LOST * largest):
            return True
    return False
