"""Stiffness of arms from URDF, against eq. (7) with Jacobians of pinocchio, and networks."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from tests.io.urdf.examples import (
    PANDA,
    TALOS,
    UR5,
    UR5_JOINTS,
    UR5_SIDE,
    matrix_distance,
    needs_examples,
    pinocchio_model,
    robot_of,
    with_side,
)

# Talos has a differential in its torso, and the Panda a stiffness that nothing reads.
pytestmark = [
    needs_examples,
    pytest.mark.filterwarnings(
        "ignore:.*(transmissions that connect several joints|K in <dynamics>)"
        ":robostiff.errors.PlausibilityWarning"
    ),
]


def _saddle_point(C, J_q):
    """K by eq. (7): the upper left block of [[C, J_q], [J_q^T, 0]]^-1."""
    n = J_q.shape[1]
    S = np.block([[C, J_q], [J_q.T, np.zeros((n, n))]])
    return np.linalg.inv(S)[:6, :6]


def _pinocchio_jacobian(path, values, tool, at):
    """J of all joints in `values` about a point of the tool, world axes (6, n)."""
    pin, model, data = pinocchio_model(path)
    q = pin.neutral(model)
    for name, value in values.items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    frame = pin.Frame(
        "tip",
        model.frames[model.getFrameId(tool)].parentJoint,
        model.frames[model.getFrameId(tool)].placement * pin.SE3(np.eye(3), np.array(at)),
        pin.FrameType.OP_FRAME,
    )
    tip = model.addFrame(frame)
    data = model.createData()
    J = pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL_WORLD_ALIGNED)
    return J[:, [model.joints[model.getJointId(name)].idx_v for name in values]]


@pytest.mark.needs("pinocchio")
@pytest.mark.parametrize("seed", range(4))
def test_ur5_is_eq_7_with_the_jacobian_of_pinocchio(seed, tmp_path):
    robot = robot_of(UR5, with_side(tmp_path, UR5_SIDE))
    q = np.random.default_rng(seed).uniform(-2.5, 2.5, 6)
    J = _pinocchio_jacobian(UR5, dict(zip(UR5_JOINTS, q, strict=True)), "tool0", [0, 0, 0.12])
    C = J @ np.diag(1 / np.array([3e4, 3e4, 3e4, 5e3, 5e3, 5e3])) @ J.T
    K = rs.stiffness(robot, rs.JointCoordinates(q)).K
    assert matrix_distance(K, _saddle_point(C, np.zeros((6, 0)))) < 1e-9


@pytest.mark.needs("pinocchio")
def test_ur5_with_a_passive_joint_is_eq_7(tmp_path):
    side = UR5_SIDE.replace("wrist_*:", "wrist_2_joint: {role: passive}\n  wrist_*:")
    robot = robot_of(UR5, with_side(tmp_path, side))
    q = np.array([0.3, -1.0, 1.4, 0.2, 0.8, -0.5])
    J = _pinocchio_jacobian(UR5, dict(zip(UR5_JOINTS, q, strict=True)), "tool0", [0, 0, 0.12])
    k = np.array([3e4, 3e4, 3e4, 5e3, np.inf, 5e3])
    result = rs.stiffness(robot, rs.JointCoordinates(q))
    # rank(J_theta) = 5: the sixth compliance of eq. (7) is the passive joint's own.
    K = _saddle_point(J @ np.diag(1 / k) @ J.T, J[:, 4:5])
    assert result.rank == 5
    assert matrix_distance(result.K, K) < 1e-9


@pytest.mark.parametrize(
    ("path", "base", "tool"),
    [
        pytest.param(PANDA, "panda_link0", "panda_hand", id="panda"),
        pytest.param(TALOS, "base_link", "left_sole_link", id="talos-leg"),
        pytest.param(TALOS, "right_sole_link", "torso_1_link", id="talos-on-one-leg"),
    ],
)
def test_arms_with_elastic_links_are_what_their_networks_are(path, base, tool, tmp_path):
    thigh = "leg_left_4_link" if base == "base_link" else "leg_right_4_link"
    beam = "{type: beam, material: aluminium, section: {circle: {diameter: 60 mm}}}"
    link = "panda_link3" if path == PANDA else thigh
    side = f"""
robostiff: 1
source: chosen here
base: {base}
tool: {{link: {tool}, at: [10 mm, 20 mm, 30 mm]}}
joints: {{"*": {{stiffness: 2e4}}}}
links: {{{link}: {beam}}}
"""
    file = with_side(tmp_path, side)
    robot = robot_of(path, file)
    names = [joint.name for joint, _ in robot.legs[0].chain.moving]
    q = np.random.default_rng(5).uniform(-1, 1, len(names))
    result = rs.stiffness(robot, rs.JointCoordinates(q))
    network = rs.network_at(rs.load_linkage(path, side=file), dict(zip(names, q, strict=True)))
    assert network.springs
    assert np.allclose(network.reference_point, result.reference_point, atol=1e-12)
    assert matrix_distance(rs.stiffness(network).K, result.K) < 1e-9


def test_base_and_platform_exchanged_give_the_same_stiffness_about_one_point(tmp_path):
    """What the sole feels against the pelvis is what the pelvis feels against the sole."""
    side = """
robostiff: 1
source: chosen here
base: {base}
tool: {tool}
joints: {{"*": {{stiffness: 2e4}}}}
links:
  leg_left_4_link:
    type: beam
    material: steel
    y_axis: x
    section: {{rectangle: {{width_y: 60 mm, height_z: 30 mm}}}}
"""
    down_side = side.format(base="base_link", tool="left_sole_link")
    one = robot_of(TALOS, with_side(tmp_path, down_side))
    q = np.array([0.1, -0.2, -0.4, 0.8, -0.3, 0.15])
    down = rs.stiffness(one, rs.JointCoordinates(q))
    other = robot_of(
        TALOS, with_side(tmp_path, side.format(base="left_sole_link", tool="base_link"))
    )
    posture = rs.find_posture(one, rs.JointCoordinates(q))
    R = Rotation.from_rotvec(posture.pose[0, 3:]).as_matrix()
    up = rs.stiffness(other, rs.JointCoordinates(q[::-1]), at=[0, 0, 0])
    # About the sole's origin, in the axes of the sole: `up` is given in those axes already.
    B = np.kron(np.eye(2), R)
    assert matrix_distance(B @ up.K @ B.T, down.K) < 1e-9
