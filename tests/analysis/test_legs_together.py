"""Legs that are alike are computed together at a few poses: as each of them alone."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.kinematics import jacobians
from robostiff.model import Passive, PlacedFreedom, PlacedLeg, Snapshot
from robostiff.spatial import Space
from tests.generators.planted_poses import PoseSpace


def scaled_difference(found: np.ndarray, expected: np.ndarray) -> float:
    size = np.abs(expected).max(axis=(-1, -2), keepdims=True)
    return float(np.max(np.abs(found - expected) / np.where(size > 0, size, 1.0)))


@pytest.mark.parametrize(
    ("name", "groups"),
    [
        ("hexapod", [6]),  # telescopes whose beams differ in length
        ("3-rpr", [3]),  # drives of several stiffnesses, in the plane
        ("delta", [3]),  # parallelograms, whose branches are alike as well
        ("gantry-tau", [1, 1, 1]),  # legs of one, two and three rods
    ],
)
def test_legs_together_are_as_each_alone(
    name: str, groups: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = rs.load(name)
    snapshot = rs.find_posture(robot).snapshot
    together = jacobians.legs_together(snapshot.legs, snapshot.reference_point.shape[:-1])
    assert [len(own.places) for own in together] == groups
    for count in (1, 4):
        poses = PoseSpace(robot).beside(count, 0.05)
        found = direct_stiffness(robot, poses)
        with monkeypatch.context() as alone:
            alone.setattr(jacobians, "FEW", 0)
            expected = direct_stiffness(robot, poses)
        assert_equal(found, expected)


def assert_equal(found: rs.Stiffness, expected: rs.Stiffness) -> None:
    assert np.all(expected.answered)
    assert found.details().passive_joint_names == expected.details().passive_joint_names
    for one, other in [
        (found.details(), expected.details()),
        *zip(found.details().legs, expected.details().legs, strict=True),
    ]:
        np.testing.assert_array_equal(one.status_codes, other.status_codes)
        np.testing.assert_array_equal(one.rank, other.rank)
        np.testing.assert_array_equal(one.redundant, other.redundant)
        assert scaled_difference(one.matrix, other.matrix) < 1e-12


def test_legs_of_different_ranks_together() -> None:
    """Joints of one leg are redundant, of the other not: poses of a batch may differ like that."""
    z, far = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
    legs = []
    for name, places in (("a", (far, far)), ("b", (far, 2 * far))):
        joints = [
            PlacedFreedom(z, place, 0.0, f"joint{i}", Passive()) for i, place in enumerate(places)
        ]
        drive = PlacedFreedom(z, np.zeros(3), 0.0, "drive", rs.Actuated(1e5))
        slide = PlacedFreedom(far, np.zeros(3), None, "slide", rs.Actuated(1e6))
        legs.append(PlacedLeg(name, (drive, slide, *joints), far))
    snapshot = Snapshot("two legs", tuple(legs), 0.3 * far, Space.PLANAR)
    together = jacobians.legs_together(snapshot.legs, ())
    assert [own.places for own in together] == [(0, 1)]
    both = direct_stiffness(snapshot)
    for leg, found in zip(legs, both.details().legs, strict=True):
        one = (
            direct_stiffness(Snapshot("one leg", (leg,), 0.3 * far, Space.PLANAR)).details().legs[0]
        )
        assert found.rank == one.rank
        np.testing.assert_array_equal(found.redundant, one.redundant)
