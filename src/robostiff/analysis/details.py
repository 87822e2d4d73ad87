"""What the direct form finds at poses, and the question that it answers there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robostiff.elastostatics import (
    BlockCompliance,
    CartesianStiffness,
    Form,
    Status,
    Tolerance,
    scaling,
)
from robostiff.elastostatics.batched import PoseBatch
from robostiff.errors import DisagreementError
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.analysis.compiled_answer import CompiledAnswer
    from robostiff.model import Snapshot
    from robostiff.network import Network

# Poses of a batch that are worked out together when they are asked for one by one.
_BLOCK = 64
# Of the size of an entry: by what equal matrices may differ.
_AGREEMENT = 1e-9

Differences = list[tuple[int, float | str]]


@dataclass(frozen=True)
class StructuralAnalysis:
    """Matrix structural analysis: all bodies and all wrenches between them in one system."""

    name = "network"
    equation = "[[0, A^T], [A, -S]] [x; f] = [F; 0], condensed to the platform"


def distances(K: np.ndarray, other: np.ndarray, scale: np.ndarray, free: float) -> np.ndarray:
    """How far stiffness matrices are from others, (..., n, n) each; scale (..., n) of wrenches.

    Entries are judged by sqrt(K_ii K_jj) of the other, those of free motions not by zero. Where the
    other vanishes as a whole, as that of legs that transmit nothing does, the distance is 0 or
    infinite.
    """
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", other), 0.0)) / scale
    size = np.maximum(size, free * np.max(size, axis=-1, keepdims=True)) * scale
    each = size[..., :, None] * size[..., None, :]
    apart = np.abs(K - other)
    parts = np.where(apart == 0, 0.0, np.inf)
    np.divide(apart, each, out=parts, where=each > 0)
    return np.max(parts, axis=(-1, -2))


@dataclass(frozen=True)
class Details(PoseBatch):
    """What the direct form finds at poses: the whole and the legs about one point, the posture.

    Attributes
    ----------
    whole : CartesianStiffness
        About `origin`, where ranks are decided, independent of the reference point.
    origin : (..., 3) array
        Where it was computed: the robot's own reference point in the world [m], or the middle of a
        robot that is far away from it.
    reference_point : (..., 3) array
        The robot's own, in the world [m].
    passive_joint_names : tuple of str
        ``leg/joint`` of every passive freedom, the columns of ``whole.redundant``.
    legs : tuple of CartesianStiffness
        Each leg about `origin`; none of a network.
    leg_blocks : tuple of tuples of BlockCompliance
        Parallel blocks of each leg about `origin`, by which their branches share a wrench.
    shares : (..., b, n, n) array or None
        On a flexible platform, what each leg carries of a wrench on the tool about `origin`, and
        then each part of the platform.
    pose : (..., 6) array or None
        x, y, z [m] and rotation vector [rad] of the platform; None for a snapshot.
    joint_coordinates : mapping of str to (..., size) array
        The posture: coordinates of the joints of each leg [m, rad], by its name.
    joint_names : mapping of str to tuple of str
        Names of these coordinates, of robots of legs.
    reasons : tuple of str
        Why some pose has no answer, beside its status.
    """

    whole: CartesianStiffness
    origin: np.ndarray
    reference_point: np.ndarray
    passive_joint_names: tuple[str, ...]
    legs: tuple[CartesianStiffness, ...] = ()
    leg_blocks: tuple[tuple[BlockCompliance, ...], ...] = ()
    shares: np.ndarray | None = None
    pose: np.ndarray | None = None
    joint_coordinates: Mapping[str, np.ndarray] = field(default_factory=dict)
    joint_names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    reasons: tuple[str, ...] = ()

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of poses, () for a single one."""
        return self.whole.batch_shape

    @property
    def status_codes(self) -> np.ndarray:
        """Status of every pose (...) as uint16."""
        return self.whole.status_codes

    @property
    def rank(self) -> np.ndarray:
        """Of K (...); -1 where out of reach."""
        unreachable = (self.status_codes & int(Status.UNREACHABLE)) != 0
        return np.where(unreachable, -1, self.whole.rank)

    @cached_property
    def matrix(self) -> np.ndarray:
        """K about the reference point (..., n, n), meaningful where there is one."""
        return self.whole.moved(self.reference_point - self.origin)

    def differences(self, other: Details | CompiledAnswer, free: float) -> Differences:
        """Numbers of N poses at which another answer differs, and by how much.

        Differences of the status come first, then of the rank, then of K, the largest first; none
        within rounding, which leaves `free` of zero, as a part of the largest size.
        """
        found: Differences = []
        alike = other.status_codes == self.status_codes
        for i in np.flatnonzero(~alike).tolist():
            codes = other.status_codes[i], self.status_codes[i]
            found.append((i, "on the status, {} and {},".format(*(Status(int(c)) for c in codes))))
        same = alike & (other.rank == self.rank)
        for i in np.flatnonzero(alike & ~same).tolist():
            found.append((i, f"on the rank, {int(other.rank[i])} and {int(self.rank[i])},"))
        rows = np.flatnonzero(same & self.whole.answered)
        if rows.size:
            scale = scaling(self.whole.length[rows], self.whole.space)
            apart = distances(other.matrix[rows], self.matrix[rows], scale, free)
            order = [i for i in np.argsort(-apart) if not apart[i] <= _AGREEMENT]
            found += [(int(rows[i]), float(apart[i])) for i in order]
        return found


