"""Stiffness of a cable robot at a pose, with the geometric stiffness of its tensions; its loads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.cable_tensions import CableAnswer, cable_tensions
from robostiff.analysis.free_motion import FreeMotion, free_motions_in_words
from robostiff.analysis.questions import Question, question_of
from robostiff.analysis.result import given_points
from robostiff.cables import (
    TensionRule,
    axial_stiffness,
    elastic_stiffness,
    force_stiffness,
    geometric_stiffness,
    structure_matrix,
    weight_stiffness,
    weight_wrench,
)
from robostiff.cables.stiffness_matrix import Stability, stability
from robostiff.elastostatics import DEFAULT_TOLERANCE, Form, Status, StiffnessOfPoses, Tolerance
from robostiff.elastostatics.result import scaled_inverse
from robostiff.elastostatics.tolerance import scaling
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen, replace
from robostiff.kinematics import Near, Pose
from robostiff.markup import InNotebooks
from robostiff.model.cable import CableRobot
from robostiff.spatial import Space, move_wrench

_ROUNDING = 1e-12  # of squares, with room


@frozen(repr=False)
class CableStiffness(StiffnessOfPoses, InNotebooks, CableAnswer):
    """Stiffness of a cable robot about a point, in world axes, with tensions and status.

    Attributes
    ----------
    name, cable_names, pose, status_codes, rule, limits
        As of `CableTensions`.
    placed : PlacedCables
        Where the cables run, and the point about which the matrices are given.
    tensions : (..., m) array
        Of every cable [N]; zero where there is no answer.
    axial : (..., m) array
        Stiffness of every cable with its winch [N/m]; zero for a slack cable.
    wrench : (..., n) array
        Applied to the platform beside its weight, about the reference point [N, N m].
    load_point : (..., 3) array
        Point of the platform at which the force of the wrench acts, in the world [m].
    held_rank, rank : (...) arrays of int
        Rank of the structure matrix and of K; -1 where there is no answer.
    tolerance : Tolerance
    """

    tensions: np.ndarray
    axial: np.ndarray
    load_point: np.ndarray
    held_rank: np.ndarray
    rank: np.ndarray
    tolerance: Tolerance

    @property
    def space(self) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return self.placed.space

    @property
    def characteristic_length(self) -> np.ndarray:
        """Of exit points and attachments (...) [m]."""
        return self.placed.characteristic_length

    @cached_property
    def matrix(self) -> np.ndarray:
        """K (..., n, n): elastic, geometric, of weight and wrench; meaningful where `answered`.

        The second derivative of the potential energy; symmetric.
        """
        return elastic_stiffness(self.placed, self.axial) + steady_stiffness(self)

    @property
    def elastic(self) -> np.ndarray:
        """The part of stretching cables, A^T diag(k) A (..., n, n)."""
        self.check_answered()
        return elastic_stiffness(self.placed, self.axial)

    @property
    def geometric(self) -> np.ndarray:
        """The part of turning cables under tension (..., n, n)."""
        self.check_answered()
        return geometric_stiffness(self.placed, self.tensions)

    @property
    def of_forces(self) -> np.ndarray:
        """The part of weight and wrench, forces that keep their direction (..., n, n).

        Those that act at the reference point have none.
        """
        self.check_answered()
        return _of_forces(self)

    @property
    def taut_stiffness(self) -> np.ndarray:
        """K without the cables that have no tension (..., n, n)."""
        taut = np.where(self.tensions > 0, self.axial, 0.0)
        return elastic_stiffness(self.placed, taut) + self.geometric + self.of_forces

    @property
    def compliance(self) -> np.ndarray | None:
        """Inverse of K (..., n, n) [m/N, 1/N, rad/(N m)]; None where K is singular or missing."""
        return self._inverses if np.all(self._is_regular) else None

    @property
    def _is_regular(self) -> np.ndarray:
        return self.answered & (self.rank == self.space.size)

    @cached_property
    def _inverses(self) -> np.ndarray:
        """Inverse of K at all poses (..., n, n); NaN where it is missing or singular."""
        C, rows = np.full_like(self.matrix, np.nan), self._is_regular
        C[rows] = scaled_inverse(self.matrix[rows], self.characteristic_length[rows])
        return C

    @property
    def compliances(self) -> np.ndarray:
        """Compliance of all poses (..., n, n); NaN where K is missing, singular or unstable."""
        unstable = (self.status_codes & int(Status.UNSTABLE)) != 0
        return np.where(unstable[..., None, None], np.nan, self._inverses)

    def required_compliance(self) -> np.ndarray:
        """Compliance of all poses (..., n, n), those of a batch that have none masked.

        Raises
        ------
        NoAnswerError
            When a single pose has none, with the advice of its status.
        """
        C = self.compliance
        if C is None and self.batch_shape:
            missing = np.broadcast_to(~self._is_regular[..., None, None], self._inverses.shape)
            return np.ma.MaskedArray(self._inverses, missing)
        if C is None:
            self.check_answered()
            reason = Status.FREE_MOTIONS.advice[0]
            raise NoAnswerError(f"no compliance matrix of {self.name!r}: {reason}")
        return C

    @property
    def missing_wrench(self) -> np.ndarray:
        """Wrench (..., n) that cables, weight and the applied wrench do not balance [N, N m]."""
        self.check_answered()
        pulled = np.einsum("...ij,...j->...i", structure_matrix(self.placed), self.tensions)
        return -(pulled + weight_wrench(self.placed) + self.wrench)

    @property
    def free_motions(self) -> tuple[FreeMotion, ...]:
        """Free motions of the platform, at a single pose."""
        return self._in_words("free")

    @property
    def unstable_motions(self) -> tuple[FreeMotion, ...]:
        """Unstable motions of the platform, at a single pose."""
        return self._in_words("unstable")

    def about(self, point: ArrayLike | None) -> CableStiffness:
        """The same answer about another point of the platform (..., 3), in the world [m].

        The answer itself for None.
        """
        if point is None:
            return self
        placed = self.placed.about(given_points(point, self.batch_shape))
        v = placed.reference_point - self.reference_point
        wrench = move_wrench(self.wrench, v[..., : self.space.translations])
        return replace(self, placed=placed, wrench=wrench)

    def _in_words(self, kind: str) -> tuple[FreeMotion, ...]:
        self.check_is_single(f"{kind} motions")
        if not self.answered:
            return ()
        length = self.placed.characteristic_length
        found = stability_of(self[None])
        basis = found.motions[0][:, getattr(found, kind)[0]].T / scaling(length, self.space)
        return free_motions_in_words(basis, self.reference_point, float(length))


def steady_stiffness(result: CableStiffness) -> np.ndarray:
    """The part that is not elastic, at poses without an answer too (..., n, n)."""
    return geometric_stiffness(result.placed, result.tensions) + _of_forces(result)


def _of_forces(result: CableStiffness) -> np.ndarray:
    K, d = weight_stiffness(result.placed), result.space.translations
    if np.any(result.wrench[..., :d]):
        force = np.zeros((*result.wrench.shape[:-1], 3))
        force[..., :d] = result.wrench[..., :d]
        K = K + force_stiffness(force, result.load_point - result.reference_point, result.space)
    return K


def stability_of(result: CableStiffness) -> Stability:
    """Rank and stability at N poses with an answer."""
    s = scaling(result.placed.characteristic_length, result.space)
    scale = s[:, :, None] * s[:, None, :]
    tension = steady_stiffness(result)
    # What the tensions could give, were none to cancel another.
    size = np.sum(result.tensions / result.placed.lengths, axis=-1)
    size = np.maximum(size, np.abs(tension / scale).max(axis=(-1, -2)))
    W = structure_matrix(result.placed) / s[:, :, None] * (result.axial > 0)[:, None, :]
    return stability(W, result.K / scale, size, result.tolerance)


def cable_stiffness(
    robot: CableRobot,
    pose: Pose = None,
    wrench: ArrayLike | None = None,
    *,
    tensions: TensionRule | None = None,
    at: ArrayLike | None = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> CableStiffness:
    """Stiffness K of a cable robot at a pose or a batch of poses, with its geometric part.

    The winches are locked, with tensions that balance the weight and a wrench, whose force keeps
    its direction and acts at the robot's reference point. K is the second derivative of the
    potential energy by displacement and rotation vector, in world axes: symmetric, and neither
    positive definite nor of full rank for certain.

    Parameters
    ----------
    robot : CableRobot
    pose : RigidTransform, array or None
        As for `stiffness`.
    wrench : (n,) or (..., n) array, optional
        On the platform beside its weight, about the reference point [N, N m].
    tensions : TensionRule, optional
        As for `cable_tensions`.
    at : (3,) or (..., 3) array, optional
        Point of the platform about which K is given, in world coordinates [m].
    tolerance : Tolerance

    Raises
    ------
    InputError
        When an argument does not fit.

    Examples
    --------
    >>> import robostiff as rs
    >>> result = rs.cable_stiffness(rs.load("cable-4-planar"))
    >>> result
    <CableStiffness of 'cable-4-planar' about (1, 0.75, 0) m, rank 3 of 3, status ok>
    """
    chosen = cable_tensions(robot, pose, wrench, tensions=tensions)
    lengths = chosen.placed.lengths
    axial = axial_stiffness(robot, lengths, chosen.values)
    lost = chosen.feasible & np.isnan(axial).any(axis=-1)
    codes = np.asarray(chosen.status_codes | lost * np.uint16(Status.INFEASIBLE))
    chosen = replace(chosen, status_codes=codes)
    result = CableStiffness(
        **{own.name: getattr(chosen, own.name) for own in fields(CableAnswer)},
        tensions=np.where(lost[..., None], 0.0, chosen.values),
        axial=np.where(chosen.feasible[..., None], axial, 0.0),
        load_point=chosen.placed.reference_point,
        held_rank=np.full(chosen.batch_shape, -1),
        rank=np.full(chosen.batch_shape, -1),
        tolerance=tolerance,
    )
    return with_status(result).about(at)


@question_of.register
def _(machine: CableRobot, pose: Any, method: Form, near: Near, tolerance: Tolerance) -> Question:
    del pose, method, near, tolerance
    raise InputError(
        "robot",
        got=Words(f"cable robot {machine.name!r}"),
        expected="a robot without cables: these may become slack, and need not stay near",
        hint="write cable_stiffness(robot, pose), cable_response(robot, pose, wrench=...), "
        "or 'robostiff cables'",
    )


def with_status(result: CableStiffness) -> CableStiffness:
    """The same answer with rank and status of every pose."""
    n, batch, tolerance = result.space.size, result.batch_shape, result.tolerance
    status = result.status_codes.copy()
    held_rank, rank = np.full(batch, -1), np.full(batch, -1)
    # Poses that are held in all directions, with room to all decisions: most of them.
    plain, s = np.zeros(batch, dtype=bool), scaling(result.characteristic_length, result.space)
    W = structure_matrix(result.placed) / s[..., :, None] * (result.axial > 0)[..., None, :]
    if W.shape[-1] >= n:
        squares = np.linalg.eigvalsh(W @ np.swapaxes(W, -1, -2))[..., 0]
        values = np.linalg.eigvalsh(result.matrix / (s[..., :, None] * s[..., None, :]))
        plain = result.answered & (values[..., 0] > tolerance.near_rigidity * values[..., -1])
        plain &= squares > max(tolerance.near_independence**2, _ROUNDING * W.shape[-1])
    held_rank[plain], rank[plain] = n, n
    rest = result.answered & ~plain
    if np.any(rest):
        found = stability_of(result[rest])
        held_rank[rest], rank[rest] = found.held, found.rank
        status[rest] |= (found.rank < n) * np.uint16(Status.FREE_MOTIONS)
        status[rest] |= found.unstable.any(axis=-1) * np.uint16(Status.UNSTABLE)
        status[rest] |= found.doubtful * np.uint16(Status.ILL_CONDITIONED)
    loose = np.any((result.tensions <= 0) & (result.axial > 0), axis=-1)
    status = np.where(loose & result.answered, status | np.uint16(Status.UNTENSIONED), status)
    found = replace(result, status_codes=status, held_rank=held_rank, rank=rank)
    vars(found)["matrix"] = result.matrix  # which is computed once
    return found


@frozen
class SlackEvent:
    """The first cable that becomes slack while the load grows.

    Attributes
    ----------
    factor : float
        Part of the load at which it does; above 1 beyond the load.
    cable : str
    """

    factor: float
    cable: str


@frozen(repr=False)
class CableResponse(InNotebooks):
    """A cable robot under a load on top of its weight.

    Attributes
    ----------
    load : (n,) array
        About the reference point, which it follows; it keeps its direction [N, N m].
    before : CableStiffness
        Without the load.
    status : Status
    carried : float
        Part of the load up to which there is a stable rest; 1 for all of it.
    displacement : (n,) array or None
        Of the reference point [m], and rotation vector [rad]: not small for certain. None where the
        load is not carried.
    after : CableStiffness or None
        Tensions and stiffness under the load, slack cables left out.
    first_slack : SlackEvent or None
        None where no cable becomes slack up to a hundred times the load, or up to where the
        platform moves away.
    beyond_limits : tuple of str
        Cables whose tension is, a sentence each.
    """

    load: np.ndarray
    before: CableStiffness
    status: Status
    carried: float
    displacement: np.ndarray | None = None
    after: CableStiffness | None = None
    first_slack: SlackEvent | None = None
    beyond_limits: tuple[str, ...] = ()

    @property
    def has_answer(self) -> bool:
        """Whether the load is carried."""
        return self.after is not None

    @property
    def tensions(self) -> np.ndarray:
        """Tensions under the load (m,) [N]; zero for slack cables.

        Raises
        ------
        NoAnswerError
            When the load is not carried.
        """
        return self._answer().tensions

    @property
    def slack(self) -> tuple[str, ...]:
        """Cables that are slack under the load."""
        after = self._answer()
        return tuple(
            name for name, axial in zip(after.cable_names, after.axial, strict=True) if axial == 0
        )

    @property
    def advice(self) -> tuple[str, ...]:
        """Advice about this result, a sentence each."""
        lack = self.before.advice[:1] if Status.INFEASIBLE in self.before.status else ()
        return (*self.beyond_limits, *lack, *self.status.advice)

    def __repr__(self) -> str:
        slack = f"slack {', '.join(self.slack) or 'none'}" if self.has_answer else "no rest"
        return f"<CableResponse of {self.before.name!r}: {slack}, status {self.status}>"

    def _answer(self) -> CableStiffness:
        if self.after is None:
            advice = " ".join(f"{line}." for line in self.advice)
            raise NoAnswerError(
                f"{self.before.name!r} does not carry the load ({self.status}): {advice}"
            )
        return self.after


def status_of_cables(robot: CableRobot, tensions: np.ndarray) -> Status:
    """What is to be said of tensions under a load (m,) [N]; those of slack cables are zero."""
    status = Status.OK if np.all(tensions > 0) else Status.SLACK
    return status | Status.BEYOND_LIMITS if any(beyond_limits(robot, tensions)) else status


def beyond_limits(robot: CableRobot, tensions: np.ndarray) -> Iterator[str]:
    """The taut cables whose tension (m,) [N] is beyond its limits, a sentence each."""
    least, greatest = robot.tension_limits
    for i in np.flatnonzero(are_beyond_limits(robot, np.where(tensions > 0, tensions, np.nan))):
        yield (
            f"the tension of {robot.cables[i].name!r} is {tensions[i]:.5g} N, "
            f"outside its limits {least[i]:.5g} to {greatest[i]:.5g} N"
        )


def are_beyond_limits(robot: CableRobot, tensions: np.ndarray) -> np.ndarray:
    """Which of the tensions (..., m) are beyond their limits; NaN are not."""
    least, greatest = robot.tension_limits
    return (tensions < least - 1e-9) | (tensions > greatest * (1 + 1e-9))
