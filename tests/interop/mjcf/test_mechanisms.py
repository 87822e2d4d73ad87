"""Mechanisms from MJCF, against the same ones as model files, and MuJoCo's own kinematics."""

from typing import Any

import mujoco as _mujoco
import numpy as np
import pytest

import robostiff as rs
from robostiff.linkage import close
from tests.files import FILES, text_of
from tests.io.urdf.examples import matrix_distance, robot_of

mujoco: Any = _mujoco  # a module in C without annotations

FOUR_BAR = text_of("four-bar.xml")
FOUR_BAR_SIDE = text_of("four-bar.stiffness.yaml")


def _written(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def _loaded(folder, mjcf, side):
    return robot_of(_written(folder, "m.xml", mjcf), _written(folder, "side.yaml", side))


def test_a_four_bar_is_that_of_a_model_file(tmp_path):
    robot = _loaded(tmp_path, FOUR_BAR, FOUR_BAR_SIDE)
    written = rs.load(FILES / "four-bar.yaml")
    assert [leg.chain.size for leg in robot.legs] == [2, 4]
    result, wanted = rs.stiffness(robot), rs.stiffness(written)
    assert result.rank == wanted.rank
    assert matrix_distance(result.K, wanted.K) < 1e-9
    assert rs.verify(robot).agree


def test_a_four_bar_moves_as_in_mujoco(tmp_path):
    """Positions that MuJoCo's own constraint calls closed."""
    path = _written(
        tmp_path, "m.xml", FOUR_BAR.replace('<geom type="mesh" mesh="shell" mass="0"/>', "")
    )
    side = _written(tmp_path, "side.yaml", FOUR_BAR_SIDE)
    found = close(rs.load_linkage(path, side=side), {"crank": 0.4})
    assert found.is_closed
    spec = mujoco.MjSpec.from_file(str(path))
    for mesh in spec.meshes:
        spec.delete(mesh)
    spec.compiler.boundmass = spec.compiler.boundinertia = 1.0
    model = spec.compile()
    data = mujoco.MjData(model)
    for name in ("crank", "knee", "rocker"):
        data.joint(name).qpos[:] = found.coordinates[name]
    mujoco.mj_forward(model, data)
    assert data.ne == 3
    assert np.abs(data.efc_pos[:3]).max() < 1e-9
    tip = found.frames["coupler"].p + found.frames["coupler"].R @ [0.2, 0, 0.1]
    assert np.allclose(data.site("tip").xpos, tip, atol=1e-12)


ARM = """
<body name="{name} upper" pos="{x} 0 0" euler="0 0 {turn}">
  <joint name="{name} yaw" axis="0 0 1"/>
  <body name="{name} lower" pos="0.3 0 0.1">
    <joint name="{name} pitch" axis="0 1 0" pos="0.02 0 0.01"/>
    <body name="{name} hand" pos="0.2 0 0.2">
      <joint name="{name} slide" type="slide" axis="0 0 1"/>
      <joint name="{name} wrist" type="ball"/>
      {content}
    </body>
  </body>
</body>
"""
TWO_ARMS = (
    '<mujoco model="two arms"><worldbody>'
    + ARM.format(name="left", x=0, turn=0, content='<site name="grasp" pos="0.1 0 0"/>')
    + ARM.format(name="right", x=1.2, turn=180, content='<site name="grasp2" pos="0.1 0 0"/>')
    + "</worldbody><equality><weld site1='grasp' site2='grasp2'/></equality></mujoco>"
)
TWO_ARMS_SIDE = text_of("two-arms.stiffness.yaml")


def test_a_welded_pair_of_arms_is_the_sum_of_both(tmp_path):
    robot = _loaded(tmp_path, TWO_ARMS, TWO_ARMS_SIDE)
    assert [leg.chain.size for leg in robot.legs] == [6, 6]
    result = rs.stiffness(robot)
    assert result.rank == 6
    total = np.zeros((6, 6))
    for leg in robot.legs:
        arm = rs.Robot("arm", (leg,), home=robot.home, reference_point=robot.reference_point)
        total += rs.stiffness(arm).K
    assert matrix_distance(result.K, total) < 1e-9
    assert rs.verify(robot).agree


def test_arms_with_several_joints_on_a_body_stand_as_in_mujoco(tmp_path):
    mjcf = TWO_ARMS.split("<equality>")[0] + "</mujoco>"
    robot = _loaded(tmp_path, mjcf, TWO_ARMS_SIDE)
    (leg,) = robot.legs
    assert leg.chain.size == 6
    q = np.array([0.3, -0.4, 0.05, 0.1, 0.2, -0.3])
    posture = rs.find_posture(robot, rs.JointCoordinates(q))
    spec = mujoco.MjSpec.from_string(mjcf)
    spec.compiler.boundmass = spec.compiler.boundinertia = 1.0
    model = spec.compile()
    data = mujoco.MjData(model)
    for name, value in zip(("yaw", "pitch", "slide"), q[:3], strict=True):
        data.joint(f"left {name}").qpos[:] = value
    angle = np.linalg.norm(q[3:])
    quaternion = [np.cos(angle / 2), *(np.sin(angle / 2) * q[3:] / angle)]
    data.joint("left wrist").qpos[:] = quaternion
    mujoco.mj_forward(model, data)
    assert np.allclose(posture.pose[0, :3], data.site("grasp").xpos, atol=1e-12)


def test_reference_coordinates_of_joints_are_kept(tmp_path):
    mjcf = """
<mujoco><compiler angle="radian"/><worldbody><body name="arm" pos="0 0 1">
  <joint name="turn" axis="0 1 0" ref="0.4"/>
  <joint name="slide" type="slide" axis="1 0 0" ref="0.1"/>
  <site name="tip" pos="0.5 0 0"/></body></worldbody></mujoco>
"""
    side = 'robostiff: 1\nsource: chosen here\ntool: tip\njoints: {"*": {stiffness: 1e4}}\n'
    robot = _loaded(tmp_path, mjcf, side)
    assert robot.legs[0].chain.home.tolist() == pytest.approx([0.4, 0.1])
    assert np.allclose(rs.find_posture(robot).pose[0], [0.5, 0, 1, 0, 0, 0], atol=1e-15)


def test_roles_that_mjcf_tells(tmp_path):
    """Joints without actuator are passive; those with a stiffness are springs."""
    sprung = FOUR_BAR.replace('<joint name="knee"', '<joint name="knee" stiffness="70"')
    side = FOUR_BAR_SIDE.replace("joints: {crank: {stiffness: 4e3 N m/rad}}\n", "")
    robot = _loaded(tmp_path, sprung, side)
    roles = {joint.name: joint.role for leg in robot.legs for joint, _ in leg.chain.moving}
    assert roles["crank"] == rs.Actuated()
    assert roles["knee"] == rs.Actuated(70.0)
    assert roles["rocker"] == rs.Passive()
    assert roles["ball"] == rs.Passive()


def test_a_platform_that_floats_and_is_connected_to_legs(tmp_path):
    """Three struts of MJCF hold a free body by connect: a parallel robot."""
    legs, loops = "", ""
    for i in range(3):
        x, y = np.cos(2.1 * i), np.sin(2.1 * i)
        legs += f"""<body name="foot{i}" pos="{x} {y} 0"><joint name="a{i}" axis="{-y} {x} 0"/>
          <body name="rod{i}"><joint name="slide{i}" type="slide" axis="0 0 1"/></body></body>"""
        loops += f"<connect name='ball{i}' body1='rod{i}' body2='table' anchor='0 0 1'/>"
    mjcf = f"""<mujoco><worldbody>{legs}<body name="table" pos="0 0 1"><freejoint/></body>
      </worldbody><equality>{loops}</equality></mujoco>"""
    side = """
robostiff: 1
source: chosen here
platform: table
joints: {"slide?": {role: actuated, stiffness: 1e7 N/m}}
links:
"""
    for i in range(3):
        side += (
            f"  rod{i}: {{type: beam, material: steel, section: {{circle: {{diameter: 0.03}}}}}}\n"
        )
    robot = _loaded(tmp_path, mjcf, side)
    assert [leg.chain.size for leg in robot.legs] == [5, 5, 5]
    assert {c.value for c in robot.coordinates} == {"z", "rx", "ry"}
    network = rs.network_at(rs.load_linkage(tmp_path / "m.xml", side=tmp_path / "side.yaml"))
    assert matrix_distance(rs.stiffness(network).K, rs.stiffness(robot).K) < 1e-9


def test_whatever_draws_touches_or_senses_is_left_out(tmp_path):
    """As in the files that come with robots: assets that are not there, tendons, sensors, keys."""
    dressed = FOUR_BAR.replace(
        "<worldbody>",
        """
  <asset><texture name="t" type="2d" file="t.png"/><material name="m" texture="t"/>
    <hfield name="hills" file="hills.png" size="1 1 1 1"/></asset>
  <default><geom material="m"/><default class="shell"><geom type="mesh" mesh="shell"/></default>
  </default>
  <worldbody><geom name="floor" type="hfield" hfield="hills"/><light/><camera name="c"/>""",
    ).replace(
        "</equality>",
        """</equality>
  <contact><exclude body1="crank" body2="rocker"/></contact>
  <tendon><spatial name="rope"><site site="tip"/><site site="tip2"/></spatial>
    <fixed name="both"><joint joint="crank" coef="1"/></fixed></tendon>
  <sensor><framepos objtype="site" objname="tip"/><touch site="tip"/></sensor>
  <keyframe><key name="home" qpos="0.1 0 0"/></keyframe>""",
    )
    dressed = dressed.replace(
        '<site name="tip" ', '<geom class="shell"/><site name="tip2"/><site name="tip" '
    ).replace("</actuator>", '<motor tendon="both"/><general site="tip"/></actuator>')
    with pytest.warns(rs.PlausibilityWarning) as caught:
        robot = _loaded(tmp_path, dressed, FOUR_BAR_SIDE)
    said = [str(warning.message).rpartition("not read: ")[2] for warning in caught]
    assert said == [
        "tendons both; nothing stands in their place",
        "drives of sites or bodies without a name; nothing stands in their place",
        "the masses of meshes of coupler; bodies have those of other shapes",
        "keyframes home; write its coordinates under home: in the side file",
    ]
    plain = _loaded(tmp_path, FOUR_BAR, FOUR_BAR_SIDE)
    assert matrix_distance(rs.stiffness(robot).K, rs.stiffness(plain).K) == 0.0


def test_equalities_that_are_no_loops(tmp_path):
    coupled = '<equality><joint joint1="rocker" joint2="crank" polycoef="0.1 {} 0 0"/>'
    quadratic = FOUR_BAR.replace("<equality>", coupled.format("1 2"))
    with pytest.raises(rs.FileError, match="degree two or more"):
        _loaded(tmp_path, quadratic, FOUR_BAR_SIDE)
    linear = FOUR_BAR.replace("<equality>", coupled.format("-2 0"))
    with pytest.raises(rs.FileError, match=r"'rocker'.*of different legs, one of which follows"):
        _loaded(tmp_path, linear, FOUR_BAR_SIDE)
    inactive = linear.replace("<joint joint1", '<joint active="false" joint1')
    assert _loaded(tmp_path, inactive, FOUR_BAR_SIDE).legs[1].chain.roles[0] == rs.Passive()


FINGER = """<mujoco><worldbody><body name="palm"><body name="near" pos="0 0 0.1">
  <joint name="mcp" axis="0 1 0"/><body name="far" pos="0 0 0.05"><joint name="pip" axis="0 1 0"/>
  <site name="tip" pos="0 0 0.04"/></body></body></body></worldbody>
  <equality><joint joint1="pip" joint2="mcp" polycoef="0.1 0.7 0 0 0"/></equality>
  <actuator><motor joint="mcp"/></actuator></mujoco>"""


def test_a_joint_equality_couples_joints(tmp_path):
    """Rigid links: C = t t^T / k, t the motion of the tip while both joints turn."""
    side = "robostiff: 1\nsource: chosen here\ntool: tip\njoints: {mcp: {stiffness: 20}}\n"
    robot = _loaded(tmp_path, FINGER, side + "home: {mcp: 0.2}\n")
    (leg,) = robot.legs
    assert leg.chain.joint_coordinates(leg.chain.home) == pytest.approx([0.2, 0.24])
    a, b = 0.2, 0.44
    near = np.array([0.05 * np.cos(a), 0, -0.05 * np.sin(a)])
    far = np.array([0.04 * np.cos(b), 0, -0.04 * np.sin(b)])
    t = np.concatenate([near + far + 0.7 * far, [0, 1.7, 0]])
    assert rs.compliance(robot) == pytest.approx(np.outer(t, t) / 20, abs=1e-12)


# Two arms of three and five joints, whose ends a weld connects.
WELDED = """<mujoco><compiler angle="radian"/><default><joint stiffness="70"/></default><worldbody>
<body name="a"><joint axis="0 1 0"/><joint axis="1 0 0" pos="0 0 1"/><joint axis="1 1 0"/>
 <site name="one" pos="0.5 0.1 0" euler="0.3 -0.4 0.2"/><geom size="0.1"/></body>
<body name="b" pos="1 0 0" euler="0 0 1.5707963267948966"><joint axis="0 0 1"/>
 <joint axis="1 0 0" pos="0 0 0.2" stiffness="300"/><joint axis="0 1 0" pos="0.3 0 0"/>
 <joint type="slide" stiffness="900"/><joint axis="0 1 1"/>
 <site name="other" pos="0.1 0.5 0"/><site name="tip" pos="0.2 0.1 0.3"/><geom size="0.1"/></body>
</worldbody><equality><weld {}/></equality></mujoco>"""
ANCHORED = "body1='a' body2='b' anchor='0.2 -0.1 0.3'"


@pytest.mark.parametrize(
    "weld",
    [
        pytest.param("body1='a' body2='b'", id="origins"),
        pytest.param(ANCHORED, id="a point beside both"),
        pytest.param(f"{ANCHORED} torquescale='0'", id="no torque"),
        pytest.param("site1='one' site2='other' torquescale='0'", id="sites without torque"),
    ],
)
def test_a_weld_connects_what_that_of_mujoco_connects(weld, tmp_path):
    """Least energy of the springs over the motions that MuJoCo's own constraint leaves."""
    mjcf = WELDED.format(weld)
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    _, sizes, rows = np.linalg.svd(data.efc_J.reshape(-1, model.nv)[: data.ne])
    free = rows[np.sum(sizes > 1e-9) :].T
    J = np.zeros((6, model.nv))
    mujoco.mj_jacSite(model, data, J[:3], J[3:], model.site("tip").id)
    k = np.diag([float(np.ravel(model.joint(i).stiffness)[0]) for i in range(model.njnt)])
    C = J @ free @ np.linalg.inv(free.T @ k @ free) @ free.T @ J.T
    robot = _loaded(tmp_path, mjcf, "robostiff: 1\nsource: chosen here\ntool: tip\n")
    assert np.allclose(rs.compliance(robot), C, rtol=0, atol=1e-10 * np.abs(C).max())


def test_a_loop_may_have_the_name_of_a_joint(tmp_path):
    """MuJoCo counts names of each kind by themselves."""
    plain = _loaded(tmp_path, FOUR_BAR, FOUR_BAR_SIDE)
    name = 'connect name="ball"'
    assert name in FOUR_BAR
    for other in ("crank", "knee"):
        named = FOUR_BAR.replace(name, f'connect name="{other}"')
        robot = _loaded(tmp_path, named, FOUR_BAR_SIDE)
        assert matrix_distance(rs.stiffness(robot).K, rs.stiffness(plain).K) < 1e-12


def test_names_that_are_missing_or_twice_are_made(tmp_path):
    mjcf = """<mujoco><worldbody><body><joint/><joint axis="1 0 0"/><site name="tool"/>
      <body name="tool" pos="0 0 1"><joint/><site pos="0 0 1"/></body></body></worldbody>
      </mujoco>"""
    side = 'robostiff: 1\nsource: x\ntool: {}\njoints: {{"*": {{stiffness: 1e3}}}}\n'
    for tool, joints in (("tool", 3), ("tool site", 2), ("site2", 3), ("body1", 2)):
        assert _loaded(tmp_path, mjcf, side.format(tool)).legs[0].chain.size == joints
