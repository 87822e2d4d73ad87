"""Deflection under loads at bodies: the limit of equilibria, closed forms, reciprocity."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import PlacedBodySpring, PlacedLeg
from robostiff.spatial import Space, move_twist, move_wrench
from tests.statics.robots_under_load import SPRINGS, joint, loaded
from tests.statics.test_weights import arm, rod


def some_body(robot: rs.Robot) -> str:
    leg = robot.legs[0]
    names = [e.name for e in leg.chain.elements if not isinstance(e, rs.Rigid)]
    return f"{leg.name}/{names[len(names) // 2]}"


@pytest.mark.parametrize(
    "name", ["hexapod", "3-prs", "six-joint-arm", "gough-stewart-b-beams", "3-rpr-beams", "scara"]
)
def test_small_loads_are_the_limit_of_large_ones(name: str):
    robot, s = rs.load(name), 1e-4
    n = robot.space.size
    F = np.array([300.0, -200, 100, 20, 30, -10])[-n:]
    g = np.array([1.0, -5.0, -8.0])
    loads = {some_body(robot): [30.0, 20.0, -50.0], "platform": rs.Mass(15)}
    bent = rs.deflection(robot, None, F, loads=loads, gravity=g)
    few = {some_body(robot): s * np.array([30.0, 20.0, -50.0]), "platform": rs.Mass(15)}
    limit = loaded(robot, wrench=s * F, loads=few, gravity=s * g, beams=rs.Linear())
    size = np.abs(bent.twist).max()
    assert np.allclose(limit.displacement / s, bent.twist, rtol=1e-5, atol=1e-5 * size)
    assert np.isclose(limit.energy / s**2, bent.energy, rtol=1e-5, atol=0)
    assert np.isclose(bent.energy, sum(part.energy for part in bent.parts), rtol=1e-9, atol=0)
    wrenches = np.array(limit.leg_wrenches) / s
    point = bent.stiffness.reference_point - bent.stiffness.origin
    for own, other in zip(bent.leg_wrenches, wrenches, strict=True):
        if n == 6:
            moved = own.copy()
            moved[3:] -= np.cross(point, own[:3])
            assert np.allclose(moved, other, rtol=1e-4, atol=1e-4 * np.abs(wrenches).max())
    by_name = {(p.leg, p.part): p.load for p in limit.parts if p.load is not None}
    for actuator in bent.actuators:
        wanted = by_name[actuator.leg, actuator.joint] / s
        assert np.isclose(actuator.load, wanted, rtol=1e-4, atol=1e-4 * np.abs(F).max())


def test_a_gravity_of_the_robot_is_no_part_of_a_deflection():
    robot = arm(rod(), gravity="-z")
    F = [0, 0, -3, 0, 0, 0]
    assert np.array_equal(
        rs.deflection(robot, None, F).twist, rs.deflection(arm(rod()), None, F).twist
    )
    with_loads = rs.deflection(robot, None, F, loads={"arm/beam": [0, 0, 0]})
    assert np.allclose(
        with_loads.twist, rs.deflection(robot, None, F).twist, rtol=1e-12, atol=1e-15
    )


def test_loads_that_drive_a_free_motion_and_poses_out_of_reach():
    robot = rs.load("planar-link")
    bent = rs.deflection(robot, loads={"platform": rs.DeadForce([0, -1, 0], [9.0, 0, 0])})
    assert rs.Status.UNBALANCED in bent.status
    assert not bent.has_answer
    unreached = rs.deflection(rs.load("3-puu"), [1, 0, 0.3], gravity="-z")
    assert rs.Status.UNREACHABLE in unreached.status


@pytest.mark.parametrize(
    ("name", "body"), [("six-joint-arm", "arm/forearm"), ("orthoglide", "leg-y/drive")]
)
def test_springs_between_bodies_are_the_limit_of_an_equilibrium(name: str, body: str):
    """Between base, bodies and platform, without tension where the robot is."""
    springs = tuple(
        rs.BodySpring(f"s{i}", own.between, stiffness=2e4, preload=0.0)
        for i, own in enumerate(SPRINGS[name])
    )
    robot, small = rs.load(name).with_springs(springs), 1e-6
    F, load = np.array([20.0, -15, -40, 3, -4, 2]), np.array([3, 0, -20.0])
    bent = rs.deflection(robot, None, F, loads={body: rs.DeadForce(load)})
    answer = loaded(robot, wrench=small * F, loads={body: rs.DeadForce(small * load)})
    assert bent.status == 0
    assert np.allclose(bent.twist, answer.displacement / small, rtol=1e-4, atol=1e-9)
    assert np.isclose(bent.energy, answer.energy / small**2, rtol=1e-4, atol=0)
    assert np.isclose(sum(part.energy for part in bent.parts), bent.energy, rtol=1e-9, atol=0)
    known = {(part.leg, part.part): part for part in answer.parts}
    for reaction in bent.reactions:
        wrench = known[reaction.leg, reaction.joint].wrench / small
        assert np.allclose(reaction.wrench, wrench, rtol=1e-3, atol=2e-2)
    once, twice = (rs.deflection(robot, None, n * F).twist for n in (1, 2))
    assert np.allclose(2 * once, twice, rtol=1e-12)
    assert rs.deflection(robot, None, F).energy < rs.deflection(rs.load(name), None, F).energy


def test_spring_alone_holds_a_platform():
    """On a leg without stiffness along x: F / k, and no free motion."""
    tip = np.array([0.3, 0, 0])
    elements = (
        joint("slide", [0, 0, 0], [1, 0, 0], "P"),
        joint("across", tip, [0, 1, 0], "P", 1e6),
        joint("turn", tip, [0, 0, 1], "R", 1e5),
    )
    robot = rs.Snapshot("slider", (PlacedLeg("leg", elements, tip),), tip, Space.PLANAR)
    spring = PlacedBodySpring(
        "spring", ("base", "platform"), (tip + np.array([0.5, 0, 0]), tip), 400.0, 0.2
    )
    held = replace(robot, springs=(spring,))
    bent = rs.deflection(held, None, [8.0, 0, 0])
    assert bent.status == 0
    assert np.isclose(bent.twist[0], 8 / 400)
    assert np.isclose(bent.energy, 8**2 / 400 / 2)
    assert (bent.parts[0].name, round(bent.parts[0].share, 9)) == ("springs/spring", 1.0)
    assert not rs.deflection(robot, None, [8.0, 0, 0]).has_answer


def test_what_rigid_legs_carry_does_not_depend_on_the_point_of_the_wrench():
    """Two legs that hold one another are loaded alike with and without loads at bodies."""
    tip, legs = np.array([0.1, 0.2, 0.3]), []
    for k, foot in enumerate(([0, 0, 0], [0, 0.5, 0.1])):
        drive = joint("drive", foot, [1, 0, 0], "P", 1e5 * (1 + k))
        legs.append(PlacedLeg(f"leg{k}", (drive, joint("hinge", foot, [0, 1, 0], "R", 1e3)), tip))
    robot, wrench = rs.Snapshot("pair", tuple(legs), tip), np.array([100, 50, -200, 10, 5, 7.0])
    aside = np.array([3.0, -1, 2])
    about = move_wrench(wrench, aside)
    whole = rs.deflection(robot, None, wrench)
    for loads in (None, {}):
        one = rs.deflection(robot, None, about, loads=loads, at=tip + aside)
        assert np.allclose(one.leg_wrenches, whole.leg_wrenches, rtol=0, atol=1e-9)
        assert np.allclose(move_twist(one.twist, -aside), whole.twist, atol=1e-12)
