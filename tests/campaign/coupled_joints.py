"""Random robots with gears, belts and differentials, against joints that each move alone.

A leg is a chain of joints and beams, with parallel blocks in it; sums of its joints are held by
gears, held by springs, or driven. The stiffness follows here from the wrenches of all chains and
branches and from what every sum transmits: those that do no work on passive joints, and their
energy. Nothing is reduced to the coordinates ``q = T p`` of the package, and places of axes follow
from products of exponentials.
"""
# pyright: reportArgumentType=false

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import robostiff as rs
from robostiff.elasticity import circle, material
from robostiff.elastostatics import Status
from robostiff.io.snapshot import snapshot_to_data
from robostiff.kinematics import Posture, find_posture
from robostiff.model import Branch, Joint, ParallelBlock, Role, coupling, helical
from robostiff.network import condense, network_of_snapshot
from robostiff.spatial import Frame, move_stiffness
from tests.campaign.answers import Complaint, Judge
from tests.campaign.moved_linkages import ByForces, from_wrenches, motion, rotated, to_point

_AGREEMENT = 1e-7  # of floats, with the wrenches of all chains at once
_CLOSED = 1e-7
_FORMS = (rs.Block(), rs.Recursive(), rs.SaddlePoint())
_KERNELS, _OTHERS, _FORMULAS = 0.3, 0.5, 0.03  # parts of the robots that take these ways


@dataclass
class Wrenches:
    """Unknowns of a robot at a posture: wrenches of chains, and what sums transmit."""

    point: np.ndarray
    scale: np.ndarray
    rows: list[dict[int, np.ndarray]] = field(default_factory=list)
    springs: list[tuple[dict[int, np.ndarray], np.ndarray]] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)

    def unknown(self, size: int) -> int:
        """A new unknown of so many entries."""
        self.sizes.append(size)
        return len(self.sizes) - 1

    def along(self, chain: rs.Chain, q: list[float], start: Frame) -> tuple[int, Frame]:
        """The wrench of a chain at coordinates of its joints, which are used up, and its end."""
        wrench, R, p = self.unknown(6), start.R, start.p
        sums = [(own, self.unknown(1)) for own in chain.couplings]
        for element in chain.elements:
            if isinstance(element, rs.Rigid):
                R, p = R @ element.transform.R, p + R @ element.transform.p
            elif isinstance(element, rs.Link):
                p = p + R @ element.to
                own = to_point(p - self.point) * self.scale
                B = rotated(R @ element.axes).T @ own
                self.springs.append(({wrench: B}, element.elasticity.compliance))
            elif isinstance(element, Joint):
                own_q = [q.pop(0) for _ in element.freedoms]
                turned, shift, columns = motion(element, own_q)
                for column in columns:
                    v = rotated(R) @ column
                    v = np.concatenate([v[:3] + np.cross(p - self.point, v[3:]), v[3:]])
                    terms = {wrench: (v * self.scale)[None]}
                    for one, place in sums:
                        if (factor := dict(one.terms).get(element.name)) is not None:
                            terms[place] = np.array([[-float(factor)]])
                    self._joint(terms, element.role)
                R, p = R @ turned, p + R @ shift
            elif isinstance(element, ParallelBlock):
                R, p = self._block(element, q, Frame(R, p), wrench)
        for own, place in sums:
            if own.role.stiffness is not None:
                self.springs.append(({place: np.eye(1)}, np.eye(1) / own.role.stiffness))
        return wrench, Frame(R, p)

    def _joint(self, terms: dict[int, np.ndarray], role: Role) -> None:
        if isinstance(role, rs.Passive):
            self.rows.append(terms)
        elif role.stiffness is not None:
            self.springs.append((terms, np.eye(1) / role.stiffness))

    def _block(
        self, block: ParallelBlock, q: list[float], start: Frame, wrench: int
    ) -> tuple[np.ndarray, np.ndarray]:
        total, ends = {wrench: -np.eye(6)}, []
        for branch in block.branches:
            own, end = self.along(branch.chain, q, start @ branch.start)
            total[own] = np.eye(6)
            ends.append(end @ branch.end.inverse)
        self.rows.append(total)
        for other in ends[1:]:
            self.open = max(self.open, apart(other, ends[0]))
        return ends[0].R, ends[0].p

    open: float = 0.0

    def stiffness(self, legs: list[int]) -> ByForces:
        """About the point, of legs that hold one platform."""
        load = self.unknown(6)
        self.rows.append({**{leg: np.eye(6) for leg in legs}, load: -np.eye(6)})
        ends = np.cumsum(self.sizes)

        def whole(terms: dict[int, np.ndarray]) -> np.ndarray:
            height = next(iter(terms.values())).shape[0]
            M = np.zeros((height, ends[-1]))
            for place, block in terms.items():
                M[:, ends[place] - self.sizes[place] : ends[place]] = block
            return M

        rows = [whole(terms) for terms in self.rows]
        rows = [row / np.linalg.norm(row, axis=1, keepdims=True) for row in rows]
        felt = [(whole(terms)[:, :-6], C) for terms, C in self.springs]
        energy = sum((B.T @ C @ B for B, C in felt), np.zeros((ends[-2], ends[-2])))
        return from_wrenches(np.vstack(rows), energy, self.scale)


