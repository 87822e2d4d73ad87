"""A cable robot under a load: displacement, tensions, slack."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.cable_stiffness import CableStiffness
from robostiff.analysis.result_tables import cable_load_html
from robostiff.elastostatics import Status
from robostiff.errors import NoAnswerError
from robostiff.model.cable import CableRobot


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


def status_of_cables(robot: CableRobot, tensions: np.ndarray) -> Status:
    """What is to be said of tensions under a load (m,) [N]; those of slack cables are zero."""
    status = Status.OK if np.all(tensions > 0) else Status.SLACK
    return status | Status.BEYOND_LIMITS if any(beyond_limits(robot, tensions)) else status


def beyond_limits(robot: CableRobot, tensions: np.ndarray) -> Iterator[str]:
    """The taut cables whose tension (m,) [N] is beyond its limits, a sentence each."""
    least, greatest = robot.tension_limits
    for i in np.flatnonzero(_beyond(robot, np.where(tensions > 0, tensions, np.nan))):
        yield (
            f"the tension of {robot.cables[i].name!r} is {tensions[i]:.5g} N, "
            f"outside its limits {least[i]:.5g} to {greatest[i]:.5g} N"
        )


def are_beyond_limits(robot: CableRobot, tensions: np.ndarray) -> np.ndarray:
    """Whether some of the tensions (..., m) are beyond their limits (...); NaN are not."""
    return np.any(_beyond(robot, tensions), axis=-1)


def _beyond(robot: CableRobot, tensions: np.ndarray) -> np.ndarray:
    """Which of the tensions (..., m) are."""
    least, greatest = robot.tension_limits
    return (tensions < least - 1e-9) | (tensions > greatest * (1 + 1e-9))
