"""Laws that every equilibrium keeps: of robots of the other parts, and of linkages.

What holds a platform where a wrench has brought it is that wrench. All legs together hand the base
what acts on the robot, and add up to its stiffness. Batches, snapshots, small loads and other
points of the platform say the same.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.linkage import essential
from robostiff.model import Robot
from robostiff.spatial import skew
from tests.campaign.answers import Complaint, Judge
from tests.campaign.assembled import NotAssembledError, of_network
from tests.campaign.bodies import NoMinimumError
from tests.campaign.minima import compare, least
from tests.campaign.moved_linkages import random_linkage

_SAME = 1e-7  # of the entries of a matrix, in units of both ends
_TINY = 1e-6  # of the load: what is left is linear
_FAR = 0.7  # rad or m of a joint
_STIFFEST = 1e7  # against the softest direction: beyond, a free motion is a matter of rounding


def loaded_linkage(rng: np.random.Generator) -> list[Complaint]:
    """A linkage under a wrench; beams, joints and bodies in closed circuits."""
    linkage, judge = random_linkage(rng), Judge(None, 1.0, False)
    try:
        essential(linkage)
    except rs.InputError:  # a circuit that ends where it begins is left out
        return []
    network = rs.network_at(linkage, None)
    length = float(network.characteristic_length) or 1.0
    unloaded, scale = rs.stiffness(network), np.repeat([length, 1.0], 3)
    doubt = rs.Status.UNREACHABLE | rs.Status.ILL_CONDITIONED | rs.Status.RIGID_DIRECTION
    if unloaded.status & doubt or int(unloaded.rank) < 6:
        return []
    deflection = 10 ** rng.uniform(-5, -1.3)
    if np.linalg.cond(unloaded.K / np.outer(1 / scale, 1 / scale)) > _STIFFEST:
        return []
    wrench = deflection * unloaded.K @ (rng.normal(size=6) * scale)
    ask = partial(rs.equilibrium, network, None, wrench)
    keep_laws(rng, judge, network, None, wrench, {}, length)
    try:
        own = of_network(network)
        compare(judge, ask, own, least(own, wrench), scale)
    except (NotAssembledError, NoMinimumError):
        pass
    return judge.complaints


def keep_laws(
    rng: np.random.Generator,
    judge: Judge,
    machine: Any,
    pose: Any,
    wrench: np.ndarray,
    more: dict[str, Any],
    length: float,
) -> None:
    """Complain where the equilibrium of a robot or a network does not keep a law."""
    found: Any = rs.equilibrium(machine, pose, wrench, **more)
    bad = rs.Status.FREE_MOTIONS | rs.Status.BEYOND_CRITICAL_LOAD
    if not found.has_answer or found.status & bad or not found.stable or found.margin < 0.1:
        return
    if found.found.known.regular and found.status & rs.Status.REDUNDANT_JOINTS:
        return  # what spins freely at rest is turned by the least load
    if max(float(np.max(np.abs(part.motion))) for part in found.parts) > _FAR:
        return  # by other ways it may come to rest elsewhere
    laws = _Laws(judge, machine, pose, wrench, more, found, length)
    laws.held()
    laws.balance()
    laws.other_ways()
    laws.about_another_point(rng.uniform(-1, 1, 3) * length)


class _Laws:
    """An equilibrium, and what it has to keep."""

    def __init__(
        self,
        judge: Judge,
        machine: Any,
        pose: Any,
        wrench: np.ndarray,
        more: dict[str, Any],
        found: Any,
        length: float,
    ) -> None:
        self.judge, self.machine, self.pose, self.wrench = judge, machine, pose, wrench
        self.more, self.found, self.length = more, found, length
        self.rows = list(machine.space.rows)
        self.scale = np.array([1.0 if row < 3 else 1.0 / length for row in self.rows])
        self.ask: Any = partial(rs.equilibrium, machine, pose, **more)
        rigid = bool(found.status & rs.Status.RIGID_DIRECTION)
        self.has_springs = isinstance(machine, Robot) and bool(machine.springs)
        self.K: Any = None if rigid else found.K

    def near(self, way: str, what: str, one: Any, other: Any, limit: float, size: Any) -> None:
        """Complain where two differ by more than a part of a size."""
        off = float(np.max(np.abs(np.asarray(one) - other) / size, initial=0.0))
        if not off <= limit:
            detail = f"{off:.1e}; {self.found.status}, margin {self.found.margin:.2g}"
            self.judge.say(way, what, detail)

    def sizes(self, K: np.ndarray) -> np.ndarray:
        """Units of entries of K."""
        own = np.sqrt(np.abs(np.diag(K)))
        own = np.maximum(own, 1e-3 * np.max(own * self.scale) / self.scale)
        return np.outer(own, own)

    @property
    def force(self) -> np.ndarray:
        """Units of the components of a wrench that legs carry."""
        legs = [np.abs(W * self.scale) for W in self.found.leg_wrenches]
        most = max(float(np.max(legs)), float(np.max(np.abs(self.wrench * self.scale))))
        return most / self.scale

    def held(self) -> None:
        """The pose prescribed: what holds it is the wrench that brought it there."""
        own, found = self.ask(displacement=self.found.displacement), self.found
        if not own.has_answer:
            self.judge.say("held", "no answer", str(own.status))
            return
        if self.K is not None:
            slack = np.abs(found.K_total) @ (1e-11 * self.length * self.scale) + 1e-8 * self.force
            self.near("held", "another wrench", own.wrench, self.wrench, 1, slack)
            self.near("held", "another K", own.K, self.K, _SAME, self.sizes(self.K))
        energy = max(abs(found.energy), 1e-300)
        self.near("held", "another energy", own.energy, found.energy, 1e-6, energy)

    def balance(self) -> None:
        """The base gets what acts on the robot; legs add up to K."""
        if self.has_springs:
            return
        if "loads" not in self.more and "gravity" not in self.more:
            acting, size = np.zeros(6), np.full(6, np.max(self.force * self.scale))
            acting[self.rows] = self.found.wrench
            size[3:] *= self.length
            got = np.sum(self.found.reactions, axis=0)
            self.near("balance", "another wrench on the base", got, acting, 1e-8, size)
        if self.K is not None:
            K = sum(self.found.leg_K)
            self.near("balance", "legs do not add up to K", K, self.K, 1e-9, self.sizes(self.K))

    def other_ways(self) -> None:
        """A batch, the limit of small loads, and a snapshot."""
        batch = self.ask(np.array([0.5, 1.0, -0.3])[:, None] * self.wrench)[1]
        self._same("batch", batch)
        if not self.has_springs and not self.more:
            tiny = _TINY * self.wrench
            moved = np.asarray(rs.stiffness(self.machine, self.pose).compliance) @ tiny
            size = np.max(np.abs(moved / self.scale)) * self.scale
            slack = 1e-4 + 1e-13 * self.length / size
            own = self.ask(tiny).displacement
            self.near("small", "another displacement", own, moved, 1, slack * size)
        is_told = {"gravity", "laws"}.isdisjoint(self.more)  # a snapshot has neither
        if isinstance(self.machine, Robot) and not self.has_springs and is_told:
            frozen = rs.equilibrium(self.found.snapshot, None, self.wrench, **self.more)
            self._same("snapshot", frozen, rs.Status.BEYOND_LIMITS)  # of which it has none

    def about_another_point(self, v: np.ndarray) -> None:
        """The same wrench at another point of the platform, v from it: K follows."""
        rows, found = self.rows, self.found
        full, F, f = np.zeros(6), np.zeros(6), np.zeros(6)
        if len(rows) == 3:
            v = v * [1, 1, 0]
        full[rows], F[rows] = found.displacement, self.wrench
        arm = Rotation.from_rotvec(full[3:]).as_matrix() @ v
        F[3:] -= np.cross(arm, F[:3])
        place = found.found.problem.point + v
        moved: Any = rs.equilibrium(self.machine, self.pose, F[rows], at=place, **self.more)
        if self.K is None or self.has_springs or not moved.has_answer or moved.margin < 0.1:
            return
        if moved.status != found.status:
            return
        f[rows] = sum(found.leg_wrenches)
        J, K = np.eye(6), np.zeros((6, 6))
        J[:3, 3:] = skew(arm)
        K[np.ix_(rows, rows)] = self.K
        K = J.T @ K @ J
        K[3:, 3:] -= skew(f[:3]) @ skew(arm)
        K = K[np.ix_(rows, rows)]
        self.near("point", "another K", moved.K, K, 1e-6, self.sizes(K))

    def _same(self, way: str, own: Any, but: rs.Status = rs.Status.OK) -> None:
        if own.status & ~but != self.found.status & ~but:
            self.judge.say(way, "another status", f"{own.status} for {self.found.status}")
            return
        size = self.scale * self.length
        self.near(way, "another place", own.displacement, self.found.displacement, 1e-9, size)
        if self.K is not None:
            self.near(way, "another K", own.K, self.K, _SAME, self.sizes(self.K))
