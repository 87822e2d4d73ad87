"""Springs between points of two bodies: what they pull, and how that changes as the points move.

With d from one point to the other, ``l = |d|`` and ``u = d / l``, a spring of stiffness k pulls
with ``t = k l + c``. The force ``t u = k d + c u`` on the first point has the derivative
``D = k I + (c/l)(I - u u^T) = k u u^T + (t/l)(I - u u^T)`` by d. It enters the tangent of its leg
as ``J^T D J``, J the velocity of d, and as a force does, with the second derivatives of the points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial import skew
from robostiff.statics.leg_state import Beside, LegState, Share

if TYPE_CHECKING:
    from robostiff.statics.legs import LegGroup
    from robostiff.statics.problem import EquilibriumProblem, State

# Of the length of a spring at the unloaded posture, or of its tension: none.
_NONE = 1e-12


@dataclass(frozen=True)
class Anchor:
    """A point of a body that holds an end of a spring, at the unloaded posture [m].

    It is one of the anchors of a chain; without a chain on the base, or on the platform.
    """

    point: np.ndarray
    chain: int | None = None
    place: int = 0
    on_platform: bool = False


@dataclass(frozen=True)
class FiniteBodySpring:
    """A spring between two bodies; ``t = s tension + stiffness (l - length)`` at the share s.

    Raises
    ------
    InputError
        When its ends are in one point, and it pulls there: nowhere.
    """

    name: str
    ends: tuple[Anchor, Anchor]
    stiffness: float  # [N/m]
    # at the unloaded posture [m], [N]
    length: float
    tension: float

    def __post_init__(self) -> None:
        constant = abs(self.tension - self.stiffness * self.length)
        size = max(float(np.max(np.abs(end.point), initial=0.0)) for end in self.ends)
        if self.length <= _NONE * size and constant > _NONE * self.stiffness * size:
            raise InputError(
                f"spring {self.name!r}",
                got="both ends in one point at the unloaded posture",
                expected="points apart: there the direction of its pull is not determined",
                hint="a spring of free length 0 alone may have no length",
            )

    def pulling(self, a: np.ndarray, b: np.ndarray, share: float) -> Pulling:
        """Between points (3,) [m]."""
        d = b - a
        length = float(np.linalg.norm(d))
        constant = share * self.tension - self.stiffness * self.length
        D = self.stiffness * np.eye(3)
        if length == 0:
            return Pulling(np.zeros(3), np.zeros(3), D, 0.0, constant)
        u = d / length
        D = D + (constant / length) * (np.eye(3) - np.outer(u, u))
        tension = self.stiffness * length + constant
        return Pulling(tension * u, self.tension * u, D, length, tension)

    def energy(self, length: float, tension: float) -> float:
        """Stored from its free length; of a constant force, from the unloaded posture [J]."""
        if self.stiffness > 0:
            return 0.5 * tension**2 / self.stiffness
        return tension * (length - self.length)


@dataclass(frozen=True)
class Pulling:
    """A spring at a state: its force (3,) on its first point; the opposite acts on the second [N].

    `rate` is that of the force by the share of loads, D that by the vector between the points
    [N/m].
    """

    force: np.ndarray
    rate: np.ndarray
    D: np.ndarray
    length: float
    tension: float


@dataclass(frozen=True)
class SpringTerms:
    """What springs between bodies contribute to the equations of their legs, m free unknowns."""

    pulls: Sequence[np.ndarray]  # forces on the anchors of each chain [N]
    stiffness: np.ndarray  # (m, m): ``J^T D J``
    by_share: np.ndarray  # (m,): derivative of the gradient of the energy by the share of loads
    by_twist: np.ndarray  # (m, r): the same by the twist of the platform
    carried: np.ndarray  # (r,): what the platform exerts on springs about its point [N, N m]
    beside: Beside  # its derivatives

    @staticmethod
    def of(
        group: LegGroup, state: LegState, R: np.ndarray, p: np.ndarray, share: Share
    ) -> SpringTerms:
        """At a state of legs, with the platform at (R, p)."""
        m, rows = group.free_size, list(group.rows)
        r = len(rows)
        anchored = group.anchored(state)
        pulls = [np.zeros(points.shape) for points, _ in anchored]
        stiffness, by_share = np.zeros((m, m)), np.zeros(m)
        by_twist, carried = np.zeros((m, r)), np.zeros(6)
        by_unknown, of_twist, of_share = np.zeros((6, m)), np.zeros((6, 6)), np.zeros(6)
        for spring in group.springs:
            (a, b), J, J_t = _between(spring, group, anchored, R, p)
            own = spring.pulling(a, b, share.value)
            stiffness += J.T @ own.D @ J
            by_share += J.T @ own.rate
            by_twist += (J.T @ own.D @ J_t)[:, rows]
            for sign, at, anchor in zip((1.0, -1.0), (a, b), spring.ends, strict=True):
                if anchor.chain is not None:
                    pulls[anchor.chain][anchor.place] += sign * own.force
                if anchor.on_platform:
                    f = -sign * own.force  # what the platform exerts
                    arm = at - p
                    carried += np.concatenate([f, np.cross(arm, f)])
                    of_twist[3:, 3:] += skew(f) @ skew(arm)
            # the platform moves both ends where it has them: its wrench is J_t^T force
            by_unknown += J_t.T @ own.D @ J
            of_twist += J_t.T @ own.D @ J_t
            of_share += J_t.T @ own.rate
        wide = np.zeros((1, r, group.size))
        wide[0, :, :m] = by_unknown[rows]
        beside = Beside(wide, of_twist[np.ix_(rows, rows)][None], share.rate * of_share[None, rows])
        return SpringTerms(pulls, stiffness, by_share, by_twist, carried[rows], beside)


def _between(
    spring: FiniteBodySpring,
    group: LegGroup,
    anchored: Sequence[tuple[np.ndarray, np.ndarray]],
    R: np.ndarray,
    p: np.ndarray,
) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray, np.ndarray]:
    """Its points, and the velocity between them by legs (3, m) and platform (3, 6)."""
    found, J, J_t = [], np.zeros((3, group.free_size)), np.zeros((3, 6))
    for sign, anchor in zip((-1.0, 1.0), spring.ends, strict=True):
        point = anchor.point
        if anchor.chain is not None:
            points, velocities = anchored[anchor.chain]
            point, J = points[anchor.place], J + sign * velocities[anchor.place]
        elif anchor.on_platform:
            arm = R @ (anchor.point - group.platform_point)
            point = p + arm
            J_t = J_t + sign * np.concatenate([np.eye(3), -skew(arm)], axis=1)
        found.append(point)
    return (found[0], found[1]), J, J_t


def small_pulls(
    group: LegGroup, at_rest: State, step: np.ndarray, twist: np.ndarray
) -> list[np.ndarray]:
    """Forces (A, 3) on the anchors of each chain under small loads, tension among them.

    The coordinates and bodies of the legs move by a step (m,), the platform by a twist (r,).
    """
    anchored = group.anchored(group.unloaded())
    pulls = [np.zeros(points.shape) for points, _ in anchored]
    moved = np.zeros(6)
    moved[list(group.rows)] = twist
    for spring in group.springs:
        ends, J, J_t = _between(spring, group, anchored, at_rest.R, at_rest.p)
        own = spring.pulling(*ends, 0.0)
        d = J @ step + J_t @ moved
        for sign, anchor in zip((1.0, -1.0), spring.ends, strict=True):
            if anchor.chain is not None:
                pulls[anchor.chain][anchor.place] += sign * (own.D @ d + own.rate)
    return pulls


@dataclass(frozen=True)
class LoadedSpring:
    """A spring between two bodies under load.

    Attributes
    ----------
    name : str
    points : (2, 3) array
        Where its ends are [m].
    length : float
        [m].
    tension : float
        Negative where it pushes [N].
    energy : float
        Stored [J]: from its free length; of a constant force, from the unloaded posture.
    """

    name: str
    points: np.ndarray
    length: float
    tension: float
    energy: float


def loaded_springs(
    problem: EquilibriumProblem, state: State, share: float
) -> tuple[LoadedSpring, ...]:
    """Every spring between bodies at a state of a robot."""
    found = []
    for group, own in zip(problem.groups, state.legs, strict=True):
        if not group.springs:
            continue
        anchored = group.anchored(own)
        for spring in group.springs:
            ends = _between(spring, group, anchored, state.R, state.p)[0]
            now = spring.pulling(*ends, share)
            energy = spring.energy(now.length, now.tension)
            found.append(LoadedSpring(spring.name, np.array(ends), now.length, now.tension, energy))
    return tuple(found)
