"""Deflection of networks: who bends, and what joints carry."""

from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.network import JointElement, Network, Node, SpringElement, network_of_snapshot
from tests.network.frames import ball, graph, nodes, sliding, turning

LOAD = np.array([100.0, -50, 300, 10, 20, -30])
SOFT = rs.Elasticity(np.diag([1e-6, 2e-6, 3e-6, 1e-5, 2e-5, 3e-5]))
STAR = str(Path(__file__).parents[1] / "model" / "star-platform.yaml")


@pytest.mark.parametrize(
    "name", ["hexapod", "3-puu", "six-joint-arm", "3-rrr", pytest.param(STAR, id="star-platform")]
)
def test_robots_bend_like_their_networks(name):
    robot = rs.load(name)
    F = LOAD if robot.space.size == 6 else LOAD[:3]
    network = network_of_snapshot(rs.find_posture(robot).snapshot.one(0))
    bent, expected = rs.deflection(network, wrench=F), rs.deflection(robot, wrench=F)
    assert np.allclose(bent.twist, expected.twist, rtol=1e-9, atol=1e-9 * np.abs(bent.twist).max())
    energies = {(p.leg, p.part): p.energy for p in bent.parts}
    for part in expected.parts:
        assert energies[part.leg, part.part] == pytest.approx(part.energy, rel=1e-6, abs=1e-12)
    loads = {(a.leg, a.joint): a for a in bent.actuators}
    for actuator in expected.actuators:
        if actuator.travel:  # networks have no joint for a rigid drive
            own = loads[actuator.leg, actuator.joint]
            assert own.load == pytest.approx(actuator.load, rel=1e-6)
            assert own.travel == pytest.approx(actuator.travel, rel=1e-6)
    reactions = {(r.leg, r.joint): r for r in bent.reactions}
    for reaction in expected.reactions:
        if (own := reactions.get((reaction.leg, reaction.joint))) is None:
            continue
        size = np.abs(reaction.wrench).max() + 1e-6
        rows = list(robot.space.rows)
        assert np.allclose(own.wrench[rows], reaction.wrench[rows], rtol=0, atol=1e-6 * size)
    assert len(reactions) >= len(robot.legs)


def test_a_load_that_drives_a_free_motion():
    network, _ = graph("h_parallelogram_square")
    free = rs.stiffness(network).free_motions[0].twist
    assert rs.Status.UNBALANCED in rs.deflection(network, wrench=free).status


def test_a_door_that_is_rigid_and_free_carries_what_does_not_turn_it():
    """A rigid panel on one hinge, which a spring along the axis lets sink."""
    wall, door = nodes(wall=[0, 0, 0], door=[1, 0, 0])
    hinge = (turning([0, 0, 0], [0, 0, 1]), sliding([0, 0, 0], [0, 0, 1], 2e5))
    joint = JointElement("hinge", "wall", "door", hinge)
    network = Network("door", (wall, door), ("wall",), "door", door.point, joints=(joint,))
    result = rs.stiffness(network)
    assert result.status == rs.Status.RIGID_DIRECTION | rs.Status.FREE_MOTIONS
    bent = rs.deflection(network, wrench=[40.0, 0, -10, 0, 0, 0])
    assert np.allclose(bent.twist, [0, 0, -5e-5, 0, 0, 0], rtol=0, atol=1e-18)
    assert bent.energy == pytest.approx(0.5 * 10 * 5e-5)
    (reaction,) = bent.reactions
    assert np.allclose(reaction.wrench, [40, 0, -10, 0, 10, 0])
    assert rs.Status.UNBALANCED in rs.deflection(network, wrench=[0, 1.0, 0, 0, 0, 0]).status


def test_forces_at_bodies_move_a_free_platform_least():
    """A force that the platform does not feel bends the post and leaves the swing at rest."""
    wall, post, swing = nodes(wall=[0, 0, 0], post=[0, 0, 1], swing=[0.5, 0, 1])
    mount = SpringElement("mount", "wall", "post", post.point, np.eye(3), SOFT)
    hinge = JointElement("hinge", "post", "swing", (turning([0, 0, 1], [0, 0, 1]),))
    network = Network(
        "swing", (wall, post, swing), ("wall",), "swing", swing.point, (), (mount,), (hinge,)
    )
    bent = rs.deflection(network, loads={"post": [100.0, 0, 0]})
    assert bent.status == rs.Status.FREE_MOTIONS
    assert np.allclose(bent.twist[:3], [1e-4, 0, 0], rtol=0, atol=1e-15)
    assert abs(bent.twist[5]) < 1e-15
    assert bent.energy == pytest.approx(0.5 * 100 * 1e-4)
    at_platform = rs.deflection(network, wrench=[100.0, 0, 0, 0, 0, 0])
    assert np.allclose(at_platform.twist, bent.twist, rtol=0, atol=1e-15)


def test_joints_that_brace_one_another_have_no_reaction_of_their_own():
    """A door on two hinges: how they share a force along their axis is undetermined."""
    wall, door, handle = nodes(wall=[0, 0, 0], door=[0.5, 0, 1], handle=[1, 0, 1])
    hinges = tuple(
        JointElement(name, "wall", "door", (turning([0, 0, z], [0, 0, 1]),))
        for name, z in (("low", 0.2), ("high", 1.8))
    )
    mount = SpringElement("mount", "door", "handle", handle.point, np.eye(3), SOFT)
    latch = JointElement("latch", "handle", "grip", ball(handle.point))
    grip = Node("grip", handle.point)
    springs = (mount, SpringElement("glove", "handle", "grip", handle.point, np.eye(3), SOFT))
    network = Network(
        "door",
        (wall, door, handle, grip),
        ("wall",),
        "grip",
        handle.point,
        springs=springs,
        joints=(*hinges, latch),
    )
    F = rs.stiffness(network).K @ np.array([1e-5, 2e-5, 3e-5, 1e-4, 2e-4, 0])
    bent = rs.deflection(network, wrench=F)
    assert [reaction.leg for reaction in bent.reactions] == ["latch"]
    assert sum(part.energy for part in bent.parts) == pytest.approx(bent.energy, rel=1e-9)