def apart(one: Frame, other: Frame) -> float:
    """The largest difference of two frames."""
    return float(max(np.abs(one.R - other.R).max(), np.abs(one.p - other.p).max()))


def by_joints(
    robot: rs.Robot, coordinates: list[np.ndarray], pose: Frame
) -> tuple[ByForces, float]:
    """Stiffness of a robot whose joints stand at coordinates, and how far it is open."""
    point = pose.p + pose.R @ robot.reference_point
    found = Wrenches(point, np.array([1.0] * 3 + [0.5] * 3))
    legs = []
    for leg, q in zip(robot.legs, coordinates, strict=True):
        wrench, end = found.along(leg.chain, q.tolist(), leg.base)
        found.open = max(found.open, apart(end, pose @ leg.attachment))
        legs.append(wrench)
    return found.stiffness(legs), found.open


def sums_off(chain: rs.Chain, q: np.ndarray) -> float:
    """How far the held sums of a chain are from what they are at home, those of blocks included."""
    home = {}
    names = [joint.name for joint, place in chain.moving for _ in range(place.start, place.stop)]
    for joint, _ in chain.moving:
        home[joint.name] = joint.home[0]
    at = dict(zip(names, q, strict=True))
    off = 0.0
    for own in _couplings(chain):
        if isinstance(own.role, rs.Locked):
            held = own.home
            if held is None:
                held = sum(factor * home[name] for name, factor in own.terms)
            off = max(off, abs(sum(factor * at[name] for name, factor in own.terms) - held))
    return off


def _couplings(chain: rs.Chain) -> list[rs.Coupling]:
    inner = [
        own
        for element in chain.elements
        if isinstance(element, ParallelBlock)
        for branch in element.branches
        for own in _couplings(branch.chain)
    ]
    return [*chain.couplings, *inner]


def _frame(rng: np.random.Generator) -> Frame:
    from scipy.spatial.transform import Rotation

    return Frame(Rotation.from_rotvec(rng.normal(size=3)).as_matrix(), rng.uniform(-0.5, 0.5, 3))


def _stiffness(rng: np.random.Generator) -> float:
    return float(10 ** rng.uniform(4, 6))


def _joints(rng: np.random.Generator, prefix: str, count: int) -> list[Joint]:
    """Joints of one freedom, some of which are held or driven."""
    joints = []
    for i in range(count):
        role: Role = rs.Passive()
        if (chance := rng.uniform()) < 0.35:
            role = rs.Actuated(_stiffness(rng))
        elif chance < 0.5:
            role = (rs.Actuated(), rs.Locked(), rs.Locked(_stiffness(rng)))[rng.integers(3)]
        axis, name, home = rng.normal(size=3), f"{prefix}{i}", rng.uniform(-0.6, 0.6, 1)
        if rng.uniform() < 0.1:
            axis = np.eye(3)[rng.integers(3)]
        match str(rng.choice(["R", "P", "H"], p=[0.65, 0.25, 0.1])):
            case "R":
                joints.append(rs.revolute(axis, role, home=home, name=name))
            case "P":
                joints.append(rs.prismatic(axis, role, home=home, name=name))
            case _:
                joints.append(helical(axis, 0.2, role, home=home, name=name))
    return joints


