"""All postures of legs in closed form at one pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics.closure.assembly import RootSigns
from robostiff.kinematics.pose import Pose
from robostiff.kinematics.posture_finder import posture_finder
from robostiff.model import Robot


@dataclass(frozen=True)
class LegPosture:
    """One posture in which a leg reaches a pose.

    Attributes
    ----------
    leg : str
    coordinates : (size,) array
        Of all its joints [m, rad].
    mode : RootSigns
        Signs that distinguish it from the others.
    of_home : bool
        Whether it belongs to the assembly mode of home, which `stiffness` takes.
    """

    leg: str
    coordinates: np.ndarray
    mode: RootSigns
    of_home: bool


def postures(robot: Robot, pose: Pose = None) -> dict[str, tuple[LegPosture, ...]]:
    """All postures in which each leg of a robot reaches a pose, that of home first.

    The legs are independent of one another: any choice of one posture for each leg is a posture of
    the robot. Its coordinates, leg by leg, choose it: ``stiffness(robot, pose, near=[...])``.

    Parameters
    ----------
    robot : Robot
        Whose legs close in closed form.
    pose : RigidTransform, array of coordinates, or None
        One pose, all coordinates of which are given; None for home.

    Returns
    -------
    dict of str to tuple of LegPosture
        By name of the leg; empty for a leg that does not reach the pose.

    Raises
    ------
    InputError
        When a leg is closed by iteration, the pose is given by joint coordinates, or there are
        several poses.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> found = postures(load("3-rrr"))
    >>> [posture.mode.root for posture in found["leg1"]]
    [1, -1]
    """
    finder = posture_finder(robot)
    request = finder.request(pose)
    if isinstance(request, np.ndarray) or request.batch:
        raise InputError(
            f"pose of {robot.name!r}",
            got="joint coordinates" if isinstance(request, np.ndarray) else request.batch,
            expected="one pose of the platform, whose postures are listed",
        )
    at = finder.at(request).pose[0]  # what the pose leaves open, the legs determine
    found = {}
    for solver in finder.solvers:
        modes, q = solver.that_close(at)
        home = getattr(solver.closed_form, "mode", None)
        own = [
            LegPosture(solver.leg.name, coordinates, mode, mode == home)
            for mode, coordinates in zip(modes, q, strict=True)
        ]
        found[solver.leg.name] = tuple(sorted(own, key=lambda one: not one.of_home))
    return found
