"""How one equilibrium is found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

import numpy as np

from robostiff.analysis.cable_stiffness import status_of_cables
from robostiff.elastostatics import Status
from robostiff.frozen import field, frozen, replace
from robostiff.model.cable import CableRobot
from robostiff.statics.equations.equilibrium_path import (
    SAFE,
    first_critical,
    held_equilibrium,
    path,
)
from robostiff.statics.equations.newton import FoundEquilibrium, equilibrium_at
from robostiff.statics.equations.problem import LoadCase
from robostiff.statics.equations.stability import (
    CriticalPoint,
    Regular,
    end_of_path,
    may_be_singular,
    meets_stiffness,
    named_margins,
)
from robostiff.statics.loaded_parts import CarriedLoads
from robostiff.statics.loading.loaded_posture import LoadedPosture

# Of the length of the robot: what is no rounding between legs and platform.
_OPEN = 1e-9


@frozen
class Solution:
    """How one equilibrium was found, or why there is none.

    Attributes
    ----------
    status : Status
    critical : CriticalPoint or None
        Where stability is lost on the way to the full load.
    margins : mapping of str to float
        Of the platform, and of every leg with the platform held, by name: the least ratio of the
        curvature of the energy to that without load.
    held : bool
        Whether the pose of the platform was given, and the wrench follows.
    found : FoundEquilibrium or None
        Where Newton's method ended.
    loaded : LoadedPosture or None
        The robot from which it began.
    """

    status: Status
    critical: CriticalPoint | None = None
    margins: Mapping[str, float] = field(default_factory=dict)
    held: bool = False
    found: FoundEquilibrium | None = None
    loaded: LoadedPosture | None = None

    @property
    def margin(self) -> float:
        """Least of the margins that decide stability."""
        deciding = [m for name, m in self.margins.items() if name != "platform" or not self.held]
        return min(deciding, default=1.0)

    @property
    def carried(self) -> CarriedLoads:
        """What it carries under the share of preloads and of forces on legs that acts."""
        found = cast("FoundEquilibrium", self.found)
        share = found.loading.share_at(found.factor)
        return CarriedLoads(found.problem, found.state, share)


def solve(
    loaded: LoadedPosture,
    wrench: np.ndarray | None,
    displacement: np.ndarray | None = None,
    *,
    standing: bool = False,
) -> Solution:
    """The equilibrium of one robot at one posture, under a wrench or at a displacement.

    Where a growing load is followed, all loads grow together; or, `standing`, the wrench alone.
    """
    problem, status = loaded.problem, loaded.status
    if not loaded.has_posture:
        return Solution(status)
    F = np.zeros(problem.size) if wrench is None else wrench
    loading = LoadCase(F, *((1.0, 0.0) if standing else (0.0, 1.0)))
    if problem.at_rest.rigid:
        status |= Status.RIGID_DIRECTION
    found = (
        equilibrium_at(problem, loading, 1.0, problem.unloaded)
        if displacement is None
        else held_equilibrium(problem, loading, displacement)
    )
    held = displacement is not None
    critical: CriticalPoint | None = None
    margins = named_margins(found.known) if found.converged else {}
    doubtful = not found.converged or not found.direct or min(margins.values()) < SAFE
    legs = problem.legs
    if not doubtful and legs.springs:  # a cable may have become slack on the way
        pulls = legs.pulls(found.state, 1.0)
        each = zip(legs.springs, pulls.tension, strict=True)
        doubtful = any(spring.is_cable and tension == 0 for spring, tension in each)
    if not doubtful and may_be_singular(problem):  # rigid bars may have passed a singular posture
        doubtful = Regular.of(problem.at_rest).ratio(found.known) <= 0
    # what nothing elastic holds leaves the unloaded posture at once: no path leads on
    may_follow = not held and meets_stiffness(problem.at_rest)
    if may_follow and doubtful:
        ended, critical, searched_to = first_critical(path(problem, loading), 1.0)
        if critical is not None:
            status |= Status.BEYOND_CRITICAL_LOAD
        elif ended is None or searched_to < 1.0:
            return Solution(status | end_of_path(problem, ended))
        else:
            found, margins = ended, named_margins(ended.known)
    platform = found.known.held_platform
    if held and platform and np.linalg.norm(platform.gap) > _OPEN * problem.length:
        # legs stay open at the pose of the platform
        status |= Status.NO_EQUILIBRIUM
        return Solution(status, held=True)
    if not found.converged:
        status |= Status.NO_EQUILIBRIUM
        if not (held or may_follow):
            status |= Status.FREE_MOTIONS
        return Solution(status, critical)
    answer = Solution(status, critical, margins, held, found, loaded)
    return _with_status(loaded, found, answer)


def equilibrium_under(loaded: LoadedPosture, wrench: np.ndarray) -> Solution:
    """The equilibrium under a wrench; where nothing acts, the unloaded posture."""
    problem = loaded.problem
    if not loaded.has_posture or problem.bears_loads or np.any(wrench):
        return solve(loaded, wrench)
    found = FoundEquilibrium(LoadCase(wrench), problem.unloaded, 0.0, problem.at_rest, True, 0)
    return Solution(loaded.status, found=found, loaded=loaded)


def _with_status(loaded: LoadedPosture, found: FoundEquilibrium, answer: Solution) -> Solution:
    """An answer with its status."""
    known, loading, carried, status = found.known, found.loading, answer.carried, answer.status
    if known.lacks_digits or not (answer.held or carried.are_balanced(loading.wrench)):
        return Solution(status | Status.ILL_CONDITIONED, answer.critical)
    if not answer.held and not meets_stiffness(known):
        status |= Status.FREE_MOTIONS
    if not (known.regular and loaded.problem.at_rest.regular):
        status |= Status.REDUNDANT_JOINTS
    if isinstance(loaded.posed, CableRobot):
        tensions = np.array([spring.tension for spring in carried.springs()])
        status |= status_of_cables(loaded.posed, tensions)
    return replace(answer, status=status if answer.margin >= 0 else status | Status.UNSTABLE)
