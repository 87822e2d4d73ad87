"""What `stiffness` and `compliance` answer: at once, and when more is asked for."""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.careful_form import (
    AskedPoses,
    asked_of,
    careful_stiffness,
    check_arguments,
    check_is_default,
)
from robostiff.analysis.result import RobotStiffness, points_given
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD
from robostiff.elastostatics import DEFAULT_TOLERANCE, Form, Status, Tolerance
from robostiff.elastostatics.status import WITHOUT_STIFFNESS
from robostiff.errors import DisagreementError, InputError
from robostiff.kinematics import Near, Pose
from robostiff.model import Robot, Snapshot
from robostiff.spatial import Space, move_stiffness

if TYPE_CHECKING:
    from robostiff.analysis.cable_stiffness import CableStiffness
    from robostiff.analysis.linkage_stiffness import AskedConfigurations
    from robostiff.analysis.robot_record import RecordedAnswer
    from robostiff.linkage import DriveValues, Linkage
    from robostiff.model.cable import CableRobot
    from robostiff.network import Network

    Asked = AskedPoses | AskedConfigurations


_FIELDS = tuple(field.name for field in fields(RobotStiffness))
# Poses of a batch that are worked out together when they are asked for one by one.
_BLOCK = 64


class Details:
    """The careful form at the poses of one question, worked out where it is asked for.

    It must agree with what a record has given, if that is given.
    """

    def __init__(self, asked: Asked, recorded: RecordedAnswer | None) -> None:
        self.asked = asked
        self.rows = np.arange(len(asked.numbers)).reshape(asked.batch)
        self._recorded = recorded
        self._whole: RobotStiffness | None = None
        self._blocks: dict[int, RobotStiffness] = {}
        self._one_by_one = 0

    def at(self, rows: np.ndarray) -> RobotStiffness:
        """At some of the rows, with their shape."""
        if rows is self.rows or np.array_equal(rows, self.rows):
            if self._whole is None:
                self._whole = self._solved(rows)
            return self._whole
        if self._whole is not None:
            return self._whole[np.unravel_index(rows, self.rows.shape)]
        if rows.shape:
            return self._solved(rows)
        self._one_by_one += 1
        if self._one_by_one == 1:
            return self._solved(rows)
        start = int(rows) // _BLOCK * _BLOCK
        if start not in self._blocks:
            stop = min(start + _BLOCK, self.rows.size)
            self._blocks[start] = self._solved(np.arange(start, stop))
        return self._blocks[start][int(rows) - start]

    def _solved(self, rows: np.ndarray) -> RobotStiffness:
        result = self.asked.solved(rows)
        if self._recorded is not None:
            from robostiff.analysis.measures import differences

            asked, flat = self.asked, rows.reshape(-1)
            own = self._recorded.reshaped((-1,))[flat]
            for i, distance in differences(
                own.K, own.rank, own.status_codes, result, free=asked.free
            ):
                place = asked.numbers[flat[i]].tolist()
                raise DisagreementError(asked.opinions, distance, f"{asked.name!r} at {place}")
        return result


