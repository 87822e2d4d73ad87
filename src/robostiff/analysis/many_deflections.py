"""Deflection at one pose or at many, each under a load of its own or all under one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.deflection_under_load import deflection_at
from robostiff.analysis.leg_loads import leg_loads, loads_known
from robostiff.analysis.posed_stiffness import PosedStiffness, answered_at
from robostiff.analysis.result import given_wrenches
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose
from robostiff.linkage import DriveValues, Linkage
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.spatial import move_twist, move_wrench


@dataclass(frozen=True, repr=False)
class DeflectionsOfPoses:
    """How a robot deflects at a batch of poses; shares of energy are computed when first used.

    ``found[i]`` is the `Deflection` of one pose, ``found[found.answered]`` are those of some.

    Attributes
    ----------
    wrench : (..., n) array
        The load at each pose about its reference point, world axes [N, N m].
    stiffness : RobotStiffness
        What it was computed from.
    """

    wrench: np.ndarray
    stiffness: PosedStiffness

    @cached_property
    def _loads(self) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
        """Status (...), twists about the origin (..., n), and wrenches of the legs (..., n)."""
        answer, shape = self.stiffness, self.wrench.shape
        F = move_wrench(self.wrench, -answer.offset)
        codes = np.array(answer.status_codes)
        twist = np.full(shape, np.nan)
        of_legs = tuple(np.full(shape, np.nan) for _ in answer.legs)
        known = np.array(loads_known(answer))
        for rows in self._alike(known):
            loads = leg_loads(answer[rows], F[rows])
            if loads is None:
                known[rows] = False
                continue
            balanced = np.asarray(loads.balanced)
            codes[rows] |= np.where(balanced, np.uint16(0), np.uint16(Status.UNBALANCED))
            held = balanced[..., None]
            twist[rows] = np.where(held, loads.twist, np.nan)
            for own, wrench in zip(of_legs, loads.wrenches, strict=True):
                own[rows] = np.where(held, wrench, np.nan)
        lost = ~known & answer.answered
        codes[lost] |= np.uint16(Status.ILL_CONDITIONED)
        return codes, twist, of_legs

    def _alike(self, known: np.ndarray) -> Iterator[np.ndarray]:
        """Poses that can be computed together: all, unless matrices alone are known."""
        answer = self.stiffness
        serial = answer.serial_compliance
        whole = answer.about_reference.carried is not None or (
            serial is not None and not np.isnan(serial).any()
        )
        if whole and known.any():
            yield known
        elif not whole:
            for place in np.argwhere(known):
                one = np.zeros_like(known)
                one[tuple(place)] = True
                yield one

    @property
    def status_codes(self) -> np.ndarray:
        """Status of every pose (...); ``UNBALANCED`` where a load drives a free motion."""
        return self._loads[0]

    @property
    def status(self) -> Status:
        """Everything that happened at any pose."""
        return Status(int(np.bitwise_or.reduce(self.status_codes, axis=None)))

    @property
    def answered(self) -> np.ndarray:
        """Which poses have a deflection (...)."""
        return ~np.isnan(self._loads[1][..., 0])

    @property
    def twist(self) -> np.ma.MaskedArray:
        """Displacement of the reference points and rotation of the platform (..., n) [m, rad].

        Masked where there is none, which the status explains. Where free motions remain, the least
        displacement.
        """
        return self._masked(move_twist(self._loads[1], self.stiffness.offset))

    @property
    def energy(self) -> np.ma.MaskedArray:
        """Elastic energy, half of F . t (...) [J]; masked where there is no deflection."""
        return np.ma.sum(self.wrench * self.twist, axis=-1) / 2

    @property
    def leg_wrenches(self) -> tuple[np.ma.MaskedArray, ...]:
        """What each leg carries about ``stiffness.origin``, world axes (..., n) [N, N m]."""
        return tuple(self._masked(own) for own in self._loads[2])

    def _masked(self, values: np.ndarray) -> np.ma.MaskedArray:
        mask = np.broadcast_to(~self.answered[..., None], values.shape)
        return np.ma.MaskedArray(values, mask)

    def __repr__(self) -> str:
        poses, known = self.answered.size, int(np.count_nonzero(self.answered))
        return f"<DeflectionsOfPoses of {self.stiffness.name!r}, {poses} poses, {known} answered>"

    def __len__(self) -> int:
        return len(self.wrench)

    def __iter__(self) -> Iterator[Any]:
        """One pose after the other, or one row of a larger batch."""
        return (self[i] for i in range(len(self)))

    def __getitem__(self, index: Any) -> Any:
        """The deflection at one pose, with all that bends, or at some poses."""
        some = self.stiffness[index]
        if some.batch_shape:
            return replace(self, wrench=self.wrench[index], stiffness=some)
        return deflection_at(some, self.wrench[index], some.placed)


def deflection(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    wrench: ArrayLike = (),
    *,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> Any:
    """Deflection of the platform under a wrench, and how the parts of the robot share in it.

    Parameters as for `robostiff.deflection`, which takes loads at bodies besides.

    Returns
    -------
    Deflection or DeflectionsOfPoses
        The latter of a batch.

    Raises
    ------
    InputError
        When the wrench or the pose does not fit.
    """
    if isinstance(robot, CableRobot):
        raise InputError(
            "robot of a deflection",
            got=f"cable robot {robot.name!r}",
            expected="a robot without cables: these may become slack, and need not stay near",
            hint="write cable_response(robot, pose, load=...), or 'robostiff cables'",
        )
    answer = answered_at(robot, pose, at, near=near, tolerance=tolerance)
    hint = "write deflection(robot, pose, wrench) or wrench=[...]: the pose comes first"
    F = given_wrenches(wrench, answer.space, answer.batch_shape, hint=hint)
    if isinstance(robot, Snapshot | Network):
        return deflection_at(answer, F, robot)
    posed = cast("PosedStiffness", answer)
    return (
        DeflectionsOfPoses(F, posed) if posed.batch_shape else deflection_at(posed, F, posed.placed)
    )
