"""Random cable robots under loads, against the energy of cables that only pull."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from tests.cables.machines import random_robot
from tests.campaign.answers import Complaint, Judge
from tests.campaign.bodies import Bodies, DeadPull, NoMinimumError, PointSpring, curvatures, minimum

_SAME = 1e-7
_DRAWS = 60  # until tensions are feasible
_LENGTH = 1.0  # of these robots [m]


def suspended(robot: rs.CableRobot, six: np.ndarray, tensions: np.ndarray) -> Bodies:
    """The platform in its cables, which have these tensions at a pose.

    ``t = EA (l - l0) / l0`` in series with the winch, where ``l0 = (l + g - t/kw) / (1 + t/EA)``.
    """
    R, p = Rotation.from_rotvec(six[3:]).as_matrix(), six[:3]
    bodies = Bodies([np.zeros(3), R @ robot.reference_point + p], _LENGTH)
    for cable, t in zip(robot.cables, tensions, strict=True):
        end = R @ cable.attachment + p
        length = float(np.linalg.norm(end - cable.exit_point))
        soft = 0.0 if cable.winch_stiffness is None else 1 / cable.winch_stiffness
        rest = (length + cable.guide_length - t * soft) / (1 + t / cable.EA)
        k = 1 / (rest / cable.EA + soft)
        ends = np.asarray(cable.exit_point), end
        bodies.springs.append(PointSpring(0, 1, ends, k, t - k * length, is_cable=True))
    if robot.weight is not None:
        centre = R @ robot.weight.point + p
        bodies.pulls.append(DeadPull(1, centre, np.asarray(robot.weight.force)))
    return bodies


def cable_robot(rng: np.random.Generator) -> list[Complaint]:
    """Seven to ten cables under a wrench, some of them slack."""
    judge = Judge(None, _LENGTH, False)
    for _ in range(_DRAWS):
        robot = random_robot(int(rng.integers(2**31)), int(rng.integers(7, 11)))
        pose = rng.uniform(-0.2, 0.2, 6)
        at_rest = rs.cable_tensions(robot, pose)
        if not at_rest.status & rs.Status.INFEASIBLE:
            break
    else:
        return judge.complaints
    _in_a_batch(rng, robot, pose, judge)
    bodies = suspended(robot, pose, np.ravel(at_rest.tensions))
    try:
        free = minimum(bodies, np.zeros(6))
        C = free.compliance
        F = rng.normal(size=6)
        F *= 10 ** rng.uniform(-4, -1.5) / np.max(np.abs(C @ F))
        truth = minimum(bodies, F)
    except NoMinimumError:
        return judge.complaints
    K = rs.stiffness(robot, pose)
    curved = curvatures(bodies, free.state)
    if curved[0] < 1e-6 * curved[-1] or K.status != rs.Status.OK:
        return judge.complaints
    off = judge.distance(0.5 * (K.K + K.K.T), np.linalg.inv(C))
    if not off <= 1e-6:
        judge.say("cables", "another K at rest", f"{off:.1e}")
    found = rs.equilibrium(robot, pose, F)
    bad = rs.Status.BEYOND_CRITICAL_LOAD | rs.Status.UNSTABLE | rs.Status.NO_EQUILIBRIUM
    moved = np.max(np.abs(truth.displacement))
    if found.status & bad or moved > 0.1:
        return judge.complaints
    off = np.max(np.abs(found.displacement - truth.displacement))
    if not off <= _SAME * moved + 1e-11:
        slack = sum(1 for cable in found.springs if cable.tension <= 0)
        judge.say("cables", "another place", f"{off:.1e} of {moved:.1e}, {slack} slack")
    return judge.complaints


def _in_a_batch(rng: np.random.Generator, robot: Any, pose: np.ndarray, judge: Judge) -> None:
    """The same status and K beside other poses."""
    batch = rs.cable_stiffness(robot, np.vstack([np.zeros(6), pose, rng.uniform(-0.2, 0.2, 6)]))
    one = rs.cable_stiffness(robot, pose)
    if int(one.status) != int(batch.status_codes[1]):
        judge.say("cables", "another status in a batch", str(one.status))
    elif bool(one.answered) and not judge.distance(batch[1].K, one.K) <= 1e-9:
        judge.say("cables", "another K in a batch", str(one.status))
