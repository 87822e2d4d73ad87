"""Advice for legs with several postures of different stiffness, of which none was chosen."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robostiff.elastostatics import scaling
from robostiff.kinematics import Posture, PostureFinder, place_chain
from robostiff.kinematics.closure import LegSolver, NewtonTask
from robostiff.model import Actuated, PlacedLeg, Snapshot

# Of the stiffness of a leg: two postures that differ by less are the same to it.
_SAME = 1e-6
_MOVES = 1e-6  # radians and parts of the length: less is rounding
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
    robot without home. Home coordinates choose none for a leg whose drives can move while the
    platform stands still.

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
    moving = []
    for solver, q in zip(finder.solvers, posture.coordinates, strict=True):
        if any(_drives_move_alone(solver, posture.pose[i], q[i]) for i in rows[:1]):
            moving.append(repr(solver.leg.name))
            continue
        if finder.robot.is_posed_by_joints:
            given = bool(np.any(solver.leg.chain.home_given))
        else:
            given = solver.posture_is_given
        if given:
            continue
        if any(_matters(finder, solver, posture.pose[i], q[i], leg_stiffness) for i in rows):
            names.append(repr(solver.leg.name))
    advice = (*_advice(names), *map(_of_moving_drives, moving))
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


def _drives_move_alone(solver: LegSolver, pose: np.ndarray, q: np.ndarray) -> bool:
    """Whether drives of a leg closed by iteration can move at a posture whose end is fixed."""
    if solver.closed_form is not None:
        return False
    leg = solver.leg
    J = NewtonTask((leg,), (), solver.length).rates(np.concatenate([pose, q])[None])[0]
    values, V_T = np.linalg.svd(J)[1:]
    alone = V_T[np.count_nonzero(values > _MOVES) :]
    drives = [isinstance(leg.chain.roles[i], Actuated) for i in np.flatnonzero(leg.chain.free)]
    return bool(np.any(np.abs(alone[:, drives]) > _MOVES))


def _of_moving_drives(name: str) -> str:
    return (
        f"the drives of leg {name} can move while the platform stands still, and the pose alone "
        "does not say how it stands: the posture nearest to home is taken; choose one by joint "
        "coordinates close by: near=[...]"
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
