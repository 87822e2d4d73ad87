"""Results at a batch of poses: the status of each, some of the poses, batches joined."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from enum import IntFlag
from typing import Any, Protocol, Self

import numpy as np


class Status(IntFlag):
    """Status of a pose; several flags may hold at once, and 0 means that nothing is to be reported.

    ``FREE_MOTIONS``, ``REDUNDANT_JOINTS`` and ``SLACK`` accompany a right answer. The others are
    bad: there is no stiffness matrix, or there is one to be used with care. From ``UNSTABLE`` on
    they are said of equilibria under loads and of cable robots. Maps have flags of their own at
    256 and 512.

    Examples
    --------
    >>> status = Status.FREE_MOTIONS | Status.REDUNDANT_JOINTS
    >>> str(status), status.is_bad
    ('free-motions+redundant-joints', False)
    """

    OK = 0
    FREE_MOTIONS = 1
    REDUNDANT_JOINTS = 2
    ILL_CONDITIONED = 4
    BEYOND_LIMITS = 8
    RIGID_DIRECTION = 16
    FORM_DOES_NOT_HOLD = 32
    UNREACHABLE = 64
    UNBALANCED = 128
    UNSTABLE = 1024
    NO_EQUILIBRIUM = 2048
    BEYOND_CRITICAL_LOAD = 4096
    UNTENSIONED = 8192
    INFEASIBLE = 16384
    SLACK = 32768

    @property
    def is_bad(self) -> bool:
        """Whether the result is missing or to be used with care."""
        return bool(self & ~_HARMLESS)

    @property
    def has_stiffness(self) -> bool:
        """Whether there is a stiffness matrix."""
        return not self & WITHOUT_STIFFNESS

    @property
    def advice(self) -> tuple[str, ...]:
        """One sentence of advice for each flag."""
        return tuple(_ADVICE[member] for member in type(self) if member & self)

    def __str__(self) -> str:
        names = (str(member.name) for member in Status if member & self)
        return "+".join(name.lower().replace("_", "-") for name in names) or "ok"


_HARMLESS = Status.FREE_MOTIONS | Status.REDUNDANT_JOINTS | Status.SLACK
WITHOUT_STIFFNESS = (
    Status.RIGID_DIRECTION
    | Status.FORM_DOES_NOT_HOLD
    | Status.UNREACHABLE
    | Status.NO_EQUILIBRIUM
    | Status.INFEASIBLE
)

_ADVICE = {
    Status.FREE_MOTIONS: (
        "the platform can move without meeting stiffness: the matrix is singular, and only loads "
        "that do no work on the free motions can be carried"
    ),
    Status.REDUNDANT_JOINTS: (
        "a passive joint adds no freedom to those before it, and is not held by the platform (for "
        "instance the spin of a rod between two spherical joints): the stiffness is that of the "
        "posture at hand"
    ),
    Status.ILL_CONDITIONED: (
        "near a singular pose or the loss of stability, a joint that is almost redundant, or "
        "springs of too different size: few digits of the matrix hold; move away from the pose, "
        "align the joint exactly, or give the very stiff parts as rigid"
    ),
    Status.BEYOND_LIMITS: (
        "a coordinate or a force is beyond its limits: the machine cannot stand at this pose"
    ),
    Status.RIGID_DIRECTION: (
        "a wrench is carried without meeting any compliance, so the stiffness is infinite and no "
        "matrix exists: give a link or an actuator on that path its elasticity, or move an arm "
        "with rigid links out of its singular posture"
    ),
    Status.FORM_DOES_NOT_HOLD: "the form asked for does not hold here: use the default, which does",
    Status.UNREACHABLE: (
        "the pose cannot be reached, or only in another assembly mode than at home: move the pose, "
        "or check the dimensions"
    ),
    Status.UNBALANCED: (
        "forces are not in balance, so the platform runs away instead of deflecting: apply a load "
        "that does no work on free motions, hold these motions, or give other forces"
    ),
    Status.UNSTABLE: (
        "the robot does not stay in this equilibrium: the least disturbance moves it away; lower "
        "the load or the tensions, stiffen what moves in the mode of critical_load or in "
        "unstable_motions, or guide the platform"
    ),
    Status.NO_EQUILIBRIUM: (
        "no equilibrium was found from the unloaded posture: the load is too large, or drives a "
        "motion that nothing resists; apply it in smaller parts, or hold the platform"
    ),
    Status.BEYOND_CRITICAL_LOAD: (
        "on the way to the full load the robot buckles, snaps through or meets a singular posture, "
        "at the factor critical_factor of the load: what is found beyond need not be where it ends"
    ),
    Status.UNTENSIONED: (
        "a cable has no tension: the matrix counts it, which is right only for motions that pull "
        "it; taut_stiffness leaves it out"
    ),
    Status.INFEASIBLE: (
        "no tensions within their limits balance weight and wrench at this pose: cables only pull, "
        "so move the pose into the workspace, lower the least tensions, or raise the greatest"
    ),
    Status.SLACK: "a cable is slack under the load: it carries no force until taut again",
}


_WITHOUT = int(WITHOUT_STIFFNESS)


class _OfPoses(Protocol):
    @property
    def status_codes(self) -> np.ndarray: ...


class StatusOfPoses:
    """Base of results that have a status at each pose: ``status_codes`` (...) of uint16."""

    @property
    def batch_shape(self: _OfPoses) -> tuple[int, ...]:
        """Shape of the batch of poses, () for a single one."""
        return self.status_codes.shape

    def __iter__(self) -> Iterator[Self]:
        """One pose after the other, or one row of a larger batch."""
        of_poses: Any = self
        return (of_poses[i] for i, _ in enumerate(of_poses.status_codes))

    @property
    def status(self: _OfPoses) -> Status:
        """Status of a single pose; of a batch, all flags that hold at any pose."""
        return Status(int(np.bitwise_or.reduce(self.status_codes, axis=None)))

    @property
    def answered(self: _OfPoses) -> np.ndarray:
        """Where there is a stiffness matrix (...)."""
        return (self.status_codes & _WITHOUT) == 0


class PoseBatch:
    """A frozen dataclass; its arrays, and those of parts of it, begin with the axes of a batch."""

    doubtful: np.ndarray  # (...) of bool

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of poses, () for a single one."""
        return self.doubtful.shape

    def __getitem__(self, index: Any) -> Self:
        """The same at one pose, or at some poses, of the batch."""
        return _map_arrays(lambda array: np.asarray(array[index]), self)

    def reshaped(self, batch: tuple[int, ...]) -> Self:
        """The same under another batch shape."""
        axes = len(self.batch_shape)
        return _map_arrays(lambda array: array.reshape((*batch, *array.shape[axes:])), self)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Several batches, each along one axis, as one.

        Zeros fill up the other axes, and what one of the parts lacks the whole does, too.
        """

        def one_batch(*stacks: np.ndarray) -> np.ndarray:
            most = np.max([stack.shape[1:] for stack in stacks], axis=0).astype(int)
            missing = [[(0, 0), *((0, k) for k in most - stack.shape[1:])] for stack in stacks]
            return np.concatenate([np.pad(s, k) for s, k in zip(stacks, missing, strict=True)])

        return parts[0] if len(parts) == 1 else _map_arrays(one_batch, *parts)


def _map_arrays(f: Callable[..., np.ndarray], first: Any, *others: Any) -> Any:
    """The first of several values that are alike, its arrays made from those of all."""
    found = first
    if isinstance(first, np.ndarray | np.generic):
        found = f(*map(np.asarray, (first, *others)))
    elif any(other is None for other in others):
        found = None
    elif isinstance(first, PoseBatch):
        values = vars(first)
        mapped = {}
        for name in first.__dataclass_fields__:  # type: ignore[attr-defined]
            is_alone = not others and type(values[name]) is np.ndarray  # most of all calls
            rest = [getattr(other, name) for other in others]
            mapped[name] = f(values[name]) if is_alone else _map_arrays(f, values[name], *rest)
        found = type(first)(**mapped)
    elif isinstance(first, str):
        found = "; ".join(dict.fromkeys(text for text in (first, *others) if text))
    elif isinstance(first, tuple) and not isinstance(next(iter(first), None), str):
        found = tuple(_map_arrays(f, *entries) for entries in zip(first, *others, strict=True))
    elif isinstance(first, dict):
        found = {
            key: _map_arrays(f, first[key], *(other[key] for other in others)) for key in first
        }
    return found
