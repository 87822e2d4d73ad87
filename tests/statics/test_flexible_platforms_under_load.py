"""Flexible platforms under load: as chains that are the same, and as their own derivatives."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import circle, material
from robostiff.kinematics import with_masses
from robostiff.model import (
    FlexiblePlatform,
    PlacedLeg,
    PlacedPlatform,
    PlacedSpring,
    PlatformNode,
    Snapshot,
    platform_beam,
    rigid_member,
)
from robostiff.network import network_of_snapshot
from tests.statics.robots_under_load import joint, loaded

STAR = Path(__file__).parents[2] / "docs/star-platform.yaml"
F = np.array([2e4, 1e4, -1e5, 1e3, 0, 2e3])
HUB, RIM = PlatformNode("hub", np.zeros(3)), PlatformNode("rim", np.array([-0.3, 0.1, 0]))
ARM = platform_beam(RIM, HUB, material("steel"), circle(0.03), name="arm")
BACK = platform_beam(HUB, RIM, material("steel"), circle(0.03), name="arm")
TIP = np.array([0.2, 0.4, 0.9])


def arm_with(platform: FlexiblePlatform | None) -> Snapshot:
    """A chain of six elastic joints to the rim; its hub is the tool."""
    at = TIP + RIM.at
    elements = [
        joint(f"{kind}{i}", [0.1 * i, 0, 0.2], axis, kind, 4e4 if kind == "R" else 3e6)
        for i, axis in enumerate(np.eye(3))
        for kind in "RP"
    ]
    if platform is None:
        elements.append(PlacedSpring("arm", TIP, ARM.axes, ARM.elasticity))  # type: ignore[arg-type]
        return Snapshot("chain", (PlacedLeg("leg", tuple(elements), TIP),), TIP)
    placed = PlacedPlatform(platform, ("rim",), np.eye(3), TIP)
    return Snapshot("arm", (PlacedLeg("leg", tuple(elements), at),), TIP, platform=placed)


def test_a_platform_of_one_beam_is_one_more_link():
    """Exactly so; from its other end, as far as one element of a beam is exact."""
    wrench = np.array([800, -1500, -2500, 100, -200, 150])
    chain = loaded(arm_with(None), wrench=wrench)
    same = loaded(arm_with(FlexiblePlatform((HUB, RIM), (ARM,), "hub")), wrench=wrench)
    assert np.abs(chain.displacement).max() > 0.01
    assert np.allclose(same.displacement, chain.displacement, rtol=1e-10, atol=1e-13)
    assert np.allclose(same.K, chain.K, rtol=0, atol=1e-11 * np.abs(chain.K).max())
    assert np.isclose(same.energy, chain.energy, rtol=1e-10)
    back = loaded(arm_with(FlexiblePlatform((HUB, RIM), (BACK,), "hub")), wrench=wrench)
    assert np.allclose(back.displacement, chain.displacement, rtol=0, atol=1e-5)
    assert 0 < np.abs(back.K - chain.K).max() < 1e-3 * np.abs(chain.K).max()


def test_two_halves_of_a_beam_and_rigid_members():
    """A node between two halves changes nothing; a rigid member makes two nodes one body."""
    wrench = np.array([800, -1500, -2500, 100, -200, 150])
    one = FlexiblePlatform((HUB, RIM), (ARM,), "hub")
    middle = PlatformNode("middle", 0.5 * RIM.at)
    halves = FlexiblePlatform(
        (HUB, middle, RIM, PlatformNode("sensor", np.array([0.5, 0, 0]))),
        (
            platform_beam(RIM, middle, material("steel"), circle(0.03), name="first"),
            platform_beam(middle, HUB, material("steel"), circle(0.03), name="second"),
            rigid_member(HUB, PlatformNode("sensor", np.array([0.5, 0, 0])), name="bracket"),
        ),
        "hub",
    )
    whole = loaded(arm_with(one), wrench=wrench, beams=rs.Bowing(elements=2))
    cut = loaded(arm_with(halves), wrench=wrench, beams=rs.Bowing(elements=1))
    assert np.allclose(cut.displacement, whole.displacement, rtol=1e-9, atol=1e-12)
    assert np.allclose(cut.K, whole.K, rtol=0, atol=1e-9 * np.abs(whole.K).max())


@pytest.fixture(scope="module")
def star() -> rs.Robot:
    return rs.load(str(STAR))


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
        "platform, tip1": force,
        "platform, tip2": rs.Mass(3.0, point=tip2),
        "platform": [0, 0, -7.0],
    }
    for gravity in (None, "-z"):
        known = rs.deflection(network, loads=named, gravity=gravity)
        bent = rs.deflection(star, loads=loads, gravity=gravity)
        assert np.allclose(bent.twist, known.twist, rtol=0, atol=1e-9 * np.abs(known.twist).max())
        assert np.isclose(bent.energy, known.energy, rtol=1e-9)
        assert np.isclose(bent.energy, sum(part.energy for part in bent.parts), rtol=1e-9)
    far, same = (
        loaded(own, loads=given, gravity="-z", beams=rs.Linear())
        for own, given in ((star, loads), (network, named))
    )
    assert np.allclose(far.displacement, same.displacement, rtol=0, atol=1e-12)
    heavy = {name: own for name, own in loads.items() if isinstance(own, rs.Mass)}
    other = {"platform, tip2": named["platform, tip2"]}
    own = [rs.modes(star, masses=heavy).frequencies, rs.modes(network, masses=other).frequencies]
    assert np.allclose(own[0][:20], own[1][:20], rtol=1e-8)
    assert own[0][0] < rs.modes(star).frequencies[0]
