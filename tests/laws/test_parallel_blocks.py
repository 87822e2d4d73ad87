"""Robots whose legs hold parallel blocks, against the same robots as networks of single parts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robostiff.analysis import deflection, stiffness
from robostiff.analysis.verification import matrix_distance
from robostiff.elastostatics import Block, Form, Recursive, SaddlePoint, Status
from robostiff.network import network_of_snapshot
from robostiff.spatial import Space
from tests.generators.nested import nested_snapshots

FORMS: tuple[Form, ...] = (SaddlePoint(), Block(), Recursive())
few = settings(max_examples=8)


@few
@pytest.mark.parametrize(
    ("space", "rigid"), [(Space.SPATIAL, False), (Space.SPATIAL, True), (Space.PLANAR, True)]
)
@given(data=st.data())
def test_blocks_two_deep_are_as_their_network(space, rigid, data):
    """Same status, rank and K, also by other forms where they hold; networks have no chains."""
    snapshot = data.draw(nested_snapshots(space=space, rigid=rigid))
    result = stiffness(snapshot)
    expected = stiffness(network_of_snapshot(snapshot))
    if Status.ILL_CONDITIONED in result.status | expected.status:
        return
    assert result.status == expected.status
    assert int(result.rank) == int(expected.rank)
    assert len(result.redundant_joints) == len(expected.redundant_joints)
    if not result.status.has_stiffness:
        return
    assert matrix_distance(result.K, expected.K, 1.0) < 1e-9
    for form in FORMS:
        other = stiffness(snapshot, method=form)
        if other.status.has_stiffness and Status.ILL_CONDITIONED not in other.status:
            assert int(other.rank) == int(expected.rank)
            assert matrix_distance(other.K, expected.K, 1.0) < 1e-7


@few
@given(nested_snapshots(rigid=True))
def test_energy_of_the_parts_is_the_work_of_the_load(snapshot):
    """Castigliano: half of F . t, with t from the network."""
    result = stiffness(snapshot)
    if result.status & (Status.ILL_CONDITIONED | Status.FREE_MOTIONS | Status.RIGID_DIRECTION):
        return
    F = np.array([30.0, -20.0, 50.0, 4.0, 5.0, -3.0])
    bent = deflection(snapshot, wrench=F)
    parts = sum(part.energy for part in bent.parts)
    C = stiffness(network_of_snapshot(snapshot)).required_compliance()
    assert parts == pytest.approx(0.5 * F @ C @ F, rel=1e-7)
    assert sum(part.share for part in bent.parts) == pytest.approx(1.0)
