"""Identification does not depend on order, or on where the world is.

Units of files are in test_measurement_files.py.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

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


@pytest.mark.parametrize("kind", [rs.Reading.DISPLACEMENT, rs.Reading.POINT, rs.Reading.TORQUE])
@pytest.mark.parametrize("body", ["", "arm/joint3"])
def test_readings_of_another_kind_are_told_by_equilibria(kind: rs.Reading, body: str):
    robot, marker = rs.load("examples/loaded-arm.yaml"), np.array([0.1, 0.05, 0.02])
    q = np.array([[0.3, -0.5, 0.8, 0.2, 0.5, 0.3], [-0.4, -0.8, 0.5, -0.3, 0.7, 0.1]])
    F, W = np.array([100.0, -200, -300]), np.array([60.0, 50, -80, 0, 0, 5])

    def read(kind: rs.Reading, body: str) -> np.ndarray:
        found = []
        for row in q:
            pose, loads = rs.JointCoordinates(row), {body: F} if body else None
            bent = rs.equilibrium(robot, pose, W, loads=loads)
            places = [
                each.pose[:3] + Rotation.from_rotvec(each.pose[3:]).apply(marker)
                for each in (bent, rs.equilibrium(robot, pose))
            ]
            is_motion = kind is rs.Reading.DISPLACEMENT
            found.append(places[0] - places[1] if is_motion else places[0])
            if kind is rs.Reading.TORQUE:
                load = next(x.load or 0.0 for x in bent.parts if x.part == "joint2")
                found[-1] = np.array([-load, np.nan, np.nan])
        return np.array(found)

    def campaign(kind: rs.Reading, body: str) -> rs.Measurements:
        more = {"forces": F, "bodies": body} if body else {}
        drive = "joint2" if kind is rs.Reading.TORQUE else ""
        return rs.Measurements(
            rs.JointCoordinates(q), read(kind, body), wrenches=W, sigma=1e-6, kinds=kind,
            markers="m", drives=drive, **more,
        )  # fmt: skip

    motions = campaign(rs.Reading.DISPLACEMENT, "")
    frames = rs.KnownFrames({"m": marker}, [0.0] * 6)
    found = rs.identify(robot, motions, ["arm/joint2", "arm/joint3"], frames=frames)
    other = campaign(kind, body)
    off = np.abs(found.predict(other)[0] - other.values)[other.is_read].max()
    assert off < (0.1 if kind is rs.Reading.TORQUE else 3e-6)  # N m, m


def test_displacements_beside_a_spring_between_bodies():
    """Such a spring acts under finite loads alone, as do all readings of its robot."""
    robot, marker = rs.load("examples/loaded-arm.yaml"), np.array([0.1, 0.05, 0.02])
    ends = rs.BodyPoint("base", [-0.2, 0, 0.5]), rs.BodyPoint("arm/joint2", [0, 0, 0.3])
    robot = robot.with_springs([rs.BodySpring("compensator", ends, stiffness=2e4, free_length=0.1)])
    postures: Any = rs.random_postures(robot, 4)
    q = postures.values
    W, at_rest = np.array([60.0, 50, -80, 10, 0, 5]), np.zeros(6)

    def place(row: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        pose: Any = rs.equilibrium(robot, rs.JointCoordinates(row), wrench).pose
        return pose[:3] + Rotation.from_rotvec(pose[3:]).apply(marker)

    moved = [place(row, W) - place(row, at_rest) for row in q]
    motions = rs.Measurements(
        rs.JointCoordinates(q), moved, wrenches=W, sigma=1e-6, kinds=rs.Reading.DISPLACEMENT
    )
    frames = rs.KnownFrames({"marker": marker}, [0.0] * 6)
    found = rs.identify(robot, motions, ["arm/joint2", "arm/joint3"], frames=frames)
    for unknown in found.model.parameters:
        assert found.values[unknown.name] == pytest.approx(unknown.nominal, rel=1e-8)
    assert found.chi_square < 1e-9
