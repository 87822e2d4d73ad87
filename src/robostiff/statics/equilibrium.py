"""Equilibrium of a robot under load: from its posture to the answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.cable_stiffness import status_of_cables
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.kinematics import Near
from robostiff.kinematics.turn import turn_by_vector
from robostiff.linkage import Linkage
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.equations.equilibrium_path import SAFE, CriticalPoint, first_critical
from robostiff.statics.equations.newton import FoundEquilibrium, equilibrium_at
from robostiff.statics.equations.problem import Linearised, LoadCase
from robostiff.statics.equations.stability import (
    Regular,
    leg_margins,
    may_be_singular,
    meets_stiffness,
    platform_margin,
)
from robostiff.statics.loaded_parts import CarriedLoads
from robostiff.statics.loading.given_loads import Acting, Gravity, Laws, Loads
from robostiff.statics.loading.loaded_posture import LoadedPosture, postures_of, wrenches_of
from robostiff.statics.result import Equilibria, Equilibrium

_BOWING = Bowing()
# Of the length of the robot: what is no rounding between legs and platform.
_OPEN = 1e-9


def equilibrium(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Any = None,
    wrench: ArrayLike | None = None,
    *,
    displacement: ArrayLike | None = None,
    at: ArrayLike | None = None,
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, Any] | None = None,
    laws: Laws | None = None,
    beams: Beams = _BOWING,
    near: Near = None,
) -> Equilibrium | Equilibria:
    """Equilibrium of a robot under finite loads: where it is, how stiff, whether it stays.

    Actuators are springs that are unloaded at the coordinates of `pose`. Either the wrench on the
    platform is given, and it moves until all is in balance; or its displacement is given, and the
    wrench that holds it there follows.

    Parameters
    ----------
    robot : Robot, Snapshot, Network, Linkage or CableRobot
        Legs with parallel blocks to any depth, on a rigid or a flexible platform; bodies, joints
        and elastic parts in any arrangement; or cables, which pull as at rest without the loads.
    pose : RigidTransform, array, JointCoordinates or None
        The unloaded posture, as for `stiffness`; a batch (N, 6) gives an answer at each.
        Of a linkage the coordinates of its joints, by name.
    wrench : (6,) array, or (3,) for a planar robot
        Force [N] and moment [N m] of the environment on the platform about `at`, in world axes,
        which keep their directions while the platform moves; none when left out. A batch (N, 6)
        gives an answer under each.
    displacement : (6,) array, or (3,) for a planar robot
        Of the point `at` [m] and rotation vector of the platform [rad], from the unloaded posture,
        world axes; in place of the wrench.
    at : (3,) array, optional
        Point of the platform at the unloaded posture, in the world [m], where the wrench acts and
        about which K is given; it moves along. The robot's reference point when left out.
    loads : mapping of str to force, DeadForce, Mass or a sequence of them, optional
        Forces [N] that keep their directions, by the name of the part before the body on which
        they act, ``leg/part``, or ``platform``. A `Mass` [kg] is pulled by gravity, and down where
        there is none; its centre is in the world at the unloaded posture, that of the part when
        left out. A `Weight` acts on the platform.
    gravity : (3,) array or str, optional
        Acceleration of free fall in the world [m/s^2], or an axis such as ``"-z"``, which makes
        weights of the masses of the robot. That of the robot when left out; ``[0, 0, 0]`` for none.
    preload : mapping of str to float, optional
        Force or moment with which the drive of a joint, ``leg/part``, pushes along its coordinate
        at the unloaded posture [N or N m].
    laws : mapping of str to ForceLaw, optional
        How the force of a joint, ``leg/part``, follows from its motion, in place of its stiffness.
    beams : Bowing or Linear
        What axial load does to a beam between its ends.
    near : joint coordinates, optional
        Those that choose the posture, as for `stiffness`.

    Returns
    -------
    Equilibrium
        `Equilibria` of a batch, with a status for each. Where rigid parts hold the platform in some
        direction, it has a compliance and no K.

    Raises
    ------
    InputError
        When a load does not fit, or both wrench and displacement are given.

    Examples
    --------
    >>> import robostiff as rs
    >>> loaded = rs.equilibrium(rs.load("hexapod"), wrench=[0, 0, -1e6, 0, 0, 0])
    >>> loaded.stable, round(1e3 * float(loaded.displacement[2]), 3), round(loaded.margin, 3)
    (True, -3.11, 0.935)
    """
    if wrench is not None and displacement is not None:
        raise InputError(
            "wrench and displacement of an equilibrium",
            got="both",
            expected="one of them: the other follows",
        )
    postures = postures_of(robot, pose, near)
    space = postures.robot.space
    given = wrenches_of(
        "displacement" if displacement is not None else "wrench",
        wrench if displacement is None else displacement,
        space,
    )
    batch = np.broadcast_shapes(postures.batch, given.shape[:-1])
    if len(batch) > 1:
        raise InputError(
            "batch of equilibria", got=batch, expected="poses and wrenches along one axis"
        )
    given = np.broadcast_to(given, (*batch, space.size)).reshape(-1, space.size)
    answers = []
    loaded: LoadedPosture | None = None
    acting = Acting(loads, gravity, preload, beams, at, laws or {})
    for i, own in enumerate(given):
        if loaded is None or postures.batch:
            loaded = postures.loaded(i, acting)
        target = None if displacement is None else own
        answers.append(solved(loaded, own if target is None else None, target))
    return Equilibria(tuple(answers)) if batch else answers[0]


def solved(
    loaded: LoadedPosture,
    wrench: np.ndarray | None,
    displacement: np.ndarray | None,
    *,
    standing: bool = False,
) -> Equilibrium:
    """The equilibrium of one robot at one posture.

    Where a growing load is followed, all loads grow together; or, `standing`, the wrench alone.
    """
    problem, status = loaded.problem, loaded.status
    if not loaded.has_posture:
        return Equilibrium(loaded.name, loaded.space, status)
    nothing = np.zeros(problem.size)
    share = (1.0, 0.0) if standing else (0.0, 1.0)
    loading = LoadCase(nothing, nothing if wrench is None else wrench, *share)
    unloaded = problem.at_rest
    if unloaded.rigid:
        status |= Status.RIGID_DIRECTION
    target = None
    if displacement is not None:
        full = np.zeros(6)
        full[list(problem.rows)] = displacement
        target = turn_by_vector(full[3:]), problem.point + full[:3]
    first = None
    if problem.loads_platform_alone and not unloaded.rigid:
        first = problem.under_load(unloaded, loading, 1.0)
    found = equilibrium_at(problem, loading, 1.0, problem.unloaded, target, first=first)
    critical: CriticalPoint | None = None
    margins = _margins(found.known) if found.converged else {}
    near = not found.converged or not found.direct or min(margins.values()) < SAFE
    if displacement is None and (near or _has_branched(found)):
        confirmed, critical = _confirmed(found)
        if confirmed is not found:
            found = confirmed
            margins = _margins(found.known) if found.converged else {}
    held = found.known.held
    if displacement is not None and held and np.linalg.norm(held.gap) > _OPEN * problem.length:
        # legs stay open at the pose of the platform
        status |= Status.NO_EQUILIBRIUM
        return Equilibrium(loaded.name, loaded.space, status, held=True)
    if critical is not None:
        status |= Status.BEYOND_CRITICAL_LOAD
    if not found.converged:
        status |= Status.NO_EQUILIBRIUM
        if displacement is None and not meets_stiffness(problem.at_rest):
            status |= Status.FREE_MOTIONS
        return Equilibrium(loaded.name, loaded.space, status, critical)
    return _answer(loaded, margins, found, status, critical, displacement is not None)


def _has_branched(found: FoundEquilibrium) -> bool:
    """Whether a cable has become slack on the way from the unloaded posture.

    Or rigid bars may have passed a singular posture.
    """
    problem = found.problem
    slack = (
        own.is_cable and own.tension == 0 for own in CarriedLoads(problem, found.state).springs()
    )
    return any(slack) or (
        may_be_singular(problem) and Regular.of(problem.at_rest).ratio(found.known) <= 0
    )


def _confirmed(found: FoundEquilibrium) -> tuple[FoundEquilibrium, CriticalPoint | None]:
    """The equilibrium on the path from the unloaded posture, and the critical load before it."""
    problem = found.problem
    if not meets_stiffness(problem.at_rest):
        return found, None  # what nothing elastic holds leaves the unloaded posture at once
    ended, critical, searched_to = first_critical(problem, found.loading, 1.0)
    if critical is not None:
        return found, critical
    if ended is None or searched_to < 1.0:
        return replace(found, converged=False), None
    return ended, None


def _margins(known: Linearised) -> dict[str, float]:
    """Of the platform and of every leg, by name."""
    names, legs = known.problem.leg_names, leg_margins(known)
    return {"platform": platform_margin(known).value} | {names[k]: legs[k].value for k in legs}


def _answer(
    loaded: LoadedPosture,
    margins: dict[str, float],
    found: FoundEquilibrium,
    status: Status,
    critical: CriticalPoint | None,
    held: bool,
) -> Equilibrium:
    problem, known, loading = loaded.problem, found.known, found.loading
    wrench = loading.wrench + loading.wrench_rate
    share = loading.shares(found.factor).value
    if not held and not CarriedLoads(problem, found.state, share).are_balanced(wrench):
        return Equilibrium(loaded.name, loaded.space, status | Status.ILL_CONDITIONED, critical)
    if not held and not meets_stiffness(known):
        status |= Status.FREE_MOTIONS
    if not (known.regular and problem.at_rest.regular):
        status |= Status.REDUNDANT_JOINTS
    answer = Equilibrium(
        name=loaded.name,
        space=loaded.space,
        status=status,
        critical=critical,
        found=found,
        margins=margins,
        held=held,
        frame=loaded.frame,
        posed=loaded.posed,
    )
    if isinstance(loaded.posed, CableRobot):
        status |= status_of_cables(loaded.posed, np.array([own.tension for own in answer.springs]))
    return replace(answer, status=status if answer.stable else status | Status.UNSTABLE)