class Question(ABC):
    """Poses of a machine at which its stiffness is asked for, and what was found out there.

    Parameters
    ----------
    name : str
        Of the machine.
    space : Space
    method : Form or StructuralAnalysis
    tolerance : Tolerance
    batch : tuple of int
        Shape of the batch of poses.
    """

    name: str
    space: Space
    method: Form | StructuralAnalysis
    tolerance: Tolerance
    rows: np.ndarray
    #: Between what a record and the direct form differ.
    opinions: ClassVar[str] = ""
    #: Of the largest size: what rounding leaves of zero.
    free: ClassVar[float] = 0.0

    def __init__(
        self,
        name: str,
        space: Space,
        method: Form | StructuralAnalysis,
        tolerance: Tolerance,
        batch: tuple[int, ...],
    ) -> None:
        self.name, self.space, self.method, self.tolerance = name, space, method, tolerance
        self.rows = np.arange(int(np.prod(batch, dtype=int))).reshape(batch)
        self.recorded: CompiledAnswer | None = None
        self._whole: Details | None = None
        self._blocks: dict[int, Details] = {}
        self._asked_for_one = False

    def details(self, rows: np.ndarray) -> Details:
        """What the direct form finds at some of the poses, with the shape of the rows.

        Raises DisagreementError where it is another answer than that of the record.
        """
        if rows is self.rows or np.array_equal(rows, self.rows):
            if self._whole is None:
                self._whole = self._checked(rows)
            return self._whole
        if self._whole is not None:
            return self._whole[np.unravel_index(rows, self.rows.shape)]
        if rows.shape or not self._asked_for_one:
            self._asked_for_one |= not rows.shape
            return self._checked(rows)
        start = int(rows) // _BLOCK * _BLOCK
        if start not in self._blocks:
            stop = min(start + _BLOCK, self.rows.size)
            self._blocks[start] = self._checked(np.arange(start, stop))
        return self._blocks[start][int(rows) - start]

    def _checked(self, rows: np.ndarray) -> Details:
        flat = rows.reshape(-1)
        found = self.solved(flat)
        if self.recorded is not None:
            recorded = self.recorded.reshaped((-1,))[flat]
            for i, distance in found.differences(recorded, self.free):
                where = f"{self.name!r} at {self.place(flat[i])}"
                raise DisagreementError(self.opinions, distance, where)
        return found if rows.ndim == 1 else found.reshaped(rows.shape)

    def from_record(self) -> CompiledAnswer | None:
        """What the record gives at all poses; None where there is none, or it does not pay yet."""
        return None

    @abstractmethod
    def solved(self, rows: np.ndarray) -> Details:
        """What the direct form finds at N of the poses, a batch of them."""

    @abstractmethod
    def placed(self, row: np.ndarray) -> Snapshot | Network:
        """The machine in the world at one pose."""

    def place(self, row: int) -> list[float]:
        """The numbers of one pose [m, rad]."""
        return []

    def pose_at(self, rows: np.ndarray) -> np.ndarray | None:
        """Pose coordinates (..., 6) where all of them are given."""
        return None

    def reference_points(self, rows: np.ndarray) -> np.ndarray | None:
        """The reference point in the world (..., 3) [m], where it is known without the posture."""
        return None

    def complaints(self, rows: np.ndarray, status: Status) -> tuple[str, ...]:
        """What is to be said of one pose of that status, or of several, beside their status."""
        return ()
