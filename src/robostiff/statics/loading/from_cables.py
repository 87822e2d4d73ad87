"""Platforms in cables with locked winches, ready to be loaded: springs that only pull."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.analysis import CableStiffness, cable_stiffness
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model.cable import CableRobot
from robostiff.statics.chains.body_springs import FiniteBodySpring
from robostiff.statics.chains.elements import FiniteChain, Spot
from robostiff.statics.chains.legs import Legs
from robostiff.statics.equations.problem import DeadForces, EquilibriumProblem, Steady
from robostiff.statics.equations.vibration import CarriedMasses
from robostiff.statics.loading.given_loads import (
    Acting,
    Masses,
    given_forces,
    given_masses,
    on_platform,
)
from robostiff.statics.loading.loaded_posture import LoadedPosture, point_at

# What is said of a pose before the load, and holds under it.
_LASTING = Status.UNBALANCED | Status.UNREACHABLE | Status.INFEASIBLE | Status.FORM_DOES_NOT_HOLD


@dataclass(frozen=True)
class CablePostures:
    """A cable robot at poses, without the loads: its tensions balance its weight.

    Attributes
    ----------
    robot : CableRobot
    before : CableStiffness
        Of one pose or a batch.
    """

    robot: CableRobot
    before: CableStiffness

    @staticmethod
    def of(robot: CableRobot, pose: Pose, near: Near) -> CablePostures:
        """At a pose or a batch of poses (N, 6).

        Raises
        ------
        InputError
            When the poses do not fit, or lie along several axes; when a posture is chosen.
        """
        if near is not None:
            raise InputError(
                f"near of {robot.name!r}", got=near, expected="none: cables have one posture"
            )
        before = cable_stiffness(robot, pose)
        if len(before.batch_shape) > 1:
            raise InputError(
                f"poses of {robot.name!r}", got=before.batch_shape, expected="poses along one axis"
            )
        return CablePostures(robot, before)

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of its batch, () for one."""
        return self.before.batch_shape

    def loaded(self, i: int, acting: Acting, masses: Masses | None = None) -> LoadedPosture:
        """The robot at pose i with its loads and masses, which are on the platform.

        Raises
        ------
        InputError
            When they are on anything but the platform, or what a cable robot does not have is
            given.
        """
        others = {"preload": acting.preload, "laws": acting.laws}
        for name, own in {**others, "gravity": acting.gravity}.items():
            if own is not None and (name == "gravity" or own):
                raise InputError(
                    f"{name} of {self.robot.name!r}",
                    expected="none: cables have tensions, and the platform its weight",
                )
        before = self.before[i] if self.batch else self.before
        placed, space = before.placed, before.space
        point = point_at(acting.at, placed.reference_point)
        frame = turn_by_vector(before.pose[3:]), before.pose[:3]
        frame_of = {"platform": frame}.get
        forces = given_forces(acting.loads, np.zeros(3), space, frame_of)
        moving = given_masses(masses or {}, {"platform": point}, frame_of)
        forces_on_it, on_it = forces.pop("platform", ()), tuple(moving.pop("platform", ()))
        for what, others in (("loads", forces), ("masses", moving)):
            for name in others:
                raise InputError(
                    what, got=name, expected="platform: cables have no weight and carry no loads"
                )
        problem = cables_loaded(before, point, on_platform(forces_on_it, point))
        status = before.status & _LASTING
        masses_of = CarriedMasses((), on_it)
        return LoadedPosture(before.name, problem, space, frame, status, self.robot, masses_of)


def cables_loaded(
    before: CableStiffness, point: np.ndarray, loads: DeadForces
) -> EquilibriumProblem:
    """The problem of a platform that rests in its cables, as they are without the loads.

    Wrenches are about a point of the platform (3,) [m]. What cables and weight leave without the
    loads is held by others, as a force at the reference point and a moment.
    """
    placed, rows = before.placed, before.space.rows
    springs = tuple(
        FiniteBodySpring(
            name,
            np.array([placed.exit_points[i], placed.attachments[i]]),
            (None, Spot(0, 0)),
            float(before.axial[i]),
            float(placed.lengths[i]),
            float(before.tensions[i] - before.axial[i] * placed.lengths[i]),
            is_cable=True,
        )
        for i, name in enumerate(before.cable_names)
    )
    left = np.zeros(6)
    if before.answered:
        left[list(rows)] = before.missing_wrench
    steady = Steady(
        DeadForces(
            np.array([placed.weight_point, placed.reference_point]) - point,
            np.array([placed.weight_force, left[:3]]),
        ),
        np.where(np.arange(6) < 3, 0.0, left)[list(rows)],
    )
    legs = Legs((FiniteChain(0, None, ()),), point[None], point, rows, springs)
    size = float(placed.characteristic_length)
    return EquilibriumProblem(legs, rows, point, size, loads, steady)
