"""Robots whose legs hold parallel blocks, against the same robots as networks of single parts."""

import numpy as np
import pytest
from hypothesis import given, settings

from robostiff.analysis import deflection, stiffness
from robostiff.analysis.verification import matrix_distance
from robostiff.elastostatics import Block, Form, Recursive, SaddlePoint, Status, WrenchBasis
from robostiff.errors import NoAnswerError
from robostiff.model import PlacedBlock, PlacedLeg, Snapshot
from robostiff.network import network_of_snapshot
from robostiff.spatial import Space
from tests.generators.nested import nested_snapshots

FORMS: tuple[Form, ...] = (WrenchBasis(), SaddlePoint(), Block(), Recursive())
few = settings(max_examples=15)


def check(snapshot: Snapshot) -> None:
    """Same status, rank and K as the network, which knows no chains."""
    result = stiffness(snapshot)
    expected = stiffness(network_of_snapshot(snapshot))
    if Status.ILL_CONDITIONED in result.status | expected.status:
        return
    assert result.status == expected.status
    assert int(result.rank) == int(expected.rank)
    assert len(result.redundant_joints) == len(expected.redundant_joints)
    if result.status.has_stiffness:
        assert matrix_distance(result.K, expected.K, 1.0) < 1e-9


@few
@given(nested_snapshots())
def test_blocks_two_deep_are_as_their_network(snapshot):
    check(snapshot)


@few
@given(nested_snapshots(rigid=True))
def test_rigid_branches_too(snapshot):
    check(snapshot)


@few
@given(nested_snapshots(space=Space.PLANAR, rigid=True))
def test_in_the_plane_too(snapshot):
    check(snapshot)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
@settings(max_examples=10)
@given(snapshot=nested_snapshots())
def test_forms_of_stiffness_agree_where_they_hold(form, snapshot):
    expected, result = stiffness(snapshot), stiffness(snapshot, method=form)
    if Status.FORM_DOES_NOT_HOLD in result.status:
        assert form.name != "wrench-basis"
        return
    if result.status.has_stiffness and Status.ILL_CONDITIONED not in result.status:
        assert int(result.rank) == int(expected.rank)
        assert matrix_distance(result.K, expected.K, 1.0) < 1e-7


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


@settings(max_examples=10)
@given(nested_snapshots(legs=1))
def test_a_block_of_one_leg_twice_is_twice_as_stiff(snapshot):
    (leg,) = snapshot.legs
    block = PlacedBlock("both", (leg, leg))
    twice = Snapshot("twice", (PlacedLeg("leg", (block,), leg.end),), snapshot.reference_point)
    try:
        K = stiffness(snapshot).K
    except NoAnswerError:
        return
    assert matrix_distance(stiffness(twice).K, 2 * K, 1.0) < 1e-9
