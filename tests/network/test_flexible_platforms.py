"""Legs on platforms that bend, against the network of all bodies, and their laws."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings

from robostiff import Status, deflection, stiffness
from robostiff.elasticity import Elasticity
from robostiff.network import energy_stiffness, network_of_snapshot
from tests.generators.metric import distance
from tests.generators.platforms import OnPlatform, robots_on_platforms

WITHOUT = Status.RIGID_DIRECTION


@settings(max_examples=120)
@given(robots_on_platforms())
def test_same_as_the_network_of_all_bodies(given_robot: OnPlatform):
    snapshot = given_robot.snapshot
    result, network = stiffness(snapshot), network_of_snapshot(snapshot)
    expected = stiffness(network)
    if Status.ILL_CONDITIONED in result.status | expected.status:
        return
    assert (WITHOUT in result.status) == (WITHOUT in expected.status)
    assert result.rank == expected.rank
    assert len(result.redundant_joints) == len(expected.redundant_joints)
    if WITHOUT in result.status:
        return
    assert distance(result.K, expected.K) < max(1e-10, 100 * given_robot.robot.rounding())
