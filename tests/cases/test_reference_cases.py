"""Robots at a pose, by their placed parts and as model files, against 60-digit arithmetic."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import robostiff as rs
from robostiff.analysis import stiffness
from robostiff.elastostatics import Form, aggregate_matrices
from robostiff.io.snapshot import snapshot_schema
from tests.campaign.ways import in_frame
from tests.cases.metric import distance
from tests.cases.reference_case import NAMES, case, leg_stiffness, robot_stiffness
from tests.files import FILES
from tests.network.frames import GRAPHS

FORMS: tuple[Form, ...] = (rs.WrenchBasis(), rs.SaddlePoint(), rs.Block(), rs.Recursive())

#: Forms that do not hold: redundant joints, or actuators as the only springs.
REFUSED = {
    "a15_SS_redundant": ("saddle-point", "block"),
    "a17_rigid_UPS_actuator_only": ("block", "recursive"),
    "f_3RPR_planar_pose0": ("block", "recursive"),
}

#: What float64 reaches; the cases themselves ask for 1e-10.
REACHED = 1e-11


each_case = pytest.mark.parametrize("name", NAMES)


def test_all_twenty_are_there_and_fit_the_published_schema():
    assert len(NAMES) == 20
    validator = Draft202012Validator(snapshot_schema())
    for name in NAMES:
        validator.validate(case(name).data)


@each_case
def test_stiffness_rank_and_compliance_of_the_robot(name):
    given = case(name)
    assert given.oracle["suggested_rtol"] > REACHED
    results: list[Any] = [stiffness(given.snapshot)]
    assert len(results[0].free_motions) == len(given.K) - given.oracle["rank"]
    for form in FORMS:
        result = robot_stiffness(given.snapshot, form)
        if form.name in REFUSED.get(name, ()):
            assert rs.Status.FORM_DOES_NOT_HOLD in result.status
            assert result.reason
        else:
            assert result.status.has_stiffness
            results.append(result)
    for result in results:
        assert distance(result.K, given.K, given.size) < REACHED
        assert result.rank == given.oracle["rank"]
    is_regular = given.oracle["rank"] == len(given.K)
    assert ("compliance" in given.oracle) <= is_regular
    C = robot_stiffness(given.snapshot, rs.WrenchBasis()).compliance
    assert (C is not None) == is_regular
    if C is not None and "compliance" in given.oracle:
        assert distance(C, np.array(given.oracle["compliance"]), 1 / given.size) < REACHED


@pytest.mark.parametrize("name", [x for x in NAMES if "leg_K_at_reference" in case(x).oracle])
def test_stiffness_of_each_leg_at_the_reference_point(name):
    given = case(name)
    at = given.snapshot.reference_point
    for form in (own for own in FORMS if own.name not in REFUSED.get(name, ())):
        for leg, K in zip(given.snapshot.legs, given.oracle["leg_K_at_reference"], strict=True):
            result = leg_stiffness(given.snapshot, leg, at, form)
            assert distance(result.K, np.array(K), given.size) < REACHED


@pytest.mark.parametrize("name", [x for x in NAMES if "leg_K_at_leg_end" in case(x).oracle])
def test_stiffness_of_each_leg_at_its_end_and_their_sum(name):
    given = case(name)
    legs, at = given.snapshot.legs, given.snapshot.reference_point
    form = rs.WrenchBasis()
    computed = [leg_stiffness(given.snapshot, leg, leg.end, form).K for leg in legs]
    expected = [np.array(K) for K in given.oracle["leg_K_at_leg_end"]]
    for K, K_ref in zip(computed, expected, strict=True):
        assert distance(K, K_ref, given.size) < REACHED
    to_reference = [at - leg.end for leg in legs]
    assert distance(aggregate_matrices(computed, to_reference), given.K, given.size) < REACHED
    assert distance(aggregate_matrices(expected, to_reference), given.K, given.size) < REACHED


# Millimetres read as metres are questioned, as they should be.
@pytest.mark.filterwarnings("ignore::robostiff.errors.PlausibilityWarning")
@each_case
def test_millimetres_change_nothing(name):
    given = case(name)
    in_mm = in_frame(given.snapshot, np.eye(3), np.zeros(3), 1e3)
    factor = np.where(np.arange(len(given.K)) < given.snapshot.space.translations, 1e3, 1.0)
    for form in FORMS:
        result, result_mm = (robot_stiffness(own, form) for own in (given.snapshot, in_mm))
        assert result_mm.status == result.status
        assert result_mm.rank == result.rank
        assert result_mm.redundant.tolist() == result.redundant.tolist()
        if result.status.has_stiffness:
            K = result_mm.K * np.outer(factor, factor) / 1e3
            assert distance(K, given.K, given.size) < REACHED


def oracle(name: str) -> dict:
    return json.loads((GRAPHS / f"{name}.json").read_text())["oracle"]


def test_parallelogram():
    expected = oracle("h_parallelogram_square")
    robot = rs.load(FILES / "parallelogram-of-tubes.yaml")
    result = rs.stiffness(robot)
    assert distance(result.K, np.array(expected["K"])) < expected["suggested_rtol"]
    assert int(result.rank) == expected["rank"]
    assert [str(motion) for motion in result.free_motions] == ["translation along z"]


def test_orthoglide_through_inverse_kinematics():
    """The shipped robot has the dimensions of the case."""
    expected = oracle("h_orthoglide_pose0")
    result = rs.stiffness(rs.load("orthoglide"), [0.0, 0.0, 0.0])
    assert distance(result.K, np.array(expected["K"])) < expected["suggested_rtol"]
    assert int(result.rank) == expected["rank"]
    C = np.array(expected["compliance"])
    assert distance(result.required_compliance(), C, 1.0) < expected["suggested_rtol"]
