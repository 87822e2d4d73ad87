"""All stiffness indices of a robot at a pose."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, ClassVar, TypeVar, overload

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
from robostiff.analysis.indices.stiffness_parts import StationaryStiffness, stiffness_parts
from robostiff.analysis.measures import principal_stiffnesses, symmetric_eigenvalues
from robostiff.analysis.posed_stiffness import stiffness_by_record
from robostiff.analysis.result import Stiffness
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, scaling
from robostiff.elastostatics.status import StatusOfPoses
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.kinematics import Near, Pose
from robostiff.kinematics.pose import OnePose
from robostiff.linkage import DriveValues, Linkage
from robostiff.markup import InNotebooks
from robostiff.model import Robot, Snapshot
from robostiff.model.subject import Subject
from robostiff.network import Network

_Index = TypeVar("_Index")


def _of_result(index: Callable[..., _Index]) -> cached_property[_Index]:
    """An index by its function, of the result and, where it takes one, of the length."""
    needs_length = "length" in index.__annotations__

    def value(indices: StiffnessIndices) -> _Index:
        result = indices.result
        return index(result, length=indices.length) if needs_length else index(result)

    value.__doc__ = f"By `{index.__name__}`" + (", with the length." if needs_length else ".")
    return cached_property(value)


@frozen(repr=False)
class StiffnessIndices(InNotebooks):
    """The stiffness indices of a single pose, each computed when it is first used.

    Every index has a text `about` its definition.

    Attributes
    ----------
    result : Stiffness
        What they are computed from.
    given_length : float or None
        The characteristic length [m] of those that need one; None for the robot's own at the pose.
    """

    result: Stiffness
    given_length: float | None = None

    @property
    def length(self) -> float:
        """The characteristic length [m] of those that need one."""
        return index_length(self.result, self.given_length)

    @cached_property
    def along_axes(self) -> tuple[DirectionalStiffness, ...]:
        """Along the world axes."""
        axes = np.eye(3)[: self.result.space.translations]
        return tuple(directional_stiffness(self.result, axis) for axis in axes)

    principal: ClassVar[cached_property[PrincipalStiffnesses]] = _of_result(principal_stiffness)
    collinear: ClassVar[cached_property[CollinearStiffness]] = _of_result(collinear_stiffness)
    worst_deflection: ClassVar[cached_property[WorstDeflections]] = _of_result(worst_deflection)
    anisotropy: ClassVar[cached_property[Anisotropy]] = _of_result(anisotropy)
    eigenscrews: ClassVar[cached_property[Eigenscrews]] = _of_result(eigenscrews)
    centre_of_stiffness: ClassVar[cached_property[Centre]] = _of_result(centre_of_stiffness)
    centre_of_compliance: ClassVar[cached_property[Centre]] = _of_result(centre_of_compliance)
    eigenstiffness: ClassVar[cached_property[Eigenstiffness]] = _of_result(eigenstiffness)
    condition: ClassVar[cached_property[ConditionNumber]] = _of_result(condition_number)
    virtual_work: ClassVar[cached_property[VirtualWork]] = _of_result(virtual_work)

    @property
    def status(self) -> Status:
        """Status of the pose."""
        return self.result.status

    def __repr__(self) -> str:
        return f"<StiffnessIndices of {self.result.name!r}, status {self.status}>"


INDEX_NAMES = [name for name, x in vars(StiffnessIndices).items() if type(x) is cached_property]
"""Of all indices, in the order in which pages have them."""


@frozen(repr=False)
class IndicesOfPoses(StatusOfPoses):
    """The stiffness indices of a batch of poses, computed when they are taken from it.

    ``found[i]`` are those of one pose, and ``found[found.answered]`` those of all that have a
    matrix. In a loop over the poses None stands where there is none, and the status says why.
    Numbers of all poses at once are masked where there is no matrix, or no finite number.

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

    @cached_property
    def principal_stiffness(self) -> np.ma.MaskedArray:
        """Of forces [N/m] and then of moments [N m/rad], each ascending (..., n)."""
        return self._numbers(
            lambda known: principal_stiffnesses(self.result.matrix[known]),
            lambda single: single.principal,
        )

    @cached_property
    def collinear_stiffness(self) -> np.ma.MaskedArray:
        """Of forces [N/m] and then of moments [N m/rad], each ascending (..., n)."""
        d = self.result.space.translations

        def inverses(known: Any) -> np.ndarray:
            k = 1 / principal_stiffnesses(self.result.compliances[known])
            return np.concatenate([k[:, :d][:, ::-1], k[:, d:][:, ::-1]], axis=-1)

        return self._numbers(inverses, lambda single: single.collinear)

    @property
    def worst_deflection(self) -> np.ma.MaskedArray:
        """Largest displacement per force (...) [m/N]."""
        return 1 / self.collinear_stiffness[..., 0]

    @property
    def anisotropy(self) -> np.ma.MaskedArray:
        """Largest over smallest principal compliance, of forces and of moments (..., 2)."""
        k, d = self.collinear_stiffness, self.result.space.translations
        return np.ma.stack([k[..., d - 1] / k[..., 0], k[..., -1] / k[..., d]], axis=-1)

    @cached_property
    def condition_number(self) -> np.ma.MaskedArray:
        """Of K in the two-norm (...), with rotations measured in the length."""
        length = self.result.length if self.length is None else np.array(self.length)
        s = scaling(np.broadcast_to(length, self.answered.shape), self.result.space)
        scale = s[..., :, None] * s[..., None, :]

        def largest(A: np.ndarray) -> np.ndarray:
            return symmetric_eigenvalues(A)[:, -1:]

        def ratios(known: Any) -> np.ndarray:
            K, C = self.result.matrix[known], self.result.compliances[known]
            return largest(K / scale[known]) * largest(C * scale[known])

        return self._numbers(ratios, lambda single: single.condition.two_norm)[..., 0]

    def _numbers(
        self,
        together: Callable[[Any], np.ndarray],
        alone: Callable[[StiffnessIndices], StationaryStiffness | float | None],
    ) -> np.ma.MaskedArray:
        """Numbers (..., m) of poses with K and C `together`, and of each other pose `alone`."""
        known = self.answered & self.result.has_compliance
        if known.ndim == 1 and known.all():
            values = together(slice(None))
            return np.ma.MaskedArray(values, np.zeros(values.shape, dtype=bool))
        values = together(known)
        numbers = np.ma.masked_all((*known.shape, values.shape[-1]))
        numbers.data[...] = np.nan  # what is read past the mask is no number
        numbers[known] = values
        for place in map(tuple, np.argwhere(self.answered & ~known)):
            value = alone(self[place])
            if isinstance(value, StationaryStiffness):
                numbers[place] = np.concatenate([value.translational, value.rotational])
            elif value is not None:
                numbers[place] = value
        return numbers

    def __repr__(self) -> str:
        poses, known = self.answered.size, int(np.count_nonzero(self.answered))
        return f"<IndicesOfPoses of {self.result.name!r}, {poses} poses, {known} with a matrix>"

    def __len__(self) -> int:
        return len(self.answered)

    def __iter__(self) -> Iterator[Any]:
        """Indices of one pose after the other, or of one row of a larger batch; None for none."""
        for i in range(len(self)):
            result = self.result[i]
            yield self[i] if result.batch_shape or result.status.has_stiffness else None

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


