"""Identification does not depend on order, or on where the world is.

Units of files are in test_measurement_files.py.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from tests.identification.campaigns import arm_campaign, machine


@pytest.fixture(scope="module")
def arm():
    return machine("arm")


@pytest.fixture(scope="module")
def found(arm):
    return rs.identify(arm, arm_campaign(), ["arm/joint*"])


def _alike(one: rs.Identified, other: rs.Identified, part: float = 1e-6) -> None:
    for name, value in one.values.items():
        if name.startswith("arm"):
            assert abs(other.values[name] - value) < part * one.std[name]
            assert other.std[name] == pytest.approx(one.std[name], rel=1e-6)


def test_an_instrument_elsewhere(arm, found):
    """The same readings from another place and under another rotation."""
    R, b = Rotation.from_rotvec([0.4, -1.1, 2.0]).as_matrix(), np.array([3.0, -2.0, 1.0])
    measured = arm_campaign()
    moved = replace(measured, values=(measured.values - b) @ R.T)
    other = rs.identify(arm, moved, ["arm/joint*"])
    _alike(found, other, 1e-5)
    assert other.chi_square == pytest.approx(found.chi_square, rel=1e-8)


def test_a_world_that_is_turned_and_the_order_of_rows_and_parameters(arm, found):
    """Robot, gravity and loads turned and shifted together, beside the same readings."""
    R, p = Rotation.from_rotvec([0.7, 0.4, -1.3]).as_matrix(), np.array([0.5, -1.0, 2.0])
    (leg,) = arm.legs
    base = rs.Frame(R @ leg.base.R, R @ leg.base.p + p)
    turned = replace(arm, legs=(replace(leg, base=base),), gravity=R @ arm.gravity)
    measured = arm_campaign().chosen(np.random.default_rng(4).permutation(36))
    moved = replace(measured, forces=measured.forces @ R.T)
    names = [f"arm/joint{k}" for k in (3, 1, 6, 2, 5, 4)]
    other = rs.identify(turned, moved, names)
    assert other.names[:6] == tuple(names)
    _alike(found, other, 1e-5)
    assert other.chi_square == pytest.approx(found.chi_square, rel=1e-8)
