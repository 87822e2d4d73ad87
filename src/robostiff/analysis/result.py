"""The result of `stiffness`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.free_motion import FreeMotion, free_motions_in_words
from robostiff.elastostatics import BlockCompliance, CartesianStiffness, Form, RankDecision, Status
from robostiff.errors import InputError, NoAnswerError
from robostiff.markup import InNotebooks
from robostiff.spatial import (
    Space,
    as_floats,
    move_compliance,
    move_stiffness,
    move_twist,
    move_wrench,
)
from robostiff.spatial.rotation import matrix_of_rotation, rigid_transform

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from robostiff.analysis.cable_stiffness import CableStiffness


@dataclass(frozen=True)
class StructuralAnalysis:
    """Matrix structural analysis: all bodies and all wrenches between them in one system."""

    name = "network"
    equation = "[[0, A^T], [A, -S]] [x; f] = [F; 0], condensed to the platform"


@dataclass(frozen=True, repr=False)
class RobotStiffness(InNotebooks):
    """K_C of a robot about a point, in world axes, with rank, free motions and status.

    Attributes
    ----------
    name : str
        Of the robot.
    pose : (..., 6) array or None
        x, y, z [m] and rotation vector [rad] of the platform; None for a snapshot.
    reference_point : (..., 3) array
        Point about which K is given, in the world [m].
    about_reference : CartesianStiffness
        About `origin`, where ranks are decided, independent of the reference point.
    legs : tuple of CartesianStiffness
        Each leg about `origin`.
    passive_joint_names : tuple of str
        ``leg/joint`` of every passive freedom.
    method : Form or StructuralAnalysis
    complaints : tuple of str
        What keeps a single pose from being reached or allowed.
    serial_compliance : (..., n, n) array or None
        Compliance about `origin` of a single leg without passive joints, or of a network with a
        rigid direction; not a number at poses of a batch that have none.
    origin : (..., 3) array
        Where it was computed: the robot's own reference point in the world [m], or the middle of a
        robot that is far away from it.
    joint_coordinates : mapping of str to (..., size) array
        The posture: coordinates of the joints of each leg [m, rad], by its name.
    joint_names : mapping of str to tuple of str
        Names of these coordinates, of robots of legs.
    leg_blocks : tuple of tuples of BlockCompliance
        Parallel blocks of each leg about `origin`, by which their branches share a wrench.
    """

    name: str
    pose: np.ndarray | None
    reference_point: np.ndarray
    about_reference: CartesianStiffness
    legs: tuple[CartesianStiffness, ...]
    passive_joint_names: tuple[str, ...]
    method: Form | StructuralAnalysis
    complaints: tuple[str, ...]
    serial_compliance: np.ndarray | None
    origin: np.ndarray
    joint_coordinates: Mapping[str, np.ndarray] = field(default_factory=dict)
    joint_names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    leg_blocks: tuple[tuple[BlockCompliance, ...], ...] = field(default_factory=tuple)

    @property
    def space(self) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return self.about_reference.space

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of poses, () for a single one."""
        return self.about_reference.batch_shape

    @property
    def transform(self) -> RigidTransform | None:
        """Pose of the platform as a rigid transform, or as a batch of them; None for a snapshot."""
        if self.pose is None:
            return None
        T = np.zeros((*self.pose.shape[:-1], 4, 4))
        T[..., :3, :3] = matrix_of_rotation(self.pose[..., 3:])
        T[..., :3, 3], T[..., 3, 3] = self.pose[..., :3], 1.0
        return rigid_transform(T)

    @property
    def K(self) -> np.ndarray:
        """Stiffness matrix (..., n, n) [N/m, N, N m] about the reference point.

        Raises
        ------
        NoAnswerError
            When a pose has none.
        """
        self._require_answer()
        return self.matrix

    @property
    def matrix(self) -> np.ndarray:
        """K (..., n, n) of all poses, unchecked: meaningful where they have a stiffness matrix."""
        K, v = self.about_reference.matrix, self.offset
        return move_stiffness(K, v) if np.any(v) else K

    @property
    def has_compliance(self) -> np.ndarray:
        """Where every load meets a finite compliance (...), also where a direction is rigid."""
        if self.serial_compliance is None:
            return self.about_reference.has_compliance
        reached = (self.status_codes & int(Status.UNREACHABLE)) == 0
        return reached & ~np.isnan(self.serial_compliance[..., 0, 0])

    @property
    def compliance(self) -> np.ndarray | None:
        """Compliance (..., n, n) [m/N, 1/N, rad/(N m)]; None when some pose has none.

        The inverse of K. Where a direction is rigid, and K does not exist, C is zero for its
        wrench: legs without elastic links have the C of their drives.
        """
        serial = self.serial_compliance
        C = self.about_reference.compliance if serial is None else serial
        if C is None or not np.all(self.has_compliance):
            return None
        return move_compliance(C, self.offset) if np.any(self.offset) else C

    def required_compliance(self) -> np.ndarray:
        """Compliance (..., n, n) of all poses, those of a batch that have none masked.

        Raises
        ------
        NoAnswerError
            When a single pose has none, with the advice of its status.
        """
        C = self.compliance
        if C is not None:
            return C
        if not self.batch_shape:
            whole = self.about_reference
            if whole.carried is None or Status.UNREACHABLE in self.status:
                self._require_answer()
            why = Status(self.status & (Status.FREE_MOTIONS | Status.ILL_CONDITIONED))
            raise NoAnswerError(
                f"no compliance matrix of {self.name!r} ({self.status}): {'; '.join(why.advice)}"
            )
        n, known = self.space.size, self.has_compliance
        found = np.ma.masked_all((*self.batch_shape, n, n))
        found.data[...] = np.nan  # what is read past the mask is no number
        if np.any(known):
            found[known] = self[known].compliance
        return found

    @property
    def rank(self) -> np.ndarray:
        """How many independent wrenches hold the platform (...); -1 where out of reach."""
        unreachable = self.about_reference.status_codes & int(Status.UNREACHABLE)
        return np.where(unreachable, -1, self.about_reference.rank)

    @property
    def status(self) -> Status:
        """Status of a single pose; of a batch, all flags that hold at any pose."""
        return self.about_reference.status

    @property
    def status_codes(self) -> np.ndarray:
        """Status of every pose (...) as uint16."""
        return self.about_reference.status_codes

    @property
    def answered(self) -> np.ndarray:
        """Where there is a stiffness matrix (...)."""
        return self.about_reference.answered

    @property
    def advice(self) -> tuple[str, ...]:
        """What to know about this answer, a sentence each."""
        reason = self._reason
        why = (f"{self.method.name}: {reason}",) if reason else ()
        return (*self.complaints, *why, *self.status.advice)

    @property
    def free_motions(self) -> tuple[FreeMotion, ...]:
        """Free motions of the platform, at a single pose."""
        if Status.UNREACHABLE in self.status:
            return ()
        # About the robot's own point: from far away every rotation resembles a translation.
        length = float(self.about_reference.length)
        motions = free_motions_in_words(self.about_reference.free_motions, self.origin, length)
        return tuple(
            FreeMotion(move_twist(motion.twist, self.offset), motion.screw) for motion in motions
        )

    @property
    def rigid_directions(self) -> np.ndarray:
        """Rigid wrenches about the reference point, rows (r, n), at a single pose."""
        return move_wrench(self.about_reference.rigid_directions, self.offset)

    @property
    def redundant_joints(self) -> tuple[str, ...]:
        """``leg/joint`` of the passive freedoms that add nothing to those before, at any pose."""
        redundant = self.about_reference.redundant
        lost = np.atleast_1d(redundant.any(axis=tuple(range(redundant.ndim - 1))))
        return tuple(
            name for name, is_lost in zip(self.passive_joint_names, lost, strict=True) if is_lost
        )

    @property
    def decision(self) -> RankDecision:
        """How the rank was decided, at a single pose."""
        return self.about_reference.decision

    @property
    def leg_stiffness(self) -> tuple[np.ndarray, ...]:
        """Stiffness of each leg (..., n, n) about the reference point; they add up to K.

        On a flexible platform, what each leg carries for a twist of the tool: not symmetric, as
        the legs share the bending of the platform.
        """
        self._require_answer()
        return tuple(move_stiffness(leg.K, self.offset) for leg in self.legs)

    def about(self, point: ArrayLike | None) -> RobotStiffness:
        """The same answer about another point of the platform (..., 3), in the world [m].

        The answer itself for None.
        """
        if point is None:
            return self
        return replace(self, reference_point=points_given(point, self.batch_shape))

    def __repr__(self) -> str:
        return in_short(self, "RobotStiffness")

    def __getitem__(self, index: Any) -> RobotStiffness:
        """The answer at one pose, or at some poses, of a batch."""
        return replace(
            self,
            pose=None if self.pose is None else self.pose[index],
            reference_point=self.reference_point[index],
            about_reference=self.about_reference[index],
            legs=tuple(leg[index] for leg in self.legs),
            serial_compliance=(
                None if self.serial_compliance is None else self.serial_compliance[index]
            ),
            origin=self.origin[index],
            joint_coordinates={leg: q[index] for leg, q in self.joint_coordinates.items()},
            leg_blocks=tuple(tuple(block[index] for block in own) for own in self.leg_blocks),
        )

    @property
    def offset(self) -> np.ndarray:
        """From the origin to the reference point, in the coordinates of the space (..., d) [m]."""
        v = self.reference_point - self.origin
        return v if self.space is Space.SPATIAL else v[..., :2]

    @property
    def _reason(self) -> str:
        """Why the form refused, where it did."""
        return self.about_reference.reason

    def _require_answer(self) -> None:
        if np.all(self.answered):
            return
        if self.complaints:
            raise NoAnswerError(f"no stiffness matrix of {self.name!r}: {'; '.join(self.advice)}")
        _ = self.about_reference.K


