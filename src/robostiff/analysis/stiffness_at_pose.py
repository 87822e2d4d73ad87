"""Stiffness of a robot at a pose: where model, kinematics and the forms of K_C meet."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.cable_result import CableStiffness
from robostiff.analysis.cable_stiffness import cable_stiffness
from robostiff.analysis.network_stiffness import network_stiffness
from robostiff.analysis.posture_choice import posture_advice
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.snapshot_stiffness import SnapshotStiffness, solve_snapshot
from robostiff.elastostatics import (
    CartesianStiffness,
    Form,
    Status,
    Tolerance,
    WrenchBasis,
)
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose, Posture, PostureFinder, posture_finder
from robostiff.kinematics.pose import PoseRequest
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.spatial import as_floats

_DEFAULT_METHOD = WrenchBasis()
_DEFAULT_TOLERANCE = Tolerance()
#: Poses worked on at once: few enough for the cache, enough to hide the cost of a NumPy call.
CHUNK = 4096


@overload
def stiffness(
    robot: Robot | Snapshot | Network,
    pose: Pose = None,
    *,
    method: Form = _DEFAULT_METHOD,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = _DEFAULT_TOLERANCE,
) -> RobotStiffness: ...
@overload
def stiffness(
    robot: CableRobot,
    pose: Pose = None,
    *,
    at: ArrayLike | None = None,
    near: None = None,
    tolerance: Tolerance = _DEFAULT_TOLERANCE,
) -> CableStiffness: ...
def stiffness(
    robot: Robot | Snapshot | Network | CableRobot,
    pose: Pose = None,
    *,
    method: Form = _DEFAULT_METHOD,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = _DEFAULT_TOLERANCE,
) -> RobotStiffness | CableStiffness:
    """Cartesian stiffness matrix K_C of a robot at a pose or a batch of poses, F = K_C t.

    Each leg's stiffness comes from its compliance and its passive joints by `method`; the legs are
    summed about the reference point, eq. (12). World axes.

    Parameters
    ----------
    robot : Robot, Snapshot, Network or CableRobot
    pose : RigidTransform, array, JointCoordinates or None
        Platform pose; coordinates (..., 6) as x, y, z [m] and rotation vector [rad], or the free
        coordinates of the robot, the others following from the legs; joint coordinates for a serial
        arm; None for home. A snapshot and a network have their own pose.
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
    """
    _check_arguments(robot, method, tolerance)
    _check_near(robot, near)
    if isinstance(robot, CableRobot):
        if method != _DEFAULT_METHOD:
            raise InputError(
                f"method for cable robot {robot.name!r}",
                got=method.name,
                expected="none: forms of K_C are of legs",
            )
        return cable_stiffness(robot, pose, at=at, tolerance=tolerance)
    if isinstance(robot, Snapshot | Network) and pose is not None:
        kind = "network" if isinstance(robot, Network) else "snapshot"
        raise InputError(
            f"pose of {kind} {robot.name!r}",
            got=pose,
            expected=f"none: a {kind} is frozen at its own pose",
            hint="describe the robot in a model file to move it",
        )
    if isinstance(robot, Network):
        return _about(_of_network(robot, method, tolerance), at)
    if isinstance(robot, Snapshot):
        solved = solve_snapshot(robot, method, tolerance)
        result = RobotStiffness(
            name=robot.name,
            pose=None,
            reference_point=robot.reference_point,
            about_reference=solved.whole,
            legs=solved.legs,
            passive_joint_names=solved.passive_joint_names,
            method=method,
            complaints=(),
            serial_compliance=solved.compliance,
            origin=solved.origin,
        )
        return _about(result, at)
    finder = posture_finder(robot)
    request = finder.request(pose)
    rows = _rows(request)
    parts = []
    for start in range(0, max(rows, 1), CHUNK):
        posture = _find(finder, request, slice(start, start + CHUNK), near)
        solved = solve_snapshot(posture.snapshot, method, tolerance)
        parts.append((posture, _with_reach(solved, posture)))
    batch = request.shape[:-1] if isinstance(request, np.ndarray) else request.batch
    result = _joined(robot, parts, batch, method)
    if near is None and not isinstance(request, np.ndarray):

        def of_leg(snapshot: Snapshot) -> np.ndarray:
            return solve_snapshot(snapshot, _DEFAULT_METHOD, tolerance).legs[0].matrix

        more = posture_advice(finder, parts[0][0], of_leg)
        result = replace(result, complaints=(*result.complaints, *more))
    return _about(result, at)


def compliance(
    robot: Robot | Snapshot | Network | CableRobot,
    pose: Pose = None,
    *,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = _DEFAULT_TOLERANCE,
) -> np.ndarray:
    """Cartesian compliance matrix of a robot, t = C F (..., n, n) [m/N, 1/N, rad/(N m)].

    Parameters as for `stiffness`.

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
    _check_near(robot, near)
    if isinstance(robot, CableRobot):
        return stiffness(robot, pose, at=at, tolerance=tolerance).required_compliance()
    return stiffness(robot, pose, at=at, near=near, tolerance=tolerance).required_compliance()


