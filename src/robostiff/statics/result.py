"""What `equilibrium` answers, and how one is found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from robostiff.analysis import PartShare
from robostiff.analysis.cable_stiffness import beyond_limits, status_of_cables
from robostiff.elastostatics import Status
from robostiff.elastostatics.status import WITHOUT_STIFFNESS, StatusOfPoses
from robostiff.errors import NoAnswerError
from robostiff.kinematics.turn import turn_by_vector
from robostiff.markup import InNotebooks
from robostiff.model import Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.spatial import Space
from robostiff.spatial.rotation import vector_of_rotation
from robostiff.statics.equations.equilibrium_path import SAFE, first_critical, path
from robostiff.statics.equations.newton import FoundEquilibrium, equilibrium_at
from robostiff.statics.equations.problem import EquilibriumProblem, Linearised, LoadCase
from robostiff.statics.equations.stability import (
    CriticalPoint,
    Regular,
    may_be_singular,
    meets_stiffness,
    named_margins,
)
from robostiff.statics.loaded_parts import (
    BodyPlaces,
    CarriedLoads,
    LoadedPart,
    LoadedSpring,
    body_places,
    shares_of,
)
from robostiff.statics.loading.loaded_posture import LoadedPosture, as_snapshot

# Of the length of the robot: what is no rounding between legs and platform.
_OPEN = 1e-9
_NOT_FREE = (
    "rigid parts do not let the platform move so: give a displacement along the motions that they "
    "leave, or a wrench"
)


@dataclass(frozen=True, repr=False)
class Equilibrium(InNotebooks):
    """A robot under load, or why there is none.

    Everything but `status`, `advice`, `stable` and `critical_factor` raises `NoAnswerError` where
    ``has_answer`` is false.

    Attributes
    ----------
    name : str
    space : Space
    status : Status
    critical : CriticalPoint or None
        Where stability is lost on the way to the full load.
    margins : mapping of str to float
        Of the platform, and of every leg with the platform held, by name: the least ratio of the
        curvature of the energy to that without load.
    held : bool
        Whether the pose of the platform was given, and the wrench follows.
    found, frame, posed
        Where Newton's method ended, the unloaded frame of the platform, and the robot there, as a
        snapshot, a network or a cable robot.
    """

    name: str
    space: Space
    status: Status
    critical: CriticalPoint | None = None
    margins: Mapping[str, float] = field(default_factory=dict)
    held: bool = False
    found: FoundEquilibrium | None = None
    frame: tuple[np.ndarray, np.ndarray] | None = None
    posed: Snapshot | Network | CableRobot | None = None

    @property
    def problem(self) -> EquilibriumProblem | None:
        """What was solved."""
        return self.found and self.found.problem

    @property
    def snapshot(self) -> Snapshot | None:
        """The robot without load; None of a network or a cable robot."""
        return as_snapshot(self.posed)

    @property
    def has_answer(self) -> bool:
        """Whether there is an equilibrium."""
        return self.found is not None

    @property
    def advice(self) -> tuple[str, ...]:
        """What to know about this answer, a sentence each."""
        if self.held and not self.has_answer:
            return (_NOT_FREE, *Status.RIGID_DIRECTION.advice)
        own = self.status.advice
        if self.has_answer and isinstance(self.posed, CableRobot):
            tensions = np.array([cable.tension for cable in self.springs])
            own = (*beyond_limits(self.posed, tensions), *own)
        if self.critical is None:
            return own
        return (f"at {self.critical.factor:.4g} of the load {self.critical.words}", *own)

    @property
    def critical_factor(self) -> float | None:
        """Factor of the load at which stability is lost on the way to it; None where it is not."""
        return None if self.critical is None else self.critical.factor

    @property
    def margin(self) -> float:
        """Least of the margins that decide stability: 1 without load, 0 at the critical load."""
        self._require()
        deciding = [m for name, m in self.margins.items() if name != "platform" or not self.held]
        return min(deciding, default=1.0)

    @property
    def stable(self) -> bool:
        """Whether the energy has a minimum: within the legs, and as a whole where it is not held.

        A motion that nothing resists, before and under load, is neither: it counts as stable.
        """
        return self.has_answer and self.margin >= 0

    @property
    def displacement(self) -> np.ndarray:
        """Of the point and rotation vector of the platform, from the unloaded posture (r,)."""
        found = self._require()
        return found.displacement

    @property
    def pose(self) -> np.ndarray:
        """Of the platform frame: x, y, z [m] and rotation vector [rad] (6,).

        Of a snapshot the frame is at its reference point, along the world axes without load.
        """
        found = self._require()
        R, p = self.frame or (np.eye(3), found.problem.point)
        state = found.state
        place = state.p + state.R @ (p - found.problem.point)
        return np.concatenate([place, vector_of_rotation(state.R @ R)])

    @property
    def point(self) -> np.ndarray:
        """Where the point is now, about which matrices and wrenches are (3,) [m]."""
        return self._require().state.p

    @property
    def K(self) -> np.ndarray:
        """Rate of the wrench that the legs carry by the twist of the platform (r, r).

        World axes, about `point`, which moves along. Under a moment its rotation block has the
        antisymmetric part ``-skew(M) / 2``.
        """
        return self._known_stiffness.K

    @property
    def K_sym(self) -> np.ndarray:
        """Hessian of the energy in exponential coordinates: the symmetric part of K (r, r)."""
        return 0.5 * (self.K + self.K.T)

    @property
    def K_total(self) -> np.ndarray:
        """K less the rate of the forces on the platform (r, r): what more load meets."""
        return self._known_stiffness.K_total

    @property
    def compliance(self) -> np.ndarray:
        """Twist of the platform by a little more load, loads that act staying (r, r).

        The inverse of `K_total`; with rigid parts, where that does not exist, zero for wrenches
        that they carry.

        Raises
        ------
        NoAnswerError
            Where nothing resists some motion.
        """
        found = self._require()
        if self.status & Status.FREE_MOTIONS:
            raise NoAnswerError(
                f"no compliance of {self.name!r} under load ({self.status}): a load along a free "
                "motion meets no stiffness"
            )
        known, scale = found.known, found.problem.scale
        C = np.linalg.inv(known.K_total / np.outer(scale, scale))
        if known.held is not None:
            C = C @ known.held.free @ known.held.free.T
        return C / np.outer(scale, scale)

    @property
    def leg_K(self) -> tuple[np.ndarray, ...]:
        """Rate of what each leg carries, as K (r, r): they add up to K.

        Springs on the platform add to K beside them. Of a flexible platform by the twist of the
        tool; none is symmetric by itself.
        """
        known = self._known_stiffness
        through = self._through_platform
        if through is not None:
            return tuple(through[1])
        return known.problem.by_leg(known.by_twist[known.problem.legs.numbers.W])

    @property
    def leg_wrenches(self) -> tuple[np.ndarray, ...]:
        """What the platform exerts on each leg about `point`, world axes (r,) [N, N m]."""
        found = self._require()
        through = self._through_platform
        if through is not None:
            return tuple(through[0])
        return found.problem.by_leg(found.state.legs.W)

    @property
    def reactions(self) -> tuple[np.ndarray, ...]:
        """What each leg exerts on the base about `point`, world axes (6,) [N, N m].

        Weights of parts that the base carries itself are included.
        """
        return self._carried.reactions()

    @property
    def wrench(self) -> np.ndarray:
        """Of the environment on the platform about `point` (r,): given, or what holds the pose.

        Of a given displacement, without what rigid parts would carry.
        """
        found = self._require()
        if not self.held:
            return found.loading.wrench + found.loading.wrench_rate
        held, scale = found.known.held, found.problem.scale
        if held is None:
            return -found.known.missing
        return -held.free @ (held.free.T @ (found.known.missing / scale)) * scale

    @property
    def energy(self) -> float:
        """Elastic energy of the parts of the legs, and of springs between bodies [J]."""
        return sum(part.energy for part in (*self.parts, *self.springs))

    @property
    def potential(self) -> float:
        """Energy less the work of preloads and dead forces, the wrench left out [J]."""
        found = self._require()
        return self.energy + found.problem.platform_potential(
            found.state, found.loading, found.factor
        )

    @cached_property
    def parts(self) -> tuple[LoadedPart, ...]:
        """What every joint and elastic part carries, and how it has moved."""
        return self._carried.parts()

    @property
    def places(self) -> BodyPlaces:
        """Where the bodies behind all joints and elastic parts are, and the platform."""
        found = self._require()
        return body_places(found.problem, found.state)

    @cached_property
    def springs(self) -> tuple[LoadedSpring, ...]:
        """Springs between bodies: how long they are, and how much they pull."""
        return self._carried.springs()

    @property
    def shares(self) -> tuple[PartShare, ...]:
        """Energy of every elastic part, largest first."""
        return shares_of(self.parts)

    def __repr__(self) -> str:
        if not self.has_answer:
            return f"<Equilibrium of {self.name!r}, status {self.status}>"
        shown = self.space.without_rounding(self.displacement)
        moved = ", ".join(f"{x:.4g}" for x in shown)
        return (
            f"<Equilibrium of {self.name!r}: moved ({moved}) m, rad, margin {self.margin:.3g}, "
            f"status {self.status}>"
        )

    @property
    def _carried(self) -> CarriedLoads:
        """What it carries under the share of preloads and of forces on legs that acts."""
        found = self._require()
        share = found.loading.shares(found.factor).value
        return CarriedLoads(found.problem, found.state, share)

    @property
    def _known_stiffness(self) -> Linearised:
        known = self._require().known
        if known.held is not None:
            raise NoAnswerError(
                f"no stiffness matrix of {self.name!r} under load ({self.status}): "
                f"{self.status.advice[0]}; its compliance is there"
            )
        return known

    @property
    def _through_platform(self) -> tuple[list[np.ndarray], list[np.ndarray]] | None:
        """Wrenches and stiffnesses of legs by the tool of a flexible platform; None of others."""
        if self.snapshot is None or self.snapshot.platform is None:
            return None
        return self._carried.about_the_tool(self._require().known.by_twist)

    def _require(self) -> FoundEquilibrium:
        if self.found is None:
            raise NoAnswerError(
                f"no equilibrium of {self.name!r} ({self.status}): {'; '.join(self.advice)}"
            )
        return self.found


def solved(
    loaded: LoadedPosture,
    wrench: np.ndarray | None,
    displacement: np.ndarray | None = None,
    *,
    standing: bool = False,
) -> Equilibrium:
    """The equilibrium of one robot at one posture, under a wrench or at a displacement.

    Where a growing load is followed, all loads grow together; or, `standing`, the wrench alone.
    """
    problem, status = loaded.problem, loaded.status
    if not loaded.has_posture:
        return Equilibrium(loaded.name, loaded.space, status)
    nothing = np.zeros(problem.size)
    share = (1.0, 0.0) if standing else (0.0, 1.0)
    loading = LoadCase(nothing, nothing if wrench is None else wrench, *share)
    if problem.at_rest.rigid:
        status |= Status.RIGID_DIRECTION
    target = None
    if displacement is not None:
        full = np.zeros(6)
        full[list(problem.rows)] = displacement
        target = turn_by_vector(full[3:]), problem.point + full[:3]
    found = equilibrium_at(problem, loading, 1.0, problem.unloaded, target)
    critical: CriticalPoint | None = None
    margins = named_margins(found.known) if found.converged else {}
    doubtful = not found.converged or not found.direct or min(margins.values()) < SAFE
    legs = problem.legs
    if not doubtful and legs.springs:  # a cable may have become slack on the way
        pulls = legs.pulls(found.state.legs, 1.0)
        doubtful = bool(np.any(legs.spring_arrays.is_cable & (pulls.tension == 0)))
    if not doubtful and may_be_singular(problem):  # rigid bars may have passed a singular posture
        doubtful = Regular.of(problem.at_rest).ratio(found.known) <= 0
    # what nothing elastic holds leaves the unloaded posture at once: no path leads on
    may_follow = target is None and meets_stiffness(problem.at_rest)
    if may_follow and doubtful:
        ended, critical, searched_to = first_critical(path(problem, loading), 1.0)
        if critical is not None:
            status |= Status.BEYOND_CRITICAL_LOAD
        elif ended is None or searched_to < 1.0:
            found = replace(found, converged=False)
        else:
            found, margins = ended, named_margins(ended.known)
    held = found.known.held
    if target is not None and held and np.linalg.norm(held.gap) > _OPEN * problem.length:
        # legs stay open at the pose of the platform
        status |= Status.NO_EQUILIBRIUM
        return Equilibrium(loaded.name, loaded.space, status, held=True)
    if not found.converged:
        status |= Status.NO_EQUILIBRIUM
        if target is None and not may_follow:
            status |= Status.FREE_MOTIONS
        return Equilibrium(loaded.name, loaded.space, status, critical)
    return _answer(loaded, margins, found, status, critical, target is not None)


def _answer(
    loaded: LoadedPosture,
    margins: dict[str, float],
    found: FoundEquilibrium,
    status: Status,
    critical: CriticalPoint | None,
    held: bool,
) -> Equilibrium:
    problem, known, loading = loaded.problem, found.known, found.loading
    known_as, where = (loaded.name, loaded.space), (found, loaded.frame, loaded.posed)
    answer = Equilibrium(*known_as, status, critical, margins, held, *where)
    if not held:
        wrench = loading.wrench + loading.wrench_rate
        share = loading.shares(found.factor).value
        if not CarriedLoads(problem, found.state, share).are_balanced(wrench):
            status |= Status.ILL_CONDITIONED
            return Equilibrium(loaded.name, loaded.space, status, critical)
        if not meets_stiffness(known):
            status |= Status.FREE_MOTIONS
    if not (known.regular and problem.at_rest.regular):
        status |= Status.REDUNDANT_JOINTS
    if isinstance(loaded.posed, CableRobot):
        status |= status_of_cables(loaded.posed, np.array([own.tension for own in answer.springs]))
    return replace(answer, status=status if answer.stable else status | Status.UNSTABLE)


@dataclass(frozen=True, repr=False)
class Equilibria(StatusOfPoses):
    """Equilibria of a robot at poses, or under wrenches, along one axis, one a row.

    Properties are masked where a row has no answer, or no matrix.

    Attributes
    ----------
    each : sequence of Equilibrium
    known : mapping of str to arrays
        All properties of all but margins, where a record of the robot has answered: then `each` is
        computed when it is asked for.
    """

    each: Sequence[Equilibrium]
    known: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def status_codes(self) -> np.ndarray:
        """Status of each (N,) as uint16."""
        if self.known:
            return self.known["status_codes"]
        return np.array([int(one.status) for one in self.each], dtype=np.uint16)

    @property
    def answered(self) -> np.ndarray:
        """Which of them have an answer (N,)."""
        if self.known:
            return np.isfinite(self.known["displacement"]).all(axis=1)
        return np.array([one.has_answer for one in self.each], dtype=bool)

    @property
    def stable(self) -> np.ndarray:
        """Which of them are stable (N,)."""
        if self.known:
            return self.known["stable"]
        return np.array([one.stable for one in self.each], dtype=bool)

    @property
    def K(self) -> np.ma.MaskedArray:
        """Of each (N, r, r); see `Equilibrium.K`."""
        return self._all("K")

    @property
    def K_total(self) -> np.ma.MaskedArray:
        """Of each (N, r, r); see `Equilibrium.K_total`."""
        return self._all("K_total")

    @property
    def displacement(self) -> np.ma.MaskedArray:
        """Of each (N, r); see `Equilibrium.displacement`."""
        return self._all("displacement")

    @property
    def pose(self) -> np.ma.MaskedArray:
        """Of each (N, 6); see `Equilibrium.pose`."""
        return self._all("pose")

    @property
    def margin(self) -> np.ma.MaskedArray:
        """Of each (N,); see `Equilibrium.margin`."""
        return self._all("margin")

    def _all(self, what: str) -> np.ma.MaskedArray:
        has = self.answered
        if what in ("K", "K_total"):
            has = has & ((self.status_codes & int(WITHOUT_STIFFNESS)) == 0)
        if what in self.known:
            values, shape = self.known[what][has], self.known[what].shape[1:]
        else:
            r = self.each[0].space.size if self.each else 6
            shapes = {"K": (r, r), "K_total": (r, r), "displacement": (r,), "pose": (6,)}
            shape = shapes.get(what, ())
            values = [np.asarray(getattr(self.each[i], what)) for i in np.flatnonzero(has)]
        found = np.ma.masked_all((len(has), *shape))
        found.data[...] = np.nan  # what is read past the mask is no number
        found[has] = np.reshape(values, (-1, *shape))
        return found

    def __len__(self) -> int:
        return len(self.each)

    def __getitem__(self, i: int) -> Equilibrium:
        return self.each[i]

    def __iter__(self) -> Iterator[Equilibrium]:
        return iter(self.each)

    def __repr__(self) -> str:
        stable = int(np.count_nonzero(self.stable))
        return f"<{len(self)} equilibria, {stable} stable, status {self.status}>"
