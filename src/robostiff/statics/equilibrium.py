"""Equilibrium of a robot under load."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.posed_stiffness import KeptRecord
from robostiff.analysis.questions import PosesOfRobot
from robostiff.errors import InputError, Words
from robostiff.kept import kept, kept_for_last
from robostiff.kinematics import JointCoordinates, Near
from robostiff.linkage import Linkage
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.one_thread import in_one_thread
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.loading.given_loads import (
    Acting,
    Gravity,
    Laws,
    Loads,
    StandingLoads,
    comparable_gravity,
)
from robostiff.statics.loading.loaded_posture import LoadedPosture, beside, postures_of, wrenches_of
from robostiff.statics.result import Equilibrium
from robostiff.statics.solution import solve

if TYPE_CHECKING:
    from robostiff.statics.kernels.compiled_loading import CompiledLoading

_BOWING = Bowing()
#: Equilibria from which a record of the robot is made, or read from disk. It takes as long as some
#: 50 equilibria or more to make, a tenth of that to read, and is on disk from then on.
WORTH_COMPILING, WORTH_READING = 100, 20
_CALLS = 3  # at the third a record is looked for on disk
#: Equilibria from which machine code is worth the time that it takes to compile.
WORTH_MACHINE_CODE = 100_000


@in_one_thread
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
) -> Equilibrium:
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
        Of a linkage the coordinates of its joints by name, or of all that are actuated.
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
        there is none. What has no place of its own acts at that of the part, or at the reference
        point of the robot, whatever `at` is. A `Weight` acts on the platform.
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
        Of a batch with a status for each; from 100 on by a record of the robot, as `compile_loaded`
        makes it, from 20 on where that is on disk. Where rigid parts hold the platform in some
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
            got=Words("both"),
            expected="one of them: the other follows",
        )
    acting = Acting(loads, gravity, preload, beams, at, laws or {})
    if displacement is None and at is None and near is None:
        recorded = _by_record(robot, pose, wrench, acting)
        if recorded is not None:
            return recorded
    postures = postures_of(robot, pose, near)
    space = postures.robot.space
    what = "wrench" if displacement is None else "displacement"
    moved = wrench if displacement is None else displacement
    each = beside(postures.batch, wrenches_of(what, moved, space))
    answers = []
    loaded: LoadedPosture | None = None
    for i, row in enumerate(np.atleast_2d(each)):
        if loaded is None or postures.batch:
            loaded = postures.with_loads(i, acting)
        given = (row, None) if displacement is None else (None, row)
        answers.append(solve(loaded, partial(postures.loaded_at, i), *given))
    return Equilibrium.of(postures.robot.name, space, answers if each.ndim > 1 else answers[0])


def _record(robot: Robot, standing: StandingLoads) -> KeptRecord:
    """The record of a robot under a wrench."""

    def made(pays: bool) -> CompiledLoading | None:
        from robostiff.compiled import Backend
        from robostiff.statics.kernels.compile import is_on_disk, kept_loading

        if not (pays or is_on_disk(robot, standing)):
            return None
        return kept_loading(robot, **standing.given, backend=Backend.ARRAYS)

    return KeptRecord(made, lambda calls, count: count >= WORTH_READING or calls == _CALLS)


@kept
def _record_without_loads(robot: Robot, gravity: Gravity, beams: Beams) -> KeptRecord:
    return _record(robot, StandingLoads(None, gravity, None, beams))


def _by_record(
    robot: Any, pose: Any, wrench: ArrayLike | None, acting: Acting
) -> Equilibrium | None:
    """Equilibria under wrenches by the record of a robot; None where there is none, or not so."""
    is_recorded = isinstance(robot, Robot) and not acting.laws
    poses = kept_for_last(_coordinates, robot, pose) if is_recorded else None
    if poses is None:
        return None
    F, batch = wrenches_of("wrench", wrench, robot.space), poses.shape[:-1]
    if acting.loads or acting.preload:
        record = _record(robot, StandingLoads(**acting.given))
    else:
        gravity = comparable_gravity(robot, acting.gravity)
        record = _record_without_loads(robot, gravity, acting.beams)
    count, pays = len(np.atleast_2d(beside(batch, F))), (0, WORTH_COMPILING, WORTH_MACHINE_CODE)
    compiled = record.for_poses(count, pays)
    if compiled is None:
        return None
    return compiled.evaluate(JointCoordinates(poses) if robot.is_posed_by_joints else poses, F)


def _coordinates(robot: Robot, pose: Any) -> np.ndarray | None:
    """Coordinates (..., n) of poses that a record answers; None where there is none for them.

    Those of joints where these pose the robot, else of the platform.
    """
    question = PosesOfRobot(robot, pose)
    given = question.recordable()
    if given is None:
        return None
    numbers = np.asarray(getattr(given[1], "values", given[1]))
    return numbers.reshape(*question.request.batch, numbers.shape[-1])
