"""Flexible platforms under load: as bodies in the world, and as their own derivatives."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.kinematics import with_masses
from robostiff.model import PlatformNode, platform_beam, rigid_member
from robostiff.network import network_of_snapshot
from robostiff.spatial import move_compliance
from tests.campaign.bodies import DeadPull
from tests.campaign.minima import least
from tests.generators.platforms import KINDS_OF_PARTS, shipped_on_platform
from tests.statics.robots_under_load import bodies_of, loaded

STAR = Path(__file__).parents[2] / "docs/star-platform.yaml"
F = np.array([2e4, 1e4, -1e5, 1e3, 0, 2e3])


@pytest.fixture(scope="module")
def star() -> rs.Robot:
    return rs.load(str(STAR))


@pytest.mark.parametrize("beams", [rs.Linear(), rs.Bowing(1)])
def test_it_rests_where_the_energy_of_its_bodies_is_least(star: rs.Robot, beams):
    """Under a wrench and a force at a node; arms and legs linear, or beams of one element.

    Also with a loop of a rigid member and one more beam.
    """
    force, platform = np.array([9e3, -5e3, -2e4]), star.platform
    assert platform is not None
    corner, (hub, tip, *_) = PlatformNode("corner", np.array([0, 0.1, 0.1])), platform.nodes
    brace = platform_beam(corner, tip, rs.material("steel"), rs.circle(0.03), name="brace")
    parts = (*platform.parts, rigid_member(hub, corner, "rib"), brace)
    braced = replace(platform, nodes=(*platform.nodes, corner), parts=parts)
    for robot in (star, replace(star, platform=braced)):
        own = bodies_of(robot, beams=0 if beams == rs.Linear() else 1)
        body, point = own.behind["platform/tip1"]
        own.bodies.pulls.append(DeadPull(body, point, force))
        truth = least(own, 3 * F)
        answer = loaded(robot, wrench=3 * F, loads={"platform/tip1": force}, beams=beams)
        assert np.abs(answer.displacement).max() > 5e-4
        assert np.allclose(answer.displacement, truth.displacement, rtol=0, atol=1e-10)
        K = truth.K_total
        assert np.allclose(answer.K_total, K, rtol=0, atol=1e-7 * np.abs(K).max())
        fast = rs.compile_loaded(
            robot, loads={"platform/tip1": force}, beams=beams, backend=rs.Backend.ARRAYS
        )
        recorded = fast.evaluate(rs.find_posture(robot).pose[0], 3 * F, again=False)
        assert np.allclose(recorded.displacement, truth.displacement, rtol=0, atol=1e-10)
        assert np.allclose(recorded.K_total, K, rtol=0, atol=1e-7 * np.abs(K).max())


@pytest.mark.parametrize(("name", "case"), [("tripteron", 2), ("3-prs", 1)])
def test_kernels_have_platforms_with_loops_hinges_and_rigid_members(name: str, case: int):
    """Under weights and a force at a node, at poses where the kernel answers alone."""
    robot = shipped_on_platform(name, 0, KINDS_OF_PARTS[case], closing=2)
    home = rs.find_posture(robot).pose[0, robot.coordinate_places]
    poses = home + 0.01 * np.random.default_rng(3).uniform(-1, 1, (3, home.size))
    wrenches, given = 2e3 * np.eye(robot.space.size)[:3], {"platform/n1": [300.0, -200.0, 900.0]}
    fast = rs.compile_loaded(robot, loads=given, gravity="-z", backend=rs.Backend.ARRAYS)
    answer = fast.evaluate(poses, wrenches, again=False)
    assert not answer.guarded.any()
    for k, (pose, wrench) in enumerate(zip(poses, wrenches, strict=True)):
        one = loaded(robot, pose, wrench, loads=given, gravity="-z")
        K, moved = one.K_total, one.displacement
        assert np.allclose(answer.K_total[k], K, rtol=0, atol=1e-10 * np.abs(K).max())
        assert np.allclose(answer.displacement[k], moved, rtol=0, atol=1e-10 * np.abs(moved).max())


def test_a_path_of_a_flexible_platform_is_compensated(star: rs.Robot):
    """Loaded at the commands it is where it should be."""
    path = np.array([[-0.05, 0, 0.8, 0, 0, 0], [0.05, 0.02, 0.8, 0, 0.05, 0]])
    found = rs.compensate(star, path, F)
    assert np.abs(found.deviation).max() > 1e-4
    for commanded, target in zip(found.commanded, path, strict=True):
        moved = loaded(star, commanded, F).pose
        assert np.allclose(moved, target, rtol=0, atol=1e-10)


def test_legs_carry_the_load_of_the_tool_together(star: rs.Robot):
    """About the tool, wherever the nodes are; rates by differences, and by the linear answer."""
    answer, rest = loaded(star, wrench=F), loaded(star)
    assert np.allclose(np.sum(answer.leg_wrenches, axis=0), F, rtol=0, atol=1e-6)
    size = np.abs(answer.K).max()
    assert np.allclose(np.sum(answer.leg_K, axis=0), answer.K, rtol=0, atol=1e-10 * size)
    for own, leg in zip(rest.leg_K, rs.stiffness(star).details().legs, strict=True):
        assert np.allclose(own, leg.K, rtol=0, atol=1e-9 * np.abs(rest.K).max())
    h = 1e-6
    for i in range(3):
        moved = [answer.displacement + s * h * np.eye(6)[i] for s in (1, -1)]
        ends = [np.array(loaded(star, displacement=own).leg_wrenches) for own in moved]
        rate = (ends[0] - ends[1]) / (2 * h)
        assert np.allclose(np.array(answer.leg_K)[:, :, i], rate, rtol=0, atol=1e-6 * size)


@pytest.mark.parametrize("name", ["h4", "orthoglide"])
def test_legs_with_one_joint_behind_a_block_carry_what_they_do_without_other_loads(name: str):
    robot, wrench, s = shipped_on_platform(name, 3), np.array([1, 2, 3, 0.1, 0.2, 0.3]), 1e-4
    alone, beside = rs.deflection(robot, None, wrench), rs.deflection(robot, None, wrench, loads={})
    limit = loaded(robot, wrench=s * wrench, beams=rs.Linear())
    each = zip(alone.leg_wrenches, beside.leg_wrenches, limit.leg_wrenches, strict=True)
    for own, other, finite in each:
        assert np.allclose(other, own, rtol=0, atol=1e-9)
        assert np.allclose(finite[:3] / s, own[:3], rtol=0, atol=1e-4)
    assert np.allclose(np.sum(limit.leg_K, axis=0), limit.K, atol=1e-9 * np.abs(limit.K).max())
    carried = {(own.leg, own.joint): own.wrench for own in beside.reactions}
    for own in alone.reactions:
        if not own.joint.startswith("rods"):
            assert np.allclose(carried[own.leg, own.joint], own.wrench, rtol=0, atol=1e-9)


def test_weights_springs_modes_and_buckling_go_through_it(star: rs.Robot):
    """A force on a strut, a spring from base to tool; rigid members are a rigid platform."""
    load = {"leg1/tube.beam": [0, 0, -500.0]}
    sunk = loaded(star, loads=load)
    assert np.allclose(np.sum(sunk.reactions, axis=0)[:3], [0, 0, -500], atol=1e-8)
    ends = rs.BodyPoint("base", [0, 0, 0]), rs.BodyPoint("platform", [0, 0, 0])
    held = loaded(star.with_springs([rs.BodySpring("rope", ends, 5e6, free_length=0.8)]))
    K = loaded(star).K
    assert np.isclose(held.K[2, 2] - K[2, 2], 5e6, rtol=1e-6)
    heavy = rs.modes(star, masses={"platform": 1e7}).frequencies[:3]
    exact = np.sqrt(1 / np.linalg.eigvalsh(np.linalg.inv(K)[:3, :3])[::-1] / 1e7) / (2 * np.pi)
    assert np.allclose(heavy, exact, rtol=1e-4)
    found = rs.critical_load(star, wrench=[0, 0, -1e5, 0, 0, 0], up_to=100)
    assert "tube.beam" in found.mode
    posture = rs.find_posture(star)
    snapshot = posture.snapshot.one(0)
    placed = snapshot.platform
    assert placed is not None
    nodes = {node.name: node for node in placed.platform.nodes}
    parts = tuple(rigid_member(nodes[p.a], nodes[p.b], p.name) for p in placed.platform.parts)
    stiff = replace(placed, platform=replace(placed.platform, parts=parts))
    rigid = loaded(replace(snapshot, platform=stiff), wrench=F)
    plain = loaded(replace(snapshot, platform=None), wrench=F)
    assert np.allclose(rigid.K, plain.K, rtol=0, atol=1e-11 * np.abs(plain.K).max())
    assert np.allclose(rigid.leg_wrenches, plain.leg_wrenches, rtol=0, atol=1e-6)
    assert np.shape(rigid.leg_K) == (6, 6, 6)


def test_loads_and_masses_at_nodes_are_those_of_the_network():
    """Small loads, weights of its own parts among them, equilibria and vibrations."""
    star = rs.load(STAR)
    network = network_of_snapshot(with_masses(rs.find_posture(star)).one(0))
    force, tool = np.array([50.0, 30, -1000]), rs.Mass(3.0, [0, 0.02, 0.1])
    loads = {"platform/tip1": force, "platform/tip2": tool, "platform/hub": [0, 0, -7.0]}
    frame = rs.find_posture(star).snapshot.one(0).platform
    assert frame is not None
    tip2 = frame.in_world(frame.platform.point_of("tip2")) + frame.rotation @ tool.centre
    named = {
        "platform/tip1": force,
        "platform/tip2": rs.Mass(3.0, point=tip2),
        "platform": [0, 0, -7.0],
    }
    for gravity in (None, "-z"):
        known = rs.deflection(network, loads=named, gravity=gravity)
        bent = rs.deflection(star, loads=loads, gravity=gravity)
        assert np.allclose(bent.twist, known.twist, rtol=0, atol=1e-9 * np.abs(known.twist).max())
        assert np.isclose(bent.energy, known.energy, rtol=1e-9, atol=0)
        assert np.isclose(bent.energy, sum(part.energy for part in bent.parts), rtol=1e-9, atol=0)
    far, same = (
        loaded(own, loads=given, gravity="-z", beams=rs.Linear())
        for own, given in ((star, loads), (network, named))
    )
    assert np.allclose(far.displacement, same.displacement, rtol=0, atol=1e-12)
    heavy = {name: own for name, own in loads.items() if isinstance(own, rs.Mass)}
    other = {"platform/tip2": named["platform/tip2"]}
    own = [rs.modes(star, masses=heavy).frequencies, rs.modes(network, masses=other).frequencies]
    assert np.allclose(own[0][:20], own[1][:20], rtol=1e-8)
    assert own[0][0] < rs.modes(star).frequencies[0]


@pytest.mark.parametrize("graph", [False, True], ids=["legs", "network"])
def test_the_weight_of_a_spring_does_not_depend_on_the_point_of_its_matrix(star: rs.Robot, graph):
    """An arm as a matrix about its end, and the same about a point beside it."""
    platform, found = star.platform, []
    assert platform is not None
    arm = platform.parts[0]
    for aside in ([0, 0, 0], [0.01, 0.02, -0.03]):
        C = move_compliance(arm.elasticity.compliance, arm.axes.T @ aside)
        moved = replace(arm, point=arm.point + aside, elasticity=Elasticity(C))
        own = replace(platform, parts=(moved, *platform.parts[1:]))
        snapshot = with_masses(rs.find_posture(replace(star, platform=own))).at(0)
        robot = network_of_snapshot(snapshot) if graph else snapshot
        found.append(rs.deflection(robot, gravity="-z").twist)
    assert np.allclose(found[1], found[0], rtol=0, atol=1e-9 * np.abs(found[0]).max())
