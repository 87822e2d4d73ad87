"""Commands of an arm with heavy links and of a hexapod against references of 40 digits."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs

CASES = json.loads((Path(__file__).parent / "data" / "commands.json").read_text("utf-8"))


def column(machine: str, key: str) -> np.ndarray:
    return np.array([point[key] for point in CASES[machine]["points"]], dtype=float)


@pytest.fixture(scope="module")
def models(tmp_path_factory) -> dict[str, rs.Robot]:
    folder, found = tmp_path_factory.mktemp("models"), {}
    for machine, key in (("arm", "arm_yaml"), ("hexapod", "model_yaml")):
        file = folder / f"{machine}.yaml"
        file.write_text(CASES[machine][key])
        found[machine] = rs.load(file)
    return found


METHODS = {"exact": rs.Exact(), "mirror": rs.Mirror()}


@pytest.mark.parametrize("name", METHODS)
def test_commands_of_a_hexapod(models, name):
    wrenches = column("hexapod", "wrench_dead_about_reference")
    target = column("hexapod", "target_pose")
    found = rs.compensate(models["hexapod"], target, wrenches, METHODS[name])
    expected = column("hexapod", "uncompensated_displacement")
    np.testing.assert_allclose(-found.deviation, expected, atol=1e-13)
    np.testing.assert_allclose(found.commanded, column("hexapod", f"{name}_pose"), atol=1e-12)
    assert not found.status
    if name == "exact":
        assert np.max(np.abs(found.residual)) < 1e-13
        lengths = column("hexapod", "exact_strut_lengths")
        home = rs.find_posture(models["hexapod"], found.commanded).snapshot
        assert np.ptp(found.drives - lengths, axis=0).max() < 1e-12  # but for the home lengths
        assert home is not None
    else:
        for part, key in ((slice(3), "mirror_residual_m"), (slice(3, 6), "mirror_residual_rad")):
            left = np.linalg.norm(found.residual[:, part], axis=1)
            np.testing.assert_allclose(left, column("hexapod", key), atol=1e-13)


@pytest.mark.parametrize("name", METHODS)
def test_commands_of_an_arm(models, name):
    joints = rs.JointCoordinates(column("arm", "target_joints"))
    wrenches = column("arm", "wrench_dead_about_tip")
    found = rs.compensate(models["arm"], joints, wrenches, METHODS[name])
    np.testing.assert_allclose(found.target, column("arm", "target_pose"), atol=1e-13)
    expected = column("arm", "uncompensated_displacement")
    np.testing.assert_allclose(-found.deviation, expected, atol=1e-13)
    np.testing.assert_allclose(found.coordinates, column("arm", f"{name}_joints"), atol=1e-12)
    np.testing.assert_allclose(found.drives, found.coordinates)
    if name == "mirror":
        left = np.linalg.norm(found.residual[:, :3], axis=1)
        np.testing.assert_allclose(left, column("arm", "mirror_residual_m"), atol=1e-13)
