"""The result of `stiffness`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.free_motion import FreeMotion, free_motions_in_words
from robostiff.analysis.questions import Question, StructuralAnalysis
from robostiff.elastostatics import Details, Form, RankDecision, Status, StiffnessOfPoses
from robostiff.elastostatics.result import definite_inverse
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.markup import InNotebooks
from robostiff.model import Snapshot
from robostiff.spatial import (
    Space,
    as_floats,
    check_order,
    move_compliance,
    move_stiffness,
    move_twist,
    move_wrench,
)
from robostiff.spatial.batch import empty_batch
from robostiff.spatial.rotation import matrix_of_rotation, rigid_transform

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from robostiff.analysis.compiled_answer import CompiledAnswer
    from robostiff.network import Network


@frozen(repr=False)
class Stiffness(StiffnessOfPoses, InNotebooks):
    """K_C of a machine about a point, in world axes, with rank and status, at one pose or many.

    Matrix, rank and status are those of the record of the machine where it has one, and compliance
    is the inverse of that matrix where no digits are lost. All else is worked out by the direct
    form at the poses of which it is asked; both must agree.

    Attributes
    ----------
    question : Question
        The machine, all poses of the batch, and the details at them.
    rows : (...) array of int
        Which of these poses it is about.
    point : (..., 3) array or None
        Point about which K is given, in the world [m]; None for the reference point of the machine.
    """

    question: Question
    rows: np.ndarray
    point: np.ndarray | None = None

    @classmethod
    def of(cls, question: Question, at: ArrayLike | None = None) -> Stiffness:
        """The stiffness at all poses of a question, about the reference point or a point [m].

        By the direct form where no record has answered.
        """
        found = cls(question, question.rows)
        if question.recorded is None:
            found.details()  # bad input is found now
        return found.about(at)

    @kept
    def details(self) -> Details:
        """What the direct form finds at these poses: legs, posture, and how ranks were decided.

        Raises
        ------
        DisagreementError
            When it is another answer than that of the record.
        """
        return self.question.details(self.rows)

    @cached_property
    def recorded(self) -> CompiledAnswer | None:
        """What the record has given at these poses; None where it was not asked."""
        whole = self.question.recorded
        if whole is None or self.rows is self.question.rows:
            return whole
        return whole[np.unravel_index(self.rows, self.question.rows.shape)]

    @property
    def name(self) -> str:
        """Of the machine."""
        return self.question.name

    @property
    def method(self) -> Form | StructuralAnalysis:
        """The form of K_C."""
        return self.question.method

    @property
    def space(self) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return self.question.space

    @cached_property
    def pose(self) -> np.ndarray | None:
        """x, y, z [m] and rotation vector [rad] of the platform (..., 6); None for a snapshot."""
        given = self.question.pose_at(self.rows)
        return self.details().pose if given is None else given

    @property
    def transform(self) -> RigidTransform:
        """Pose of the platform as a rigid transform, or as a batch of them.

        Raises
        ------
        NoAnswerError
            When it has no pose, as a snapshot.
        """
        if self.pose is None:
            raise NoAnswerError(f"no transform of {self.name!r}: it is placed, and has no pose")
        T = np.zeros((*self.pose.shape[:-1], 4, 4))
        T[..., :3, :3] = matrix_of_rotation(self.pose[..., 3:])
        T[..., :3, 3], T[..., 3, 3] = self.pose[..., :3], 1.0
        return rigid_transform(T)

    @property
    def reference_point(self) -> np.ndarray:
        """Point about which K is given, in the world (..., 3) [m]."""
        return self._own_point if self.point is None else self.point

    @cached_property
    def _own_point(self) -> np.ndarray:
        point = None if self.recorded is None else self.question.reference_points(self.rows)
        return self.details().reference_point if point is None else point

    @property
    def _found(self) -> Details | CompiledAnswer:
        return self.details() if self.recorded is None else self.recorded

    @cached_property
    def matrix(self) -> np.ndarray:
        """K (..., n, n) of all poses, unchecked: meaningful where they have a stiffness matrix."""
        if self.recorded is None:
            found = self.details()
            return found.at_reference if self.point is None else found.moved(self.offset)
        return self._moved(self.recorded.matrix, move_stiffness)

    def _moved(self, A: np.ndarray, move: Callable[..., np.ndarray]) -> np.ndarray:
        """K or C of the record (..., n, n) about the reference point."""
        if self.point is None:
            return A
        v = (self.point - self._own_point)[..., : self.space.translations]
        return move(A, v) if np.any(v) else A

    @property
    def rank(self) -> np.ndarray:
        """How many independent wrenches hold the platform (...); -1 where out of reach."""
        return self._found.rank

    @property
    def status_codes(self) -> np.ndarray:
        """Status of every pose (...) as uint16."""
        return self._found.status_codes

    @cached_property
    def inverted(self) -> tuple[np.ndarray, np.ndarray]:
        """K of the record inverted, about the reference point, and where no digits are lost (...).

        Elsewhere, and without a record, compliance is that of the direct form.
        """
        if self.recorded is None:
            shape, n = self.batch_shape, self.space.size
            return np.empty((*shape, n, n)), np.zeros(shape, dtype=bool)
        C, certain = definite_inverse(self.recorded.matrix)
        certain &= self.answered & (self.rank == self.space.size)
        return self._moved(C, move_compliance), certain

    @cached_property
    def has_compliance(self) -> np.ndarray:
        """Where every load meets a finite compliance (...), also where a direction is rigid."""
        known = self.inverted[1].copy()
        if not known.all():
            known[~known] = np.ravel(self.not_inverted.details().has_compliance)
        return known

    @cached_property
    def not_inverted(self) -> Stiffness:
        """The answer at those poses at which K of the record is not inverted, one after the other.

        The answer itself where there is no other pose.
        """
        known = self.inverted[1]
        return self[~known] if known.any() else self

    @cached_property
    def compliances(self) -> np.ndarray:
        """Compliance (..., n, n) of all poses [m/N, 1/N, rad/(N m)]; NaN where there is none.

        The inverse of K. Where a direction is rigid, and K does not exist, C is zero for its
        wrench: legs without elastic links have the C of their drives.
        """
        C, known = self.inverted
        if known.all():
            return C
        n, rest = self.space.size, self.not_inverted
        found = empty_batch(self.batch_shape, (n, n))
        found[...] = np.nan
        if known.any():
            found[known] = C[known]
        whole, offset = rest.details(), rest.offset
        has = whole.has_compliance
        if has.any():
            some = (whole if has.all() else whole[has]).inverse
            v = offset if has.all() else offset[has]
            some = move_compliance(some, v) if np.any(v) else some
            found[self.has_compliance & ~known] = np.reshape(some, (-1, n, n))
        return found

    @property
    def compliance(self) -> np.ndarray | None:
        """As `compliances`; None when some pose has none."""
        return self.compliances if np.all(self.has_compliance) else None

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
            if self.details().carried is None or Status.UNREACHABLE in self.status:
                self.check_answered()
            why = Status(self.status & (Status.FREE_MOTIONS | Status.ILL_CONDITIONED))
            raise NoAnswerError(
                f"no compliance matrix of {self.name!r} ({self.status}): {'; '.join(why.advice)}"
            )
        missing = np.broadcast_to(~self.has_compliance[..., None, None], self.compliances.shape)
        return np.ma.MaskedArray(self.compliances, missing)

    @cached_property
    def complaints(self) -> tuple[str, ...]:
        """What keeps a single pose from being reached or allowed, and postures not chosen."""
        return self.question.complaints(self.rows, self.status)

    @property
    def advice(self) -> tuple[str, ...]:
        """What to know about this answer, a sentence each."""
        reason = self.details().reason if self.recorded is None else ""
        why = (f"{self.method.name}: {reason}",) if reason else ()
        return (*self.complaints, *why, *self.status.advice)

    @property
    def free_motions(self) -> tuple[FreeMotion, ...]:
        """Free motions of the platform, at a single pose."""
        found = self.details()
        if not self.status & Status.FREE_MOTIONS or Status.UNREACHABLE in self.status:
            return ()
        # About the robot's own point: from far away every rotation resembles a translation.
        motions = free_motions_in_words(found.free_motions, found.origin, float(found.length))
        return tuple(replace(one, twist=move_twist(one.twist, self.offset)) for one in motions)

    @property
    def rigid_directions(self) -> np.ndarray:
        """Rigid wrenches about the reference point, rows (r, n), at a single pose."""
        return move_wrench(self.details().rigid_directions, self.offset)

    @property
    def redundant_joints(self) -> tuple[str, ...]:
        """``leg/joint`` of the passive freedoms that add nothing to those before, at any pose."""
        redundant, names = self.details().redundant, self.details().passive_joint_names
        lost = np.atleast_1d(redundant.any(axis=tuple(range(redundant.ndim - 1))))
        return tuple(name for name, is_lost in zip(names, lost, strict=True) if is_lost)

    @property
    def decision(self) -> RankDecision:
        """How the rank was decided, at a single pose."""
        return self.details().decision

    @property
    def length(self) -> np.ndarray:
        """Characteristic length (...) [m], by which rotations are compared with displacements."""
        return self.details().length

    @property
    def origin(self) -> np.ndarray:
        """Point about which the details are, in the world (..., 3) [m]."""
        return self.details().origin

    @property
    def joint_coordinates(self) -> Mapping[str, np.ndarray]:
        """The posture: coordinates of the joints of each leg (..., size) [m, rad], by its name."""
        return self.details().joint_coordinates

    @property
    def leg_stiffness(self) -> tuple[np.ndarray, ...]:
        """Stiffness of each leg (..., n, n) about the reference point; they add up to K.

        On a flexible platform, what each leg carries for a twist of the tool: not symmetric, as
        the legs share the bending of the platform.
        """
        self.check_answered()
        return tuple(move_stiffness(leg.K, self.offset) for leg in self.details().legs)

    def about(self, point: ArrayLike | None) -> Stiffness:
        """The same answer about another point of the platform (..., 3), in the world [m].

        The answer itself for None.
        """
        if point is None:
            return self
        return replace(self, point=points_given(point, self.batch_shape))

    def placed(self) -> Snapshot | Network:
        """The machine in the world at a single pose; a linkage as a network."""
        return self.question.placed(self.rows)

    def snapshot(self) -> Snapshot:
        """The robot in the world at a single pose."""
        if not self.question.has_legs:
            raise InputError(
                f"snapshot of {self.name!r}",
                got=Words("bodies in any arrangement"),
                expected="a robot with legs",
                hint="result.placed() is the network",
            )
        found: Any = self.placed()
        return found

    def __getitem__(self, index: Any) -> Stiffness:
        """The answer at one pose, or at some poses, of a batch."""
        point = None if self.point is None else self.point[index]
        return Stiffness(self.question, np.asarray(self.rows[index]), point)

    @property
    def offset(self) -> np.ndarray:
        """From `origin` to the reference point, in the coordinates of the space (..., d) [m]."""
        v = self.reference_point - self.origin
        return v[..., : self.space.translations]

    def check_answered(self) -> None:
        """Raise a NoAnswerError unless all poses have a matrix; what a single one complains of."""
        if self.answered.all():
            return
        if self.complaints:
            raise NoAnswerError(f"no stiffness matrix of {self.name!r}: {'; '.join(self.advice)}")
        self.details().check_answered()


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
    check_order(subject, wrench, space.wrench_order)
    F = as_floats(subject, wrench, expected, space.wrench_units)
    if F.shape in {(space.size,), (*batch, space.size)}:
        return np.broadcast_to(F, (*batch, space.size))
    if F.ndim > 1 and batch:
        expected += f", or as many wrenches as poses: {(*batch, space.size)}"
    raise InputError(subject, got=wrench, expected=expected, hint=None if F.size else hint)


def require_one_pose(subject: str, batch: tuple[int, ...], hint: str | None = None) -> None:
    """Raise for a batch of poses (``batch`` is its shape) of ``subject``."""
    if not batch:
        return
    count = int(np.prod(batch))
    raise InputError(
        f"pose of {subject}", got=Words(f"{count} poses"), expected="one pose", hint=hint
    )
