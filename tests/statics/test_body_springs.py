"""Springs between bodies: closed forms, differences, cables, and what is refused."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import PlacedBlock, PlacedBodySpring, PlacedFreedom, PlacedLeg
from robostiff.spatial import Space
from tests.cases.metric import distance
from tests.statics.robots_under_load import SPRINGS, joint, loaded, number, root

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


def test_a_strut_is_stable_where_the_axis_of_a_joint_meets_its_spring():
    """Its curvature by that joint is rounding; on all motions that close the strut it is more."""
    ends = rs.BodyPoint("leg2/strut", [0.02, 0, 0]), rs.BodyPoint("base", [0.5, 0.5, 0.3])
    pull = rs.BodySpring("pull", ends, stiffness=1e5, free_length=0.2)
    robot = replace(rs.load("hexapod"), springs=(pull,))
    pose = rs.find_posture(robot).pose[0] + [0.01, -0.02, 0.01, 0.05, -0.03, 0.02]
    answer: Any = rs.equilibrium(robot, pose)
    assert answer.status == rs.Status.OK
    blocks, equations = answer.found.problem.blocks, answer.found.known.equations
    (spring,) = answer.found.problem.legs.springs
    own = spring.spots[0].chain
    block, A = next(pair for pair in zip(blocks, equations.A, strict=True) if own in pair[0].chains)
    m, row = block.free, int(np.flatnonzero((block.chains == own).any(axis=1))[0])
    H, C = A[row, :m, :m], A[row, m:, :m]
    motions = np.linalg.svd(C)[2][len(C) :]
    least = np.linalg.eigvalsh(motions @ (H + H.T) @ motions.T / 2)[0]
    assert least > 0.5
    assert 0.5 < answer.margins["leg2"] < 1


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


@pytest.mark.parametrize("name", sorted(SPRINGS))
def test_shares_of_the_energy_have_the_springs_between_bodies(name: str):
    """Of an equilibrium they add up to its energy; of a mode, without tension, to its stiffness."""
    robot = rs.load(name).with_springs(SPRINGS[name])
    answer = loaded(robot)
    of_springs = {f"springs/{s.name}": s.energy for s in answer.springs}
    named = {share.name: share.energy for share in answer.shares}
    assert of_springs.items() <= named.items()
    assert np.isclose(sum(named.values()), answer.energy)
    assert np.isclose(sum(share.share for share in answer.shares), 1.0)
    relaxed = tuple(
        rs.BodySpring(f"s{i}", own.between, stiffness=2e4, preload=0.0)
        for i, own in enumerate(SPRINGS[name])
    )
    found = rs.modes(rs.load(name).with_springs(relaxed), masses={"platform": 10})
    first = found[0]
    assert np.isclose(2 * sum(share.energy for share in first.shares), found.squares[0], rtol=1e-6)
    assert any(share.name.startswith("springs/") for share in first.shares)


def test_shares_of_a_mode_add_up_to_one_where_a_spring_pushes():
    """Against the turn of the drive, from which it takes energy."""
    found = rs.modes(pendulum(0.5, 200.0, length=2.0, drive=200.0), masses={"platform": 2.0})
    assert found.status == rs.Status.OK
    for mode in found:
        assert all(0 < own.share <= 1 for own in mode.shares)
        assert np.isclose(sum(own.share for own in mode.shares), 1.0)
    assert all(not own.name.startswith("springs/") for own in found[0].shares)