def _sums(rng: np.random.Generator, joints: list[Joint]) -> list[rs.Coupling]:
    """Gears, belts and differentials between some joints, each with a passive joint of its own."""
    names = [joint.name for joint in joints]
    passive = [joint.name for joint in joints if isinstance(joint.role, rs.Passive)]
    found: list[rs.Coupling] = []
    for i in range(int(rng.integers(0, 4))):
        if not passive:
            break
        first = str(rng.choice(passive))
        others = [name for name in names if name != first]
        count = int(rng.integers(1, min(3, len(others)) + 1))
        factors = {first: 1.0} if rng.uniform() < 0.5 else {first: float(rng.uniform(-2, 2))}
        for name in rng.choice(others, count, replace=False):
            factors[str(name)] = float(rng.choice([-1, 1]) * rng.choice([0.3, 1.0, 1.5, 2.0]))
        role = (
            rs.Locked(),
            rs.Locked(_stiffness(rng)),
            rs.Actuated(_stiffness(rng)),
            rs.Actuated(),
        )[rng.choice(4, p=[0.35, 0.25, 0.3, 0.1])]
        own = rs.Coupling(tuple(factors.items()), role, name=f"{names[0]} sum {i}")
        if rng.uniform() < 0.3:
            (name,) = rng.choice(others, 1)
            joint = next(one for one in joints if one.name == first)
            leader = next(one for one in joints if one.name == name)
            ratio, k = float(rng.uniform(-2, 2)), (None, _stiffness(rng))[rng.integers(2)]
            offset = joint.home[0] - ratio * leader.home[0]
            own = coupling(first, follows=str(name), ratio=ratio, offset=offset, stiffness=k)
        try:
            rs.Chain(tuple(joints), (*found, own))
        except rs.InputError:  # a sum of others, or nothing is left that could follow
            continue
        found.append(own)
    return found


def _chain(rng: np.random.Generator, prefix: str, count: int, *, block: bool = False) -> rs.Chain:
    joints = _joints(rng, prefix, count)
    elements: list = list(joints)
    if rng.uniform() < 0.2:
        elements.append(
            rs.spherical(rs.Passive(), home=rng.uniform(-0.3, 0.3, 3), name=f"{prefix}ball")
        )
    for i in range(int(rng.integers(1, 4))):
        place = int(rng.integers(len(elements) + 1))
        to = rng.uniform(-0.5, 0.5, 3)
        elements.insert(
            place, rs.beam_link(to, material("steel"), circle(0.03), name=f"{prefix}b{i}")
        )
    for _ in range(2):
        elements.insert(int(rng.integers(len(elements) + 1)), rs.Rigid(_frame(rng)))
    if block:
        elements.insert(int(rng.integers(len(elements) + 1)), _block(rng, prefix))
    return rs.Chain(tuple(elements), tuple(_sums(rng, joints)))


def _end(chain: rs.Chain, start: Frame) -> Frame:
    """Where a chain ends at home, by products of exponentials."""
    walk = Wrenches(np.zeros(3), np.ones(6))
    return walk.along(chain, chain.joint_coordinates(chain.home).tolist(), start)[1]


def _block(rng: np.random.Generator, prefix: str) -> ParallelBlock:
    """Branches that end where the first one does."""
    branches, end = [], None
    for i in range(int(rng.integers(2, 4))):
        name = f"{prefix}{'xyz'[i]}"
        chain, start = _chain(rng, name, int(rng.integers(2, 5))), _frame(rng)
        own = _end(chain, start)
        end = own if end is None else end
        branches.append(Branch(name, start, chain, end.inverse @ own))
    return ParallelBlock(tuple(branches), f"{prefix}block")


