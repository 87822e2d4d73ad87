"""All stiffness indices of a robot at a pose."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.indices.metric import (
    ConditionNumber,
    Eigenstiffness,
    VirtualWork,
    condition_number,
    eigenstiffness,
    index_length,
    virtual_work,
)
from robostiff.analysis.indices.principal import (
    Anisotropy,
    CollinearStiffness,
    DirectionalStiffness,
    PrincipalStiffnesses,
    WorstDeflections,
    anisotropy,
    collinear_stiffness,
    directional_stiffness,
    principal_stiffness,
    worst_deflection,
)
from robostiff.analysis.indices.screws import (
    Centre,
    Eigenscrews,
    centre_of_compliance,
    centre_of_stiffness,
    eigenscrews,
)
from robostiff.analysis.indices.stiffness_parts import stiffness_parts
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.result import Stiffness
from robostiff.elastostatics import Status
from robostiff.elastostatics.status import StatusOfPoses
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose
from robostiff.linkage import DriveValues, Linkage
from robostiff.markup import InNotebooks
from robostiff.model import Robot, Snapshot
from robostiff.network import Network


@dataclass(frozen=True)
class StiffnessIndices(InNotebooks):
    """The stiffness indices of a single pose; each attribute has a text `about` its definition.

    Attributes
    ----------
    result : Stiffness
        What they are computed from.
    length : float
        The characteristic length [m] of those that need one.
    along_axes : tuple of DirectionalStiffness
        Along the world axes.
    principal : PrincipalStiffnesses
    collinear : CollinearStiffness
    worst_deflection : WorstDeflections
    anisotropy : Anisotropy
    eigenscrews : Eigenscrews
    centre_of_stiffness, centre_of_compliance : Centre
    eigenstiffness : Eigenstiffness
    condition : ConditionNumber
    virtual_work : VirtualWork
    """

    result: Stiffness
    length: float
    along_axes: tuple[DirectionalStiffness, ...]
    principal: PrincipalStiffnesses
    collinear: CollinearStiffness
    worst_deflection: WorstDeflections
    anisotropy: Anisotropy
    eigenscrews: Eigenscrews
    centre_of_stiffness: Centre
    centre_of_compliance: Centre
    eigenstiffness: Eigenstiffness
    condition: ConditionNumber
    virtual_work: VirtualWork

    @property
    def status(self) -> Status:
        """Status of the pose."""
        return self.result.status

    def __repr__(self) -> str:
        return f"<StiffnessIndices of {self.result.name!r}, status {self.status}>"


@dataclass(frozen=True, repr=False)
class IndicesOfPoses(StatusOfPoses):
    """The stiffness indices of a batch of poses, computed when they are taken from it.

    ``found[i]`` are those of one pose, and ``found[found.answered]`` those of all that have a
    matrix. In a loop over the poses None stands where there is none, and the status says why.

    Attributes
    ----------
    result : Stiffness
        What they are computed from, with the status of each pose.
    length : float or None
        The characteristic length [m]; None for the robot's own at each pose.
    """

    result: Stiffness
    length: float | None

    @property
    def status_codes(self) -> np.ndarray:
        """Status of every pose (...) as uint16."""
        return self.result.status_codes

    def __repr__(self) -> str:
        poses, known = self.answered.size, int(np.count_nonzero(self.answered))
        return f"<IndicesOfPoses of {self.result.name!r}, {poses} poses, {known} with a matrix>"

    def __len__(self) -> int:
        return len(self.answered)

    def __iter__(self) -> Iterator[Any]:
        """Indices of one pose after the other, or of one row of a larger batch; None for none."""
        for i in range(len(self)):
            one = self.result[i]
            yield self[i] if one.batch_shape or one.status.has_stiffness else None

    def each(self, index: Callable[[StiffnessIndices], Any]) -> np.ma.MaskedArray:
        """One number of every pose (...), such as ``lambda one: one.collinear.smallest``.

        Masked where the pose has no indices, which its status explains, or where the index is None.
        """
        values = np.ma.masked_all(self.answered.shape)
        values.data[...] = np.nan  # what is read past the mask is no number
        for place in np.argwhere(self.answered):
            value = index(self[tuple(place)])
            if value is not None:
                values[tuple(place)] = value
        return values

    def __getitem__(self, index: Any) -> Any:
        """The indices of one pose, or of some poses."""
        return indices(self.result[index], length=self.length)


def indices(
    robot: Stiffness | Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    *,
    length: float | None = None,
    at: ArrayLike | None = None,
    near: Near = None,
) -> Any:
    """All stiffness indices of a robot.

    Parameters
    ----------
    robot : Stiffness, Robot, Snapshot, Network or Linkage
        What `stiffness` answers, or what it would be asked of.
    pose, at, near
        As for `stiffness`, where a robot is given.
    length : float, optional
        Characteristic length [m]; the robot's own at the pose when left out.

    Returns
    -------
    StiffnessIndices or IndicesOfPoses
        The latter of a batch.

    Raises
    ------
    InputError
        For a length that is not positive.
    NoAnswerError
        For a single pose without a matrix, with the advice of its status.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = rs.indices(rs.stiffness(rs.load("gough-stewart-b")))
    >>> found.centre_of_stiffness.is_decoupled
    True
    >>> round(found.collinear.smallest / 1e6, 1)
    67.8
    >>> line = [[0, 0, 0.7, 0, 0, 0], [0, 0, 0.9, 0, 0, 0]]
    >>> found = rs.indices(rs.load("gough-stewart-b"), line)
    >>> found.each(lambda one: one.collinear.smallest / 1e6).round(1)
    masked_array(data=[82.7, 56.2],
                 mask=[False, False],
           fill_value=1e+20)
    """
    if isinstance(robot, Robot | Snapshot | Network | Linkage):
        result = direct_stiffness(robot, pose, at, near=near)
    elif pose is None and at is None and near is None:
        result = robot
    else:
        raise InputError(
            "indices",
            got="a result of stiffness, and a pose, a point or a posture",
            expected="a result alone: it is of its own poses",
            hint="write indices(robot, pose, at=..., near=...)",
        )
    if isinstance(result, Stiffness) and result.batch_shape:
        return IndicesOfPoses(result, None if length is None else index_length(result, length))
    space = stiffness_parts(result).space
    L = index_length(result, length)
    return StiffnessIndices(
        result=result,
        length=L,
        along_axes=tuple(
            directional_stiffness(result, axis) for axis in np.eye(3)[: space.translations]
        ),
        principal=principal_stiffness(result),
        collinear=collinear_stiffness(result),
        worst_deflection=worst_deflection(result),
        anisotropy=anisotropy(result),
        eigenscrews=eigenscrews(result),
        centre_of_stiffness=centre_of_stiffness(result),
        centre_of_compliance=centre_of_compliance(result),
        eigenstiffness=eigenstiffness(result, length=L),
        condition=condition_number(result, length=L),
        virtual_work=virtual_work(result, length=L),
    )
