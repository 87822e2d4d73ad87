"""Side files: how they are found, what they may say, and how slips in them are reported."""

import shutil
from importlib import import_module

import numpy as np
import pytest

import robostiff as rs
from tests.files import text_of, written
from tests.io.urdf.examples import (
    ROMEO,
    UR5,
    UR5_SIDE,
    matrix_distance,
    needs_examples,
    robot_of,
    with_side,
)

ARM = text_of("arm-with-fingers.urdf")
HEAD = "robostiff: 1\nsource: chosen here\n"
STIFF = HEAD + 'tool: tip\njoints: {"*": {stiffness: 1e4}}\n'


@pytest.fixture
def arm(tmp_path):
    return written(tmp_path / "arm.urdf", ARM)


def test_the_side_file_is_found_beside_the_description(arm):
    arm.with_name("arm.stiffness.yaml").write_text(STIFF, encoding="utf-8")
    assert [leg.name for leg in robot_of(arm).legs] == ["arm"]
    assert [leg.name for leg in robot_of(str(arm)).legs] == ["arm"]


@needs_examples
def test_a_side_file_can_name_its_description(tmp_path):
    shutil.copy(UR5, tmp_path / "ur5.urdf")
    side = written(tmp_path / "heavy payload.yaml", UR5_SIDE + "robot: ur5.urdf\n")
    K = rs.stiffness(rs.load(side)).K
    assert matrix_distance(K, rs.stiffness(rs.load(UR5, side=side)).K) == 0.0
    assert rs.load_linkage(side).name == "ur5"
    side.write_text(UR5_SIDE + "robot: ur6.urdf\n", encoding="utf-8")
    with pytest.raises(rs.FileError, match=r"robot: got 'ur6\.urdf', expected a file"):
        rs.load(side)


def test_parameters_of_a_side_file_take_other_values(arm, tmp_path):
    side = with_side(
        tmp_path,
        HEAD + "parameters: {k: 1e4 N m/rad}\ntool: tip\njoints: {shoulder: {stiffness: 2*k}}\n",
    )
    roles = [
        robot_of(arm, side, parameters).legs[0].chain.roles[0]
        for parameters in (None, {"k": "3e4 N m/rad"})
    ]
    assert roles == [rs.Actuated(2e4), rs.Actuated(6e4)]
    with pytest.raises(rs.InputError, match="kk"):
        rs.load(arm, {"kk": 3.0}, side=side)


def test_a_name_comes_before_patterns_and_the_first_pattern_counts(arm, tmp_path):
    side = HEAD + (
        'tool: tip\njoints: {"s*": {stiffness: 1e4}, "*": {stiffness: 2e4},'
        ' "sh*": {stiffness: 3e4},'
        " elbow: {stiffness: 4e4}}\n"
    )
    roles = robot_of(arm, with_side(tmp_path, side)).legs[0].chain.roles
    assert roles == (rs.Actuated(1e4), rs.Actuated(4e4, (-1.0, 2.0)))


def test_a_pattern_need_not_fit_joints_that_are_not_used(arm, tmp_path):
    """The fingers slide, beyond the tool; the mimic joint of the second one needs the first."""
    side = STIFF.replace("1e4", "20 kN m/rad")
    roles = robot_of(arm, with_side(tmp_path, side)).legs[0].chain.roles
    assert roles == (rs.Actuated(2e4), rs.Actuated(2e4, (-1.0, 2.0)))


def test_limits_of_the_description_are_kept_unless_others_are_given(arm, tmp_path):
    side = HEAD + "tool: tip\njoints: {elbow: {stiffness: 1, limits: [-10 deg, 10 deg]}}\n"
    roles = robot_of(arm, with_side(tmp_path, side)).legs[0].chain.roles
    assert roles[0] == rs.Actuated()
    assert roles[1] == rs.Actuated(1.0, (np.radians(-10), np.radians(10)))


def test_a_joint_that_follows_one_outside_of_the_chain_is_held_by_its_drive(arm, tmp_path):
    """q = 2 g + 0.01, so that a drive of k at g is one of k / 4 at q."""
    assert robot_of(arm, with_side(tmp_path, STIFF)).legs[0].chain.size == 2
    tool = STIFF.replace("tool: tip", "tool: other finger")
    robot = robot_of(arm, with_side(tmp_path, tool + "home: {grip: 20 mm}\n"))
    assert robot.legs[0].chain.roles[2] == rs.Actuated(2.5e3)
    assert robot.legs[0].chain.home.tolist() == [0, 0, pytest.approx(0.05)]
    decided = tool.replace('joints: {"*"', 'joints: {grip 2: {role: locked}, "*"')
    robot = robot_of(arm, with_side(tmp_path, decided + "home: {grip: 20 mm}\n"))
    assert robot.legs[0].chain.home.tolist() == [0, 0, pytest.approx(0.05)]
    assert robot.legs[0].chain.roles[2] == rs.Locked()
    driven = tool.replace('joints: {"*"', 'joints: {grip 2: {stiffness: 2e5}, "*"')
    assert robot_of(arm, with_side(tmp_path, driven)).legs[0].chain.roles[2] == rs.Actuated(2e5)


