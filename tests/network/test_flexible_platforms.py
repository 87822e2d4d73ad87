"""Legs on platforms that bend, against the network of all bodies; random ones: tests/campaign."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic import snapshot_formula
from robostiff.model import (
    FlexiblePlatform,
    PlacedLeg,
    PlacedPlatform,
    PlatformNode,
    platform_beam,
    rigid_member,
)
from robostiff.network import energy_stiffness, network_of_snapshot
from tests.cases.metric import distance
from tests.generators.machines import case_b

STEEL, BAR = rs.material("steel"), rs.CrossSection(1.5e-3, 1.1e-7, 3.1e-7, 2.8e-7)
POSE = np.array([0.03, -0.02, 0.62, 0.1, -0.15, 0.2])


def star(robot: rs.Robot) -> rs.Robot:
    """The robot on arms from a hub to the end of each leg."""
    hub = PlatformNode("hub", np.zeros(3))
    ends = [PlatformNode(leg.name, leg.attachment.p) for leg in robot.legs]
    arms = tuple(
        platform_beam(hub, end, STEEL, BAR, y_axis=np.eye(3)[2], name=f"arm {end.name}")
        for end in ends
    )
    legs = tuple(replace(leg, node=leg.name) for leg in robot.legs)
    return replace(robot, legs=legs, platform=FlexiblePlatform((hub, *ends), arms, "hub"))


def test_rigid_members_are_the_rigid_platform():
    robot = case_b()
    hub = PlatformNode("hub", np.zeros(3))
    ends = [PlatformNode(leg.name, leg.attachment.p) for leg in robot.legs]
    legs = tuple(replace(leg, node=leg.name) for leg in robot.legs)
    members = tuple(rigid_member(hub, end, end.name) for end in ends)
    # One more closes a loop of rigid members.
    members = (*members, rigid_member(ends[0], ends[3], "brace"))
    framed = replace(robot, legs=legs, platform=FlexiblePlatform((hub, *ends), members, "hub"))
    # rounding: 1.3e-13 on every processor, at this pose or at others near it
    assert distance(rs.stiffness(framed, POSE).K, rs.stiffness(robot, POSE).K) < 1e-12


def test_every_method_agrees_at_a_general_pose():
    checked = rs.verify(star(case_b()), POSE)
    outcomes = {c.method: c.outcome.value for c in checked.comparisons}
    # Rigid legs with a soft actuator: forms that invert the compliance of a leg do not hold.
    assert outcomes["network"] == outcomes["energy"] == outcomes["saddle-point"] == "agrees"
    assert checked.agree
    beams = rs.load("gough-stewart-b-beams")
    for method in (rs.SaddlePoint(), rs.Block(), rs.Recursive()):
        K = rs.stiffness(star(beams), POSE, method=method).K
        assert distance(K, rs.stiffness(star(beams), POSE).K) < 1e-12


def test_a_leg_that_is_rigid_bends_with_the_platform():
    hub, end = PlatformNode("hub", np.zeros(3)), PlatformNode("end", np.array([0.5, 0, 0]))
    arm = platform_beam(hub, end, STEEL, BAR, y_axis=np.eye(3)[2], name="arm")
    drive = rs.find_posture(case_b()).snapshot.one(0).legs[0]
    free = next(drive.freedoms)
    hinge = replace(free, point=np.zeros(3), axis=np.eye(3)[2], role=rs.Passive())
    base = PlacedLeg("leg", (hinge,), np.zeros(3))
    placed = PlacedPlatform(
        FlexiblePlatform((hub, end), (arm,), "end"), ("hub",), np.eye(3), hub.at
    )
    snapshot = rs.Snapshot("arm", (base,), end.at, platform=placed)
    result = rs.stiffness(snapshot)
    expected = rs.stiffness(network_of_snapshot(snapshot))
    assert (str(result.status), int(result.rank)) == ("free-motions", 5)
    assert distance(result.K, expected.K) < 1e-12
    assert distance(np.sum(result.leg_stiffness, axis=0), result.K) < 1e-12
    with pytest.raises(rs.InputError, match="flexible platform"):
        snapshot_formula(snapshot)
    # leg and arm are one chain, which meets compliance
    assert distance(rs.stiffness(snapshot, method=rs.SaddlePoint()).K, expected.K) < 1e-12
    locked = replace(base, elements=(replace(hinge, role=rs.Actuated(1e5)),))
    serial = replace(snapshot, legs=(locked,))
    C = rs.stiffness(serial).compliance
    assert np.allclose(C @ rs.stiffness(network_of_snapshot(serial)).K, np.eye(6), atol=1e-9)


def test_a_hinge_in_the_platform_is_held_by_legs_or_reported():
    robot = star(case_b())
    platform = robot.platform
    assert platform is not None
    loose, *others = platform.parts
    C, about_z = loose.elasticity.compliance.copy(), np.eye(6)[:, 5:]
    C[5, :] = C[:, 5] = 0.0
    hinged = replace(loose, point=np.zeros(3), elasticity=rs.Elasticity(C, about_z))
    with_hinge = replace(robot, platform=replace(platform, parts=(hinged, *others)))
    snapshot = rs.find_posture(with_hinge, POSE).snapshot.one(0)
    result, expected = rs.stiffness(with_hinge, POSE), rs.stiffness(network_of_snapshot(snapshot))
    assert result.rank == expected.rank == 5  # the first leg gives its wrench to hold the hinge
    assert distance(result.K, expected.K) < 1e-12
    nobody = replace(
        platform,
        nodes=(*platform.nodes, PlatformNode("flap", np.array([0, 0, 0.3]))),
        parts=(*platform.parts, replace(hinged, name="flap hinge", b="flap")),
    )
    idle = rs.stiffness(replace(robot, platform=nobody), POSE)
    assert idle.redundant_joints == ("platform/flap hinge.free[0]",)
    assert distance(idle.K, rs.stiffness(robot, POSE).K) < 1e-13


def test_a_frame_on_the_tool_that_holds_nothing_changes_nothing():
    """Two members from the tool to a node and back are a path from a body to itself."""
    robot = star(case_b())
    platform = robot.platform
    assert platform is not None
    handle = PlatformNode("handle", np.array([0.1, 0.2, 0.4]))
    hub = platform.nodes[0]
    members = [
        platform_beam(hub, handle, STEEL, BAR, y_axis=axis, name=name)
        for name, axis in (("left", np.eye(3)[0]), ("right", np.eye(3)[1]))
    ]
    nodes, parts = (*platform.nodes, handle), (*platform.parts, *members)
    more = replace(robot, platform=replace(platform, nodes=nodes, parts=parts))
    result, expected = rs.stiffness(more, POSE), rs.stiffness(robot, POSE)
    assert result.status == expected.status
    assert distance(result.K, expected.K) < 1e-13
    assert rs.verify(more, POSE).agree


def test_planar_robots_bend_in_their_plane():
    robot = rs.load("3-rpr-beams")
    flexible = star(robot)
    pose = [0.01, 0.02, 0.1]
    snapshot = rs.find_posture(flexible, pose).snapshot.one(0)
    result = rs.stiffness(flexible, pose)
    assert result.K.shape[-1] == robot.space.size
    assert distance(result.K, rs.stiffness(network_of_snapshot(snapshot)).K) < 1e-11
    assert distance(result.K, energy_stiffness(network_of_snapshot(snapshot))) < 1e-9
    assert np.trace(result.K) < np.trace(rs.stiffness(robot, pose).K)