@overload
def indices(
    robot: Robot | Snapshot | Network | Linkage,
    pose: OnePose = None,
    *,
    length: float | None = None,
    at: ArrayLike | None = None,
    near: Near = None,
) -> StiffnessIndices: ...
@overload
def indices(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Sequence[Sequence[float]],
    *,
    length: float | None = None,
    at: ArrayLike | None = None,
    near: Near = None,
) -> IndicesOfPoses: ...
@overload
def indices(
    robot: Stiffness | Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    *,
    length: float | None = None,
    at: ArrayLike | None = None,
    near: Near = None,
) -> Any: ...
def indices(
    robot: Stiffness | Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    *,
    length: float | None = None,
    at: ArrayLike | None = None,
    near: Near = None,
) -> StiffnessIndices | IndicesOfPoses:
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
    >>> print((found.collinear_stiffness[:, 0] / 1e6).round(1))
    [82.7 56.2]
    >>> print(found.each(lambda one: one.centre_of_stiffness.point[2]).round(2))
    [0.64 0.83]
    """
    if isinstance(robot, Subject):
        result = stiffness_by_record(robot, pose, at, near, DEFAULT_TOLERANCE)
    elif pose is None and at is None and near is None:
        result = robot
    else:
        raise InputError(
            "indices",
            got=Words("a result of stiffness, and a pose, a point or a posture"),
            expected="a result alone: it is of its own poses",
            hint="write indices(robot, pose, at=..., near=...)",
        )
    known = None if length is None else index_length(result, length)
    if isinstance(result, Stiffness) and result.batch_shape:
        return IndicesOfPoses(result, known)
    stiffness_parts(result)  # what has none is refused now
    return StiffnessIndices(result, known)