def random_robot(rng: np.random.Generator) -> rs.Robot:
    """An arm, a single leg with a block, or a platform on two or three legs."""
    kind = str(rng.choice(["arm", "block", "platform"], p=[0.4, 0.25, 0.35]))
    tip = rng.uniform(-0.3, 0.3, 3)
    if kind == "arm":
        chain = _chain(rng, "j", int(rng.integers(2, 8)))
        leg = rs.Leg("arm", _frame(rng), chain, _frame(rng))
        return rs.Robot("arm", (leg,), reference_point=tip, coordinates=())
    home, legs = _frame(rng), []
    for i in range(1 if kind == "block" else int(rng.integers(2, 4))):
        block = kind == "block" or rng.uniform() < 0.15
        while True:
            count = int(rng.integers(2, 6) if kind == "block" else rng.integers(5, 10))
            chain, base = _chain(rng, "abc"[i], count, block=block), _frame(rng)
            if chain.has_compliance:
                break
        legs.append(rs.Leg(f"leg{i}", base, chain, home.inverse @ _end(chain, base)))
    return rs.Robot(kind, tuple(legs), home=home, reference_point=tip, coordinates=())


def _free_to_move(robot: rs.Robot) -> rs.Robot:
    """With all coordinates of the platform, where its legs can be posed by them."""
    from dataclasses import replace

    from robostiff.model import Coordinate

    try:
        free = replace(robot, coordinates=tuple(Coordinate))
        find_posture(free)
    except rs.InputError:
        return robot
    return free


def judged_robot(rng: np.random.Generator) -> list[Complaint]:
    """A robot at home, and beside it, by all ways."""
    robot = random_robot(rng)
    if robot.name != "arm":
        robot = _free_to_move(robot)
    judge = Judge(None, 1.0, False)
    pose = None
    if robot.name == "arm":
        chain = robot.legs[0].chain
        p = np.tile(chain.home, (4, 1))
        p[1:, chain.free] += rng.uniform(-0.5, 0.5, (3, int(chain.free.sum())))
        pose = rs.JointCoordinates(p)
    elif robot.coordinates:
        home = robot.home
        assert home is not None
        at = np.concatenate([home.p, home.rigid_transform.rotation.as_rotvec()])
        pose = np.tile(at, (4, 1)) + rng.uniform(-0.05, 0.05, (4, 6)) * [[0], [1], [1], [1]]
    posture = find_posture(robot, pose)
    found = rs.stiffness(robot, pose)
    truths = [_posture(judge, robot, posture, i, found) for i in range(len(posture.pose))]
    for i, truth in enumerate(truths):
        one = found[i] if found.batch_shape else found
        if truth is not None:
            compare(judge, f"stiffness {i}", truth, one.status, int(one.rank), one.matrix)
    if truths[0] is not None:
        _other_ways(rng, judge, robot, posture, truths[0])
    if rng.uniform() < _KERNELS and pose is not None:
        _by_kernel(judge, robot, pose, truths)
    return judge.complaints


def _posture(
    judge: Judge, robot: rs.Robot, posture: Posture, i: int, found: rs.Stiffness
) -> ByForces | None:
    """The truth at a posture, if it is one."""
    codes = np.atleast_1d(found.status_codes)
    if Status(int(codes[i])) & (Status.UNREACHABLE | Status.ILL_CONDITIONED):
        return None
    q = [
        leg.chain.joint_coordinates(own[i])
        for leg, own in zip(robot.legs, posture.coordinates, strict=True)
    ]
    from scipy.spatial.transform import Rotation

    R = Rotation.from_rotvec(posture.pose[i, 3:]).as_matrix()
    truth, gap = by_joints(robot, q, Frame(R, posture.pose[i, :3]))
    off = max(sums_off(leg.chain, own) for leg, own in zip(robot.legs, q, strict=True))
    if gap > _CLOSED or off > _CLOSED:
        judge.say(f"posture {i}", "open", f"{gap:.1e}, sums {off:.1e} off")
        return None
    return truth if truth.is_clear else None


