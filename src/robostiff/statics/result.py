"""What `equilibrium` answers: one equilibrium, or many."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, wraps
from typing import Any, cast

import numpy as np

from robostiff.analysis import PartShare
from robostiff.analysis.cable_stiffness import beyond_limits
from robostiff.elastostatics import Status
from robostiff.elastostatics.status import WITHOUT_STIFFNESS, StatusOfPoses
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import field, frozen, replace
from robostiff.markup import InNotebooks
from robostiff.model import Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.spatial import Space
from robostiff.spatial.rotation import vector_of_rotation
from robostiff.statics.equations.newton import FoundEquilibrium
from robostiff.statics.equations.problem import Linearised
from robostiff.statics.equations.stability import CriticalPoint
from robostiff.statics.loaded_parts import (
    BodyPlaces,
    CarriedLoads,
    LoadedPart,
    LoadedSpring,
    body_places,
    shares_of,
)
from robostiff.statics.loading.loaded_posture import LoadedPosture, as_snapshot
from robostiff.statics.solution import Solution

_NOT_FREE = (
    "rigid parts do not let the platform move so: give a displacement along the motions that they "
    "leave, or a wrench"
)


def _of_each(find: Callable[[Equilibrium], Any]) -> property:
    """A property of one equilibrium; of many an array, masked where a row has none."""

    @wraps(find)
    def found(self: Equilibrium) -> Any:
        known = self.known.get(find.__name__)
        if find.__name__ == "pose" and isinstance(self.solutions, OnDemand):
            known = self.solutions.poses(self.rows, self.known["displacement"])
        if self.batch_shape:
            return self._of_all(find.__name__, known)
        is_known = known is not None and np.all(np.isfinite(known))
        return known if is_known else find(self)

    return property(found)


class OnDemand(dict[int, Solution], ABC):
    """Solutions behind the answers of a kernel, by row, each found when it is asked for."""

    @abstractmethod
    def poses(self, rows: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Frames of the platform (..., 6) of some rows (...), after displacements (..., r)."""


