"""Stiffness, compliance and deflection at a pose or many, by the record of a machine first.

The record is kept with the machine, and made once it pays.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.questions import PosesOfRobot, Question, function_for, question_of
from robostiff.analysis.result import Stiffness, given_wrenches
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD
from robostiff.elastostatics import DEFAULT_TOLERANCE, Form, Tolerance
from robostiff.errors import InputError, NoAnswerError
from robostiff.kept import kept
from robostiff.kinematics import JointCoordinates, Near, Pose, posture_finder
from robostiff.kinematics.pose import Given, PoseRequest, held_sums
from robostiff.model import Robot, Snapshot
from robostiff.model.checks import FARTHEST, FULL_TURN

if TYPE_CHECKING:
    from robostiff.analysis.cable_stiffness import CableStiffness
    from robostiff.analysis.deflection_under_load import Deflection
    from robostiff.linkage import DriveValues, Linkage
    from robostiff.model.cable import CableRobot
    from robostiff.network import Network


# Of a record, numbers and trials of working frames among them: some two seconds, and an arm of a
# hundred joints. Beyond, the direct form stays.
_MOST_OPERATIONS = 100_000
# One that is on disk is read in as long as one or two calls take, and loading what reads it takes
# some more: who asks once has an answer before.
_READER, _CALLS = "robostiff.analysis.compiled_stiffness", 2


@dataclass
class KeptRecord:
    """A record of one machine: read from disk, or made once it pays; run by NumPy at first.

    It pays once as many poses were computed without it as `Question.pays` says.
    """

    made: Callable[[bool], Any]  # read from disk alone where it does not pay; None where it is not
    is_near: Callable[[int, int], bool]  # whether to look for it, by calls, and poses of the last
    calls: int = 0
    poses: int = 0  # computed without the record, or by NumPy
    compiled: Any = None  # run by NumPy
    by_machine_code: Any = None  # the same, for many poses
    is_sought: bool = False  # on disk
    is_tried: bool = False

    def for_poses(self, count: int, pays: tuple[int, int, int]) -> Any:
        """What computes that many poses; None where it does not pay yet, or there is no record."""
        a_call, recording, machine_code = pays
        self.poses += a_call + count
        if self.compiled is None and not self.is_tried:
            self._seek(count, self.poses >= recording)
        many = count > 1 and self.poses > machine_code
        if many and self.compiled is not None and self.by_machine_code is None:
            from robostiff.compiled import MachineCode, machine_code_is_available

            is_there = machine_code_is_available()
            self.by_machine_code = self.compiled.by(MachineCode) if is_there else self.compiled
        return self.compiled if count == 1 else self.by_machine_code or self.compiled

    def _seek(self, count: int, pays: bool) -> None:
        self.calls += 1
        if not pays and (self.is_sought or not self.is_near(self.calls, count)):
            return
        self.is_sought, self.is_tried = True, pays
        with suppress(InputError, NoAnswerError):
            self.compiled = self.made(pays)
        if self.compiled is not None:
            self.poses = count


@kept
def record_of(machine: Any) -> KeptRecord:
    """The record of a robot or of a driven linkage, kept with it."""

    def made(pays: bool) -> Any:
        from robostiff.analysis.compiled_stiffness import CompiledStiffness
        from robostiff.analysis.kernel_inputs import recordable
        from robostiff.compiled import Backend

        taken = function_for(recordable, machine)(machine, (), None)
        most = _MOST_OPERATIONS if pays else 0
        found = CompiledStiffness.of(taken, backend=Backend.ARRAYS, most=most)
        return found if found.verified else None

    return KeptRecord(made, lambda calls, _: _READER in sys.modules or calls >= _CALLS)


def recorded_at_one(robot: Robot, pose: Any) -> PosesOfRobot | None:
    """One pose of free coordinates, or joints, in plain numbers, answered by the robot's record.

    None of other poses, and where the record does not answer at once: for `stiffness`, which then
    reads and answers the pose as any other.
    """
    record = record_of(robot)
    if record.compiled is None:
        return None
    by_joints = type(pose) is JointCoordinates
    given = pose.values if by_joints else pose
    numbers = given.tolist() if type(given) is np.ndarray and given.ndim == 1 else given
    bounds, home, left = _plain_coordinates(robot, by_joints)
    if not bounds or type(numbers) is not list or len(numbers) != len(bounds):
        return None
    coordinates = home.copy()
    for (place, middle, most), x in zip(bounds, numbers, strict=True):
        if not ((type(x) is float or type(x) is int) and abs(x - middle) <= most):
            return None
        coordinates[place] = x
    found = record.for_poses(1, PosesOfRobot.pays).at_one(numbers, by_joints)
    if found is None:
        return None
    by = Given.JOINTS if by_joints else Given.POSE
    question = PosesOfRobot(robot, PoseRequest((), np.array([coordinates]), left, by=by))
    question.recorded = found
    return question


@kept
def _plain_coordinates(
    robot: Robot, by_joints: bool
) -> tuple[list[tuple[int, float, float]], list[float], tuple[int, ...]]:
    """Places of coordinates that pose a robot, and about which middle most values are no slip.

    Then all coordinates at home, and which of the platform the legs decide. There are no places
    where poses need more than to be read.
    """
    chain = robot.legs[0].chain
    if by_joints:
        if not robot.is_posed_by_joints or chain.has_blocks or any(held_sums(chain)):
            return [], [], ()
        bounds = [
            2 * FULL_TURN if screw.is_rotation else FARTHEST / abs(screw.advance(1.0))
            for screw in chain.freedoms
        ]
        return [(i, 0.0, most) for i, most in enumerate(bounds)], [0.0] * chain.size, ()
    home = posture_finder(robot).home_pose.tolist()
    places = robot.coordinate_places if not robot.is_serial else ()
    inside = list(places) if all(place in robot.space.rows for place in places) else []
    left = tuple(place for place in robot.space.rows if place not in inside)
    part_of_turn = FULL_TURN / 3**0.5  # the length of the rotation vector is below a turn
    bounds = [(k, home[k], FARTHEST) if k < 3 else (k, 0.0, part_of_turn) for k in inside]
    return bounds, home, left


def asked_question(
    machine: Any, pose: Any, method: Form, near: Near, tolerance: Tolerance
) -> Question:
    """What is asked for by arguments of `stiffness`, which are checked."""
    _check_options(method, tolerance)
    question = function_for(question_of, machine)(machine, pose, method, near, tolerance)
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
    machine: Any,
    pose: Any,
    at: ArrayLike | None,
    near: Near,
    tolerance: Tolerance,
    method: Form = DEFAULT_METHOD,
) -> Stiffness:
    """As `stiffness`, of machines without cables."""
    plain = method is DEFAULT_METHOD and tolerance is DEFAULT_TOLERANCE and near is None
    plain = plain and type(machine) is Robot
    one = recorded_at_one(machine, pose) if plain else None
    if one is not None:
        return Stiffness(one, one.rows).about(at)
    question = asked_question(machine, pose, method, near, tolerance)
    given = question.recordable()
    if given is not None:  # and where it pays
        record = record_of(given[0])
        is_new, count = record.compiled is None, question.rows.size
        recorded = record.for_poses(count, question.pays)
        if plain and is_new and recorded is not None and count == 1:
            return stiffness_by_record(machine, pose, at, near, tolerance, method)
        if recorded is not None:
            question.recorded = recorded.evaluate(given[1]).reshaped(question.rows.shape)
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
    if hasattr(robot, "cables"):
        _check_options(method, tolerance)
        _check_fits(robot, method, near, has_legs=False, has_postures=False)
        from robostiff.analysis.cable_stiffness import cable_stiffness

        return cable_stiffness(cast("Any", robot), cast("Any", pose), at=at, tolerance=tolerance)
    return stiffness_by_record(robot, pose, at, near, tolerance, method)


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
) -> Deflection:
    """Deflection of the platform under a wrench, and how the parts of the robot share in it.

    Parameters as for `robostiff.deflection`, which takes loads at bodies besides.

    Returns
    -------
    Deflection
        Of one pose, or of a batch.

    Raises
    ------
    InputError
        When the wrench or the pose does not fit.
    """
    answer = stiffness_by_record(robot, pose, at, near, tolerance)
    from robostiff.analysis.deflection_under_load import Deflection

    hint = "write deflection(robot, pose, wrench) or wrench=[...]: the pose comes first"
    F = given_wrenches(wrench, answer.space, answer.batch_shape, hint=hint)
    return Deflection(F, answer)
