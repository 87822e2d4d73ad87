"""The critical load of a robot: how often a wrench may act before stability is lost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near
from robostiff.linkage import Linkage
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.spatial import as_float
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.equations.critical_point import CriticalPoint
from robostiff.statics.equations.equilibrium_path import first_critical
from robostiff.statics.equations.problem import LoadCase
from robostiff.statics.equations.stability import meets_stiffness
from robostiff.statics.loading.given_loads import Gravity, Loads
from robostiff.statics.loading.joint_laws import Laws
from robostiff.statics.loading.loaded_posture import one_loaded_posture

_BOWING = Bowing()


@dataclass(frozen=True, repr=False)
class CriticalLoad:
    """The smallest factor of a wrench at which a robot loses its stability.

    Attributes
    ----------
    name : str
    wrench : (r,) array
        At factor 1 [N, N m].
    status : Status
        Bad where the path of equilibria could not be followed. With free motions, there may be no
        stable equilibrium to start from.
    searched_to : float
        Factor up to which equilibria were followed.
    point : CriticalPoint or None
        None where the robot is stable up to `searched_to`.
    """

    name: str
    wrench: np.ndarray
    status: Status
    searched_to: float
    point: CriticalPoint | None

    @property
    def is_found(self) -> bool:
        """Whether there is a critical load up to `searched_to`."""
        return self.point is not None

    @property
    def factor(self) -> float:
        """Of the wrench.

        Raises
        ------
        NoAnswerError
            Where none was found.
        """
        return self._required.factor

    @property
    def mode(self) -> str:
        """How the robot leaves its place, in words."""
        return self._required.words

    @property
    def leg(self) -> str | None:
        """The leg that buckles while the platform stays; None where the platform moves."""
        return self._required.leg

    @property
    def twist(self) -> np.ndarray:
        """Motion of the platform, about its point, per metre or radian (r,)."""
        return self._required.twist

    @property
    def is_limit(self) -> bool:
        """Whether no larger load is carried at all: the platform snaps through."""
        return self._required.is_limit

    @property
    def advice(self) -> tuple[str, ...]:
        """What to know about this answer, a sentence each."""
        return self.status.advice

    @property
    def _required(self) -> CriticalPoint:
        if self.point is None:
            searched = [f"none up to factor {self.searched_to:g}"] if self.searched_to else []
            why = "; ".join((*searched, *self.advice))
            raise NoAnswerError(f"no critical load of {self.name!r}: {why}")
        return self.point

    def __repr__(self) -> str:
        if self.point is None:
            return (
                f"<CriticalLoad of {self.name!r}: none up to factor {self.searched_to:g}, "
                f"status {self.status}>"
            )
        return f"<CriticalLoad of {self.name!r}: factor {self.factor:.6g}, {self.mode}>"


def critical_load(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Any = None,
    wrench: ArrayLike = (),
    *,
    at: ArrayLike | None = None,
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, Any] | None = None,
    laws: Laws | None = None,
    beams: Beams = _BOWING,
    near: Near = None,
    up_to: float = 1e3,
) -> CriticalLoad:
    """Smallest factor of a wrench at which a robot stops being stable, and how it leaves.

    Equilibria are followed from the wrench zero on, `loads`, weights and `preload` acting
    throughout, until the energy has no minimum any more, or rigid bars lie in a singular
    posture, where another assembly mode begins; the point between is then solved for. The factor
    is 0 where these alone are too large.

    Parameters
    ----------
    robot, pose, at, loads, gravity, preload, laws, beams, near
        As for `equilibrium`.
    wrench : (6,) array, or (3,) for a planar robot
        At factor 1, as for `equilibrium` [N, N m].
    up_to : float
        Factor at which the search ends.

    Returns
    -------
    CriticalLoad

    Raises
    ------
    InputError
        As for `equilibrium`; when the wrench is zero.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = rs.critical_load(rs.load("gough-stewart-b"), wrench=[0, 0, -1e6, 0, 0, 0])
    >>> round(found.factor, 2), found.mode
    (71.6, 'the platform buckles: ...')
    """
    up_to = as_float("up_to of a critical load", up_to, "a positive factor")
    if not up_to > 0:
        raise InputError("up_to of a critical load", got=up_to, expected="a positive factor")
    grows = "critical_load(robot, pose, [0, 0, -1000, 0, 0, 0])"
    loaded, F = one_loaded_posture(
        robot, pose, wrench, at, loads, preload, beams, near, gravity, grows
    )
    loaded = loaded.under(laws)
    problem, status = loaded.problem, loaded.status
    nothing = np.zeros(problem.size)
    if not loaded.has_posture:
        return CriticalLoad(loaded.name, F, status, 0.0, None)
    unloaded = problem.at_rest
    if unloaded.rigid:
        status |= Status.RIGID_DIRECTION
    loading = LoadCase(nothing, F, share=1.0, share_rate=0.0)
    _, point, searched_to = first_critical(problem, loading, unloaded, up_to)
    is_free = not meets_stiffness(problem, unloaded)
    if is_free:
        status |= Status.FREE_MOTIONS
    if is_free and point is not None and point.factor <= 0:
        point = None  # what nothing holds is not stable without the load, either
    elif point is None and searched_to < up_to:
        status |= Status.NO_EQUILIBRIUM
    return CriticalLoad(loaded.name, F, status, searched_to, point)
