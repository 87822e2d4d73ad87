"""Stiffness, deflection and indices of a linkage at values of its joints: as those of a network."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.linkage_stiffness import ConfigurationsOfLinkage
from robostiff.elastostatics import Status
from robostiff.kinematics import ActuatorCoordinates
from robostiff.model import Link
from robostiff.spatial import Frame

FOUR_BAR = Path(__file__).parents[2] / "examples" / "four-bar.xml"
ANGLES = [-0.3, 0.0, 0.4]
F = np.array([10.0, -20, 30, 1, 2, 3])


@pytest.fixture(scope="module")
def four_bar():
    return rs.load_linkage(FOUR_BAR)


def _alike(result, network):
    own = rs.stiffness(network)
    assert result.status == own.status
    assert result.rank == own.rank
    np.testing.assert_allclose(result.reference_point, own.reference_point, atol=1e-12)
    size = np.sqrt(np.diag(own.matrix))
    np.testing.assert_array_less(np.abs(result.matrix - own.matrix), 1e-9 * np.outer(size, size))


def test_at_values_it_is_the_network_at_these(four_bar):
    _alike(rs.stiffness(four_bar), rs.network_at(four_bar))
    every = rs.stiffness(four_bar, {"crank": ANGLES})
    assert every.batch_shape == (3,)
    for i, angle in enumerate(ANGLES):
        network = rs.network_at(four_bar, {"crank": angle})
        _alike(every[i], network)
        _alike(rs.stiffness(four_bar, {"crank": angle}), network)
    assert every.joint_coordinates["crank"][:, 0].tolist() == ANGLES


@pytest.mark.parametrize("values", [None, {"crank": 0.35}, {"crank": -0.2}])
def test_the_network_and_its_energy_check_the_direct_form(four_bar, values):
    checked = rs.verify(four_bar, values)
    assert checked.agree
    assert [one.method for one in checked.comparisons] == ["network", "energy"]
    assert checked.reference.method.name == "wrench-basis"


def test_values_come_by_name_in_rows_or_as_coordinates_of_actuators(four_bar):
    rows = np.reshape(ANGLES, (3, 1))
    expected = rs.stiffness(four_bar, {"crank": ANGLES}).K
    ways = (rows, ActuatorCoordinates({"crank": ANGLES}), ActuatorCoordinates(rows))
    for values in ways:
        assert np.array_equal(rs.stiffness(four_bar, values).K, expected)
    table = rs.stiffness(four_bar, {"crank": [ANGLES, ANGLES]})
    # Arrays of another length may be rounded otherwise.
    scale = np.abs(expected).max()
    np.testing.assert_allclose(table.K, [expected, expected], rtol=0, atol=1e-13 * scale)
    assert rs.stiffness(four_bar, np.zeros((0, 1))).K.shape == (0, 6, 6)


def test_out_of_reach_is_a_status_with_the_gap():
    """Bars of 500 mm end where the feet are 500 mm apart."""
    linkage = rs.load_linkage("double-pantograph")
    every = rs.stiffness(linkage, {"screw": [0.2, -0.1]})
    assert every.status_codes.tolist() == [Status.UNREACHABLE, Status.OK]
    assert every.rank.tolist() == [-1, 6]
    one = every[0]
    assert "100 mm" in one.advice[0]
    assert one.compliance is None
    C = rs.compliance(linkage, {"screw": [0.2, -0.1]})
    assert np.ma.getmaskarray(C)[:, 0, 0].tolist() == [True, False]


def test_deflection_compliance_and_indices_are_those_of_the_networks(four_bar):
    values = {"crank": ANGLES}
    bent = rs.deflection(four_bar, values, F)
    C = rs.compliance(four_bar, values)
    found = rs.indices(four_bar, values)
    for i, angle in enumerate(ANGLES):
        network = rs.network_at(four_bar, {"crank": angle})
        expected = rs.deflection(network, None, F)
        np.testing.assert_allclose(bent.twist[i], expected.twist, rtol=1e-9)
        for one in (bent[i], rs.deflection(four_bar, {"crank": angle}, F)):
            assert [p.part for p in one.parts] == [p.part for p in expected.parts]
            np.testing.assert_allclose(one.energy, expected.energy, rtol=1e-9)
        np.testing.assert_allclose(C[i], rs.compliance(network), rtol=1e-8, atol=1e-8 * C[i].max())
        expected = rs.indices(network).collinear.smallest
        np.testing.assert_allclose(found[i].collinear.smallest, expected, rtol=1e-9)


@cache
def _with_record():
    """A linkage that records itself at once, and its answer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ConfigurationsOfLinkage, "pays", (0, 1, 10**9))
        linkage = rs.load_linkage(FOUR_BAR)
        return linkage, rs.stiffness(linkage, {"crank": [*ANGLES, 0.7]})


def test_many_poses_are_answered_by_the_record():
    _, answer = _with_record()
    fresh = rs.load_linkage(FOUR_BAR)
    assert answer.recorded is not None
    assert not any("details" in name for name in vars(answer))
    for i, angle in enumerate([*ANGLES, 0.7]):
        _alike(answer[i], rs.network_at(fresh, {"crank": angle}))
    assert not any("details" in name for name in vars(answer))
    about = rs.stiffness(fresh, {"crank": ANGLES[0]}, at=[0, 0, 0]).K
    own = answer.about(np.zeros(3))[0].K
    np.testing.assert_allclose(own, about, rtol=1e-9, atol=1e-9 * about.max())


def test_a_record_that_differs_from_the_network_is_an_error():
    _, answer = _with_record()
    question: Any = answer.question
    asked = ConfigurationsOfLinkage(question.driven, question.numbers)
    assert answer.recorded is not None
    asked.recorded = replace(answer.recorded, values={"K": 1.01 * answer.recorded.matrix})
    with pytest.raises(rs.DisagreementError, match="record of a linkage"):
        rs.Stiffness(asked, asked.rows)[0].details()


def test_another_tolerance_is_not_left_to_the_record():
    linkage, _ = _with_record()
    strict = rs.stiffness(linkage, {"crank": [0.1]}, tolerance=rs.Tolerance(independence=1e-8))
    assert strict.recorded is None


def test_rigid_bars_have_a_compliance_and_a_deflection(four_bar):
    """Nothing bends but the crank's drive: no K, and the compliance of the drive alone."""
    rigid = tuple(
        replace(c, element=None, after=_end(c)) if isinstance(c.element, Link) else c
        for c in four_bar.connections
    )
    linkage = replace(four_bar, connections=rigid)
    values = {"crank": ANGLES}
    answer = rs.stiffness(linkage, values)
    assert all(Status(int(code)) & Status.RIGID_DIRECTION for code in answer.status_codes)
    C = rs.compliance(linkage, values)
    bent = rs.deflection(linkage, values, F)
    for i, angle in enumerate(ANGLES):
        network = rs.network_at(linkage, {"crank": angle})
        np.testing.assert_allclose(C[i], rs.compliance(network), atol=1e-9 * np.abs(C[i]).max())
        expected = rs.deflection(network, None, F).twist
        np.testing.assert_allclose(bent.twist[i], expected, atol=1e-9 * np.abs(expected).max())
        assert bent[i].leg_wrenches == ()


def _end(connection):
    """The frame of body b behind a bar that does not bend."""
    assert isinstance(connection.element, Link)
    return Frame(np.eye(3), np.asarray(connection.element.to)) @ connection.after
