"""Stiffness, compliance and deflection of machines of all kinds, at a pose or many."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.questions import Question, dispatched, question_of
from robostiff.analysis.result import Stiffness, given_wrenches
from robostiff.analysis.robot_record import ask_record, recorded_at_one
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD
from robostiff.elastostatics import DEFAULT_TOLERANCE, Form, Tolerance
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose
from robostiff.model import Robot, Snapshot

if TYPE_CHECKING:
    from robostiff.analysis.cable_stiffness import CableStiffness
    from robostiff.linkage import DriveValues, Linkage
    from robostiff.model.cable import CableRobot
    from robostiff.network import Network


def asked_question(
    machine: Any, pose: Any, method: Form, near: Near, tolerance: Tolerance
) -> Question:
    """What is asked for by arguments of `stiffness`, which are checked."""
    _check_options(method, tolerance)
    question = dispatched(question_of, machine)(machine, pose, method, near, tolerance)
    _check_fits(machine, method, near, question.has_legs, question.has_postures)
    return question


def _check_fits(machine: Any, method: Form, near: Near, has_legs: bool, has_postures: bool) -> None:
    if method != DEFAULT_METHOD and not has_legs:
        raise InputError(
            f"method for {machine.kind} {machine.name!r}",
            got=method.name,
            expected=f"none: forms of K_C are of legs, and a {machine.kind} is solved as a whole",
        )
    if near is not None and not has_postures:
        raise InputError(
            f"near of {machine.name!r}",
            got=near,
            expected="none: only a robot of joints and legs has postures to choose from",
        )


def _check_options(method: Any, tolerance: Any) -> None:
    if isinstance(method, type) or not isinstance(method, Form):
        name = method.__name__ if isinstance(method, type) else "WrenchBasis"
        raise InputError(
            "method", got=method, expected="a form of K_C", hint=f"write method={name}()"
        )
    if not isinstance(tolerance, Tolerance):
        raise InputError(
            "tolerance",
            got=tolerance,
            expected="a Tolerance",
            hint="write tolerance=Tolerance(independence=1e-9)",
        )


def stiffness_by_record(
    machine: Any, pose: Any, at: ArrayLike | None, near: Near, tolerance: Tolerance
) -> Stiffness:
    """As `stiffness`, of one pose by the direct form: for what asks for the legs at one pose."""
    question = asked_question(machine, pose, DEFAULT_METHOD, near, tolerance)
    if question.rows.shape:
        ask_record(question)
    return Stiffness.of(question, at)


def direct_stiffness(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Any = None,
    at: ArrayLike | None = None,
    *,
    method: Form = DEFAULT_METHOD,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> Stiffness:
    """As `stiffness`, but never by the record of the robot.

    For what is going to ask for legs, compliance or loads, and for what checks a record.
    """
    return Stiffness.of(asked_question(robot, pose, method, near, tolerance), at)


@overload
def stiffness(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    *,
    method: Form = DEFAULT_METHOD,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> Stiffness: ...
@overload
def stiffness(
    robot: CableRobot,
    pose: Pose = None,
    *,
    at: ArrayLike | None = None,
    near: None = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> CableStiffness: ...
def stiffness(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Pose | DriveValues = None,
    *,
    method: Form = DEFAULT_METHOD,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> Stiffness | CableStiffness:
    """Cartesian stiffness matrix K_C of a robot at a pose or a batch of poses, F = K_C t.

    Each leg's stiffness comes from its compliance and its passive joints by `method`; the legs are
    summed about the reference point, eq. (12). World axes.

    Parameters
    ----------
    robot : Robot, Snapshot, Network, Linkage or CableRobot
    pose : RigidTransform, array, JointCoordinates, mapping or None
        Platform pose; coordinates (..., 6) as x, y, z [m] and rotation vector [rad], or the free
        coordinates of the robot, the others following from the legs; joint coordinates for a serial
        arm; None for home. A snapshot and a network have their own pose. Of a linkage coordinates
        of joints by name, numbers (...) each, or those of all actuated joints (..., n); the other
        joints follow, as in `network_at`.
    method : Form
        ``WrenchBasis()`` (default), ``Block()``, ``Recursive()``, ``SaddlePoint()``,
        ``IndexRules()``. A network is solved as a whole, without any of them.
    at : (3,) or (..., 3) array, optional
        Point of the platform about which the matrix is given, in world coordinates [m]; the robot's
        reference point when left out.
    near : joint coordinates, optional
        Of all legs, in a row or leg by leg [m, rad]: the posture nearest to them is taken. When
        left out, it is the assembly mode of the home configuration.
    tolerance : Tolerance

    Returns
    -------
    Stiffness
        Of a cable robot a `CableStiffness`, as `cable_stiffness` answers it.

    Raises
    ------
    InputError
        When the pose does not fit the robot, or a planar robot leaves the plane.

    Examples
    --------
    >>> import robostiff as rs
    >>> result = rs.stiffness(rs.load("gough-stewart-a"))
    >>> int(result.rank)
    3
    >>> print(result.free_motions[0])
    rotation about x through (0, 0, 2) m
    >>> linkage = rs.load_linkage("double-pantograph")
    >>> rs.stiffness(linkage, {"screw": [-0.1, 0, 0.2]}).rank
    array([ 6,  6, -1])
    """
    plain = method is DEFAULT_METHOD and tolerance is DEFAULT_TOLERANCE and near is None
    if plain and type(robot) is Robot:
        one = recorded_at_one(robot, pose)
        if one is not None:
            return Stiffness(one, one.rows).about(at)
    if hasattr(robot, "cables"):
        _check_options(method, tolerance)
        _check_fits(robot, method, near, has_legs=False, has_postures=False)
        from robostiff.analysis.cable_stiffness import cable_stiffness

        return cable_stiffness(cast("Any", robot), cast("Any", pose), at=at, tolerance=tolerance)
    question = asked_question(robot, pose, method, near, tolerance)
    ask_record(question)
    return Stiffness.of(question, at)


def compliance(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Pose | DriveValues = None,
    *,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> np.ndarray:
    """Cartesian compliance matrix of a robot, t = C F (..., n, n) [m/N, 1/N, rad/(N m)].

    Parameters as for `stiffness`, a batch of poses among them. It follows from the wrenches of the
    legs by least energy. The K of a record is inverted where no digits are lost by that.

    Returns
    -------
    (..., n, n) array
        Of a batch in which some poses have no compliance a masked array, in which those are masked;
        ``stiffness(robot, poses).status_codes`` says why.

    Raises
    ------
    NoAnswerError
        When the platform has free motions at a single pose, or cannot reach it, with the advice of
        the status.

    Examples
    --------
    >>> import robostiff as rs
    >>> C = rs.compliance(rs.load("gough-stewart-b"))
    >>> C.shape
    (6, 6)
    """
    machine: Any = robot
    found = stiffness(machine, pose, at=at, near=near, tolerance=tolerance)
    return found.required_compliance()


def deflection(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    wrench: ArrayLike | None = None,
    *,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> Any:
    """Deflection of the platform under a wrench, and how the parts of the robot share in it.

    Parameters as for `robostiff.deflection`, which takes loads at bodies besides.

    Returns
    -------
    Deflection or DeflectionsOfPoses
        The latter of a batch.

    Raises
    ------
    InputError
        When the wrench or the pose does not fit.
    """
    answer = stiffness_by_record(robot, pose, at, near, tolerance)
    from robostiff.analysis.deflection_under_load import DeflectionsOfPoses, deflection_at

    hint = "write deflection(robot, pose, wrench) or wrench=[...]: the pose comes first"
    F = given_wrenches(wrench, answer.space, answer.batch_shape, hint=hint)
    return DeflectionsOfPoses(F, answer) if answer.batch_shape else deflection_at(answer, F)