def test_joints_that_follow_one_another_in_a_circle_are_refused(arm, tmp_path):
    circle = ARM.replace(
        '<axis xyz="1 0 0"/></joint>', '<axis xyz="1 0 0"/><mimic joint="grip 2"/></joint>'
    )
    arm.write_text(circle, encoding="utf-8")
    tool = STIFF.replace("tool: tip", "tool: other finger")
    with pytest.raises(rs.FileError, match=r"'grip 2'.*does not follow it in turn"):
        rs.load(arm, side=with_side(tmp_path, tool))


@needs_examples
@pytest.mark.needs("pinocchio")
def test_fingers_of_romeo_follow_its_hand(tmp_path):
    """Rigid fingers: C = t t^T / k with the columns of Pinocchio."""
    pin = import_module("pinocchio")

    side = with_side(
        tmp_path,
        HEAD + "base: l_wrist\ntool: LFinger13Link\njoints: {LHand: {stiffness: 12}}\n"
        "home: {LHand: 0.3}\n",
    )
    C = rs.compliance(robot_of(ROMEO, side))
    model = pin.buildModelFromUrdf(str(ROMEO))
    data, q = model.createData(), pin.neutral(model)
    joints = [model.joints[model.getJointId(n)] for n in ("LHand", "LFinger12", "LFinger13")]
    for joint in joints:
        q[joint.idx_q] = 0.3
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    frame, wrist = (model.getFrameId(name) for name in ("LFinger13Link", "l_wrist"))
    J = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
    t = J[:, sorted({joint.idx_v for joint in joints})].sum(axis=1)
    t = np.kron(np.eye(2), data.oMf[wrist].rotation.T) @ t
    assert matrix_distance(C, np.outer(t, t) / 12) < 1e-12


def test_a_link_leads_from_its_joint_to_the_next(arm, tmp_path):
    beam = "{type: beam, material: steel, section: {circle: {diameter: 20 mm}}}"
    side = STIFF + f"links: {{upper: {beam}, lower: {beam}}}\n"
    elements = robot_of(arm, with_side(tmp_path, side)).legs[0].chain.elements
    ends = [element.to.tolist() for element in elements if isinstance(element, rs.Link)]
    assert ends == [[0, 0, 0.4], [0, 0, 0.3]]


def test_a_link_can_be_a_matrix_and_the_last_one_leads_to_the_tool(arm, tmp_path):
    side = HEAD + (
        "tool: {link: lower, at: [0, 0, 250 mm]}\n"
        "links:\n  lower: {type: link, compliance: [1e-8, 1e-8, 1e-8, 1e-6, 1e-6, 1e-6]}\n"
        "joints: {shoulder: {role: locked}, elbow: {role: locked}}\n"
    )
    robot = robot_of(arm, with_side(tmp_path, side))
    C = rs.compliance(robot)
    assert np.allclose(C, np.diag([1e-8] * 3 + [1e-6] * 3), atol=1e-20)
    assert np.allclose(rs.stiffness(robot).reference_point, [0, 0, 0.65], atol=1e-15)


def test_frames_of_platform_and_tool_may_differ(arm, tmp_path):
    side = STIFF.replace("tool: tip", "platform: lower\ntool: {link: tip, at: [0, 0, 50 mm]}")
    robot = robot_of(arm, with_side(tmp_path, side))
    assert robot.reference_point.tolist() == pytest.approx([0, 0, 0.35])
    assert rs.find_posture(robot).pose[0, 2] == pytest.approx(0.4)


def test_floating_and_planar_joints(arm, tmp_path):
    floating = ARM.replace('"shoulder" type="continuous"', '"shoulder" type="floating"')
    arm.write_text(floating, encoding="utf-8")
    with pytest.raises(
        rs.FileError, match="connected with others; floating joints connect nothing"
    ):
        rs.load(arm, side=with_side(tmp_path, STIFF))
    locked = STIFF.replace('joints: {"*"', 'joints: {shoulder: {role: locked}, "*"')
    chain = robot_of(arm, with_side(tmp_path, locked)).legs[0].chain
    assert [joint.name for joint, _ in chain.moving] == ["elbow"]
    side = STIFF.replace('joints: {"*"', 'joints: {shoulder: {stiffness: 1}, "*"')
    with pytest.raises(rs.FileError, match=r"stiffness of the floating joint.*role: locked"):
        rs.load(arm, side=with_side(tmp_path, side))
    arm.write_text(ARM.replace('"shoulder" type="continuous"', '"shoulder" type="planar"'))
    planar = STIFF.replace('joints: {"*"', 'joints: {shoulder: {role: passive}, "*"')
    robot = robot_of(arm, with_side(tmp_path, planar))
    assert robot.legs[0].chain.size == 4
    assert rs.stiffness(robot).rank == 3