def in_short(result: RobotStiffness | CableStiffness, kind: str) -> str:
    """What is printed of a result: point, rank and status; how many matrices a batch has."""
    if result.batch_shape:
        answered = int(np.count_nonzero(result.answered))
        poses = int(np.prod(result.batch_shape))
        return f"<{kind} of {result.name!r}, {poses} poses, {answered} with a matrix>"
    point = ", ".join(f"{x:.5g}" for x in result.reference_point)
    return (
        f"<{kind} of {result.name!r} about ({point}) m, rank {int(result.rank)} of "
        f"{result.space.size}, status {result.status}>"
    )


def points_given(at: ArrayLike, batch_shape: tuple[int, ...]) -> np.ndarray:
    """A point of the platform that a user gave, at every pose (..., 3) [m]."""
    point = as_floats("point 'at'", at, "three numbers x y z [m]", "m")
    if point.shape[-1:] != (3,):
        raise InputError("point 'at'", got=at, expected="three numbers x y z [m]")
    shape = (*batch_shape, 3)
    try:
        return np.broadcast_to(point, shape)
    except ValueError:
        expected = f"a shape that fits {shape}"
        raise InputError("point 'at'", got=point.shape, expected=expected) from None


def given_wrenches(
    wrench: ArrayLike | None,
    space: Space,
    batch: tuple[int, ...] = (),
    subject: str = "wrench",
    hint: str | None = None,
) -> np.ndarray:
    """A wrench as a user gave it, or one for each pose (..., n) [N, N m].

    Raises InputError when the numbers are not finite, or do not fit the space and the batch.
    """
    expected = f"{space.size} numbers: {' '.join(space.wrench_order)} [N, N m]"
    if wrench is None:
        raise InputError(subject, expected=expected, hint=hint)
    F = as_floats(subject, wrench, expected, space.wrench_units)
    if F.shape in {(space.size,), (*batch, space.size)}:
        return np.broadcast_to(F, (*batch, space.size))
    if F.ndim > 1 and batch:
        expected += f", or as many wrenches as poses: {(*batch, space.size)}"
    raise InputError(subject, got=wrench, expected=expected, hint=None if F.size else hint)


def require_one_pose(subject: str, batch: tuple[int, ...], hint: str | None = None) -> None:
    """Raise for a batch of poses (``batch`` is its shape) of ``subject``.

    Examples
    --------
    >>> require_one_pose("a deflection", (2, 3))
    Traceback (most recent call last):
    ...
    robostiff.errors.InputError: pose of a deflection: got '6 poses', expected one pose
    """
    if not batch:
        return
    count = int(np.prod(batch))
    raise InputError(f"pose of {subject}", got=f"{count} poses", expected="one pose", hint=hint)
