"""Serial arms as a textbook has them: compliance as a sum over the springs, K its inverse."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic.placement.agreement import matrix_distance
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.analytic.placement.robot_pose import AtHome, AtSymbols
from robostiff.analytic.series_form import series_form
from robostiff.analytic.vectors.forms import VectorForm
from robostiff.analytic.vectors.vector_expressions import names_in
from robostiff.robots import robot_file
from tests.analytic.formulas import in_numbers


@pytest.mark.parametrize("pose", [AtHome(), AtSymbols()])
def test_an_arm_of_six_joints_is_its_rotations_points_and_springs(pose):
    robot = rs.load("six-joint-arm", symbols=("upper", "fore", "flange"))
    placed = place_robot(robot, pose)
    arm = series_form(placed)
    assert isinstance(arm, VectorForm)
    assert [name for name, _, _ in arm.drives] == [f"joint{i}" for i in range(1, 7)]
    assert [name for name, *_ in arm.beams] == ["column", "upper arm", "forearm", "wrist"]
    assert len(arm.leg) <= 30
    # The last joint turns neither a spring nor the reference point.
    rotations = [e.name for e in arm.leg if e.name.startswith("R_")]
    for name in rotations:
        assert any(name in names_in(e.expression) for e in arm.leg), name
    random = np.random.default_rng(5)
    for _ in range(3):
        values = {k: v * random.uniform(0.8, 1.2) for k, v in robot.nominal.items()}
        joints = {name: float(random.uniform(-1.5, 1.5)) for name in placed.coordinates}
        numeric = robot.substituted(values)
        at = rs.JointCoordinates(np.array(list(joints.values()))) if joints else None
        wanted = rs.stiffness(numeric, at).K
        assert matrix_distance(in_numbers(arm, values | joints), wanted, 0.5) < 1e-10


def test_an_arm_in_numbers_alone_is_inverted_in_steps():
    """Sines of its angles are no fractions: entries of an inverse would grow without end."""
    form = rs.derive(rs.load("six-joint-arm")).in_series
    assert not form.K.free_symbols - {d.symbol for d in form.definitions}
    assert max(sp.count_ops(d.expression) for d in form.definitions) < 500
    found = np.array(form.evalf().tolist(), dtype=float)
    assert matrix_distance(found, rs.stiffness(rs.load("six-joint-arm")).K, 0.5) < 1e-12


def test_rigid_drives_add_nothing_and_axes_may_be_inclined(tmp_path):
    text = robot_file("six-joint-arm").read_text(encoding="utf-8")
    for old, new in (
        (
            "name: joint2, axis: y, role: actuated, stiffness: 5e5 N m/rad,",
            "name: joint2, axis: y, role: actuated,",
        ),
        ("name: joint4, axis: x,", "name: joint4, axis: [3, 0, 4],"),
    ):
        assert old in text
        text = text.replace(old, new)
    page = tmp_path / "arm.yaml"
    page.write_text(text, encoding="utf-8")
    robot = rs.load(page, symbols=rs.ALL_PARAMETERS)
    placed = place_robot(robot, AtSymbols())
    arm = series_form(placed)
    assert isinstance(arm, VectorForm)
    assert [name for name, *_ in arm.drives] == [f"joint{i}" for i in (1, 3, 4, 5, 6)]
    assert arm.passive == ()
    joints = dict(zip(placed.coordinates, (0.4, 0.3, -0.6, 0.8, 0.5, -0.2), strict=True))
    wanted = rs.stiffness(robot.numeric, rs.JointCoordinates(np.array([*joints.values()]))).K
    assert matrix_distance(in_numbers(arm, {**robot.nominal, **joints}), wanted, 0.5) < 1e-10
