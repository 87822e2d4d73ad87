"""Springs between bodies: closed forms, MuJoCo, an independent minimum of energy, differences."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.errors import InputError
from robostiff.model import PlacedBlock, PlacedBodySpring, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.spatial import Space
from tests.cases.metric import distance
from tests.statics.robots_under_load import joint, loaded, number, root

G = 9.80665
POST, HOLD, MASS, REACH = 0.4, 0.3, 5.0, 0.5


def held(
    *bodies: str,
    points: object,
    k: float,
    length: float = 0.0,
    tension: float = 0.0,
    name: str = "spring",
) -> PlacedBodySpring:
    a, b = np.array(points, dtype=float)
    return PlacedBodySpring(name, (bodies[0], bodies[1]), (a, b), k, length, tension)


def pendulum(
    angle: float, k: float, length: float = 0.0, drive: float | None = None
) -> rs.Snapshot:
    """A rod on a hinge in a vertical plane; a spring from a post above to the rod."""
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    tip = REACH * along
    elements = (
        joint("hinge", [0, 0, 0], [0, 0, 1], "R", drive),
        joint("rod", [0, 0, 0], along, "P", 1e10),
        joint("end", tip, [0, 0, 1], "R", 1e10),
    )
    spring = held("base", "rod/hinge", points=([0, POST, 0], HOLD * along), k=k, length=length)
    robot = rs.Snapshot("pendulum", (PlacedLeg("rod", elements, tip),), tip, Space.PLANAR)
    return replace(robot, springs=(spring,))


BALANCED = MASS * G * REACH / (POST * HOLD)


@pytest.mark.parametrize("angle", [-2.5, -1.0, 0.0, 0.7, 1.4, 2.0])
def test_spring_of_zero_free_length_balances_a_weight_at_every_angle(angle: float):
    """k a b = m g l: what holds the rod is its soft drive alone, as without weight and spring."""
    drive = 10.0
    robot = pendulum(angle, BALANCED, drive=drive)
    answer = loaded(robot, loads={"platform": rs.Mass(MASS)})
    assert answer.stable
    hinge = next(part for part in answer.parts if part.part == "hinge")
    assert abs(hinge.motion[0]) < 1e-7
    assert abs(number(hinge.load)) < 1e-6
    along = np.array([np.cos(angle), np.sin(angle)])
    turn = np.array([-along[1] * REACH, along[0] * REACH, 1.0])  # of the rod, by its hinge
    felt = answer.K_total @ turn
    assert np.isclose(turn @ felt, drive, rtol=1e-6)
    # the bare hinge would need drive's moment for the weight
    bare = loaded(replace(robot, springs=()), loads={"platform": rs.Mass(MASS)})
    assert np.abs(bare.displacement).max() > 1e-2 or abs(np.cos(angle)) < 0.2


def test_pendulum_on_a_spring_with_a_free_length():
    """k (l - l0) a b sin(angle between) / l = m g l cos(angle), solved for the angle."""
    k, free, start = 900.0, 0.25, 0.3

    def moment(angle: float) -> float:
        end = HOLD * np.array([np.cos(angle), np.sin(angle)])
        d = np.array([0, POST]) - end
        pull = k * (np.linalg.norm(d) - free) * d / np.linalg.norm(d)
        return end[0] * pull[1] - end[1] * pull[0] - MASS * G * REACH * np.cos(angle)

    angle = root(moment, 0.3, 1.4)
    answer = loaded(pendulum(start, k, free), loads={"platform": rs.Mass(MASS)})
    assert answer.stable
    hinge = next(part for part in answer.parts if part.part == "hinge")
    assert np.isclose(start + hinge.motion[0], angle, atol=1e-7)
    (spring,) = answer.springs
    assert np.isclose(spring.tension, k * (spring.length - free))
    assert np.isclose(spring.energy, k * (spring.length - free) ** 2 / 2)
    along = np.array([-np.sin(angle), np.cos(angle)]) * REACH
    turn = np.array([*along, 1.0])
    h = 1e-5
    slope = -(moment(angle + h) - moment(angle - h)) / (2 * h)
    assert np.isclose(turn @ answer.K_total @ turn, slope, rtol=1e-5)
    base = answer.reactions[0][:2] - [0.0, 0.0]
    # hinge and post together carry the weight
    post = spring.tension * (spring.points[1] - spring.points[0])[:2] / spring.length
    assert np.allclose(base + post, [0, -MASS * G], atol=1e-5)


def two_arms(*springs: PlacedBodySpring) -> rs.Snapshot:
    """Two arms of three sprung hinges each in space, which hold one platform."""
    legs = []
    for i, side in enumerate((-1.0, 1.0)):
        points = np.array([[0, 0.3 * side, 0], [0.1, 0.35 * side, 0.3], [0.3, 0.2 * side, 0.5]])
        axes = np.array([[0, 0.1, 1.0], [0, 1, 0.2 * side], [1, 0, 0.3]])
        end = np.array([0.5, 0.1 * side, 0.55])
        elements = [
            joint(f"j{n + 1}", point, axis / np.linalg.norm(axis), "R", 300.0 - 40 * n - 20 * i)
            for n, (point, axis) in enumerate(zip(points, axes, strict=True))
        ]
        elements += [
            joint(f"e{n + 1}", end, axis, "R", 150.0 + 10 * n) for n, axis in enumerate(np.eye(3))
        ]
        legs.append(PlacedLeg(f"arm{i + 1}", tuple(elements), end))
    robot = rs.Snapshot("two arms", tuple(legs), np.array([0.5, 0, 0.55]))
    return replace(robot, springs=springs)


A, B = [0.2, -0.25, 0.4], [0.25, 0.28, 0.45]
SPRINGS = {
    "base to body": held("base", "arm1/j2", points=([-0.1, -0.2, 0.6], A), k=4e3, length=0.2),
    "two bodies of an arm": held(
        "arm1/j1", "arm1/e1", points=(A, [0.4, 0, 0.6]), k=3e3, tension=40
    ),
    "two arms": held("arm1/j2", "arm2/j2", points=(A, B), k=5e3, length=0.3, tension=-60.0),
    "body to platform": held("arm2/j1", "platform", points=(B, [0.6, 0.1, 0.5]), k=2e3, length=0.1),
    "base to platform": held("platform", "base", points=([0.6, 0, 0.6], [0.9, 0.2, 1]), k=1e3),
    "constant force": held("arm2/j3", "base", points=(B, [0, 0.5, 1]), k=0.0, tension=70.0),
}
WRENCH = np.array([20.0, -15, -40, 3, -4, 2])


@pytest.mark.parametrize("which", ["all", *SPRINGS])
def test_stiffness_is_that_of_differences_of_equilibria(which: str):
    chosen = SPRINGS.values() if which == "all" else [SPRINGS[which]]
    robot = two_arms(*(replace(own, name=f"s{i}") for i, own in enumerate(chosen)))
    weights = {
        "arm1/j2": rs.Mass(2.0, point=[0.2, -0.3, 0.4]),
        "arm2/j1": rs.DeadForce([5, 0, -20]),
    }
    answer = loaded(robot, wrench=WRENCH, loads=weights)
    assert answer.stable
    assert np.abs(answer.displacement).max() > 5e-3  # far from small
    h, columns = 1e-5, []
    R = Rotation.from_rotvec(answer.displacement[3:])
    for direction in np.eye(6):
        pair = []
        for step in (h, -h):
            moved = answer.displacement + step * direction
            moved[3:] = (Rotation.from_rotvec(step * direction[3:]) * R).as_rotvec()
            pair.append(loaded(robot, displacement=moved, loads=weights).wrench)
        columns.append((pair[0] - pair[1]) / (2 * h))
    assert distance(np.array(columns).T, answer.K) < 1e-6
    assert np.allclose(np.sum(answer.leg_wrenches, axis=0), WRENCH, atol=1e-8) == (
        which not in ("body to platform", "base to platform", "all")
    )
    # without any of the springs it rests elsewhere
    bare = loaded(two_arms(), wrench=WRENCH, loads=weights)
    assert np.abs(bare.displacement - answer.displacement).max() > 1e-4


def test_a_strut_is_stable_where_the_axis_of_a_joint_meets_its_spring():
    """Its curvature by that joint is rounding; on all motions that close the strut it is more."""
    ends = rs.BodyPoint("leg2/strut", [0.02, 0, 0]), rs.BodyPoint("base", [0.5, 0.5, 0.3])
    pull = rs.BodySpring("pull", ends, stiffness=1e5, free_length=0.2)
    robot = replace(rs.load("hexapod"), springs=(pull,))
    pose = rs.find_posture(robot).pose[0] + [0.01, -0.02, 0.01, 0.05, -0.03, 0.02]
    answer: Any = rs.equilibrium(robot, pose)
    assert answer.status == rs.Status.OK
    blocks, equations = answer.problem.blocks, answer.found.known.equations
    (spring,) = answer.problem.legs.springs
    own = spring.spots[0].chain
    block, A = next(pair for pair in zip(blocks, equations.A, strict=True) if own in pair[0].chains)
    m, row = block.free, int(np.flatnonzero((block.chains == own).any(axis=1))[0])
    H, C = A[row, :m, :m], A[row, m:, :m]
    motions = np.linalg.svd(C)[2][len(C) :]
    least = np.linalg.eigvalsh(motions @ (H + H.T) @ motions.T / 2)[0]
    assert least > 0.5
    assert 0.5 < answer.margins["leg2"] < 1


def test_energy_has_its_least_there():
    """An optimiser over the hinges of one arm, with springs and weights, finds the same place."""
    robot = two_arms(
        replace(SPRINGS["two bodies of an arm"], name="a"),
        replace(SPRINGS["base to body"], name="b"),
        held("base", "platform", points=([0.9, -0.2, 1], [0.5, -0.1, 0.6]), k=8e2, length=0.4),
    )
    robot = replace(robot, legs=robot.legs[:1])
    answer = loaded(robot, loads={"platform": rs.Mass(3.0)})
    parts = robot.legs[0].elements
    holders = {"base": 0, "arm1/j2": 2, "arm1/j1": 1, "arm1/e1": 4, "platform": 6}

    def energy(q: np.ndarray) -> float:
        R, t, places = np.eye(3), np.zeros(3), [(np.eye(3), np.zeros(3))]
        total = 0.0
        for part, angle in zip(parts, q, strict=True):
            assert isinstance(part, type(parts[0]))
            turn = Rotation.from_rotvec(angle * part.axis).as_matrix()  # type: ignore[union-attr]
            t = R @ (part.point - turn @ part.point) + t  # type: ignore[union-attr]
            R = R @ turn
            places.append((R, t))
            total += 0.5 * part.stiffness * angle**2  # type: ignore[union-attr]
        for spring in robot.springs:
            a, b = (
                places[holders[body]][0] @ point + places[holders[body]][1]
                for body, point in zip(spring.bodies, spring.points, strict=True)
            )
            more = np.linalg.norm(b - a) - spring.length
            total += spring.tension * more + 0.5 * spring.stiffness * more**2
        tip = R @ robot.reference_point + t
        return float(total + 3.0 * G * tip[2])

    found = minimize(energy, np.zeros(6), method="BFGS", options={"gtol": 1e-9})
    motions = [float(part.motion[0]) for part in answer.parts]
    assert np.abs(motions).max() > 0.05
    assert np.allclose(motions, found.x, atol=2e-6)


def guyed(k: float, tension: float) -> rs.Snapshot:
    """An upright rod on a hinge between two guys."""
    tip = np.array([0, REACH, 0])
    elements = (
        joint("hinge", [0, 0, 0], [0, 0, 1]),
        joint("rod", [0, 0, 0], [0, 1, 0], "P", 1e10),
        joint("end", tip, [0, 0, 1], "R", 1e10),
    )
    length = float(np.hypot(HOLD, POST))
    guys = tuple(
        PlacedBodySpring(
            f"guy{side:+}",
            ("base", "rod/hinge"),
            (np.array([side * POST, 0, 0]), np.array([0, HOLD, 0])),
            k,
            length,
            tension,
        )
        for side in (1, -1)
    )
    robot = rs.Snapshot("guyed", (PlacedLeg("rod", elements, tip),), tip, Space.PLANAR)
    return replace(robot, springs=guys)


def test_critical_load_of_a_guyed_rod():
    """P = 2 (h w / l)^2 (k - t / l) / L."""
    k, t, l = 5e3, 200.0, float(np.hypot(HOLD, POST))
    found = rs.critical_load(guyed(k, t), wrench=[0, -1.0, 0], up_to=1e5)
    assert np.isclose(found.factor, 2 * (HOLD * POST / l) ** 2 * (k - t / l) / REACH, rtol=1e-6)
    assert not found.is_limit


def test_frequency_of_a_balanced_rod():
    """The drive against the mass, m l^2, as if there were neither weight nor spring."""
    drive = 10.0
    found = rs.modes(
        pendulum(0.4, BALANCED, drive=drive),
        masses={"platform": MASS},
        loads={"platform": rs.Mass(MASS)},
    )
    rate = np.sqrt(drive / MASS) / REACH
    assert np.isclose(found.frequencies[0], rate / (2 * np.pi), rtol=1e-6)


def test_spring_on_the_platform_in_its_modes():
    """Of a platform on a spring alone beside its soft drive: (k + k_drive) / m."""
    tip = np.array([0.2, 0, 0])
    slide = joint("slide", [0, 0, 0], [1, 0, 0], "P", 300.0)
    ends = (joint("x", tip, [0, 1, 0], "P", 1e8), joint("turn", tip, [0, 0, 1], "R", 1e8))
    robot = rs.Snapshot("slide", (PlacedLeg("leg", (slide, *ends), tip),), tip, Space.PLANAR)
    spring = held("platform", "base", points=(tip, [1.0, 0, 0]), k=500.0, length=0.8)
    found = rs.modes(replace(robot, springs=(spring,)), masses={"platform": 2.0})
    assert np.isclose(found.frequencies[0], np.sqrt(800 / 2.0) / (2 * np.pi), rtol=1e-9)


@pytest.mark.parametrize(("carrier", "body"), [("slide", "base"), ("lock", "platform")])
def test_drives_that_are_rigid_hold_springs_and_loads_before_and_behind_blocks(
    carrier: str, body: str
):
    """They move with what they are fixed to: the base, and the platform."""
    tip = np.array([0.0, 0.4, 0.0])

    def rigid(name: str, point: np.ndarray) -> PlacedFreedom:
        return PlacedFreedom(np.array([1.0, 0, 0]), point, None, name, rs.Actuated(None))

    branches = tuple(
        PlacedLeg(
            f"branch{i}",
            (
                joint(f"foot{i}", [x, 0, 0], [0, 0, 1]),
                joint(f"rod{i}", [x, 0, 0], [-x, 0.4, 0], "P", 2e4),
                joint(f"head{i}", np.add(tip, [x / 2, 0, 0]), [0, 0, 1], "R", 30.0),
            ),
            tip,
        )
        for i, x in enumerate((-0.3, 0.2))
    )
    elements = (rigid("slide", np.zeros(3)), PlacedBlock("block", branches), rigid("lock", tip))
    robot = rs.Snapshot("A frame", (PlacedLeg("leg", elements, tip),), tip, Space.PLANAR)
    wrench = [100.0, -300, 5]
    other = "platform" if body == "base" else "base"
    answers = [
        loaded(
            replace(robot, springs=(held(*ends, points=([0.1, 0.1, 0], tip), k=4e3),)),
            wrench=wrench,
            **({} if own == "base" else {"loads": {own: rs.DeadForce([20.0, 10, 0], tip)}}),
        )
        for own in (f"leg/{carrier}", body)
        for ends in [(own, other) if body == "base" else (other, own)]
    ]
    assert answers[0].stable
    assert distance(answers[0].K, answers[1].K) < 1e-12
    np.testing.assert_allclose(answers[0].displacement, answers[1].displacement, atol=1e-14)
    without = loaded(robot, wrench=wrench)
    assert distance(answers[0].K, without.K) > 1e-3


def test_what_cannot_be_is_refused():
    robot = pendulum(0.3, 100.0)
    with pytest.raises(InputError, match=r"rs\.equilibrium\(robot, pose\)\.K"):
        rs.stiffness(robot)
    spring = held("base", "rod/hing", points=([0, 1, 0], [0, 0, 0]), k=1.0)
    with pytest.raises(InputError, match="rod/hinge"):
        loaded(replace(robot, springs=(spring,)))
    spring = held("base", "rod/hinge", points=([0, 0, 0], [0, 0, 0]), k=1.0, tension=3.0)
    with pytest.raises(InputError, match="both ends in one point"):
        loaded(replace(robot, springs=(spring,)))
    with pytest.raises(InputError, match="free_length or preload"):
        rs.BodySpring("s", (rs.BodyPoint("base"), rs.BodyPoint("platform")), 10.0)
    with pytest.raises(InputError, match="two bodies"):
        rs.BodySpring("s", (rs.BodyPoint("base"), rs.BodyPoint("base")), 10.0, free_length=0)


@pytest.mark.parametrize("name", ["cable-8", "cable-8-suspended"])
def test_taut_cables_are_springs_between_base_and_platform(name: str):
    """The stiffness of a cable robot, with its tensions and its weight."""
    cables = rs.load(name)
    assert isinstance(cables, rs.CableRobot)
    taut = rs.cable_stiffness(cables)
    p, R = np.asarray(cables.home.p), np.asarray(cables.home.R)
    springs = []
    for cable, t in zip(cables.cables, taut.tensions, strict=True):
        ends = (cable.exit_point, p + R @ cable.attachment)
        length = float(np.linalg.norm(ends[1] - ends[0]))
        winch = 0.0 if cable.winch_stiffness is None else 1 / cable.winch_stiffness
        unstretched = (length + cable.guide_length - t * winch) / (1 + t / cable.EA)
        k = 1 / (unstretched / cable.EA + winch)
        springs.append(
            PlacedBodySpring(cable.name, ("base", "platform"), ends, float(k), length, float(t))
        )
    soft = PlacedSpring("soft", p, np.eye(3), rs.Elasticity(1e6 * np.eye(6)))
    robot = rs.Snapshot("springs", (PlacedLeg("leg", (soft,), p),), taut.reference_point)
    weight = cables.weight
    assert weight is not None
    loads = {"platform": rs.DeadForce(weight.force, p + R @ weight.point)}
    answer = loaded(replace(robot, springs=tuple(springs)), loads=loads)
    assert np.abs(answer.displacement).max() < 1e-9  # the tensions balance the weight
    assert distance(answer.K_total, taut.K) < 1e-7  # what holds the platform besides is soft
