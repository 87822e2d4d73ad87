"""Closure by iteration: the posture at a pose does not depend on the poses that come with it."""

import numpy as np
import pytest

from robostiff.kinematics import PostureFinder
from tests.generators.machines import tripod


@pytest.mark.parametrize("kind", ["RPS", "PRS"])
def test_postures_are_the_same_to_the_last_bit_in_any_company(kind: str):
    robot = tripod(kind)
    finder = PostureFinder(robot)
    rng = np.random.default_rng(1)
    home = finder.home_pose[[2, 3, 4]]
    # As far as beyond reach, where some poses are followed in many steps.
    poses = home + rng.uniform(-1, 1, (60, 3)) * [0.5, 1.2, 1.2]
    whole = finder.find(poses)
    assert 5 < np.count_nonzero(whole.reached) < 60
    for own in (rng.permutation(60)[:25], np.array([3]), np.flatnonzero(~whole.reached)[:1]):
        part = finder.find(poses[own])
        np.testing.assert_array_equal(part.pose, whole.pose[own])
        for mine, all_ in zip(part.coordinates, whole.coordinates, strict=True):
            np.testing.assert_array_equal(mine, all_[own])
