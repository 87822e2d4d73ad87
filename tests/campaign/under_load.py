"""Random robots under finite loads, against the laws that every equilibrium keeps.

What holds a platform where a wrench has brought it is that wrench; stiffness is the rate of what
holds it, and the work of the wrench on its way is the energy that is gained. All legs together
hand the base what acts on the robot. Batches, kernels, snapshots and small loads say the same.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.kinematics import find_posture
from robostiff.linkage import essential
from robostiff.model import PlacedBlock, PlacedLeg, Robot, Snapshot
from robostiff.network import Network
from robostiff.spatial import Space, skew
from robostiff.statics.loading.given_loads import has_masses
from tests.campaign import placed
from tests.campaign.answers import Complaint, Judge
from tests.campaign.moved_linkages import random_linkage
from tests.campaign.posed import KINDS, random_posed
from tests.generators.elements import random_transform

Machine = Robot | Snapshot | Network

#: Of the entries of a matrix, in units of both ends.
_SAME = 1e-7
_BY_DIFFERENCES = 2e-6
_WORK = 1e-5  # of the energies
_TINY = 1e-6  # of the load: what is left is linear
_STEP = 1e-5  # of differences, in units of the robot's length and of rad
_KERNELS = 0.25
_SHORT = 24  # parts of a leg
_DRAWS = 10  # until a robot has a stiffness
_FAR = 0.7  # rad or m of a joint
_STIFFEST = 1e7  # against the softest direction: beyond, a free motion is a matter of rounding
_HEAVIEST = 1e9  # N: what needs more to move is rigid but for rounding
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def loaded_robot(rng: np.random.Generator) -> list[Complaint]:
    """A robot under a wrench, weights, preloads and springs, by all laws and ways."""
    for _ in range(_DRAWS):
        drawn = _drawn(rng)
        if drawn is None:
            continue
        robot, pose = drawn
        snapshot: Any = robot
        if isinstance(robot, Robot):
            snapshot = find_posture(robot, pose).snapshot.one(0)
        length = float(snapshot.characteristic_length) or 1.0
        wrench = _wrench(rng, rs.stiffness(robot, pose), robot.space, length)
        if wrench is not None:
            break
    else:
        return []
    force = float(np.max(np.abs(wrench * _scale(robot.space, length))))
    more = _beside(rng, robot, snapshot, length, force)
    if isinstance(robot, Robot) and rng.uniform() < 0.3:
        robot = _with_springs(rng, robot, snapshot, force)
    return _by_laws(rng, robot, pose, wrench, length, more)


def loaded_linkage(rng: np.random.Generator) -> list[Complaint]:
    """A linkage under a wrench, by the same laws; beams, joints and bodies in closed circuits."""
    linkage = random_linkage(rng)
    try:
        essential(linkage)
    except rs.InputError:  # a circuit that ends where it begins is left out
        return []
    network = rs.network_at(linkage, None)
    length = float(network.characteristic_length) or 1.0
    unloaded = rs.stiffness(network)
    wrench = _wrench(rng, unloaded, network.space, length)
    if wrench is None or int(unloaded.rank) < network.space.size:
        return []
    return _by_laws(rng, network, None, wrench, length, {})


def _scale(space: Space, length: float) -> np.ndarray:
    return np.array([1.0 if row < 3 else 1.0 / length for row in space.rows])


def _wrench(
    rng: np.random.Generator, unloaded: Any, space: Space, length: float
) -> np.ndarray | None:
    """A wrench that moves the platform by 1e-5 to 0.05 of its length; None of what is in doubt."""
    scale, n = _scale(space, length), space.size
    if unloaded.status & (rs.Status.UNREACHABLE | rs.Status.ILL_CONDITIONED) or not unloaded.rank:
        return None
    deflection = 10 ** rng.uniform(-5, -1.3)
    if not unloaded.status & rs.Status.RIGID_DIRECTION:
        if np.linalg.cond(unloaded.K * np.outer(scale, scale)) > _STIFFEST:
            return None
        return deflection * unloaded.K @ (rng.normal(size=n) * scale * length)
    if (C := unloaded.compliance) is None or not np.any(C):
        return None
    F = rng.normal(size=n) / scale
    F *= deflection * length / float(np.max(np.abs(C @ F / scale)))
    return F if np.max(np.abs(F * scale)) < _HEAVIEST else None


def _by_laws(
    rng: np.random.Generator,
    robot: Machine,
    pose: Any,
    wrench: np.ndarray,
    length: float,
    more: dict[str, Any],
) -> list[Complaint]:
    judge = Judge(None, 1.0, False)
    found: Any = rs.equilibrium(robot, pose, wrench, **more)
    bad = rs.Status.FREE_MOTIONS | rs.Status.BEYOND_CRITICAL_LOAD
    if not found.has_answer or found.status & bad or not found.stable or found.margin < 0.1:
        return judge.complaints
    if found.found.known.regular and found.status & rs.Status.REDUNDANT_JOINTS:
        return judge.complaints  # what spins freely at rest is turned by the least load
    if max(float(np.max(np.abs(part.motion))) for part in found.parts) > _FAR:
        return judge.complaints  # by other ways it may come to rest elsewhere
    laws = _Laws(judge, robot, pose, wrench, more, found, _scale(robot.space, length), length)
    laws.held()
    laws.rates(rng)
    if rng.uniform() < 0.5:
        laws.work()
    laws.balance()
    laws.other_ways(rng)
    return judge.complaints


class _Laws:
    """An equilibrium, and what it has to keep."""

    def __init__(
        self,
        judge: Judge,
        robot: Machine,
        pose: Any,
        wrench: np.ndarray,
        more: dict[str, Any],
        found: Any,
        scale: np.ndarray,
        length: float,
    ) -> None:
        self.judge, self.robot, self.pose, self.wrench = judge, robot, pose, wrench
        self.more, self.found, self.scale, self.length = more, found, scale, length
        self.ask: Any = partial(rs.equilibrium, robot, pose, **more)
        rigid = bool(found.status & rs.Status.RIGID_DIRECTION)
        self.has_springs = isinstance(robot, Robot) and bool(robot.springs)
        self.K: Any = None if rigid else found.K
        self.K_total: Any = None if rigid else found.K_total

    def say(self, way: str, what: str, detail: str) -> None:
        """Keep what is wrong, with the status."""
        self.judge.say(way, what, f"{detail}; {self.found.status}, margin {self.found.margin:.2g}")

    def near(self, way: str, what: str, one: Any, other: Any, limit: float, size: Any) -> None:
        """Complain where two differ by more than a part of a size."""
        off = float(np.max(np.abs(np.asarray(one) - other) / size, initial=0.0))
        if not off <= limit:
            self.say(way, what, f"{off:.1e}")

    @property
    def sizes(self) -> np.ndarray:
        """Units of entries of K."""
        own = np.sqrt(np.abs(np.diag(self.K)))
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
        own = self.ask(displacement=self.found.displacement)
        if not own.has_answer:
            self.say("held", "no answer", str(own.status))
            return
        if self.K is not None:
            slack = np.abs(self.K_total) @ (1e-11 * self.length * self.scale)
            self.near(
                "held", "another wrench", own.wrench, self.wrench, 1, slack + 1e-8 * self.force
            )
            self.near("held", "another K", own.K, self.K, _SAME, self.sizes)
        energy = max(abs(self.found.energy), 1e-300)
        self.near("held", "another energy", own.energy, self.found.energy, 1e-6, energy)

    def rates(self, rng: np.random.Generator) -> None:
        """Differences of held poses have the rate K_total, those of wrenches the compliance."""
        n = self.robot.space.size
        t = rng.normal(size=n) * self.scale * self.length
        t /= np.linalg.norm(t / self.scale) / self.length
        rows = list(self.robot.space.rows)
        if self.K is not None:
            sides = []
            for h in (_STEP, -_STEP, 2 * _STEP, -2 * _STEP):
                full, turn = np.zeros(6), np.zeros(6)
                full[rows], turn[rows] = h * t, self.found.displacement
                turn[:3] += full[:3]
                R = Rotation.from_rotvec(full[3:]) * Rotation.from_rotvec(turn[3:])
                turn[3:] = R.as_rotvec()
                own = self.ask(displacement=turn[rows])
                if not own.has_answer:
                    self.say("rate", "no answer nearby", str(own.status))
                    return
                sides.append(own.wrench)
            rate = (8 * (sides[0] - sides[1]) - (sides[2] - sides[3])) / (12 * _STEP)
            size = np.sqrt(np.diag(self.sizes)) * np.linalg.norm(np.sqrt(np.diag(self.sizes)) * t)
            size = size + 1e-11 * self.force / _STEP / _BY_DIFFERENCES
            self.near("rate", "another K_total", rate, self.K_total @ t, _BY_DIFFERENCES, size)
        C = self.found.compliance
        F = rng.normal(size=n) / self.scale
        moved = np.max(np.abs(C @ F) / self.scale) / self.length
        if not 0 < moved < np.inf:
            return
        F *= _STEP / moved
        ends = [self.ask(self.wrench + h * F) for h in (1, -1, 2, -2)]
        if not all(end.has_answer for end in ends):
            self.say("rate", "no answer nearby", ", ".join(str(end.status) for end in ends))
            return
        steps = np.array([self._away(end) for end in ends])
        twist = (8 * (steps[0] - steps[1]) - (steps[2] - steps[3])) / 12
        size = self.scale * self.length * _STEP
        self.near("rate", "another compliance", twist, C @ F, 1e-5, size)

    def _away(self, end: rs.Equilibrium) -> np.ndarray:
        """Motion of the platform from the equilibrium to another one."""
        rows = list(self.robot.space.rows)
        full = np.zeros((2, 6))
        full[:, rows] = self.found.displacement, end.displacement
        turn = Rotation.from_rotvec(full[1, 3:]) * Rotation.from_rotvec(full[0, 3:]).inv()
        return np.concatenate([full[1, :3] - full[0, :3], turn.as_rotvec()])[rows]

    def work(self) -> None:
        """What the wrench does on the way from zero is what the potential gains."""
        first = self.ask(0 * self.wrench)
        if not first.stable or first.margin < 0.1:
            return  # from a buckled posture the way may lead through others
        gained, F = self.found.potential - first.potential, self.wrench
        done = np.inf
        for parts in (1, 8):  # stiffness may change within a small part of the way
            factors = np.concatenate([(_NODES + 1 + 2 * k) / (2 * parts) for k in range(parts)])
            way = [self.ask(s * F) for s in factors]
            if any(
                not own.has_answer or own.status & rs.Status.FREE_MOTIONS or own.margin < 0.02
                for own in way
            ):
                return
            rates = [s * F @ own.compliance @ F for s, own in zip(factors, way, strict=True)]
            done = float(np.dot(np.tile(_WEIGHTS, parts), rates)) / (2 * parts)
            size = abs(self.found.energy) + abs(first.energy) + abs(gained) + abs(done)
            if abs(gained - done) <= _WORK * size:
                return
        self.near("work", "another energy than the work", gained, done, _WORK, size)

    def balance(self) -> None:
        """The base gets what acts on the robot; legs and springs add up to K."""
        found = self.found
        acting, size = np.zeros(6), np.full(6, np.max(self.force * self.scale))
        acting[list(self.robot.space.rows)] = found.wrench
        size[3:] *= self.length
        alone = not self.has_springs
        if alone and "loads" not in self.more and "gravity" not in self.more:
            got = np.sum(found.reactions, axis=0)
            self.near("balance", "another wrench on the base", got, acting, 1e-8, size)
        if self.K is not None and alone:
            K = sum(found.leg_K)
            self.near("balance", "legs do not add up to K", K, self.K, 1e-9, self.sizes)
        for part in (*found.parts, *found.springs):
            if not np.isfinite(part.energy):
                self.say("balance", "no energy", str(part))

    def other_ways(self, rng: np.random.Generator) -> None:
        """A batch, the limit of small loads, a snapshot, another point, and a kernel."""
        batch = self.ask(np.array([0.5, 1.0, -0.3])[:, None] * self.wrench)[1]
        self._same("batch", batch)
        if not self.has_springs and not self.more:
            tiny = _TINY * self.wrench
            moved = np.asarray(rs.stiffness(self.robot, self.pose).compliance) @ tiny
            size = np.max(np.abs(moved / self.scale)) * self.scale
            slack = 1e-4 + 1e-13 * self.length / size
            own = self.ask(tiny).displacement
            self.near("small", "another displacement", own, moved, 1, slack * size)
        if isinstance(self.robot, Robot) and not self.has_springs and "gravity" not in self.more:
            frozen = rs.equilibrium(self.found.snapshot, None, self.wrench, **self.more)
            # A snapshot does not have limits of joints.
            passed = self.found.status & rs.Status.BEYOND_LIMITS
            self._same("snapshot", replace(frozen, status=frozen.status | passed))
        self._about_another_point(rng.uniform(-1, 1, 3) * self.length)
        # Records of legs with dozens of parts take minutes.
        legs = [part.leg for part in self.found.parts]
        few = max(Counter(legs).values()) <= _SHORT
        if few and isinstance(self.robot, Robot) and rng.uniform() < _KERNELS:
            self._by_kernel(self.robot)

    def _about_another_point(self, v: np.ndarray) -> None:
        """The same wrench at another point of the platform, v from it: K follows."""
        rows, found = list(self.robot.space.rows), self.found
        full, F, f = np.zeros(6), np.zeros(6), np.zeros(6)
        if len(rows) == 3:
            v = v * [1, 1, 0]
        full[rows], F[rows] = found.displacement, self.wrench
        arm = Rotation.from_rotvec(full[3:]).as_matrix() @ v
        F[3:] -= np.cross(arm, F[:3])
        place = found.problem.point + v
        moved: Any = rs.equilibrium(self.robot, self.pose, F[rows], at=place, **self.more)
        if self.K is None or self.has_springs or not moved.has_answer or moved.margin < 0.1:
            return
        if moved.status != found.status:
            return
        f[rows] = sum(found.leg_wrenches)
        J = np.eye(6)
        J[:3, 3:] = skew(arm)
        K = np.zeros((6, 6))
        K[np.ix_(rows, rows)] = self.K
        K = J.T @ K @ J
        K[3:, 3:] -= skew(f[:3]) @ skew(arm)
        size = np.sqrt(np.abs(np.diag(K)))[rows]
        size = np.maximum(size, 1e-3 * np.max(size * self.scale) / self.scale)
        self.near("point", "another K", moved.K, K[np.ix_(rows, rows)], 1e-6, np.outer(size, size))

    def _same(self, way: str, own: Any) -> None:
        if own.status != self.found.status:
            self.say(way, "another status", str(own.status))
            return
        size = self.scale * self.length
        self.near(way, "another place", own.displacement, self.found.displacement, 1e-9, size)
        if self.K is not None:
            self.near(way, "another K", own.K, self.K, _SAME, self.sizes)

    def _by_kernel(self, robot: Robot) -> None:
        try:
            fast = rs.compile_loaded(robot, backend=rs.Backend.ARRAYS, **self.more)
        except (rs.InputError, rs.NoAnswerError):  # with the reason
            return
        posture = find_posture(robot, self.pose)
        pose: Any = posture.pose[:, robot.coordinate_places]
        if robot.is_posed_by_joints:
            pose = rs.JointCoordinates(posture.coordinates[0])
        answer = fast.evaluate(pose, self.wrench)
        size = self.scale * self.length
        way = "kernel, guarded" if answer.guarded[0] else "kernel"
        self.near(way, "another place", answer.displacement[0], self.found.displacement, 1e-8, size)
        if self.K is not None:
            self.near(way, "another K", answer.K[0], self.K, _SAME, self.sizes)


def _drawn(rng: np.random.Generator) -> tuple[Robot | Snapshot, Any] | None:
    """A robot, and a pose of it; or one with blocks in blocks, or on a flexible platform."""
    sort = rng.uniform()
    if sort < 0.4:
        drawn = placed.KINDS[str(rng.choice(["nested", "nested planar", "platform"]))](rng)
        legs = tuple(_numbered(leg, itertools.count()) for leg in drawn.legs)
        return replace(drawn, legs=legs), None
    if sort < 0.6:
        return _hybrid(rng), None
    names = list(KINDS)
    kind = names[rng.integers(len(names))]
    posed = random_posed(rng, kind, 2)
    if posed is None:
        return None
    row = int(rng.integers(len(posed.rows)))
    rows = posed.rows[row]
    return posed.robot, rs.JointCoordinates(rows) if posed.by_joints else rows


def _numbered(leg: PlacedLeg, numbers: Iterator[int]) -> PlacedLeg:
    """The leg with a name of its own for every part: loads are given by names."""
    return replace(
        leg,
        elements=tuple(
            replace(e, branches=tuple(_numbered(branch, numbers) for branch in e.branches))
            if isinstance(e, PlacedBlock)
            else replace(e, name=f"{e.name} {next(numbers)}")
            for e in leg.elements
        ),
    )


def _hybrid(rng: np.random.Generator) -> Robot:
    """Robots of several legs and of one in series; some modules are such machines themselves."""
    modules: list[rs.Module] = []
    machine: Any = None
    while len(modules) < 2 or (len(modules) < 3 and rng.uniform() < 0.4):
        kind = str(rng.choice(["shipped", "driven arm", "structure", "hand-made"]))
        drawn = random_posed(rng, kind, 1) if rng.uniform() < 0.9 else None
        mount = random_transform(rng, 0.5) if rng.uniform() < 0.5 else None
        try:
            part = _hybrid(rng) if drawn is None else drawn.robot
            more = [*modules, rs.Module(f"m{len(modules)}", part, mount)]
            machine = rs.hybrid_machine(more)
        except rs.InputError:  # of cables, springs, couplings, in space and in a plane: no machine
            continue
        modules = more
    return machine


def _beside(
    rng: np.random.Generator, robot: Robot | Snapshot, snapshot: Any, length: float, force: float
) -> dict[str, Any]:
    """Dead forces at bodies, preloads of drives, weights: as large as the wrench, or smaller."""
    in_space = np.isin(np.arange(3), [row for row in robot.space.rows if row < 3])
    parts = {f"{leg.name}/{e.name}": e for leg in snapshot.legs for e in leg.own_parts}
    loads: dict[str, Any] = {
        name: 0.2 * force * rng.normal(size=3) * in_space
        for name in parts
        if rng.uniform() < 0.4 / len(parts)
    }
    if rng.uniform() < 0.2:
        point = snapshot.reference_point + 0.1 * length * rng.normal(size=3) * in_space
        loads["platform"] = rs.DeadForce(0.2 * force * rng.normal(size=3) * in_space, point)
    preload = {
        name: float(0.2 * force * length * rng.normal())
        for name, e in parts.items()
        if isinstance(getattr(e, "role", None), rs.Actuated) and e.role.stiffness
        if rng.uniform() < 0.1
    }
    more: dict[str, Any] = {"loads": loads} if loads else {}
    more |= {"preload": preload} if preload else {}
    if has_masses(robot) and rng.uniform() < 0.3:
        more["gravity"] = rng.uniform(-3, 3, 3) * in_space
    return more


def _with_springs(rng: np.random.Generator, robot: Robot, snapshot: Any, force: float) -> Robot:
    """With springs from the base to the platform, or from one of them to a body."""
    in_space = np.isin(np.arange(3), [row for row in robot.space.rows if row < 3])
    names = [f"{own.name}/{e.name}" for own in snapshot.legs for e in own.own_parts]
    # Couplings are no bodies, and springs know a telescope as one part.
    hidden = " sum ", "coupling", ".beam"
    names = [name for name in names if not any(own in name for own in hidden)]
    own = []
    for i in range(int(rng.integers(1, 3))):
        bodies = ["base", "platform"]
        if names and rng.uniform() < 0.6:
            bodies[rng.integers(2)] = str(rng.choice(names)).partition("[")[0]
        one, other = (rs.BodyPoint(body, rng.uniform(-0.3, 0.3, 3) * in_space) for body in bodies)
        how = {"free_length": float(rng.uniform(0, 0.5))}
        if rng.uniform() < 0.5:
            how = {"preload": float(0.2 * force * rng.normal())}
        k = force * 10 ** rng.uniform(-1, 1)
        own.append(rs.BodySpring(f"spring{i}", (one, other), stiffness=k, **how))
    return robot.with_springs(own)
