"""Response of a cable robot with locked winches to a load: displacement, tensions, slack."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis import CableResponse, CableStiffness, SlackEvent, cable_stiffness
from robostiff.analysis.cable_stiffness import beyond_limits, judged, status_of_cables
from robostiff.analysis.result import given_wrenches, require_one_pose
from robostiff.cables import TensionRule
from robostiff.cables.equilibrium import Hanging
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.kinematics import Pose
from robostiff.model.cable import CableRobot
from robostiff.spatial.rotation import matrix_of_rotation, vector_of_rotation
from robostiff.statics.equations.newton import FoundEquilibrium, equilibrium_at
from robostiff.statics.equations.problem import LOST, EquilibriumProblem, LoadCase, State
from robostiff.statics.loading.given_loads import on_platform
from robostiff.statics.loading.loaded_posture import cables_loaded

_FURTHEST = 100.0  # times the load, up to which slack is searched for
_SHORTEST_STEP = 1e-4  # of the load, before the path is given up
_TAUT = 1e-10
_STEPS = 12  # of Newton's method, before there is no equilibrium near by


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
    hint = "loop over the poses"
    require_one_pose("a loaded cable robot", before.batch_shape, hint)
    F = given_wrenches(wrench, robot.space, hint="write wrench=[...]")
    barred = Status.FREE_MOTIONS | Status.UNSTABLE
    if not before.answered:
        return CableResponse(F, before, before.status, 0.0)
    if before.status & barred:
        return CableResponse(F, before, before.status | Status.NO_EQUILIBRIUM, 0.0)
    loading = _GrowingLoad(
        cables_loaded(before, before.reference_point, on_platform((), before.reference_point)),
        LoadCase(np.zeros(len(F)), F),
        Hanging.at_rest(before.placed, before.axial, before.tensions),
    )
    event, found, carried = loading.followed()
    names = before.cable_names
    slack = None if event is None else SlackEvent(event[0], names[event[1]])
    if found is None:
        status = before.status | Status.NO_EQUILIBRIUM
        return CableResponse(F, before, status, carried, first_slack=slack)
    after = _after(before, loading.hanging(found), F)
    status = after.status | status_of_cables(robot, after.tensions)
    moved = found.displacement
    beyond = tuple(beyond_limits(robot, after.tensions))
    return CableResponse(F, before, status, 1.0, moved, after, slack, beyond)


@dataclass(frozen=True)
class _GrowingLoad:
    """A platform in cables under a load that grows; equilibria are found from one another."""

    problem: EquilibriumProblem
    loading: LoadCase
    unloaded: Hanging

    def hanging(self, found: FoundEquilibrium) -> Hanging:
        """The cables at an equilibrium."""
        return replace(self.unloaded, shift=found.state.p - self.problem.point, R=found.state.R)

    def followed(self) -> tuple[tuple[float, int] | None, FoundEquilibrium | None, float]:
        """The first slack cable, the whole load's equilibrium, and the part that is carried."""
        rest = self.at(0.0, self.problem.unloaded)
        if rest is None or not np.any(self.loading.wrench_rate):
            return None, rest, 1.0
        event, last = None, rest
        for here in self.path(last, 1.0):
            event = event or self.first_slack(last, here)
            last = here
        if last.factor < 1.0:
            return event, None, last.factor
        found = last
        if event is None:
            for here in self.path(last, _FURTHEST):
                event = self.first_slack(last, here)
                if event is not None:
                    break
                last = here
        return event, found, 1.0

    def at(self, factor: float, start: State) -> FoundEquilibrium | None:
        """The equilibrium under a part of the load, from a state near by."""
        found = equilibrium_at(self.problem, self.loading, factor, start, steps=_STEPS)
        return found if found.converged else None

    def path(self, start: FoundEquilibrium, last: float) -> Iterator[FoundEquilibrium]:
        """Stable equilibria under the growing load, after `start` up to a factor.

        The path ends early where the next equilibrium is lost or not stable.
        """
        here, step = start, min(1.0, last - start.factor)
        while here.factor < last:
            found = self.at(min(here.factor + step, last), here.state)
            if found is not None and self._is_next(here, found):
                here = found
                yield here
                step *= 2.0
                continue
            step *= 0.5
            if step < _SHORTEST_STEP * last:
                return

    def _is_next(self, before: FoundEquilibrium, after: FoundEquilibrium) -> bool:
        """Whether an equilibrium is a neighbour on the path, and the platform returns to it."""
        scale, K = self.problem.scale, after.known.K_total
        values = np.linalg.eigvalsh(0.5 * (K + K.T) / np.outer(scale, scale))
        turn = np.linalg.norm(vector_of_rotation(after.state.R @ before.state.R.T))
        shift = np.linalg.norm(after.state.p - before.state.p)
        is_near = turn < 0.3 and shift < 0.1 * self.problem.length
        return bool(is_near and values[0] > LOST * values[-1])

    def first_slack(
        self, before: FoundEquilibrium, after: FoundEquilibrium
    ) -> tuple[float, int] | None:
        """Factor at which the first cable becomes slack on a part of the path, and its number."""
        pulls = self.hanging(before).pulls
        # A cable may be just taut, within rounding.
        margin = _TAUT * float(np.max(pulls))
        taut = pulls >= -margin
        pulls_after = self.hanging(after).pulls
        if not np.any(pulls_after[taut] < -margin):
            return None
        known = {before.factor: before}

        def pulls_at(factor: float) -> np.ndarray | None:
            nearest = min(known, key=lambda own: abs(own - factor))
            found = self.at(factor, known[nearest].state)
            if found is None:
                return None
            known[factor] = found
            return self.hanging(found).pulls

        def least(factor: float) -> float:
            own = pulls_at(factor)
            # Where Newton's method finds no equilibrium, the cable is already slack.
            return -1.0 if own is None else float(own[taut].min()) + margin

        if least(before.factor) <= 0:
            return before.factor, int(np.argmin(np.where(taut, pulls, np.inf)))
        if least(after.factor) > 0:  # another rest is nearer to the start: the path decides
            return after.factor, int(np.argmin(np.where(taut, pulls_after, np.inf)))
        from scipy.optimize import root_scalar

        found = root_scalar(
            least, bracket=(before.factor, after.factor), method="brentq", xtol=1e-12
        )
        factor = float(found.root)
        own = pulls_at(factor)
        return factor, int(np.argmin(np.where(taut, pulls_after if own is None else own, np.inf)))


def _after(before: CableStiffness, state: Hanging, F: np.ndarray) -> CableStiffness:
    R = state.R @ matrix_of_rotation(before.pose[3:])
    origin = before.pose[:3] - before.reference_point
    position = before.reference_point + state.shift + state.R @ origin
    return judged(
        replace(
            before,
            pose=np.concatenate([position, vector_of_rotation(R)]),
            placed=state.now,
            tensions=state.tensions,
            axial=np.where(state.pulls > 0, before.axial, 0.0),
            wrench=F,
            load_point=state.now.reference_point,
            status_codes=np.asarray(np.uint16(before.status & Status.UNBALANCED)),
            rule="locked winches",
        )
    )
