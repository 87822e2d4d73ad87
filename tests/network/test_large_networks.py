"""Large networks are condensed before they are factorised, and keep their digits."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from robostiff.elasticity import circle, material
from robostiff.elastostatics import DEFAULT_TOLERANCE
from robostiff.network import Network, Node, beam_between, condense
from robostiff.network.equations import equations_of
from robostiff.network.saddle_point import saddle_point_system
from tests.network.frames import lattice
from tests.network.test_networks import hinged_lattice

STEEL, BAR = material("steel"), circle(0.02)


def stiff_and_soft(cells: int) -> Network:
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


def test_a_chain_of_a_thousand_beams_is_one_beam():
    """Condensed to displacements, such a chain would lose all digits."""
    count, length = 1000, 2.0
    nodes = [Node(str(i), np.array([length * i / count, 0, 0])) for i in range(count + 1)]
    beams = [beam_between(a, b, STEEL, BAR) for a, b in pairwise(nodes)]
    tip = nodes[-1]
    network = Network("chain", tuple(nodes), ("0",), tip.name, tip.point, tuple(beams))
    K = condense(network).K
    whole = beam_between(nodes[0], tip, STEEL, BAR)
    one = condense(Network("beam", (nodes[0], tip), ("0",), tip.name, tip.point, (whole,))).K
    size = np.sqrt(np.outer(np.diag(one), np.diag(one)))
    assert np.max(np.abs(K - one) / size) < 1e-9
