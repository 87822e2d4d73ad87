"""The inertia of rotors behind their gears: on paper, in files, and of descriptions."""

import json
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.io.snapshot import read_snapshot, snapshot_to_data
from robostiff.kinematics import with_masses
from robostiff.spatial import Frame
from tests.io.urdf.examples import robot_of, with_side
from tests.io.urdf.test_masses import ARM, SIDE
from tests.statics.mass_matrices import mass_matrix

ZERO = rs.JointCoordinates([0.0, 0.0])


def test_a_rotor_vibrates_beside_its_arm():
    """``sqrt(k / (J + m L^2))``; a slide carries kilograms."""
    k, J, m, L = 900.0, 0.7, 3.0, 0.5
    frame = Frame(np.eye(3), np.zeros(3))
    bar = rs.Rigid(Frame(np.eye(3), np.array([L, 0, 0])), "bar")
    for joint, exact in (
        (rs.revolute([0, 0, 1], rs.Actuated(k, inertia=J)), k / (J + m * L**2)),
        (rs.prismatic([0, 0, 1], rs.Actuated(k, inertia=J)), k / (J + m)),
    ):
        arm = rs.Robot("arm", (rs.Leg("arm", frame, rs.Chain((joint, bar)), frame),))
        found = rs.modes(arm, masses={"platform": m}).frequencies
        assert np.allclose(found, np.sqrt(exact) / (2 * np.pi), rtol=1e-9)
        alone = rs.modes(arm).frequencies  # without any other mass
        assert np.allclose(alone, np.sqrt(k / J) / (2 * np.pi), rtol=1e-9)


def test_model_files_and_snapshots_keep_it(tmp_path: Path):
    path = tmp_path / "arm.yaml"
    text = """
robostiff: 1
name: arm
source: chosen
legs:
  - name: leg
    chain:
      - {type: revolute, name: j, axis: y, role: actuated, stiffness: 1000 N m/rad, inertia: rotor}
      - {type: rigid, to: [1, 0, 0]}
parameters: {rotor: 0.2 kg m^2}
platform_masses: [{name: tool, mass: 3 kg}]
"""
    path.write_text(text, encoding="utf-8")
    robot = rs.load(path)
    exact = np.sqrt(1000 / 3.2) / (2 * np.pi)
    assert np.allclose(rs.modes(robot).frequencies, exact, rtol=1e-9)
    snapshot = with_masses(rs.find_posture(robot)).one(0)
    again = tmp_path / "arm.json"
    again.write_text(json.dumps(snapshot_to_data(snapshot)), encoding="utf-8")
    assert np.allclose(rs.modes(read_snapshot(again)).frequencies, exact, rtol=1e-9)
    for old, new, message in (
        ("inertia: rotor", "inertia: 2 kg", "a moment of inertia"),
        ("role: actuated, stiffness: 1000 N m/rad", "role: passive", "actuated joints only"),
    ):
        path.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(rs.FileError, match=message):
            rs.load(path)


TRANSMISSION = """<transmission name="t"><type>any</type><joint name="j1"/><actuator name="m">
  {}</actuator></transmission></robot>"""


@pytest.mark.parametrize(
    "drive",
    [
        '<drake:gear_ratio value="50"/><drake:rotor_inertia value="2e-4"/>',
        "<mechanicalReduction>50</mechanicalReduction><rotorInertia>2e-4</rotorInertia>",
    ],
)
def test_a_transmission_of_a_urdf_has_it(tmp_path: Path, drive: str):
    """Times the square of the reduction: as in the side file, where that has one."""
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace("</robot>", TRANSMISSION.format(drive)), encoding="utf-8")
    bare = tmp_path / "bare.urdf"
    bare.write_text(ARM, encoding="utf-8")
    side = with_side(tmp_path, SIDE)
    rotor = mass_matrix(robot_of(path, side), ZERO) - mass_matrix(robot_of(bare, side), ZERO)
    assert np.allclose(rotor, np.diag([0.5, 0.0]), atol=1e-12)
    given = SIDE.replace("stiffness: 2e4 N m/rad", "stiffness: 2e4 N m/rad, inertia: 0.3 kg m^2")
    other = robot_of(path, with_side(tmp_path, given))
    rotor = mass_matrix(other, ZERO) - mass_matrix(robot_of(bare, with_side(tmp_path, SIDE)), ZERO)
    assert np.allclose(rotor, np.diag([0.3, 0.3]), atol=1e-12)


def test_an_armature_of_a_urdf_is_at_the_joint(tmp_path: Path):
    path = tmp_path / "arm.urdf"
    text = ARM.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><dynamics armature="0.4"/>', 1)
    path.write_text(text, encoding="utf-8")
    with_rotor = mass_matrix(robot_of(path, with_side(tmp_path, SIDE)), ZERO)
    path.write_text(ARM, encoding="utf-8")
    bare = mass_matrix(robot_of(path, with_side(tmp_path, SIDE)), ZERO)
    assert np.allclose(with_rotor - bare, np.diag([0.4, 0.0]), atol=1e-12)
