"""Response of a cable robot with locked winches to a load: displacement, tensions, slack."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis import CableResponse, SlackEvent, cable_stiffness
from robostiff.analysis.cable_stiffness import beyond_limits, status_of_cables, with_status
from robostiff.analysis.result import given_wrenches, require_one_pose
from robostiff.cables import TensionRule, place_cables
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.kinematics import Pose
from robostiff.model.cable import CableRobot
from robostiff.spatial.rotation import matrix_of_rotation, vector_of_rotation
from robostiff.statics.equations.equilibrium_path import first_critical, path
from robostiff.statics.equations.newton import FoundEquilibrium, equilibrium_at
from robostiff.statics.equations.problem import EquilibriumProblem, LoadCase
from robostiff.statics.equations.stability import least_margin
from robostiff.statics.loading.given_loads import Acting
from robostiff.statics.loading.loaded_posture import Postures

_FURTHEST = 100.0  # times the load, up to which slack is searched for
# Times the load: steps up to it before the path is followed, and beyond it, at least; of the length
# of the robot, or [rad], how far one may move it; and steps of Newton's method, before there is no
# equilibrium near by.
_SHORTEST, _BEYOND, _NEAR, _STEPS = 0.3, 0.01, 0.1, 12
_TAUT = 1e-10


def cable_response(
    robot: CableRobot,
    pose: Pose = None,
    wrench: ArrayLike | None = None,
    *,
    tensions: TensionRule | None = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> CableResponse:
    """Equilibrium of a cable robot under a load with locked winches: displacement, tensions, slack.

    At the pose the tensions balance the weight. Then the load grows, the cables stretch as
    ``t = max(0, k (l - l_slack))``, and the platform moves to where it rests again; displacements
    need not be small. The load keeps its direction and acts at the reference point.

    Parameters
    ----------
    robot : CableRobot
    pose : RigidTransform, array or None
        A single pose, as for `stiffness`.
    wrench : (n,) array
        The load about the reference point [N, N m].
    tensions : TensionRule, optional
        Tensions before the load, as for `cable_tensions`.
    tolerance : Tolerance

    Raises
    ------
    InputError
        When an argument does not fit, or several poses are given.

    Examples
    --------
    >>> import robostiff as rs
    >>> bent = rs.cable_response(rs.load("cable-4-planar"), wrench=[0, -200, 0])
    >>> bent.slack, round(bent.first_slack.factor, 2)
    (('cable1', 'cable2'), 0.27)
    """
    before = cable_stiffness(robot, pose, tensions=tensions, tolerance=tolerance)
    require_one_pose("a loaded cable robot", before.batch_shape, "loop over the poses")
    F = given_wrenches(wrench, robot.space, hint="write wrench=[...]")
    barred = Status.FREE_MOTIONS | Status.UNSTABLE
    if not before.answered:
        return CableResponse(F, before, before.status, 0.0)
    if before.status & barred:
        return CableResponse(F, before, before.status | Status.NO_EQUILIBRIUM, 0.0)
    problem = Postures(robot, cables=before).with_loads(0, Acting()).problem
    event, found, carried = _outcome(problem, LoadCase(F))
    names = before.cable_names
    slack = None if event is None else SlackEvent(event[0], names[event[1]])
    if found is None:
        status = before.status | Status.NO_EQUILIBRIUM
        return CableResponse(F, before, status, carried, first_slack=slack)
    turn, pulls = found.state.R, _pulls(found)
    R = turn @ matrix_of_rotation(before.pose[3:])
    position = found.state.p + turn @ (before.pose[:3] - before.reference_point)
    placed = place_cables(robot, R, position)
    after = with_status(
        replace(
            before,
            pose=np.concatenate([position, vector_of_rotation(R)]),
            placed=placed,
            tensions=np.maximum(pulls, 0.0),
            axial=np.where(pulls > 0, before.axial, 0.0),
            wrench=F,
            load_point=placed.reference_point,
            status_codes=np.asarray(np.uint16(before.status & Status.UNBALANCED)),
            rule="locked winches",
        )
    )
    status = after.status | status_of_cables(robot, after.tensions)
    moved = found.displacement
    beyond = tuple(beyond_limits(robot, after.tensions))
    return CableResponse(F, before, status, 1.0, moved, after, slack, beyond)


def _outcome(
    problem: EquilibriumProblem, loading: LoadCase
) -> tuple[tuple[float, int] | None, FoundEquilibrium | None, float]:
    """The first slack cable, the whole load's equilibrium, and the part that is carried.

    In long steps from one stable equilibrium to the next; where these end, on the path itself from
    the beginning on: they may have left it.
    """
    here = start = equilibrium_at(problem, loading, 0.0, problem.unloaded)
    if not np.any(loading.wrench):
        return None, here if here.converged else None, 1.0
    event, whole = None, None
    for last, shortest in ((1.0, _SHORTEST), (_FURTHEST, _BEYOND)):
        for found in _long_steps(here, last, shortest):
            event = event or _first_slack(here, found)
            here = found
            if whole is not None and event is not None:
                return event, whole, 1.0
        if whole is None and here.factor < last:
            steps, seen = [], [start]
            for step in path(problem, loading):
                steps.append(step)
                seen += [step.found] if step.is_stable else []
                if step.critical or step.found.factor >= last:
                    seen += [point.found for point in step.critical[:1]]
                    break
            ended, critical, carried = first_critical(steps, last)
            is_carried = critical is None and carried == last
            pairs = itertools.pairwise(seen) if event is None else ()
            event = event or next(filter(None, itertools.starmap(_first_slack, pairs)), None)
            return event, ended if is_carried else None, carried
        whole = whole or here
        if event is not None:
            break
    return event, whole, 1.0


def _long_steps(here: FoundEquilibrium, last: float, shortest: float) -> Iterator[FoundEquilibrium]:
    """Stable equilibria near by each other under the growing load, after one up to a factor."""
    problem, loading, step = here.problem, here.loading, min(1.0, last - here.factor)
    while here.converged and here.factor < last and step > shortest:
        factor = min(here.factor + step, last)
        found = equilibrium_at(problem, loading, factor, here.state, steps=_STEPS)
        moved = problem.size_of(found.displacement - here.displacement)
        if found.converged and moved < _NEAR and least_margin(found).value > 0:
            here = found
            yield here
            step *= 2.0
        else:
            step *= 0.5


def _pulls(found: FoundEquilibrium) -> np.ndarray:
    """Stiffness times stretch (m,) [N]: the tension, or negative for a slack cable."""
    legs = found.problem.legs
    each = zip(legs.springs, legs.pulls(found.state, 0.0).length, strict=True)
    return np.array([cable.stiffness * length + cable.constant for cable, length in each])


def _first_slack(before: FoundEquilibrium, after: FoundEquilibrium) -> tuple[float, int] | None:
    """Factor at which the first cable becomes slack between two equilibria, and its number."""
    pulls = _pulls(before)
    # A cable may be just taut, within rounding.
    margin = _TAUT * float(np.max(pulls))
    taut = pulls >= -margin
    if not np.any(_pulls(after)[taut] < -margin):
        return None
    known = {before.factor: before, after.factor: after}

    def least(factor: float) -> float:
        if factor not in known:
            near = known[min(known, key=lambda other: abs(other - factor))]
            found = near.under(factor)
            if not found.converged:  # the cable is already slack
                return -1.0
            known[factor] = found
        return float(_pulls(known[factor])[taut].min()) + margin

    factor = before.factor
    if least(factor) > 0:
        from scipy.optimize import root_scalar

        found = root_scalar(least, bracket=(before.factor, after.factor), xtol=1e-12)
        factor = float(found.root)
        pulls = _pulls(known.get(factor, after))
    return factor, int(np.argmin(np.where(taut, pulls, np.inf)))