class PosedStiffness(RobotStiffness):
    """K_C of a robot at poses: matrix, rank and status at once, the rest when it is asked for.

    Where the robot's record gives the matrix, all that only the careful form has (legs, free
    motions, compliance, joint coordinates) is worked out at the poses of which it is asked. Both
    must agree.

    Parameters
    ----------
    recorded : RecordedAnswer or None
        At the rows; without one the careful form answers.
    rows : array of int
        Those of the question that this is about.
    point : (..., 3) array or None
        Point about which K is given [m]; the robot's own for None.
    """

    def __init__(
        self,
        details: Details,
        recorded: RecordedAnswer | None,
        rows: np.ndarray,
        point: np.ndarray | None = None,
    ) -> None:
        own = {"_details": details, "_recorded": recorded, "_rows": rows, "_point": point}
        asked = details.asked
        vars(self).update(own, name=asked.name, method=asked.method)
        if recorded is None:
            _ = self._careful  # bad input is found now

    @classmethod
    def of(cls, asked: Asked, recorded: RecordedAnswer | None) -> PosedStiffness:
        """At all poses of a question."""
        details = Details(asked, recorded)
        return cls(details, recorded, details.rows)

    def __getattr__(self, name: str) -> Any:
        """The result of the careful form, computed when it is first used."""
        if name not in _FIELDS or "_details" not in vars(self):
            raise AttributeError(f"{type(self).__name__!r} has no attribute {name!r}")
        match name:
            case "complaints":
                value = self._details.asked.complaints(self._rows, self.status)
            case "pose" if self._pose is not None:
                value = self._pose
            case "reference_point":
                value = self._own_point if self._point is None else self._point
            case _:
                value = getattr(self._careful, name)
        vars(self)[name] = value
        return value

    @cached_property
    def _careful(self) -> RobotStiffness:
        return self._details.at(self._rows)

    @cached_property
    def _pose(self) -> np.ndarray | None:
        """Pose coordinates (..., 6) where all of them are given."""
        return self._details.asked.pose_at(self._rows)

    @cached_property
    def _own_point(self) -> np.ndarray:
        """The robot's reference point in the world (..., 3) [m]."""
        known = "_careful" in vars(self)
        point = None if known else self._details.asked.reference_points(self._rows)
        return self._careful.reference_point if point is None else point

    @property
    def space(self) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return self._details.asked.space

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of poses, () for a single one."""
        return self._rows.shape

    @property
    def matrix(self) -> np.ndarray:
        """K (..., n, n) of all poses, unchecked: meaningful where they have a stiffness matrix."""
        if self._recorded is None:
            return super().matrix
        if self._point is None:
            return self._recorded.K
        v = (self._point - self._own_point)[..., : self.space.translations]
        return move_stiffness(self._recorded.K, v) if np.any(v) else self._recorded.K

    @property
    def rank(self) -> np.ndarray:
        """How many independent wrenches hold the platform (...); -1 where out of reach."""
        return super().rank if self._recorded is None else self._recorded.rank

    @property
    def status(self) -> Status:
        """Status of a single pose; of a batch, everything that happened at any pose."""
        return Status(int(np.bitwise_or.reduce(self.status_codes, axis=None)))

    @property
    def status_codes(self) -> np.ndarray:
        """Status of every pose (...) as uint16."""
        return super().status_codes if self._recorded is None else self._recorded.status_codes

    @property
    def answered(self) -> np.ndarray:
        """Where there is a stiffness matrix (...)."""
        return (self.status_codes & int(WITHOUT_STIFFNESS)) == 0

    def placed(self) -> Snapshot | Network:
        """The robot in the world at a single pose; a linkage as a network."""
        return self._details.asked.placed(self._rows)

    def snapshot(self) -> Snapshot:
        """The robot in the world at a single pose."""
        found = self.placed()
        if not isinstance(found, Snapshot):
            raise InputError(
                f"snapshot of {self.name!r}",
                got="a linkage",
                expected="a robot with legs",
                hint="linkage.network_at(values) is the network",
            )
        return found

    @property
    def _reason(self) -> str:
        return super()._reason if self._recorded is None else ""

    def about(self, point: ArrayLike | None) -> PosedStiffness:
        """The same answer about another point of the platform (..., 3), in the world [m].

        The answer itself for None.
        """
        if point is None:
            return self
        point = points_given(point, self.batch_shape)
        return PosedStiffness(self._details, self._recorded, self._rows, point)

    def __getitem__(self, index: Any) -> PosedStiffness:
        """The answer at one pose, or at some poses, of a batch."""
        return PosedStiffness(
            self._details,
            None if self._recorded is None else self._recorded[index],
            np.asarray(self._rows[index]),
            None if self._point is None else self._point[index],
        )


def answered_at(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    at: ArrayLike | None = None,
    *,
    method: Form = DEFAULT_METHOD,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
    by_record: bool = False,
) -> RobotStiffness:
    """As `stiffness`, by the record where that pays or, as it is left out, by the careful form."""
    asked = asked_of(robot, pose, method, near, tolerance)
    if asked is None:
        return careful_stiffness(robot, pose, method=method, tolerance=tolerance).about(at)
    return PosedStiffness.of(asked, asked.recorded() if by_record else None).about(at)


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
    if not isinstance(robot, Robot):
        from robostiff.model.cable import CableRobot

        if isinstance(robot, CableRobot):
            check_arguments(robot, method, near, tolerance)
            check_is_default(method, "cable robot", robot.name)
            from robostiff.analysis.cable_stiffness import cable_stiffness

            return cable_stiffness(robot, cast("Pose", pose), at=at, tolerance=tolerance)
    return answered_at(
        robot, pose, at, method=method, near=near, tolerance=tolerance, by_record=True
    )


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
