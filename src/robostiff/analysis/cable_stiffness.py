"""Stiffness of a cable robot at a pose, with the geometric stiffness of its tensions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.cable_result import CableStiffness, stability_of, steady_stiffness
from robostiff.analysis.cable_tensions import cable_tensions
from robostiff.analysis.result import about_point
from robostiff.cables import (
    CableStatus,
    TensionRule,
    axial_stiffness,
    elastic_stiffness,
    structure_matrix,
)
from robostiff.elastostatics import DEFAULT_TOLERANCE, Tolerance
from robostiff.elastostatics.tolerance import scaling
from robostiff.errors import InputError
from robostiff.kinematics import Pose
from robostiff.model.cable import CableRobot


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
        load_point=chosen.placed.reference_point,
        status_codes=chosen.status_codes,
        held_rank=np.full(chosen.batch_shape, -1),
        rank=np.full(chosen.batch_shape, -1),
        rule=chosen.rule,
        tolerance=tolerance,
    )
    if not isinstance(tolerance, Tolerance):
        raise InputError("tolerance", got=tolerance, expected="a Tolerance")
    return about_point(judged(result), at)


def judged(result: CableStiffness) -> CableStiffness:
    """The same answer with rank and status of every pose."""
    n, batch = result.space.size, result.batch_shape
    status = result.status_codes.copy()
    held_rank, rank = np.full(batch, -1), np.full(batch, -1)
    plain = _plain(result)
    held_rank[plain], rank[plain] = n, n
    for index in np.ndindex(batch):
        if plain[index]:
            continue
        one = result[index]
        if not one.answered:
            continue
        found = stability_of(one)
        held_rank[index], rank[index] = found.held, found.rank
        if found.rank < n:
            status[index] |= CableStatus.FREE_MOTIONS
        if found.unstable.shape[-1]:
            status[index] |= CableStatus.UNSTABLE
        if found.doubtful:
            status[index] |= CableStatus.ILL_CONDITIONED
    loose = np.any((result.tensions <= 0) & (result.axial > 0), axis=-1)
    status = np.where(loose & result.answered, status | np.uint16(CableStatus.UNTENSIONED), status)
    return replace(result, status_codes=status, held_rank=held_rank, rank=rank)


def _plain(result: CableStiffness) -> np.ndarray:
    """Poses (...) that are held in all directions, with room to all decisions: most of them."""
    tolerance = result.tolerance
    s = scaling(result.placed.characteristic_length, result.space)
    W = structure_matrix(result.placed) / s[..., :, None] * (result.axial > 0)[..., None, :]
    if W.shape[-1] < W.shape[-2]:
        return np.zeros(result.batch_shape, dtype=bool)
    geometry = np.linalg.svd(W, compute_uv=False)[..., -1] > tolerance.near_independence
    K = elastic_stiffness(result.placed, result.axial) + steady_stiffness(result)
    values = np.linalg.eigvalsh(K / (s[..., :, None] * s[..., None, :]))
    return result.answered & geometry & (values[..., 0] > tolerance.near_rigidity * values[..., -1])