def _of_network(network: Network, method: Form, tolerance: Tolerance) -> RobotStiffness:
    if method != _DEFAULT_METHOD:
        raise InputError(
            f"method for network {network.name!r}",
            got=method.name,
            expected="none: forms of K_C are of legs, and a network is solved as a whole",
        )
    return network_stiffness(network, tolerance)


def _check_arguments(robot: Any, method: Any, tolerance: Any) -> None:
    if not isinstance(robot, Robot | Snapshot | Network | CableRobot):
        raise InputError(
            "robot",
            got=robot,
            expected="a Robot, a Snapshot, a Network or a CableRobot",
            hint='write load("hexapod")',
        )
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


def _check_near(robot: Robot | Snapshot | Network | CableRobot, near: Near) -> None:
    if near is not None and not isinstance(robot, Robot):
        raise InputError(
            f"near of {robot.name!r}",
            got=near,
            expected="none: only a robot of joints and legs has postures to choose from",
        )


def _rows(request: PoseRequest | np.ndarray) -> int:
    if isinstance(request, np.ndarray):
        return int(np.prod(request.shape[:-1], dtype=int))
    return len(request.coordinates)


def _find(
    finder: PostureFinder, request: PoseRequest | np.ndarray, rows: slice, near: Near
) -> Posture:
    if isinstance(request, np.ndarray):
        return finder.at(request.reshape(_rows(request), request.shape[-1])[rows], near)
    return finder.at(request.part(rows), near)


def _with_reach(solved: SnapshotStiffness, posture: Posture) -> SnapshotStiffness:
    """Status of poses out of reach, and of actuators beyond their limits."""
    whole = solved.whole
    reached = posture.reached
    status = np.where(reached, whole.status_codes, np.uint8(Status.UNREACHABLE))
    beyond = reached & ~posture.within_limits
    status = status | beyond * np.uint8(Status.BEYOND_LIMITS)
    status = status | (reached & posture.undetermined) * np.uint8(Status.ILL_CONDITIONED)
    return replace(solved, whole=whole.with_status(np.asarray(status, dtype=np.uint8)))


def _joined(
    robot: Robot,
    parts: list[tuple[Posture, SnapshotStiffness]],
    batch: tuple[int, ...],
    method: Form,
) -> RobotStiffness:
    first = parts[0][1]
    compliance = None
    if first.compliance is not None:
        compliance = _stacked([part.compliance for _, part in parts], batch)
    return RobotStiffness(
        name=robot.name,
        pose=_stacked([posture.pose for posture, _ in parts], batch),
        reference_point=_stacked([posture.snapshot.reference_point for posture, _ in parts], batch),
        about_reference=_reshaped([part.whole for _, part in parts], batch),
        legs=tuple(
            _reshaped([part.legs[i] for _, part in parts], batch) for i in range(len(first.legs))
        ),
        passive_joint_names=first.passive_joint_names,
        method=method,
        complaints=parts[0][0].complaints if not batch else (),
        joint_coordinates={
            leg.name: _stacked([posture.coordinates[i] for posture, _ in parts], batch)
            for i, leg in enumerate(robot.legs)
        },
        serial_compliance=compliance,
        origin=_stacked([part.origin for _, part in parts], batch),
    )


def _reshaped(parts: list[CartesianStiffness], batch: tuple[int, ...]) -> CartesianStiffness:
    return CartesianStiffness.joined(parts).reshaped(batch)


def _stacked(parts: list[Any], batch: tuple[int, ...]) -> np.ndarray:
    whole = parts[0] if len(parts) == 1 else np.concatenate(parts)
    return whole.reshape(*batch, *whole.shape[1:])


def _about(result: RobotStiffness, at: ArrayLike | None) -> RobotStiffness:
    if at is None:
        return result
    reference = result.reference_point
    point = as_floats("point 'at'", at, "three numbers x y z [m]", "m")
    if point.shape[-1:] != (3,):
        raise InputError("point 'at'", got=at, expected="three numbers x y z [m]")
    try:
        point = np.broadcast_to(point, reference.shape)
    except ValueError:
        raise InputError(
            "point 'at'", got=point.shape, expected=f"a shape that fits {reference.shape}"
        ) from None
    return result.about(point)
