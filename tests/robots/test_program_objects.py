"""Objects of other programs are the robots of their files."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from tests.files import text_of

EXAMPLES = Path(__file__).parents[2] / "examples"
SIDE = EXAMPLES / "ur5.stiffness.yaml"


def urdf_of_yourdfpy():
    yourdfpy = pytest.importorskip("yourdfpy")
    file = EXAMPLES / "ur5.urdf"
    return yourdfpy.URDF.load(file, build_scene_graph=False, load_meshes=False)


def model_of_pinocchio():
    pinocchio = import_module("pinocchio")

    return pinocchio.buildModelFromUrdf(str(EXAMPLES / "ur5.urdf"))


def model_of_mujoco(text: str):
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_string(text)
    spec.compiler.boundmass = spec.compiler.boundinertia = 1.0  # bodies of the example have none
    return spec.compile()


@pytest.mark.parametrize(
    "make",
    [urdf_of_yourdfpy, pytest.param(model_of_pinocchio, marks=pytest.mark.needs("pinocchio"))],
)
def test_urdf_as_an_object(make):
    from_file = rs.load(EXAMPLES / "ur5.urdf")
    robot = rs.load(make(), side=SIDE)
    assert robot.name == "ur5"
    assert robot.legs[0].chain.coordinate_names == from_file.legs[0].chain.coordinate_names
    assert robot.legs[0].chain.roles == from_file.legs[0].chain.roles
    for q in np.random.default_rng(5).uniform(-2, 2, (3, 6)):
        at = rs.JointCoordinates(q)
        own, expected = rs.stiffness(robot, at), rs.stiffness(from_file, at)
        np.testing.assert_allclose(own.pose, expected.pose, atol=1e-12)
        np.testing.assert_allclose(own.compliance, expected.compliance, rtol=1e-9, atol=1e-16)


def test_mujoco_model_with_loops():
    """The example is a file that MuJoCo takes as it is, and whose loop stays closed there."""
    mujoco = pytest.importorskip("mujoco")
    file, side = EXAMPLES / "four-bar.xml", EXAMPLES / "four-bar.stiffness.yaml"
    model = mujoco.MjModel.from_xml_path(str(file))
    robot, K = rs.load(model, side=side), rs.stiffness(rs.load(file)).K
    np.testing.assert_allclose(rs.stiffness(robot).K, K, rtol=1e-12)
    linkage = rs.load_linkage(model, side=side)
    found = rs.compliance(linkage, {"crank": 0.3})
    expected = rs.compliance(rs.load_linkage(file), {"crank": 0.3})
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0  # N m
    mujoco.mj_step(model, data, 100)
    assert np.abs(data.qpos).max() > 0.01
    assert np.abs(data.efc_pos).max() < 1e-3


ARM = text_of("arm.xml")
ARM_SIDE = """
robostiff: 1
source: an example
tool: {link: tip}
joints: {shoulder: {stiffness: 1e4 N m/rad}, slide: {stiffness: 1e6 N/m}}
"""


def test_mujoco_model_of_an_arm(tmp_path):
    side, file = tmp_path / "arm.stiffness.yaml", tmp_path / "arm.xml"
    side.write_text(ARM_SIDE)
    file.write_text(ARM)
    robot, expected = rs.load(model_of_mujoco(ARM), side=side), rs.load(file)
    assert robot.legs[0].chain.roles == expected.legs[0].chain.roles
    at = rs.JointCoordinates([0.3, 0.2])
    # A shoulder of 1e4 N m/rad, 0.4 + 0.2 - 0.1 + 0.3 m away from the tip.
    across = rs.compliance(robot, at)[4, 4], rs.compliance(expected, at)[4, 4]
    assert across == pytest.approx((1e-4, 1e-4))
    reach = np.hypot(rs.compliance(robot, at)[0, 4], rs.compliance(robot, at)[2, 4]) / 1e-4
    assert reach == pytest.approx(0.8)


@pytest.mark.needs("pinocchio")
def test_pinocchio_joints_of_all_kinds(tmp_path):
    pin = import_module("pinocchio")

    model = pin.Model()
    model.name = "arm"
    axis = np.array([0.6, 0, 0.8])
    placed = pin.SE3(np.eye(3), np.array([0, 0, 0.5]))
    joint = 0
    for name, own in (
        ("turn", pin.JointModelRevoluteUnaligned(axis)),
        ("slide", pin.JointModelPY()),
        ("endless", pin.JointModelRUBX()),
    ):
        joint = model.addJoint(joint, own, placed, name)
        before = model.addJointFrame(joint)
        model.addBodyFrame(f"after {name}", joint, pin.SE3.Identity(), before)
    model.addBodyFrame("tip", joint, pin.SE3(np.eye(3), np.array([0.2, 0, 0])), before)
    side = tmp_path / "side.yaml"
    side.write_text(
        "robostiff: 1\nsource: an example\ntool: {link: tip}\njoints:\n"
        "  slide: {stiffness: 1e6 N/m}\n  '*': {stiffness: 1e4 N m/rad}\n"
    )
    robot = rs.load(model, side=side)
    q = [0.4, 0.1, -0.7]
    data = model.createData()
    at = np.array([0.4, 0.1, np.cos(-0.7), np.sin(-0.7)])
    pin.forwardKinematics(model, data, at)
    pin.updateFramePlacements(model, data)
    J = pin.computeFrameJacobian(
        model, data, at, model.getFrameId("tip"), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    C = J @ np.diag([1e-4, 1e-6, 1e-4]) @ J.T
    np.testing.assert_allclose(
        rs.compliance(robot, rs.JointCoordinates(q)), C, rtol=1e-9, atol=1e-15
    )


@pytest.mark.needs("pinocchio")
def test_pinocchio_joint_without_counterpart():
    pin = import_module("pinocchio")

    model = pin.Model()
    model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "table")
    with pytest.raises(rs.FileError, match="joint 'table': got Translation, expected a rev"):
        rs.load(model, side=SIDE)


def test_objects_need_a_side_file():
    with pytest.raises(rs.InputError, match="a URDF of yourdfpy: got no side file, expected side="):
        rs.load(urdf_of_yourdfpy())


def test_objects_have_no_symbols():
    with pytest.raises(rs.InputError, match="the dimensions of a robot description are decimals"):
        rs.load(urdf_of_yourdfpy(), side=SIDE, symbols=("a",))


MIMIC = """<robot name="g"><link name="b"/><link name="a"/><link name="c"/>
<joint name="j" type="revolute"><parent link="b"/><child link="a"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="k" type="{}"><parent link="a"/><child link="c"/><origin xyz="0.5 0 0"/>
<axis xyz="0 0.6 0.8"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
<mimic joint="j" multiplier="-2" offset="0.3"/></joint></robot>"""


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_mimic_joints_of_pinocchio_follow_as_in_the_urdf(kind, tmp_path):
    pinocchio = pytest.importorskip("pinocchio")
    text = MIMIC.format(kind)
    (tmp_path / "m.urdf").write_text(text)
    side = tmp_path / "s.yaml"
    side.write_text(
        "robostiff: 1\nsource: chosen here\ntool: {link: c, at: [0.1, 0.2, 0.3]}\n"
        "joints: {j: {stiffness: 100}}\nhome: {j: 0.2}\n"
    )
    wanted = rs.load(tmp_path / "m.urdf", side=side)
    robot = rs.load(pinocchio.buildModelFromXML(text, mimic=True), side=side)
    assert robot.legs[0].chain.home == pytest.approx(wanted.legs[0].chain.home)
    C = rs.compliance(robot)
    assert np.linalg.matrix_rank(C) == 1
    assert C == pytest.approx(rs.compliance(wanted), rel=1e-12, abs=1e-15)
