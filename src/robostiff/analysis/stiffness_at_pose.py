"""Stiffness of a robot at a pose, from model, kinematics and the forms of K_C."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.careful_form import check_arguments, check_is_default
from robostiff.analysis.posed_stiffness import answered_at
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD
from robostiff.elastostatics import DEFAULT_TOLERANCE, Form, Tolerance
from robostiff.kinematics import Near, Pose
from robostiff.model import Robot, Snapshot

if TYPE_CHECKING:
    from robostiff.analysis.cable_stiffness import CableStiffness
    from robostiff.linkage import DriveValues, Linkage
    from robostiff.model.cable import CableRobot
    from robostiff.network import Network


@overload
def stiffness(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    *,
    method: Form = DEFAULT_METHOD,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> RobotStiffness: ...
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
) -> RobotStiffness | CableStiffness:
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
    RobotStiffness
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
    how: dict[str, Any] = {"method": method, "near": near, "tolerance": tolerance}
    if isinstance(robot, Robot):
        return answered_at(robot, pose, at, **how, by_record=True)
    from robostiff.model.cable import CableRobot

    if isinstance(robot, CableRobot):
        check_arguments(robot, method, near, tolerance)
        check_is_default(method, "cable robot", robot.name)
        from robostiff.analysis.cable_stiffness import cable_stiffness

        return cable_stiffness(robot, cast("Pose", pose), at=at, tolerance=tolerance)
    return answered_at(robot, pose, at, **how, by_record=True)


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
    legs by least energy; K is not inverted.

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
    from robostiff.model.cable import CableRobot

    if isinstance(robot, CableRobot):
        check_arguments(robot, DEFAULT_METHOD, near, tolerance)
        from robostiff.analysis.cable_stiffness import cable_stiffness

        return cable_stiffness(
            robot, cast("Pose", pose), at=at, tolerance=tolerance
        ).required_compliance()
    result = answered_at(robot, pose, at, near=near, tolerance=tolerance)
    return result.required_compliance()
