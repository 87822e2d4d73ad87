"""A robot under a growing load: its critical load, and its curve through turning points."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError, needs_extra
from robostiff.frozen import frozen
from robostiff.kinematics import Near
from robostiff.linkage import Linkage
from robostiff.markup import InNotebooks
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.one_thread import in_one_thread
from robostiff.spatial import as_float, as_floats
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.equations.equilibrium_path import OnPath, first_critical, path
from robostiff.statics.equations.newton import FoundEquilibrium
from robostiff.statics.equations.problem import LoadCase
from robostiff.statics.equations.stability import (
    CriticalPoint,
    end_of_path,
    least_margin,
    meets_stiffness,
)
from robostiff.statics.loading.given_loads import Acting, Gravity, Laws, Loads
from robostiff.statics.loading.loaded_posture import LoadedPosture, one_loaded_posture
from robostiff.statics.result import Equilibrium
from robostiff.statics.solution import BeamCheck, solve, with_enough_elements

if TYPE_CHECKING:
    import xarray

_BOWING = Bowing()


@frozen(repr=False)
class CriticalLoad(InNotebooks):
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
        return self._critical_point.factor

    @property
    def mode(self) -> str:
        """How the robot leaves its place, in words."""
        return self._critical_point.words

    @property
    def leg(self) -> str | None:
        """The leg that buckles while the platform stays; None where the platform moves."""
        return self._critical_point.leg

    @property
    def twist(self) -> np.ndarray:
        """Motion of the platform, about its point, per metre or radian (r,)."""
        return self._critical_point.twist

    @property
    def is_limit(self) -> bool:
        """Whether no larger load is carried at all: the platform snaps through."""
        return self._critical_point.is_limit

    @property
    def advice(self) -> tuple[str, ...]:
        """What to know about this answer, a sentence each."""
        return self.status.advice

    @property
    def _critical_point(self) -> CriticalPoint:
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


@in_one_thread
def critical_load(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Any = None,
    wrench: ArrayLike | None = None,
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
    acting = Acting(loads, gravity, preload, beams, at, laws or {})
    loaded, F, again = one_loaded_posture(robot, pose, wrench, near, acting, grows)
    problem, status = loaded.problem, loaded.status
    if not loaded.has_posture:
        return CriticalLoad(loaded.name, F, status, 0.0, None)
    if problem.at_rest.rigid:
        status |= Status.RIGID_DIRECTION
    loading = LoadCase(F, share=1.0, share_rate=0.0)

    def search(
        loaded: LoadedPosture, check: BeamCheck
    ) -> tuple[FoundEquilibrium | None, CriticalPoint | None, float]:
        last, point, searched_to = first_critical(
            check.watched(path(loaded.problem, loading)), up_to
        )
        if point is not None:
            check.see(point.found.state)
        return last, point, searched_to

    last, point, searched_to = with_enough_elements(loaded, again, search)
    is_free = not meets_stiffness(problem.at_rest)
    if is_free:
        status |= Status.FREE_MOTIONS
    if is_free and point is not None and point.factor <= 0:
        point = None  # what nothing holds is not stable without the load, either
    elif point is None and searched_to < up_to:
        status |= end_of_path(problem, last)
    return CriticalLoad(loaded.name, F, status, searched_to, point)


@in_one_thread
def load_path(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Any = None,
    wrench: ArrayLike | None = None,
    factors: ArrayLike = (),
    *,
    at: ArrayLike | None = None,
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, Any] | None = None,
    laws: Laws | None = None,
    beams: Beams = _BOWING,
    near: Near = None,
) -> xarray.Dataset:
    """Force-deflection curve: equilibria under multiples of a wrench.

    At every factor s stands what `equilibrium` answers to ``s wrench``, `loads`, weights and
    `preload` acting in full. Beside it stands the path of equilibria as the wrench grows from
    zero: it goes on through the turning points of a load that a robot cannot carry, where it snaps
    through, and says where it is stable.

    Parameters
    ----------
    robot, pose, at, loads, gravity, preload, laws, beams, near
        As for `equilibrium`.
    wrench : (6,) array, or (3,) for a planar robot
        At factor 1 [N, N m].
    factors : (N,) array
        One or more numbers, of either sign.

    Returns
    -------
    xarray.Dataset
        Along ``factor``: ``displacement`` (from the unloaded posture), ``pose``, ``K``,
        ``K_total``, ``energy``, ``margin``, ``stable``, ``status_code``; no number where there is
        no equilibrium, which the status explains. Along ``step``: ``path_factor``,
        ``path_displacement``, ``path_stable``, ``path_status_code``, up to the largest factor or
        to where it ends; a step at each critical point at which stability is lost, the last that
        counts as stable. Along ``critical``: ``critical_factor`` and ``critical_mode`` of these
        points, and of singular postures of rigid bars.

    Raises
    ------
    InputError
        As for `equilibrium`; when the wrench is zero, or factors are no row of numbers.

    Examples
    --------
    >>> import robostiff as rs
    >>> curve = rs.load_path(rs.load("3-puu"), None, [500, 0, 0, 0, 0, 0], [0.5, 1.0])
    >>> (1e3 * curve.displacement.sel(twist="dx")).round(2).values
    array([14.32, 27.24])
    """
    words = "one or more numbers, such as np.linspace(0, 2, 21)"
    s = np.atleast_1d(as_floats("factors of a load path", factors, words))
    if s.ndim != 1 or not s.size:
        raise InputError("factors of a load path", got=factors, expected=words)
    grows = "load_path(robot, pose, [0, 0, -1000, 0, 0, 0], factors)"
    acting = Acting(loads, gravity, preload, beams, at, laws or {})
    loaded, F, again = one_loaded_posture(robot, pose, wrench, near, acting, grows)
    follow = partial(_path, F=F, furthest=float(s.max()))
    loaded, along = with_enough_elements(loaded, again, follow)
    answers = [solve(loaded, again, factor * F, standing=True) for factor in s]
    found = Equilibrium.of(loaded.name, loaded.space, answers)
    with needs_extra("maps", "maps"):
        import xarray
    space = loaded.space
    energy = np.array([answer.energy if answer.has_answer else np.nan for answer in found])
    moved = np.reshape([step.found.displacement for step in along], (len(along), space.size))
    critical = [point for step in along for point in step.critical]
    beyond = np.logical_or.accumulate([bool(step.critical) for step in along])
    stable = np.array([step.is_stable for step in along], dtype=bool)
    codes = np.where(stable, 0, Status.UNSTABLE)
    codes |= np.where(beyond, Status.BEYOND_CRITICAL_LOAD, 0)
    whole = {"long_name": "from the unloaded posture", "units": "m, rad"}
    variables: dict[str, Any] = {
        "displacement": (("factor", "twist"), found.displacement.filled(np.nan), whole),
        "pose": (("factor", "coordinate"), found.pose.filled(np.nan), {"units": "m, rad"}),
        "K": (("factor", "wrench", "twist"), found.K.filled(np.nan)),
        "K_total": (("factor", "wrench", "twist"), found.K_total.filled(np.nan)),
        "energy": (("factor",), energy, {"units": "J"}),
        "margin": (("factor",), found.margin.filled(np.nan)),
        "stable": (("factor",), found.stable),
        "status_code": (("factor",), found.status_codes),
        "path_factor": (("step",), np.array([step.found.factor for step in along])),
        "path_displacement": (("step", "twist"), moved, whole),
        "path_stable": (("step",), stable),
        "path_status_code": (("step",), codes.astype(np.uint16)),
        "critical_factor": (("critical",), np.array([point.factor for point in critical])),
        "critical_mode": (("critical",), np.array([point.words for point in critical], dtype=str)),
    }
    coordinates = {
        "factor": s,
        "twist": list(space.twist_order),
        "wrench": list(space.wrench_order),
        "coordinate": ["x", "y", "z", "rx", "ry", "rz"],
    }
    return xarray.Dataset(
        variables, coordinates, {"robot": loaded.name, "wrench": F.tolist(), "units": "SI"}
    )


def _path(
    loaded: LoadedPosture, check: BeamCheck, F: np.ndarray, furthest: float
) -> tuple[LoadedPosture, list[OnPath]]:
    """A robot, and its equilibria as the wrench grows to the furthest, or turns back to nothing.

    Between a stable and an unstable one stands the critical point, which counts as stable.
    """
    problem = loaded.problem
    if furthest <= 0 or not loaded.has_posture:
        return loaded, []
    loading = LoadCase(F, share=1.0, share_rate=0.0)
    found: list[OnPath] = []
    for step in check.watched(path(problem, loading, largest=0.1 * furthest)):
        on_path, at = step, step.found
        if at.factor > furthest:  # the last step ends at the largest factor
            last = on_path.at(furthest)
            at = last if last.converged else at
            is_stable = least_margin(at).value >= 0
            passed = tuple(point for point in on_path.critical if point.factor <= at.factor)
            on_path = OnPath(at, is_stable, passed)
        if found and on_path.is_stable != found[-1].is_stable:
            found += [OnPath(point.found, True) for point in on_path.critical[-1:]]
        found.append(on_path)
        if found[1:] and not 0 <= at.factor < furthest:
            break
    return loaded, found
