"""Stiffness and compliance of machines of all kinds, at a pose or many."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.details import Question, StructuralAnalysis
from robostiff.analysis.questions import OwnPose, PosesOfRobot
from robostiff.analysis.result import Stiffness
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD, solve_snapshot
from robostiff.elastostatics import DEFAULT_TOLERANCE, Form, Tolerance
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose
from robostiff.kinematics.pose import check_is_not_posed
from robostiff.model import Robot, Snapshot

if TYPE_CHECKING:
    from robostiff.analysis.cable_stiffness import CableStiffness
    from robostiff.linkage import DriveValues, Linkage
    from robostiff.model.cable import CableRobot
    from robostiff.network import Network


def question_of(
    machine: Any, pose: Any, method: Form, near: Near, tolerance: Tolerance
) -> Question:
    """What is asked for by arguments of `stiffness`, which are checked."""
    kind = getattr(machine, "kind", None)
    _check_options(machine, kind, method, near, tolerance)
    if kind == "robot":
        machine.check_has_no_springs("stiffness without load")
        return PosesOfRobot(machine, pose, method, near, tolerance)
    if kind == "linkage":
        from robostiff.analysis.linkage_stiffness import ConfigurationsOfLinkage

        return ConfigurationsOfLinkage.of(machine, pose, tolerance)
    if kind not in ("snapshot", "network"):
        raise InputError(
            "robot",
            got=machine,
            expected="a Robot, a Snapshot, a Network, a Linkage or a CableRobot",
            hint='write load("hexapod")',
        )
    check_is_not_posed(machine, pose)
    if kind == "snapshot":
        machine.check_has_no_springs("stiffness without load")
        return OwnPose(machine, method, tolerance, solve_snapshot(machine, method, tolerance))
    from robostiff.analysis.linkage_stiffness import network_details

    return OwnPose(machine, StructuralAnalysis(), tolerance, network_details(machine, tolerance))


def _check_options(machine: Any, kind: str | None, method: Any, near: Near, tolerance: Any) -> None:
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
    if method != DEFAULT_METHOD and kind in ("linkage", "network", "cable robot"):
        raise InputError(
            f"method for {kind} {machine.name!r}",
            got=method.name,
            expected=f"none: forms of K_C are of legs, and a {kind} is solved as a whole",
        )
    if near is not None and kind not in ("robot", None):
        raise InputError(
            f"near of {machine.name!r}",
            got=near,
            expected="none: only a robot of joints and legs has postures to choose from",
        )


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
    return Stiffness.of(question_of(robot, pose, method, near, tolerance), at)


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
        joints follow, as in ``linkage.network_at``.
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
        one = PosesOfRobot.recorded_at_one(robot, pose)
        if one is not None:
            return Stiffness(one, one.rows).about(at)
    if getattr(robot, "kind", None) == "cable robot":
        _check_options(robot, robot.kind, method, near, tolerance)
        from robostiff.analysis.cable_stiffness import cable_stiffness

        return cable_stiffness(cast("Any", robot), cast("Any", pose), at=at, tolerance=tolerance)
    question = question_of(robot, pose, method, near, tolerance)
    return Stiffness.of(question, at, by_record=True)


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
