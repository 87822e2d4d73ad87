"""How a compiled robot and the wrench basis form differ at the same poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.analysis.compiled_stiffness import CompiledStiffness
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.elastostatics import Status
from tests.generators.planted_poses import PoseSpace

_FREE = 1e-6
# Of a direction in which nothing is stiff: the form that recomputes poses leaves rounding there.
_ROUNDED, _IDLE = 1e-9, 1e-3


@dataclass(frozen=True)
class Agreement:
    """Differences at some poses.

    Attributes
    ----------
    poses, reached, guarded : int
        Numbers of poses.
    status, rank : (m,) arrays
        Rows where they differ.
    K : (N,) array
        Largest |dK_ij| / sqrt(K_ii K_jj); 0 where there is no K.
    """

    poses: int
    reached: int
    guarded: int
    status: np.ndarray
    rank: np.ndarray
    K: np.ndarray


def agreement(compiled: CompiledStiffness, space: PoseSpace, rows: np.ndarray) -> Agreement:
    """Compare at rows of free coordinates."""
    pose = space.pose(rows)
    answer = compiled.evaluate(pose)
    result = direct_stiffness(space.robot, pose)
    answered = (result.status_codes & int(Status.UNREACHABLE | Status.RIGID_DIRECTION)) == 0
    own = answer.values["K"]
    if not np.array_equal(np.isfinite(own).all((-1, -2)), answered):
        raise AssertionError("finite K where there is none, or none where there is")
    K = result.details().matrix[answered]
    size = np.sqrt(np.einsum("nii->ni", K))
    # What rounding leaves of a zero on the diagonal is no measure; the robots are about a metre.
    largest = size.max(axis=-1, keepdims=True, initial=0.0)
    size = np.where(size < _ROUNDED * largest, _IDLE * largest, np.maximum(size, _FREE * largest))
    allowed = size[:, :, None] * size[:, None, :]
    difference = np.zeros(len(rows))
    apart = np.abs(own[answered] - K) / np.where(allowed > 0, allowed, 1.0)
    difference[answered] = apart.max((-1, -2), initial=0.0)
    return Agreement(
        poses=len(rows),
        reached=int(np.count_nonzero(result.status_codes & int(Status.UNREACHABLE) == 0)),
        guarded=int(np.count_nonzero(answer.guarded)),
        status=np.flatnonzero(answer.status_codes != result.status_codes),
        rank=np.flatnonzero(answer.rank != result.rank),
        K=difference,
    )
