"""Robots as networks, against the wrench basis form; shipped ones are in test_verification."""

import numpy as np
import pytest

from robostiff.analysis import stiffness
from robostiff.analysis.verification import matrix_distance
from robostiff.elasticity import Elasticity
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from robostiff.network import energy_stiffness, network_of_snapshot
from tests.cases.metric import distance
from tests.cases.reference_case import NAMES, case


@pytest.mark.parametrize("name", NAMES)
def test_reference_case_against_sixty_digits(name):
    given = case(name)
    network = network_of_snapshot(given.snapshot)
    result = stiffness(network)
    assert distance(result.K, given.K, given.size) < 1e-12
    assert int(result.rank) == given.oracle["rank"]
    assert set(result.redundant_joints) == set(stiffness(given.snapshot).redundant_joints)
    assert distance(energy_stiffness(network), given.K, given.size) < 1e-10


def test_a_spring_with_free_and_rigid_directions():
    C = np.diag([1e-6, 0, 2e-6, 0, 3e-4, 0])
    free = np.eye(6)[:, [3]]
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]])
    far = np.array([0.3, 0.2, 0.9])
    soft = PlacedSpring("soft", far / 2, np.eye(3), Elasticity(1e-7 * np.eye(6)))
    odd = PlacedSpring("odd", far, turn, Elasticity(C, free))
    snapshot = Snapshot("mount", (PlacedLeg("leg", (soft, odd), far),), far)
    network = network_of_snapshot(snapshot)
    expected, result = stiffness(snapshot), stiffness(network)
    assert int(result.rank) == int(expected.rank) == 5
    assert matrix_distance(result.K, expected.K, 0.5) < 1e-12
    assert matrix_distance(energy_stiffness(network), expected.K, 0.5) < 1e-10