@frozen(repr=False)
class Equilibrium(StatusOfPoses, InNotebooks):
    """A robot under load, or why there is none; or many, along one axis.

    Everything but `status`, `advice`, `stable` and `critical_factor` raises `NoAnswerError` where
    ``has_answer`` is false. Of many, matrices, displacements, poses and margins are arrays that
    begin with the axis of them, masked where a row has no answer, or no matrix; ``[i]`` is one of
    them, which has all else.

    Attributes
    ----------
    name : str
    space : Space
    status_codes : (...) array of uint16
        Status of each.
    solutions : sequence of Solution
        How they were found, or, after a kernel, are found when it is asked for.
    rows : (...) array of int
        Which of these they are.
    known : mapping of str to arrays
        Their properties, by name, where a kernel has answered.
    """

    name: str
    space: Space
    status_codes: np.ndarray
    solutions: Sequence[Solution] | OnDemand
    rows: np.ndarray
    known: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, name: str, space: Space, solutions: Sequence[Solution] | Solution) -> Equilibrium:
        """One, or many, as they were found."""
        if isinstance(solutions, Solution):
            return cls.of(name, space, (solutions,))[0]
        codes = np.array([int(one.status) for one in solutions], dtype=np.uint16)
        return cls(name, space, codes, solutions, np.arange(len(codes)))

    def __len__(self) -> int:
        return self.rows.size

    def __getitem__(self, index: Any) -> Equilibrium:
        """One of many, or some of them."""
        known = {name: array[index] for name, array in self.known.items()}
        codes, rows = (np.asarray(array[index]) for array in (self.status_codes, self.rows))
        return replace(self, status_codes=codes, rows=rows, known=known)

    @property
    def solution(self) -> Solution:
        """How one was found, or why there is none.

        Raises
        ------
        InputError
            Of many.
        """
        if self.batch_shape:
            raise InputError(
                f"equilibria of {self.name!r}",
                got=Words(f"{len(self)} of them"),
                expected="one: [i]",
            )
        return self.solutions[int(self.rows)]

    @property
    def divisions(self) -> Mapping[str, int]:
        """Beams that bend so far that they were divided, ``leg/part``: into how many elements.

        They are one part of `parts` each.
        """
        loaded = self.solution.loaded
        parts = loaded.acting.division.parts if loaded else {}
        return {"/".join(name): n for name, n in parts.items()}

    @property
    def critical(self) -> CriticalPoint | None:
        """Where stability is lost on the way to the full load."""
        return self.solution.critical

    @property
    def margins(self) -> Mapping[str, float]:
        """Of the platform, and of every leg with the platform held, by name.

        The least ratio of the curvature of the energy to that without load.
        """
        return self.solution.margins

    @property
    def held(self) -> bool:
        """Whether the pose of the platform was given, and the wrench follows."""
        return self.solution.held

    @property
    def found(self) -> FoundEquilibrium | None:
        """Where Newton's method ended."""
        return self.solution.found

    @property
    def posed(self) -> Snapshot | Network | CableRobot | None:
        """The robot without load: a snapshot, a network or a cable robot."""
        return self.solution.loaded and self.solution.loaded.posed

    @property
    def snapshot(self) -> Snapshot | None:
        """The robot without load; None of a network or a cable robot."""
        return as_snapshot(self.posed)

    @property
    def answered(self) -> np.ndarray:
        """Where there is an equilibrium (...)."""
        if self.known:
            return np.isfinite(self.known["displacement"]).all(axis=-1)
        each = [self.solutions[i].found is not None for i in self.rows.flat]
        return np.array(each, dtype=bool).reshape(self.batch_shape)

    @property
    def has_answer(self) -> bool:
        """Whether there is an equilibrium; of many, one of each."""
        return bool(np.all(self.answered))

    @property
    def guarded(self) -> np.ndarray:
        """What a kernel left to `equilibrium` (...)."""
        return self.known.get("guarded", np.zeros(self.batch_shape, dtype=bool))

    @property
    def guarded_share(self) -> float:
        """Part of all that a kernel left to `equilibrium`."""
        return float(np.mean(self.guarded)) if len(self) else 0.0

    @property
    def platforms(self) -> Any:
        """Places of the platforms and their rates, of a kernel that was compiled with them."""
        return self.known.get("platforms")

    @property
    def advice(self) -> tuple[str, ...]:
        """What to know about this answer, a sentence each."""
        advice = self.status.advice
        if self.batch_shape:
            return advice
        if self.held and not self.has_answer:
            return (_NOT_FREE, *Status.RIGID_DIRECTION.advice)
        if self.has_answer and isinstance(self.posed, CableRobot):
            tensions = np.array([cable.tension for cable in self.springs])
            advice = (*beyond_limits(self.posed, tensions), *advice)
        if self.has_answer and (found := self.found):
            bend = np.max(found.problem.legs.bends(found.state), initial=0.0) ** 0.5
            if bend > 1.0:
                bent = f"a beam bends {bend:.2g} times as far as its elements are exact"
                advice = (f"{bent}: write beams=rs.Bowing(), which chooses their number", *advice)
        if self.critical is None:
            return advice
        return (f"at {self.critical.factor:.4g} of the load {self.critical.words}", *advice)

    @property
    def critical_factor(self) -> float | None:
        """Factor of the load at which stability is lost on the way to it; None where it is not."""
        return None if self.critical is None else self.critical.factor

    @_of_each
    def margin(self) -> float:
        """Least of the margins that decide stability: 1 without load, 0 at the critical load."""
        self._require()
        return self.solution.margin

    @property
    def stable(self) -> Any:
        """Whether the energy has a minimum: within the legs, and as a whole where it is not held.

        A motion that nothing resists, before and under load, is neither: it counts as stable.
        """
        found = self.known.get("stable")
        if found is None:
            found = self.answered & ((self.status_codes & int(Status.UNSTABLE)) == 0)
        return found if self.batch_shape else bool(found)

    @_of_each
    def displacement(self) -> np.ndarray:
        """Of the point and rotation vector of the platform, from the unloaded posture (r,)."""
        found = self._require()
        return found.displacement

    @_of_each
    def pose(self) -> np.ndarray:
        """Of the platform frame: x, y, z [m] and rotation vector [rad] (6,).

        Of a snapshot the frame is at its reference point, along the world axes without load.
        """
        found = self._require()
        R, p = cast("LoadedPosture", self.solution.loaded).frame
        state = found.state
        place = state.p + state.R @ (p - found.problem.point)
        return np.concatenate([place, vector_of_rotation(state.R @ R)])

    @property
    def point(self) -> np.ndarray:
        """Where the point is now, about which matrices and wrenches are (3,) [m]."""
        return self._require().state.p

    @_of_each
    def K(self) -> np.ndarray:
        """Rate of the wrench that the legs carry by the twist of the platform (r, r).

        World axes, about `point`, which moves along. Under a moment its rotation block has the
        antisymmetric part ``-skew(M) / 2``.
        """
        return self._known_stiffness.K

    @property
    def K_sym(self) -> np.ndarray:
        """Hessian of the energy in exponential coordinates: the symmetric part of K (r, r)."""
        K = self.K
        return 0.5 * (K + np.swapaxes(K, -1, -2))

    @_of_each
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
        if known.held_platform is not None:
            C = C @ known.held_platform.free @ known.held_platform.free.T
        return C / np.outer(scale, scale)

    @property
    def leg_K(self) -> tuple[np.ndarray, ...]:
        """Rate of what each leg carries, as K (r, r): they add up to K.

        Springs on the platform add to K beside them. Of a flexible platform by the twist of the
        tool; none is symmetric by itself.
        """
        return self._by_leg(self._known_stiffness)[1]

    @property
    def leg_wrenches(self) -> tuple[np.ndarray, ...]:
        """What the platform exerts on each leg about `point`, world axes (r,) [N, N m]."""
        return self._by_leg(self._require().known)[0]

    @property
    def reactions(self) -> tuple[np.ndarray, ...]:
        """What each leg exerts on the base about `point`, world axes (6,) [N, N m].

        Weights of parts that the base carries itself are included.
        """
        return self._carried.reactions()

    @_of_each
    def wrench(self) -> np.ndarray:
        """Of the environment on the platform about `point` (r,): given, or what holds the pose.

        Of a given displacement, without what rigid parts would carry.
        """
        found = self._require()
        if not self.held:
            return found.loading.wrench
        platform, scale = found.known.held_platform, found.problem.scale
        if platform is None:
            return -found.known.missing
        return -platform.free @ (platform.free.T @ (found.known.missing / scale)) * scale

    @property
    def energy(self) -> float:
        """Elastic energy of the parts of the legs, and of springs between bodies [J]."""
        return sum(part.energy for part in (*self.parts, *self.springs))

    @property
    def potential(self) -> float:
        """Energy less the work of preloads and dead forces, the wrench left out [J]."""
        found = self._require()
        problem, state = found.problem, found.state
        share, shift = found.loading.share_at(found.factor), state.p - problem.point
        total = self.energy + problem.legs.load_potential(state, share)
        if problem.steady is not None:
            total += problem.steady.potential(state.R, shift)
        return total + share * problem.dead.potential(state.R, shift)

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
        """Energy of every elastic part and spring between bodies, largest first."""
        return shares_of(self.parts, ((s.group, s.name, s.energy) for s in self.springs))

    def __repr__(self) -> str:
        if self.batch_shape:
            again = f", {self.guarded_share:.2%} recomputed" if "guarded" in self.known else ""
            stable = int(np.count_nonzero(self.stable))
            return f"<{len(self)} equilibria, {stable} stable{again}, status {self.status}>"
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
        self._require()
        return self.solution.carried

    def _of_all(self, name: str, known: np.ndarray | None) -> np.ma.MaskedArray:
        """A property of all (N, ...), masked where a row has none: what is read there is no number.

        As it is known, or from that of each.
        """
        has, r = self.answered, self.space.size
        if name in ("K", "K_total"):
            has = has & ((self.status_codes & int(WITHOUT_STIFFNESS)) == 0)
        if known is None:
            shapes = {"pose": (6,), "margin": (), "K": (r, r), "K_total": (r, r)}
            values = np.full((len(has), *shapes.get(name, (r,))), np.nan)
            for i in np.flatnonzero(has).tolist():
                values[i] = getattr(self[i], name)
        else:
            values = known.copy()
            values[~has] = np.nan
        lacking = ~has.reshape(len(has), *[1] * (values.ndim - 1))
        return np.ma.masked_array(values, np.broadcast_to(lacking, values.shape))

    @property
    def _known_stiffness(self) -> Linearised:
        known = self._require().known
        if known.held_platform is not None:
            raise NoAnswerError(
                f"no stiffness matrix of {self.name!r} under load ({self.status}): "
                f"{self.status.advice[0]}; its compliance is there"
            )
        return known

    def _by_leg(self, known: Linearised) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
        return self._carried.by_leg(known.by_twist, self.snapshot and self.snapshot.platform)

    def _require(self) -> FoundEquilibrium:
        found = self.found
        if found is None:
            raise NoAnswerError(
                f"no equilibrium of {self.name!r} ({self.status}): {'; '.join(self.advice)}"
            )
        return found
