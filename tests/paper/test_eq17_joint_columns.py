"""Eq. (17): columns of prismatic and revolute joints, by finite differences."""

import numpy as np
import pytest

from robostiff.spatial import rotation_twist, translation_twist
from tests.kinematics.finite_differences import AxesAndPoint, twist_rate


@pytest.mark.parametrize("seed", range(5))
def test_revolute_joint(seed: int):
    rng = np.random.default_rng(seed)
    e = rng.normal(size=3)
    e = e / np.linalg.norm(e)
    centre, reference = rng.normal(size=(2, 3))
    E = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])

    def frame(angle: float) -> AxesAndPoint:
        R = np.eye(3) + np.sin(angle) * E + (1 - np.cos(angle)) * E @ E
        return R, centre - R @ centre

    by_differences = twist_rate(frame, reference)
    r = reference - centre  # from the joint centre to the reference point
    assert np.allclose(rotation_twist(e, r), by_differences, rtol=0, atol=1e-9)
    assert np.allclose(rotation_twist(e, r)[:3], np.cross(e, r), rtol=0, atol=1e-15)
    assert not np.allclose(rotation_twist(e, -r), by_differences, rtol=0, atol=1e-2)
    # printed twice, J_tran would leave out the lever arm
    assert not np.allclose(translation_twist(e), by_differences, rtol=0, atol=1e-2)


def test_prismatic_joint():
    e = np.array([0.6, 0.0, 0.8])

    def frame(slide: float) -> AxesAndPoint:
        return np.eye(3), slide * e

    by_differences = twist_rate(frame, np.array([1.0, 2, 3]))
    assert np.allclose(translation_twist(e), by_differences, rtol=0, atol=1e-12)