def compare(
    judge: Judge, way: str, truth: ByForces, status: Status, rank: int, K: np.ndarray
) -> None:
    """Complain where an answer is not what joints that move alone say."""
    if status & (Status.ILL_CONDITIONED | Status.UNREACHABLE | Status.FORM_DOES_NOT_HOLD):
        return
    if truth.rank != rank:
        judge.say(way, "another rank", f"{rank} for {truth.rank}, {status}")
    elif (truth.K is None) != bool(status & Status.RIGID_DIRECTION):
        judge.say(way, "another answer about rigid directions", str(status))
    elif truth.K is not None and not (off := difference(K, truth.K)) <= _AGREEMENT:
        judge.say(way, "another K", f"{off:.2e}, {status}")


def difference(K: np.ndarray, other: np.ndarray) -> float:
    """The largest difference of entries, in units of both ends."""
    if not np.any(other):
        return 0.0 if not np.any(K) else np.inf
    size = np.sqrt(np.abs(np.diag(other)))
    size = np.maximum(size, 1e-3 * np.repeat([size[:3].max(), size[3:].max()], 3))
    size = np.maximum(size, 1e-6 * size.max())  # of metres and radians alike
    return float(np.max(np.abs(K - other) / np.outer(size, size)))


def _other_ways(
    rng: np.random.Generator, judge: Judge, robot: rs.Robot, posture: Posture, truth: ByForces
) -> None:
    """The first pose by forms, networks, files, deflections and formulas."""
    snapshot = posture.snapshot.one(0)
    one = rs.stiffness(snapshot)
    compare(judge, "snapshot", truth, one.status, int(one.rank), one.matrix)
    for form in _FORMS:
        own = rs.stiffness(snapshot, method=form)
        compare(judge, form.name, truth, own.status, int(own.rank), own.matrix)
    if rng.uniform() < _OTHERS:
        network = condense(network_of_snapshot(snapshot))
        v = snapshot.reference_point - network.origin
        K = move_stiffness(network.K, v) if truth.K is not None else np.zeros((6, 6))
        compare(judge, "network", truth, network.status, int(network.rank), K)
    if rng.uniform() < _OTHERS:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "robot.json")
            path.write_text(json.dumps(snapshot_to_data(snapshot)))
            own = rs.stiffness(rs.load(path))
        compare(judge, "file", truth, own.status, int(own.rank), own.matrix)
    if truth.K is not None and truth.rank == 6 and np.linalg.cond(truth.K) < 1e10:
        F = rng.normal(size=6)
        bent = rs.deflection(snapshot, None, F)
        twist = np.linalg.solve(truth.K, F)
        off = np.abs(bent.twist - twist).max() / np.abs(twist).max()
        energy = sum(part.energy for part in bent.parts)
        if not off <= 1e-6:
            judge.say("deflection", "another twist", f"{off:.1e}")
        if not abs(energy - F @ twist / 2) <= 1e-6 * abs(F @ twist):
            judge.say("deflection", "another energy", f"{energy} for {F @ twist / 2}")
    if rng.uniform() < _FORMULAS and robot.name == "arm" and truth.K is not None:
        formula = rs.derive(robot, form=rs.Steps())
        if not (off := difference(formula.lambdify()(), truth.K)) <= _AGREEMENT:
            judge.say("formula", "another K", f"{off:.2e}")


def _by_kernel(
    judge: Judge, robot: rs.Robot, pose: rs.JointCoordinates | np.ndarray, truths: list
) -> None:
    try:
        fast = rs.compile(robot, backend=rs.Backend.ARRAYS)
    except (rs.InputError, rs.NoAnswerError):  # rigid, singular: with the reason
        return
    answer = fast.attempt(pose)
    for i in np.flatnonzero(~answer.guarded).tolist():
        if truths[i] is not None:
            status, rank = Status(int(answer.status_codes[i])), int(answer.rank[i])
            compare(judge, f"kernel {i}", truths[i], status, rank, answer.values["K"][i])
