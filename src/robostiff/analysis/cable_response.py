"""Response of a cable robot with locked winches to a load: displacement, tensions, slack."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.cable_stiffness import CableStiffness, cable_stiffness, judged
from robostiff.analysis.result import given_wrenches, require_one_pose
from robostiff.analysis.result_tables import cable_load_html
from robostiff.cables import TensionRule
from robostiff.cables.equilibrium import Hanging, first_slack, load_path
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.errors import NoAnswerError
from robostiff.kinematics import Pose
from robostiff.model.cable import CableRobot
from robostiff.spatial.rotation import matrix_of_rotation, vector_of_rotation

_FURTHEST = 100.0  # times the load, up to which slack is searched for


@dataclass(frozen=True)
class SlackEvent:
    """The first cable that becomes slack while the load grows.

    Attributes
    ----------
    factor : float
        Part of the load at which it does; above 1 beyond the load.
    cable : str
    """

    factor: float
    cable: str


@dataclass(frozen=True, repr=False)
class CableResponse:
    """A cable robot under a load on top of its weight.

    Attributes
    ----------
    load : (n,) array
        About the reference point, which it follows; it keeps its direction [N, N m].
    before : CableStiffness
        Without the load.
    status : Status
    carried : float
        Part of the load up to which there is a stable rest; 1 for all of it.
    displacement : (n,) array or None
        Of the reference point [m], and rotation vector [rad]: not small for certain. None where the
        load is not carried.
    after : CableStiffness or None
        Tensions and stiffness under the load, slack cables left out.
    first_slack : SlackEvent or None
        None where no cable becomes slack up to a hundred times the load, or up to where the
        platform moves away.
    beyond_limits : tuple of str
        Cables whose tension is, a sentence each.
    """

    load: np.ndarray
    before: CableStiffness
    status: Status
    carried: float
    displacement: np.ndarray | None = None
    after: CableStiffness | None = None
    first_slack: SlackEvent | None = None
    beyond_limits: tuple[str, ...] = ()

    @property
    def has_answer(self) -> bool:
        """Whether the load is carried."""
        return self.after is not None

    @property
    def tensions(self) -> np.ndarray:
        """Tensions under the load (m,) [N]; zero for slack cables.

        Raises
        ------
        NoAnswerError
            When the load is not carried.
        """
        return self._answer().tensions

    @property
    def K(self) -> np.ndarray:
        """Stiffness matrix under the load (n, n), of the cables that are taut.

        Raises
        ------
        NoAnswerError
            When the load is not carried.
        """
        return self._answer().K

    @property
    def slack(self) -> tuple[str, ...]:
        """Cables that are slack under the load."""
        after = self._answer()
        return tuple(
            name for name, axial in zip(after.cable_names, after.axial, strict=True) if axial == 0
        )

    @property
    def advice(self) -> tuple[str, ...]:
        """Advice about this result, a sentence each."""
        return (*self.beyond_limits, *self.status.advice)

    def __repr__(self) -> str:
        slack = f"slack {', '.join(self.slack) or 'none'}" if self.has_answer else "no rest"
        return f"<CableResponse of {self.before.name!r}: {slack}, status {self.status}>"

    def _repr_html_(self) -> str:
        return cable_load_html(self)

    def _answer(self) -> CableStiffness:
        if self.after is None:
            advice = " ".join(f"{line}." for line in self.advice)
            raise NoAnswerError(
                f"{self.before.name!r} does not carry the load ({self.status}): {advice}"
            )
        return self.after


def cable_response(
    robot: CableRobot,
    pose: Pose = None,
    load: ArrayLike | None = None,
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
    load : (n,) array
        About the reference point [N, N m].
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
    >>> bent = rs.cable_response(rs.load("cable-4-planar"), load=[0, -200, 0])
    >>> bent.slack, round(bent.first_slack.factor, 2)
    (('cable1', 'cable2'), 0.27)
    """
    before = cable_stiffness(robot, pose, tensions=tensions, tolerance=tolerance)
    hint = "loop over the poses"
    require_one_pose("a loaded cable robot", before.batch_shape, hint)
    F = given_wrenches(load, robot.space, subject="load", hint="write load=[...]")
    barred = Status.FREE_MOTIONS | Status.UNSTABLE
    if not before.answered:
        return CableResponse(F, before, before.status, 0.0)
    if before.status & barred:
        return CableResponse(F, before, before.status | Status.NO_EQUILIBRIUM, 0.0)
    rest = Hanging.at_rest(before.placed, before.axial, before.tensions)
    event, state, carried = _followed(rest, F)
    names = before.cable_names
    slack = None if event is None else SlackEvent(event[0], names[event[1]])
    if state is None:
        status = before.status | Status.NO_EQUILIBRIUM
        return CableResponse(F, before, status, carried, first_slack=slack)
    after = _after(before, robot, state, F)
    status = after.status
    if np.any(after.axial == 0):
        status |= Status.SLACK
    moved = np.concatenate([state.shift, vector_of_rotation(state.R)])[list(robot.space.rows)]
    beyond = tuple(_beyond_limits(robot, after))
    return CableResponse(F, before, status, 1.0, moved, after, slack, beyond)


