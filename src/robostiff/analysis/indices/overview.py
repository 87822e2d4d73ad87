"""All stiffness indices of a robot at a pose."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.analysis.indices.centres import Centre, centre_of_compliance, centre_of_stiffness
from robostiff.analysis.indices.collinear import CollinearStiffness, collinear_stiffness
from robostiff.analysis.indices.compliance_ratio import Anisotropy, anisotropy
from robostiff.analysis.indices.condition import ConditionNumber, condition_number
from robostiff.analysis.indices.directional import (
    DirectionalStiffness,
    WorstDeflection,
    directional_stiffness,
    worst_deflection,
)
from robostiff.analysis.indices.metric import Eigenstiffness, eigenstiffness, index_length
from robostiff.analysis.indices.principal import PrincipalStiffness, principal_stiffness
from robostiff.analysis.indices.screws import Eigenscrews, eigenscrews
from robostiff.analysis.indices.stiffness_parts import stiffness_parts
from robostiff.analysis.indices.work_of_unit_loads import VirtualWork, virtual_work
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status


@dataclass(frozen=True)
class StiffnessIndices:
    """The stiffness indices of a single pose; each attribute says of itself what it is about.

    Attributes
    ----------
    result : RobotStiffness
        What they are computed from.
    length : float
        The characteristic length [m] of those that need one.
    along_axes : tuple of DirectionalStiffness
        Along the world axes.
    principal : PrincipalStiffness
    collinear : CollinearStiffness
    worst_deflection : WorstDeflection
    anisotropy : Anisotropy
    eigenscrews : Eigenscrews
    centre_of_stiffness, centre_of_compliance : Centre
    eigenstiffness : Eigenstiffness
    condition : ConditionNumber
    virtual_work : VirtualWork
    """

    result: RobotStiffness
    length: float
    along_axes: tuple[DirectionalStiffness, ...]
    principal: PrincipalStiffness
    collinear: CollinearStiffness
    worst_deflection: WorstDeflection
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


@dataclass(frozen=True, repr=False)
class IndicesOfPoses:
    """The stiffness indices of a batch of poses, computed when they are taken from it.

    ``found[i]`` are those of one pose, and ``found[found.answered]`` those of all that have a
    matrix. In a loop over the poses None stands where there is none, and the status says why.

    Attributes
    ----------
    result : RobotStiffness
        What they are computed from, with the status of each pose.
    length : float or None
        The characteristic length [m]; None for the robot's own at each pose.
    """

    result: RobotStiffness
    length: float | None

    @property
    def status_codes(self) -> np.ndarray:
        """Status of every pose (...) as uint8."""
        return self.result.status_codes

    @property
    def answered(self) -> np.ndarray:
        """Which poses have indices (...)."""
        return self.result.answered

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

    def __getitem__(self, index: Any) -> Any:
        """The indices of one pose, or of some poses.

        Raises
        ------
        NoAnswerError
            For one pose without a matrix, with the advice of its status.
        """
        return indices(self.result[index], length=self.length)


def indices(result: RobotStiffness, *, length: float | None = None) -> Any:
    """All stiffness indices of a robot.

    Parameters
    ----------
    result : RobotStiffness
        What `stiffness` answers.
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
    """
    if isinstance(result, RobotStiffness) and result.batch_shape:
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
