"""Closure by iteration: the posture at a pose does not depend on the poses that come with it."""

import numpy as np

from robostiff.kinematics import PostureFinder
from tests.generators.machines import tripod


def test_postures_are_the_same_to_the_last_bit_in_any_company():
    finder = PostureFinder(tripod("PRS"))
    rng = np.random.default_rng(1)
    home = finder.home_pose[[2, 3, 4]]
    # As far as beyond reach, where poses are followed in many steps.
    poses = home + rng.uniform(-1, 1, (24, 3)) * [0.5, 1.2, 1.2]
    whole = finder.find(poses)
    lost = np.flatnonzero(~whole.reached)
    assert 0 < lost.size < 12
    for own in (rng.permutation(24)[:9], np.array([3]), lost[:1]):
        part = finder.find(poses[own])
        np.testing.assert_array_equal(part.pose, whole.pose[own])
        for few, many in zip(part.coordinates, whole.coordinates, strict=True):
            np.testing.assert_array_equal(few, many[own])


def test_at_home_legs_are_where_they_are():
    finder = PostureFinder(tripod("PRS"))
    home = finder.home_pose[[2, 3, 4]]
    poses = np.array([home, home + np.array([0.01, 0.1, 0.0]), home])
    found = finder.find(poses)
    assert found.reached.all()
    for q, own in zip(found.coordinates, finder.homes, strict=True):
        np.testing.assert_array_equal(q[[0, 2]], [own, own])
    for q, alone in zip(found.coordinates, finder.find(poses[1]).coordinates, strict=True):
        np.testing.assert_array_equal(q[1], alone[0])
