"""How one equilibrium is found."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import TypeVar, cast

import numpy as np

from robostiff.analysis.cable_stiffness import status_of_cables
from robostiff.elastostatics import Status
from robostiff.frozen import field, frozen, replace
from robostiff.model.cable import CableRobot
from robostiff.statics.chains.beam_bowing import Bowing, Division
from robostiff.statics.chains.legs import Legs, State
from robostiff.statics.equations.equilibrium_path import (
    SAFE,
    OnPath,
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
from robostiff.statics.loading.given_loads import Acting
from robostiff.statics.loading.loaded_posture import LoadedPosture

# Of the length of the robot: what is no rounding between legs and platform.
_OPEN = 1e-9
# Elements of a beam at most, all segments together: time grows with their cube.
_MOST_ELEMENTS = 32
# Elements of beams at most where no state is known that says how far they bend.
_UNKNOWN = 8
_Answer = TypeVar("_Answer")
#: From loads, and how they divide beams, to the robot at its posture under them.
Again = Callable[[Acting], LoadedPosture]


@frozen
class Solution:
    """How one equilibrium was found, or why there is none."""

    status: Status
    critical: CriticalPoint | None = None  #: where stability is lost on the way to the full load
    #: of the platform, and of every leg with the platform held, by name: the least ratio of the
    #: curvature of the energy to that without load
    margins: Mapping[str, float] = field(default_factory=dict)
    held: bool = False  #: whether the pose of the platform was given, and the wrench follows
    found: FoundEquilibrium | None = None  #: where Newton's method ended
    loaded: LoadedPosture | None = None  #: the robot from which it began

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


class BeamCheck:
    """Whether beams are divided finely enough for the states from which an answer is computed."""

    def __init__(self, loaded: LoadedPosture) -> None:
        self._legs: Legs = loaded.problem.legs
        #: The loads, with beams divided as these states require.
        self.acting: Acting = loaded.acting

    def see(self, state: State | None) -> bool:
        """Whether no element that may be divided bends too far at a state; None: unknown.

        They are halved, so that it does not matter on which way a state is found.
        """
        acting, legs = self.acting, self._legs
        if not legs.beams or not isinstance(acting.beams, Bowing) or acting.beams.elements:
            return True
        division = finer = acting.division
        if state is None:
            least = min(2 * division.least, max(division.least, _UNKNOWN))
            finer = Division(least, {part: max(n, least) for part, n in division.parts.items()})
        else:
            parts, bends = dict(division.parts), np.sqrt(legs.bends(state))
            for i in np.flatnonzero(bends > 1.0):
                c, _, e = legs.beams[i]
                part = legs.chains[c].owner.name, e.name
                if 2 * legs.parts_of_beams[i] <= _MOST_ELEMENTS:
                    parts[part] = 2 * division.of(*part)
            finer = Division(division.least, parts)
        if finer == division:
            return True
        self.acting = replace(acting, division=finer)
        return False

    def watched(self, steps: Iterable[OnPath]) -> Iterator[OnPath]:
        """Steps of a path up to the first at which an element bends too far."""
        for step in steps:
            yield step
            if not self.see(step.found.state):
                return


def with_enough_elements(
    loaded: LoadedPosture, again: Again, ask: Callable[[LoadedPosture, BeamCheck], _Answer]
) -> _Answer:
    """What is asked of a robot, beams divided `again` until no element bends too far."""
    while True:
        answer = ask(loaded, check := BeamCheck(loaded))
        if check.acting is loaded.acting:
            return answer
        loaded = again(check.acting)


def solve(
    loaded: LoadedPosture,
    again: Again,
    wrench: np.ndarray | None,
    displacement: np.ndarray | None = None,
    *,
    standing: bool = False,
) -> Solution:
    """The equilibrium of one robot at one posture, under a wrench or at a displacement.

    Where a growing load is followed, all loads grow together; or, `standing`, the wrench alone.
    Beams are divided as they bend, by `again`.
    """
    ask = partial(_solve, wrench=wrench, displacement=displacement, standing=standing)
    return with_enough_elements(loaded, again, ask)


def _solve(
    loaded: LoadedPosture,
    check: BeamCheck,
    wrench: np.ndarray | None,
    displacement: np.ndarray | None,
    *,
    standing: bool,
) -> Solution:
    problem, status = loaded.problem, loaded.status
    if not loaded.has_posture:
        return Solution(status)
    F = np.zeros(problem.size) if wrench is None else wrench
    loading = LoadCase(F, *((1.0, 0.0) if standing else (0.0, 1.0)))
    if problem.at_rest.rigid:
        status |= Status.RIGID_DIRECTION
    if displacement is not None:
        return _held(loaded, check, status, loading, displacement)
    found = equilibrium_at(problem, loading, 1.0, problem.unloaded)
    critical: CriticalPoint | None = None
    margins = named_margins(found.known) if found.converged else {}
    # what nothing elastic holds leaves the unloaded posture at once: no path leads on
    may_follow = meets_stiffness(problem.at_rest)
    if may_follow and _is_doubtful(found, margins):
        steps = check.watched(path(problem, loading))
        ended, critical, searched_to = first_critical(steps, 1.0)
        if critical is not None:
            check.see(critical.found.state)
            status |= Status.BEYOND_CRITICAL_LOAD
        elif ended is None or searched_to < 1.0:
            return Solution(status | end_of_path(problem, ended))
        else:
            found, margins = ended, named_margins(ended.known)
    if not found.converged:
        status |= Status.NO_EQUILIBRIUM
        return Solution(status if may_follow else status | Status.FREE_MOTIONS, critical)
    answer = Solution(status, critical, margins, False, found, loaded)
    if answer.margin >= 0:
        check.see(found.state)
    return _with_status(loaded, found, answer)


def _held(
    loaded: LoadedPosture,
    check: BeamCheck,
    status: Status,
    loading: LoadCase,
    displacement: np.ndarray,
) -> Solution:
    """The equilibrium of a robot whose platform is held at a displacement."""
    problem = loaded.problem
    # of elements that bend too far forces along them are so wrong that none may be found
    step = problem.at_rest.by_twist @ displacement
    if not check.see(problem.legs.after_step(problem.unloaded, displacement, step)):
        return Solution(status, held=True)
    found = held_equilibrium(problem, loading, displacement)
    platform = found.known.held_platform
    if platform and np.linalg.norm(platform.gap) > _OPEN * problem.length:
        # legs stay open at the pose of the platform
        return Solution(status | Status.NO_EQUILIBRIUM, held=True)
    if not found.converged:
        check.see(None)
        return Solution(status | Status.NO_EQUILIBRIUM)
    answer = Solution(status, None, named_margins(found.known), True, found, loaded)
    check.see(found.state if answer.margin >= 0 else None)
    return _with_status(loaded, found, answer)


def _is_doubtful(found: FoundEquilibrium, margins: Mapping[str, float]) -> bool:
    """Whether what Newton's method found may lie beyond a critical load."""
    legs, problem = found.problem.legs, found.problem
    if not found.converged or not found.direct or min(margins.values()) < SAFE:
        return True
    if legs.springs:  # a cable may have become slack on the way
        pulls = legs.pulls(found.state, 1.0)
        each = zip(legs.springs, pulls.tension, strict=True)
        if any(spring.is_cable and tension == 0 for spring, tension in each):
            return True
    # rigid bars may have passed a singular posture
    return may_be_singular(problem) and Regular.of(problem.at_rest).ratio(found.known) <= 0


def equilibrium_under(loaded: LoadedPosture, wrench: np.ndarray, again: Again) -> Solution:
    """The equilibrium under a wrench; where nothing acts, the unloaded posture."""
    problem = loaded.problem
    if not loaded.has_posture or problem.bears_loads or np.any(wrench):
        return solve(loaded, again, wrench)
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
