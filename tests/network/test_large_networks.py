"""Large networks are condensed before they are factorised, and keep their digits."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import robostiff as rs
from robostiff.elastostatics import DEFAULT_TOLERANCE
from robostiff.model import Passive, PlacedFreedom
from robostiff.network import JointElement, Node, beam_between, condense, network_under_loads
from robostiff.network.equations import equations_of
from robostiff.network.saddle_point import saddle_point_system
from tests.network.frames import lattice
from tests.network.test_networks import hinged_lattice

STEEL, BAR = rs.material("steel"), rs.circle(0.02)


def stiff_and_soft(cells: int) -> rs.Network:
    """A lattice in which every third beam is of rubber, every fifth is stiffer."""
    welded = lattice(cells)
    factors = [1e4 if k % 3 == 0 else 1e-2 if k % 5 == 0 else 1.0 for k in range(10**5)]
    beams = [
        replace(beam, tip_compliance=beam.tip_compliance * factor)
        for beam, factor in zip(welded.beams, factors, strict=False)
    ]
    return replace(welded, beams=tuple(beams))


@pytest.mark.parametrize(
    "network",
    [lattice(5), hinged_lattice(5), stiff_and_soft(5)],
    ids=["welded", "hinged", "stiff and soft"],
)
def test_condensed_and_whole_system_say_the_same(network):
    system = saddle_point_system(equations_of(network, DEFAULT_TOLERANCE), platform_fixed=True)
    assert system.condensed is not None
    right = np.zeros((system.matrix.size, 3))
    right[system.kept] = np.random.default_rng(1).normal(size=(system.kept.size, 3))
    found, last = system.solve(right)
    assert last < 1e-12
    whole, _ = replace(system, condensed=None).solve(right)
    assert np.max(np.abs(found - whole)) < 1e-9 * np.max(np.abs(whole))
    left = right[system.kept] - system.regular @ found[system.kept]
    assert np.max(np.abs(left)) < 1e-11 * np.max(np.abs(whole))


def test_a_platform_that_swings_on_a_large_network_is_free_and_carries_what_it_can():
    """Its factors hold everything but the platform: its hinge leaves one motion free."""
    frame = lattice(5)
    swing = Node("swing", frame.reference_point)
    turn = PlacedFreedom(np.eye(3)[2], swing.point, 0.0, "turn", Passive())
    network = replace(
        frame,
        nodes=(*frame.nodes, swing),
        platform="swing",
        joints=(JointElement("hinge", frame.platform, "swing", (turn,)),),
    )
    found, whole = condense(network), condense(frame).at_reference
    assert (str(found.status), int(found.rank)) == ("free-motions", 5)
    free = np.linalg.inv(np.linalg.inv(whole)[:5, :5])
    size = np.sqrt(np.outer(np.diag(free), np.diag(free)))
    assert np.max(np.abs(found.at_reference[:5, :5] - free) / size) < 1e-9
    bent = network_under_loads(network, np.array([0, 0, 1.0, 0, 0, 0]))
    np.testing.assert_allclose(
        bent.twist("swing", swing.point)[:5], np.linalg.inv(whole)[:5, 2], rtol=1e-8, atol=1e-13
    )


def test_a_chain_of_a_thousand_beams_is_one_beam():
    """Condensed to displacements, such a chain would lose all digits."""
    count, length = 1000, 2.0
    nodes = [Node(str(i), np.array([length * i / count, 0, 0])) for i in range(count + 1)]
    beams = [beam_between(a, b, STEEL, BAR) for a, b in pairwise(nodes)]
    tip = nodes[-1]
    network = rs.Network("chain", tuple(nodes), ("0",), tip.name, tip.point, tuple(beams))
    K = condense(network).K
    whole = beam_between(nodes[0], tip, STEEL, BAR)
    one = condense(rs.Network("beam", (nodes[0], tip), ("0",), tip.name, tip.point, (whole,))).K
    size = np.sqrt(np.outer(np.diag(one), np.diag(one)))
    assert np.max(np.abs(K - one) / size) < 1e-9
