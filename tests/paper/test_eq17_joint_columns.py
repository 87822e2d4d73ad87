"""Eq. (17): columns of prismatic, revolute and helical joints, by finite differences."""

import numpy as np
import pytest

from robostiff.kinematics import place_chain
from robostiff.model import Chain, Passive, helical
from robostiff.spatial import Screw
from tests.paper.finite_differences import AxesAndPoint, twist_rate


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
    J_rot = Screw(e, centre, 0.0).twist(reference)
    assert np.allclose(J_rot, by_differences, rtol=0, atol=1e-9)
    assert np.allclose(J_rot[:3], np.cross(e, r), rtol=0, atol=1e-15)
    assert not np.allclose([*np.cross(e, -r), *e], by_differences, rtol=0, atol=1e-2)
    # printed twice, J_tran would leave out the lever arm
    J_tran = Screw(e, centre, None).twist(reference)
    assert not np.allclose(J_tran, by_differences, rtol=0, atol=1e-2)


@pytest.mark.parametrize("pitch", [0.3, -0.0008, 25.0])
def test_helical_joint(pitch: float):
    """[e x r + h e; e], with a joint of the model that advances by 2 pi h per turn."""
    rng = np.random.default_rng(4)
    axis, centre, reference = rng.normal(size=(3, 3))
    joint = helical(axis, 2 * np.pi * pitch, Passive())

    def frame(angle: float) -> AxesAndPoint:
        placed = place_chain(Chain((joint,)), np.array([angle]), np.eye(3), centre)
        return placed.R, placed.p

    e = axis / np.linalg.norm(axis)
    expected = [*(np.cross(e, reference - centre) + pitch * e), *e]
    assert np.allclose(twist_rate(frame, reference), expected, rtol=1e-8, atol=1e-8)
    assert np.allclose(Screw(e, centre, pitch).twist(reference), expected, rtol=1e-15, atol=1e-15)


def test_prismatic_joint():
    e = np.array([0.6, 0.0, 0.8])

    def frame(slide: float) -> AxesAndPoint:
        return np.eye(3), slide * e

    by_differences = twist_rate(frame, np.array([1.0, 2, 3]))
    J_tran = Screw(e, np.zeros(3), None).twist(np.array([1.0, 2, 3]))
    assert np.allclose(J_tran, by_differences, rtol=0, atol=1e-12)
