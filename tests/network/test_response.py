"""Loads on nodes and beams of networks, and supports that settle, against closed forms and laws."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import robostiff as rs
from robostiff.elasticity import BeamTheory, EulerBernoulli
from robostiff.errors import NoAnswerError
from robostiff.markup import page_text
from robostiff.network import JointElement, Network, Node, beam_between
from robostiff.page import page_data, response_page
from robostiff.spatial import Space, move_twist, move_wrench
from tests.campaign.loaded_networks import random_frame
from tests.network.frames import BAR, GRAPH_NAMES, STEEL, ball, graph, nodes, sliding, turning

E, G, A, IY, IZ = STEEL.E, STEEL.G, BAR.A, BAR.Iy, BAR.Iz
L, Q = 2.0, 35.0
SLENDER = EulerBernoulli()


def straight(fixed, middle=L / 2, theory: BeamTheory = SLENDER):
    """Beam along x in two pieces, whose middle is the platform."""
    a, b, c = nodes(a=[0, 0, 0], b=[middle, 0, 0], c=[L, 0, 0])
    along_y = np.array([0.0, 1, 0])
    pieces = (
        beam_between(a, b, STEEL, BAR, y_axis=along_y, theory=theory, name="ab"),
        beam_between(b, c, STEEL, BAR, y_axis=along_y, theory=theory, name="bc"),
    )
    return Network("beam", (a, b, c), fixed, "b", b.point, beams=pieces)


def test_a_clamped_beam_under_its_weight():
    found = rs.network_response(
        straight(("a", "c")), dict.fromkeys(["ab", "bc"], rs.DistributedForce([0, 0, -Q]))
    )
    assert_allclose(found.twists["b"][2], -Q * L**4 / (384 * E * IY), rtol=1e-10)
    assert_allclose(found.reactions["a"][2], Q * L / 2, rtol=1e-10)
    # The support turns the left end up: about y that is a negative moment.
    assert_allclose(found.reactions["a"][4], -Q * L**2 / 12, rtol=1e-10)
    assert_allclose(found.beams["ab"].end[4], -Q * L**2 / 24, rtol=1e-10)
    assert_allclose(found.energy, Q**2 * L**5 / (1440 * E * IY), rtol=1e-10)


def test_a_propped_cantilever_whose_prop_sinks():
    network = straight(("a",))
    a, b, c = network.nodes
    (foot,) = nodes(foot=[L, 0, -1])
    hinge = JointElement("hinge", "c", "foot", (turning(c.point, [0, 1, 0]),))
    network = replace(network, nodes=(a, b, c, foot), fixed=("a", "foot"), joints=(hinge,))
    sunk = 3e-3
    found = rs.network_response(network, settlements={"foot": [0, 0, -sunk, 0, 0, 0]})
    P = 3 * E * IY * sunk / L**3
    assert_allclose(found.reactions["foot"][2], -P, rtol=1e-9)
    assert_allclose(found.reactions["a"][[2, 4]], [P, -P * L], rtol=1e-9)
    assert_allclose(found.twists["c"][2], -sunk, rtol=1e-12)
    assert_allclose(found.energy, P * sunk / 2, rtol=1e-9)


@pytest.mark.parametrize("name", GRAPH_NAMES)
def test_wrenches_at_the_platform_move_it_as_its_compliance_says(name):
    network, _ = graph(name)
    K = rs.stiffness(network).K
    t = np.linspace(1e-5, 2e-5, len(K))
    node = next(node for node in network.nodes if node.name == network.platform)
    d = network.space.translations
    to_reference = (network.reference_point - node.point)[:d]
    F = K @ t
    placed = (replace(o, point=network.reference_point) if o is node else o for o in network.nodes)
    at_node = replace(network, nodes=tuple(placed))
    found = rs.network_response(at_node, {network.platform: F})
    if network.platform in found.twists:
        K_t = K @ found.twists[network.platform]
        assert_allclose(K_t, F, rtol=0, atol=1e-8 * np.abs(F).max())
        moved = rs.network_response(network, {network.platform: move_wrench(F, -to_reference)})
        back = move_twist(moved.twists[network.platform], to_reference)
        assert_allclose(back, found.twists[network.platform], rtol=0, atol=1e-8 * np.abs(t).max())
    bent = rs.deflection(network, wrench=F)
    assert_allclose(found.energy, 0.5 * F @ bent.twist, rtol=1e-7)
    assert_allclose(sum(part.energy for part in bent.parts), 0.5 * F @ bent.twist, rtol=1e-9)
    assert_allclose(sum(part.share for part in bent.parts), 1.0, rtol=1e-9)


@pytest.mark.parametrize("seed", range(16))
def test_loads_along_a_beam_are_those_of_its_halves_and_of_the_node_between(seed):
    """In random frames; the base gets what acts on them, and the tool moves by their deflection."""
    rng = np.random.default_rng([20261130, seed])
    frame = random_frame(rng)
    name = str(rng.choice(list(frame.beams)))
    start, end = (frame.nodes[own].point for own in frame.beams[name][:2])
    s, L = float(rng.choice([rng.uniform(), 0.02])), float(np.linalg.norm(end - start))
    force, along, middle = *rng.normal(size=(2, 3)) * 100, start + s * (end - start)
    loads = [rs.ForceOnBeam(force, s * L), rs.DistributedForce(along)]
    cut, at_node = frame.network({name: [s]}), {f"{name} at 0": force}
    halves = {f"{name} {i}": rs.DistributedForce(along) for i in (0, 1)}
    try:
        found = rs.network_response(frame.network(), {name: loads})
    except NoAnswerError:  # it drives a free motion
        return
    expected = rs.network_response(cut, at_node | halves)
    most = max(np.abs(own).max() for own in expected.twists.values())
    for node, twist in found.twists.items():
        assert_allclose(twist, expected.twists[node], rtol=0, atol=1e-7 * most)
    bent, alone = rs.deflection(cut, loads=at_node), rs.network_response(cut, at_node)
    if frame.platform in alone.twists:
        moved = alone.twists[frame.platform]
        assert_allclose(bent.twist, moved, rtol=0, atol=1e-7 * np.abs(moved).max())
    if len(found.reactions) < len(frame.fixed):
        return
    acting = [(middle, force, np.zeros(3)), (0.5 * (start + end), L * along, np.zeros(3))]
    acting += [(frame.nodes[own].point, R[:3], R[3:]) for own, R in found.reactions.items()]
    total = sum(np.concatenate([f, couple + np.cross(at, f)]) for at, f, couple in acting)
    assert_allclose(total, 0, atol=1e-6 * sum(np.abs(f).sum() for _, f, _ in acting))


def test_a_planar_frame_is_as_in_space():
    network = straight(("a", "c"))
    planar = replace(network, space=Space.PLANAR)
    weight = rs.DistributedForce([3.0, -Q, 0])
    in_plane = rs.network_response(planar, {"b": [10.0, 20, 5], "ab": weight})
    in_space = rs.network_response(network, {"b": [10.0, 20, 0, 0, 0, 5], "ab": weight})
    assert_allclose(in_plane.twists["b"], in_space.twists["b"][[0, 1, 5]], rtol=1e-10)
    assert_allclose(in_plane.reactions["a"], in_space.reactions["a"][[0, 1, 5]], rtol=1e-9)


def test_parts_that_move_freely_have_no_displacement():
    network = straight(("a", "c"))
    low, high = nodes(low=[0, 0, 1], high=[L / 2, 0, 1])
    rod = beam_between(low, high, STEEL, BAR, name="rod")
    ends = (
        JointElement("low", "a", "low", ball(low.point)),
        JointElement("high", "b", "high", ball(high.point)),
    )
    network = replace(
        network, nodes=(*network.nodes, low, high), beams=(*network.beams, rod), joints=ends
    )
    found = rs.network_response(network, {"b": [100.0, 0, 0]})
    assert found.free_nodes == ("low", "high")
    assert set(found.twists) == {"a", "b", "c"}
    with pytest.raises(NoAnswerError, match="drive a motion without stiffness, of low, high"):
        rs.network_response(network, {"high": [0, 0, 0, 5.0, 0, 0]})


def test_rigid_parts_that_cannot_follow_their_supports():
    a, b, c = nodes(a=[0, 0, 0], b=[1, 0, 0], c=[1, 0, 0])
    slides = tuple(
        JointElement(f"slide {end}", end, "b", (sliding([0, 0, 0], [0, 0, 1]),)) for end in "ac"
    )
    tip = nodes(tip=[1, 1, 0])[0]
    arm = beam_between(b, tip, STEEL, BAR, name="arm")
    network = Network(
        "slides", (a, b, c, tip), ("a", "c"), "tip", tip.point, beams=(arm,), joints=slides
    )
    together = {"a": [1e-3, 0, 0, 0, 0, 0], "c": [1e-3, 0, 0, 0, 0, 0]}
    found = rs.network_response(network, {"tip": [50.0, 0, 0]}, settlements=together)
    assert found.reactions == {}  # shared among rigid parts
    with pytest.raises(NoAnswerError, match="rigid parts cannot follow the supports"):
        rs.network_response(network, settlements={"a": [1e-3, 0, 0, 0, 0, 0]})


def test_quantities():
    pint = pytest.importorskip("pint")
    unit = pint.get_application_registry()
    network = straight(("a", "c"))
    loads = {"b": [0, 0, 1] * unit.kN, "ab": rs.DistributedForce([0, 0, 2] * unit("kN/m"))}
    found = rs.network_response(network, loads, settlements={"a": [0, 0, 1, 0, 0, 0] * unit.mm})
    expected = rs.network_response(
        network,
        {"b": [0, 0, 1000], "ab": rs.DistributedForce([0, 0, 2000])},
        settlements={"a": [0, 0, 1e-3, 0, 0, 0]},
    )
    assert_allclose(found.twists["b"], expected.twists["b"], rtol=1e-12)
    assert Node("a", [1, 0, 2] * unit.mm).point.tolist() == [1e-3, 0, 2e-3]
    with pytest.raises(rs.InputError, match=r"point of node .a., entry \[0\]: got .1 kilogram"):
        Node("a", [1, 0, 2] * unit.kg)


def test_nodes_of_a_truss_spin_and_are_displaced_all_the_same():
    """Bars between balls: displacements of the nodes have values, their rotations have none."""
    feet = {"a": [0, 0, 0], "b": [1, 0, 0], "c": [0, 1, 0]}
    tip = np.array([0.3, 0.3, 0.8])
    at = {**feet, "tip": tip.tolist()}
    bodies, beams, joints = list(nodes(**at)), [], []
    for name, place in feet.items():
        low, high = nodes(**{f"{name} low": place, f"{name} high": tip.tolist()})
        bodies += [low, high]
        beams.append(beam_between(low, high, STEEL, BAR, name=f"bar {name}"))
        joints.append(JointElement(f"foot {name}", name, low.name, ball(low.point)))
        joints.append(JointElement(f"top {name}", high.name, "tip", ball(tip)))
    truss = Network(
        "truss", tuple(bodies), tuple(feet), "tip", tip, beams=tuple(beams), joints=tuple(joints)
    )
    F = np.array([100.0, -200, -1000])
    found = rs.network_response(truss, {"tip": F})
    arms = [tip - np.array(place) for place in feet.values()]
    K = sum(E * A / np.linalg.norm(x) ** 3 * np.outer(x, x) for x in arms)
    assert_allclose(found.shifts["tip"], np.linalg.solve(K, F), rtol=1e-9)
    assert "tip" in found.free_nodes
    assert "tip" not in found.twists
    page = response_page(found)
    shown = page_text(page)
    assert "; it spins freely" in shown
    assert "can move freely" not in shown
    data = page_data(page)["displacements"]["tip"]
    assert_allclose(data[:3], found.shifts["tip"])
    assert data[3:] == [None] * 3