def _beyond_limits(robot: CableRobot, after: CableStiffness) -> Iterator[str]:
    """The taut cables whose tension is beyond its limits, a sentence each."""
    least, greatest = robot.tension_limits
    for i in np.flatnonzero(_beyond(robot, np.where(after.axial > 0, after.tensions, np.nan))):
        yield (
            f"the tension of {robot.cables[i].name!r} is {after.tensions[i]:.5g} N, "
            f"outside its limits {least[i]:.5g} to {greatest[i]:.5g} N"
        )


def _followed(
    rest: Hanging, F: np.ndarray
) -> tuple[tuple[float, int] | None, Hanging | None, float]:
    """The first slack cable, the state under the full load, and the part that is carried."""
    if not np.any(F):
        return None, rest, 1.0
    holding = rest.holding  # others hold what the tensions do not balance, also under the load

    def under(factor: float, start: Hanging) -> Hanging | None:
        return start.at_equilibrium(holding + factor * F)

    event, last = None, (0.0, rest)
    for here in load_path(under, last, 1.0):
        event = event or first_slack(under, last, here)
        last = here
    if last[0] < 1.0:
        return event, None, last[0]
    state = last[1]
    if event is None:
        for here in load_path(under, last, _FURTHEST):
            event = first_slack(under, last, here)
            if event is not None:
                break
            last = here
    return event, state, 1.0


def _after(
    before: CableStiffness, robot: CableRobot, state: Hanging, F: np.ndarray
) -> CableStiffness:
    pulls = state.pulls
    tensions = state.tensions
    taut = pulls > 0
    status = np.uint16(before.status & Status.UNBALANCED)
    if are_beyond_limits(robot, np.where(taut, tensions, np.nan)):
        status |= np.uint16(Status.BEYOND_LIMITS)
    R = state.R @ matrix_of_rotation(before.pose[3:])
    origin = before.pose[:3] - before.reference_point
    position = before.reference_point + state.shift + state.R @ origin
    return judged(
        replace(
            before,
            pose=np.concatenate([position, vector_of_rotation(R)]),
            placed=state.now,
            tensions=tensions,
            axial=np.where(taut, before.axial, 0.0),
            wrench=F,
            load_point=state.now.reference_point,
            status_codes=np.asarray(status),
            rule="locked winches",
        )
    )


def are_beyond_limits(robot: CableRobot, tensions: np.ndarray) -> np.ndarray:
    """Whether some of the tensions (..., m) are beyond their limits (...); NaN are not."""
    return np.any(_beyond(robot, tensions), axis=-1)


def _beyond(robot: CableRobot, tensions: np.ndarray) -> np.ndarray:
    """Which of the tensions (..., m) are."""
    least, greatest = robot.tension_limits
    return (tensions < least - 1e-9) | (tensions > greatest * (1 + 1e-9))
