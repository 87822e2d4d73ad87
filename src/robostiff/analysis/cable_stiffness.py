"""Stiffness of a cable robot at a pose, with the geometric stiffness of its tensions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.cable_result import CableStiffness, stability_of
from robostiff.analysis.cable_tensions import cable_tensions
from robostiff.cables import CableStatus, TensionRule, axial_stiffness
from robostiff.elastostatics import Tolerance
from robostiff.errors import InputError
from robostiff.kinematics import Pose
from robostiff.model.cable import CableRobot
from robostiff.spatial import as_floats

_DEFAULT_TOLERANCE = Tolerance()


def cable_stiffness(
    robot: CableRobot,
    pose: Pose = None,
    wrench: ArrayLike | None = None,
    *,
    tensions: TensionRule | None = None,
    at: ArrayLike | None = None,
    tolerance: Tolerance = _DEFAULT_TOLERANCE,
) -> CableStiffness:
    """Stiffness K of a cable robot at a pose or a batch of poses: elastic, geometric, of its weight.

    The winches are locked, with tensions that balance the weight and a wrench, which keeps its
    direction. K is the second derivative of the potential energy of cables and weight by the
    displacement of the reference point and the rotation vector, in world axes: symmetric, and
    neither positive definite nor of full rank for certain.

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

    Returns
    -------
    CableStiffness

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
    result = CableStiffness(
        name=robot.name,
        cable_names=chosen.cable_names,
        pose=chosen.pose,
        placed=chosen.placed,
        tensions=chosen.values,
        axial=np.where(chosen.feasible[..., None], axial, 0.0),
        wrench=chosen.wrench,
        status_codes=chosen.status_codes,
        held_rank=np.full(chosen.batch_shape, -1),
        rank=np.full(chosen.batch_shape, -1),
        rule=chosen.rule,
        tolerance=tolerance,
    )
    result = judged(result)
    if at is None:
        return result
    point = as_floats("point 'at'", at, "three numbers x y z [m]")
    if point.shape[-1:] != (3,):
        raise InputError("point 'at'", got=at, expected="three numbers x y z [m]")
    try:
        point = np.broadcast_to(point, result.reference_point.shape)
    except ValueError:
        expected = f"a shape that fits {result.reference_point.shape}"
        raise InputError("point 'at'", got=point.shape, expected=expected) from None
    return result.about(point)


def judged(result: CableStiffness) -> CableStiffness:
    """The same answer with rank and status of every pose."""
    from dataclasses import replace

    batch, poses = result.batch_shape, result.status_codes.size
    status = result.status_codes.reshape(-1).copy()
    ranks = np.full((2, poses), -1)
    flat = result if batch else None
    for i, index in enumerate(np.ndindex(batch)):
        one = result[index] if flat is not None else result
        if not one.answered:
            continue
        found = stability_of(one)
        ranks[:, i] = found.held, found.rank
        if found.rank < result.space.size:
            status[i] |= CableStatus.FREE_MOTIONS
        if found.unstable.shape[-1]:
            status[i] |= CableStatus.UNSTABLE
        if found.doubtful:
            status[i] |= CableStatus.ILL_CONDITIONED
        if np.any((one.tensions <= 0) & (one.axial > 0)):
            status[i] |= CableStatus.UNTENSIONED
    return replace(
        result,
        status_codes=status.reshape(batch),
        held_rank=ranks[0].reshape(batch),
        rank=ranks[1].reshape(batch),
    )
