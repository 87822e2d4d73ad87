"""Advice for legs with several postures of different stiffness, of which none was chosen."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robostiff.elastostatics import scaling
from robostiff.kinematics import Posture, PostureFinder, place_chain
from robostiff.kinematics.closure import LegSolver
from robostiff.model import PlacedLeg, Snapshot

# Of the stiffness of a leg: two postures that differ by less are the same to it.
_SAME = 1e-6
_POSES = 3  # of a batch that are looked at, where the robot has no home
_QUESTION = "legs whose posture nobody chose"


def posture_advice(
    finder: PostureFinder,
    posture_of: Callable[[], Posture],
    leg_stiffness: Callable[[Snapshot], np.ndarray],
) -> tuple[str, ...]:
    """A sentence if the posture of a leg was not chosen, and others have another stiffness.

    A posture is chosen by home coordinates of the leg's joints, by an elbow, by joint coordinates
    or by `near`. Legs of which none is given are looked at, at home, or at a few of the poses of a
    robot without home.

    Parameters
    ----------
    finder : PostureFinder
        Of the robot, which was posed by its platform.
    posture_of : callable
        Gives the posture of a robot without home.
    leg_stiffness : callable
        Stiffness (N, n, n) of the one leg of a snapshot.
    """
    at_home = finder.robot.home is not None
    if at_home:  # of the robot as a whole: found out once, whatever the poses
        if _QUESTION in finder.known:
            return finder.known[_QUESTION]
        posture = finder.find(None)
    else:
        posture = posture_of()
    rows = np.flatnonzero(posture.reached)
    if rows.size > _POSES:
        rows = rows[np.linspace(0, rows.size - 1, _POSES, dtype=int)]
    names = []
    for solver, q in zip(finder.solvers, posture.coordinates, strict=True):
        if finder.robot.is_posed_by_joints:
            given = bool(np.any(solver.leg.chain.home_given))
        else:
            given = solver.posture_is_given
        if given:
            continue
        if any(_matters(finder, solver, posture.pose[i], q[i], leg_stiffness) for i in rows):
            names.append(repr(solver.leg.name))
    advice = _advice(names)
    if at_home:
        finder.known[_QUESTION] = advice
    return advice


def _advice(names: list[str]) -> tuple[str, ...]:
    if not names:
        return ()
    legs = f"leg {names[0]} reaches" if len(names) == 1 else f"legs {', '.join(names)} reach"
    return (
        f"{legs} the pose in several postures of different stiffness, and none was chosen: give "
        "home coordinates to the joints, or joint coordinates close by: near=[...]",
    )


def _matters(
    finder: PostureFinder,
    solver: LegSolver,
    pose: np.ndarray,
    q: np.ndarray,
    leg_stiffness: Callable[[Snapshot], np.ndarray],
) -> bool:
    others = solver.alternatives(pose)
    if not len(others):
        return False
    leg, robot = solver.leg, finder.robot
    every = np.concatenate([q[None], others])
    placed = place_chain(leg.chain, every, leg.base.R, leg.base.p)
    own = PlacedLeg(leg.name, placed.elements, placed.p)
    at = np.broadcast_to(placed.p[0], placed.p.shape)
    K = leg_stiffness(Snapshot(robot.name, (own,), at, robot.space))
    s = scaling(np.array(finder.length), robot.space)
    K = K / np.outer(s, s)
    apart = np.max(np.abs(K[1:] - K[0]), axis=(-1, -2))
    return bool(np.any(apart > _SAME * np.max(np.abs(K[0]))))
