"""Tensions of a cable robot at a pose: chosen within limits, balancing weight and wrench."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.result import given_wrenches
from robostiff.cables import (
    GivenTensions,
    NearestTensions,
    PlacedCables,
    TensionProblem,
    TensionRule,
    place_cables,
    structure_matrix,
    weight_wrench,
)
from robostiff.elastostatics import Status
from robostiff.elastostatics.status import StatusOfPoses
from robostiff.elastostatics.tolerance import scaling
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen, replace
from robostiff.kinematics import Pose
from robostiff.kinematics.pose import requested_pose
from robostiff.markup import InNotebooks
from robostiff.model.cable import CableRobot

_NO_LENGTH = 1e-9  # of the characteristic length
_WITHOUT_TENSIONS = int(Status.INFEASIBLE | Status.UNREACHABLE | Status.FORM_DOES_NOT_HOLD)


@frozen(repr=False)
class CableAnswer(StatusOfPoses):
    """What results of cable robots have in common, at a pose or a batch of poses."""

    name: str
    cable_names: tuple[str, ...]
    pose: np.ndarray
    placed: PlacedCables
    wrench: np.ndarray
    status_codes: np.ndarray
    rule: str
    limits: tuple[np.ndarray, np.ndarray]

    @property
    def reference_point(self) -> np.ndarray:
        """Point of the platform about which wrench and matrices are given (..., 3) [m]."""
        return self.placed.reference_point

    @property
    def advice(self) -> tuple[str, ...]:
        """Advice about this result, a sentence each; of a pose alone what tensions lack."""
        if self.batch_shape or Status.INFEASIBLE not in self.status:
            return self.status.advice
        excess = _problem(self.placed, self.wrench, self.limits).excess(0)
        lack = f"tensions that balance weight and wrench are {excess:.4g} N or more beyond limits"
        if not excess:
            lack = "under its tension a winch deflects by more than the length of its cable"
        if np.isinf(excess):
            lack = "weight and wrench have a part that no tensions balance, whatever their limits"
        return lack, *self.status.advice

    def __getitem__(self, index: Any) -> Self:
        """The answer at one pose, or at some poses, of a batch."""
        every = {own.name: getattr(self, own.name) for own in fields(self)}
        arrays = {n: np.asarray(v[index]) for n, v in every.items() if isinstance(v, np.ndarray)}
        return replace(self, placed=self.placed[index], **arrays)


@frozen(repr=False)
class CableTensions(InNotebooks, CableAnswer):
    """Tensions of the cables at a pose or a batch of poses.

    Attributes
    ----------
    name : str
        Of the robot.
    cable_names : tuple of str
    pose : (..., 6) array
        x, y, z [m] and rotation vector [rad] of the platform.
    placed : PlacedCables
        Where the cables run.
    wrench : (..., n) array
        Applied to the platform beside its weight, about the reference point [N, N m].
    values : (..., m) array
        Tensions [N]; zero where there is no answer.
    status_codes : (...) array of uint16
        `Status` of every pose.
    rule : str
        How they were chosen.
    limits : tuple of (m,) arrays
        Least and greatest tensions [N].
    """

    values: np.ndarray

    @property
    def tensions(self) -> np.ndarray:
        """Tensions (..., m) [N].

        Raises
        ------
        NoAnswerError
            When there are none at some pose; `feasible` marks the poses with tensions.
        """
        if not np.all(self.feasible):
            advice = " ".join(f"{line}." for line in self.advice)
            count = np.count_nonzero(~self.feasible)
            where = f"at {count} of {self.feasible.size} poses" if self.batch_shape else "here"
            raise NoAnswerError(f"no tensions of {self.name!r} {where}: {advice}")
        return self.values

    @property
    def feasible(self) -> np.ndarray:
        """Where there are tensions (...)."""
        return (self.status_codes & _WITHOUT_TENSIONS) == 0

    def __repr__(self) -> str:
        if self.batch_shape:
            count = int(np.count_nonzero(self.feasible))
            poses = self.feasible.size
            return f"<CableTensions of {self.name!r}, {poses} poses, {count} with tensions>"
        values = ", ".join(f"{value:.5g}" for value in self.values) if self.feasible else "none"
        return f"<CableTensions of {self.name!r}: {values} N, status {self.status}>"


def cable_tensions(
    robot: CableRobot,
    pose: Pose = None,
    wrench: ArrayLike | None = None,
    *,
    tensions: TensionRule | None = None,
) -> CableTensions:
    """Tensions t of a cable robot that balance its weight and a wrench, A^T t + F = 0.

    Parameters
    ----------
    robot : CableRobot
    pose : RigidTransform, array or None
        Platform pose, or a batch of poses, as for `stiffness`; None for home.
    wrench : (n,) or (..., n) array, optional
        On the platform beside its weight, about the reference point [N, N m].
    tensions : TensionRule, optional
        ``NearestTensions(level)``, ``ClosedFormTensions(level)`` or ``GivenTensions(values)``.
        When left out, those that the robot gives, else the nearest to the robot's level.

    Raises
    ------
    InputError
        When robot, pose, wrench or rule do not fit.

    Examples
    --------
    >>> import robostiff as rs
    >>> answer = rs.cable_tensions(rs.load("cable-8"))
    >>> str(answer.status), bool((answer.tensions >= 50).all())
    ('ok', True)
    >>> str(rs.cable_tensions(rs.load("cable-8"), wrench=[0, 0, 5000, 0, 0, 0]).status)
    'infeasible'
    """
    rule = tensions
    if rule is None:
        given = robot.given_tensions
        rule = NearestTensions() if given is None else GivenTensions(given)
    elif isinstance(rule, type) or not isinstance(rule, TensionRule):
        name = rule.__name__ if isinstance(rule, type) else "NearestTensions"
        hint = f"write tensions={name}(...)"
        if isinstance(rule, list | tuple | np.ndarray):
            hint = "write tensions=GivenTensions([...])"
        raise InputError("tensions", got=rule, expected="a rule that chooses them", hint=hint)
    level = getattr(rule, "level", None)
    if level is None:
        level = robot.tension_level
    elif isinstance(level, bool) or not isinstance(level, int | float) or not 0 <= level <= 1:
        raise InputError("level of the tensions", got=level, expected="0 to 1")
    unbounded = [c.name for c in robot.cables if not np.isfinite(c.greatest_tension)]
    if level > 0 and unbounded:
        raise InputError(
            "level of the tensions",
            got=Words(f"{level:g}, and no greatest tension of {unbounded[0]!r}"),
            expected="0 for this robot",
            hint=f"write tensions={type(rule).__name__}(0), or give every cable a greatest tension",
        )
    # A pose is read the same way for robots of legs and of cables.
    request = requested_pose(cast(Any, robot), pose)
    batch, n, m = request.batch, robot.space.size, len(robot.cables)
    pose = request.coordinates.reshape(*batch, 6)
    placed = place_cables(robot, request.R.reshape(*batch, 3, 3), pose[..., :3])
    F = given_wrenches(np.zeros(n) if wrench is None else wrench, robot.space, batch)
    problem = _problem(placed, F, robot.tension_limits, level)
    values, status = rule.choose(problem)
    shortest = _NO_LENGTH * placed.characteristic_length[..., None]
    no_length = (placed.lengths <= shortest).any(axis=-1).reshape(-1)
    status = np.where(no_length, np.uint16(Status.UNREACHABLE), status)
    feasible = (status & _WITHOUT_TENSIONS) == 0
    status = status | (feasible & ~problem.within(values)) * np.uint16(Status.BEYOND_LIMITS)
    return CableTensions(
        name=robot.name,
        cable_names=tuple(robot.cable_names),
        pose=pose,
        placed=placed,
        wrench=F,
        values=np.where(feasible[:, None], values, 0.0).reshape(*batch, m),
        status_codes=np.asarray(status, dtype=np.uint16).reshape(batch),
        rule=rule.name,
        limits=robot.tension_limits,
    )


def _problem(
    placed: PlacedCables,
    wrench: np.ndarray,
    limits: tuple[np.ndarray, np.ndarray],
    level: float = 0.0,
) -> TensionProblem:
    """Which tensions balance weight and wrench; moments are over the characteristic length."""
    s = scaling(placed.characteristic_length, placed.space)
    W, F = structure_matrix(placed) / s[..., :, None], (wrench + weight_wrench(placed)) / s
    W, F = W.reshape(-1, *W.shape[-2:]), F.reshape(-1, F.shape[-1])
    return TensionProblem(W, F, *limits, level)
