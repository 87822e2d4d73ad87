"""Loops and springs that simulators read in a URDF, against those of side files."""

import warnings

import numpy as np
import pytest

import robostiff as rs
from tests.files import text_of

# A square of four bars, drawn closed.
BAR = """<joint name="{0}_to_{1}" type="continuous"><axis xyz="1 0 0"/><parent link="e{1}"/>
<child link="e{0}"/><origin xyz="0 -0.7 0" rpy="-1.5707963267948966 0 0"/></joint>"""
LINKS = "".join(f'<link name="{name}"/>' for name in ("world", "e1", "e2", "e3", "e4"))
SQUARE = (
    f'<robot name="sq">{LINKS}<joint name="1_to_world" type="fixed"><parent link="world"/>'
    '<child link="e1"/><origin xyz="0 0.35 0.35"/></joint>'
    + "".join(BAR.format(i, i - 1) for i in (2, 3, 4))
    + "{}</robot>"
)
SIDE = text_of("square.stiffness.yaml")
GAZEBO = "<gazebo><joint name='c' type='{}'><child>e1</child><parent>e4</parent>{}</joint></gazebo>"
X_AXIS = "<axis><xyz>1 0 0</xyz></axis>"
ENDS = '<link1 link="e4" xyz="0 -0.7 0"{}/><link2 link="e1"/>'
CONSTRAINT = """<constraint name="c" type="{}"><parent link="e4"/><child link="e1"/>
<parent_origin xyz="0 -0.7 0" rpy="0 0 0"/><parent_axis xyz="1 0 0"/>
<child_origin xyz="0 0 0"/><child_axis xyz="{}"/></constraint>"""


def _loaded(folder, urdf, side):
    """What is loaded, and the warnings."""
    (folder / "m.urdf").write_text(urdf, encoding="utf-8")
    (folder / "s.yaml").write_text(side, encoding="utf-8")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", rs.PlausibilityWarning)
        robot = rs.load(folder / "m.urdf", side=folder / "s.yaml")
    return robot, [str(warning.message) for warning in caught]


END = "{link: e4, at: [0, -0.7, 0]}, e1"


def _of_side_file(folder, joint, ends):
    loop = f"loops: [{{name: c, between: [{ends}], joint: {joint}}}]"
    robot, said = _loaded(folder, SQUARE.format(""), SIDE.replace("LOOP", "c") + loop)
    assert not said
    return rs.stiffness(robot)


HINGE = "{type: revolute, axis: x, role: passive}"


@pytest.mark.parametrize(
    ("written", "joint", "ends"),
    [
        (GAZEBO.format("revolute", X_AXIS), HINGE, END),
        (
            GAZEBO.format("revolute", f"<pose>0.1 0 0 0 0 0</pose>{X_AXIS}"),
            HINGE,
            "{link: e4, at: [0.1, -0.7, 0]}, {link: e1, at: [0.1, 0, 0]}",
        ),
        (  # about its z
            GAZEBO.format("revolute", "<pose>0 0 0 0 1.5707963267948966 0</pose>"), HINGE, END
        ),
        (GAZEBO.format("ball", ""), "spherical", END),
        (
            GAZEBO.format("fixed", ""),
            "fixed",
            "{link: e4, at: [0, -0.7, 0], turn: [{x: -90 deg}]}, e1",
        ),
        (
            GAZEBO.format(
                "revolute",
                "<axis><xyz>1 0 0</xyz><dynamics><spring_stiffness>500</spring_stiffness>"
                "</dynamics></axis>",
            ),
            "{type: revolute, axis: x, role: actuated, stiffness: 500 N m/rad}",
            END,
        ),
        (
            f'<loop_joint name="c" type="continuous">{ENDS.format("")}<axis xyz="1 0 0"/>'
            "</loop_joint>",
            HINGE,
            END,
        ),
        (f'<loop_joint name="c" type="ball">{ENDS.format("")}</loop_joint>', "spherical", END),
        (CONSTRAINT.format("revolute", "1 0 0"), HINGE, END),
        (CONSTRAINT.format("spherical", "0 1 0"), "spherical", END),
    ],
)  # fmt: skip
def test_a_loop_of_the_description_is_that_of_a_side_file(written, joint, ends, tmp_path):
    robot, said = _loaded(tmp_path, SQUARE.format(written), SIDE.replace("LOOP", "c"))
    assert not said
    result, wanted = rs.stiffness(robot), _of_side_file(tmp_path, joint, ends)
    assert result.rank == wanted.rank
    assert np.allclose(result.K, wanted.K, rtol=1e-9, atol=1e-9 * np.abs(wanted.K).max())


OPEN = SIDE[: SIDE.index("  e4")]


@pytest.mark.parametrize(
    "harmless",
    ['<transmission name="t"><joint name="2_to_1"/><actuator name="m"/></transmission>',
     '<gazebo reference="e2"><mu1>0.2</mu1></gazebo><gazebo><plugin name="p"/></gazebo>',
     '<gazebo reference="e2"><turnGravityOff>False</turnGravityOff><gravity>1</gravity></gazebo>',
     '<gazebo reference="2_to_1"><implicitSpringDamper>true</implicitSpringDamper></gazebo>',
     '<material name="red"/><ros2_control name="c" type="system"/><sensor name="s"/>'],
)  # fmt: skip
def test_what_holds_nothing_is_not_named(harmless, tmp_path):
    assert not _loaded(tmp_path, SQUARE.format(harmless), OPEN)[1]


def test_a_loop_in_both_files_is_named(tmp_path):
    loop = f"loops: [{{name: d, between: [{{link: e4, at: [0, -0.7, 0]}}, e1], joint: {HINGE}}}]"
    urdf = SQUARE.format(GAZEBO.format("revolute", X_AXIS))
    _, said = _loaded(tmp_path, urdf, SIDE.replace("LOOP", "c") + loop)
    assert any("links that 'c' of the description connects; both hold" in text for text in said)


ARM = """<robot name="g"><link name="b"/><link name="a"/><joint name="j" type="revolute">
<parent link="b"/><child link="a"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1"
velocity="1"/>{}</joint>{}</robot>"""
SPRING_OF_GAZEBO = '<gazebo reference="j"><springStiffness>500</springStiffness>{}</gazebo>'
TOOL = "robostiff: 1\nsource: chosen here\ntool: {link: a, at: [0.5, 0, 0]}\n"


@pytest.mark.parametrize(
    ("inside", "beside"),
    [("", SPRING_OF_GAZEBO.format("")),
     ('<dynamics damping="1" spring_stiffness="500" spring_reference="0"/>', ""),
     ("", SPRING_OF_GAZEBO.replace(">500</springStiffness>", ' value="500"/>').format("")),
     ('<dynamics spring_stiffness="500"/>', SPRING_OF_GAZEBO.format(""))],
)  # fmt: skip
def test_a_spring_acts_beside_the_drive(inside, beside, tmp_path):
    robot, said = _loaded(
        tmp_path, ARM.format(inside, beside), TOOL + "joints: {j: {stiffness: 1e3}}"
    )
    assert rs.compliance(robot)[4, 4] == pytest.approx(1 / 1500)
    assert len(said) == 1
    assert "springs j (500 N m/rad) act beside the stiffness in the side file" in said[0]
    robot, said = _loaded(
        tmp_path, ARM.format(inside, beside), TOOL + "joints: {j: {role: passive}}"
    )
    assert rs.compliance(robot)[4, 4] == pytest.approx(1 / 500)
    assert not said
    robot, said = _loaded(tmp_path, ARM.format(inside, beside), TOOL)
    assert rs.compliance(robot)[4, 4] == pytest.approx(1 / 500)
    assert "springs j (500 N m/rad) act alone" in said[0]


def test_springs_of_which_a_part_is_not_read(tmp_path):
    side = TOOL + "joints: {j: {role: passive}}"
    reference = SPRING_OF_GAZEBO.format("<springReference>0.3</springReference>")
    _, said = _loaded(tmp_path, ARM.format("", reference), side)
    assert "not read: the load at home of springs with a reference, j;" in said[0]
    twice = ARM.format('<dynamics spring_stiffness="70"/>', SPRING_OF_GAZEBO.format(""))
    robot, said = _loaded(tmp_path, twice, side)
    assert rs.compliance(robot)[4, 4] == pytest.approx(1 / 70)
    assert "not read: a second spring of j;" in said[0]


HELD = TOOL + "joints: {j: {stiffness: 10}}\n"


@pytest.mark.parametrize(
    ("inside", "words"),
    [('<orgin xyz="1 0 0"/>', "not read: <orgin> of j;"),
     ('<Origin xyz="1 0 0"/>', "not read: <Origin> of j;"),
     ('<origin xyz="0 0 0" rpv="1 0 0"/>', "not read: rpv in <origin> of j;"),
     ('<axis xyz="1 0 0"/>', "not read: a second <axis> of j;"),
     ('<drake:mimic joint="i" gear_ratio="3"/>', "not read: <drake:mimic> of j;"),
     ('<dynamics damping="1" K="700"/>', "not read: K in <dynamics> of j;"),
     ("<dynamics><stiffness>7</stiffness></dynamics>", "not read: <stiffness> in <dynamics> of j;"),
     ("<mimic><joint>i</joint></mimic>", "not read: <joint> in <mimic> of j;")],
)  # fmt: skip
def test_parts_of_a_joint_that_are_not_read_are_named(inside, words, tmp_path):
    _, said = _loaded(tmp_path, ARM.format(inside, ""), HELD)
    assert [words in text for text in said] == [True]


DRIVE = """<transmission name="t"><joint name="jj"/><actuator name="m">
<rotorInertia>1</rotorInertia></actuator></transmission>"""
BODY = '<mass value="2"/><inertia ixx="1" iyy="1" izz="1"/>'
FOLLOWER = {
    "ros2_control": '<ros2_control><joint name="j"><param name="mimic">i</param></joint>',
    "gazebo": "<gazebo><plugin><mimicJoint>j</mimicJoint><joint>i</joint></plugin>",
}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [("</robot>", SPRING_OF_GAZEBO.replace('"j"', '"jj"'), "springs of no joint, jj"),
     ("</robot>", DRIVE, "rotors of no joint, jj"),
     ("</robot>", DRIVE.replace(' name="jj"', ""), "rotors of no joint, without a name"),
     ('<axis xyz="0 1 0"/>', "<axis><xyz>0 1 0</xyz></axis>", "<xyz> in <axis> of j"),
     ('<axis xyz="0 1 0"/>', "<axis>0 1 0</axis>", "text in <axis> of j"),
     ('lower="-1" upper="1"', 'min="-1" max="1"', "min in <limit> of j"),
     ('"a"/>', '"a"><inertial><mass>2</mass></inertial></link>', "text in <mass> of a"),
     ("</robot>", FOLLOWER["ros2_control"] + "</ros2_control>",
      "joints that follow others by ros2_control or a plugin, j"),
     ("</robot>", '<gazebo reference="a"><turnGravityOff>true</turnGravityOff></gazebo>',
      "switches of weights (turnGravityOff, gravity) of a"),
     ("</robot>", '<gazebo reference="a"><turnGravityOff value="1"/></gazebo>',
      "switches of weights (turnGravityOff, gravity) of a"),
     ("</robot>", '<gazebo reference="a"><gravity>0</gravity></gazebo>',
      "switches of weights (turnGravityOff, gravity) of a"),
     ("</robot>", FOLLOWER["gazebo"] + "</gazebo>",
      "joints that follow others by ros2_control or a plugin, j"),
     ('"a"/>', f'"a"><Inertial>{BODY}</Inertial></link>', "<Inertial> of a"),
     ('"a"/>', f'"a"><intertial>{BODY}</intertial></link>', "<intertial> of a"),
     ('"a"/>', f'"a">{BODY}</link>', "<mass> of a"),
     ('"a"/>', f'"a">{2 * f"<inertial>{BODY}</inertial>"}</link>', "a second <inertial> of a")],
)  # fmt: skip
def test_springs_rotors_and_masses_out_of_place_are_named(old, new, words, tmp_path):
    new += old * (old == "</robot>")
    _, said = _loaded(tmp_path, ARM.format("", "").replace(old, new, 1), HELD)
    assert [f"not read: {words};" in text for text in said][:1] == [True]


def test_limits_of_which_one_is_left_out_or_that_are_reversed(tmp_path):
    urdf = ARM.format("", "").replace('lower="-1" upper="1"', "{}")
    robot, said = _loaded(tmp_path, urdf.format('lower="-1"'), HELD)
    assert robot.legs[0].chain.roles[0] == rs.Actuated(10, limits=(-1.0, 0.0))  # zero otherwise
    assert not said
    robot, said = _loaded(tmp_path, urdf.format('lower="1" upper="-2"'), HELD)
    assert robot.legs[0].chain.roles[0] == rs.Actuated(10)
    assert "limits of joint 'j', from 1 to -2: not read" in said[0]
    robot, said = _loaded(tmp_path, urdf.format('lower="-1e16" upper="1e16"'), HELD)
    assert robot.legs[0].chain.roles[0] == rs.Actuated(10)  # so some write that there are none
    assert not said
    robot, _ = _loaded(tmp_path, urdf.format('lower="-1e16" upper="2"'), HELD)
    assert robot.legs[0].chain.roles[0] == rs.Actuated(10, limits=(-1e16, 2.0))


def test_a_description_without_a_name_has_that_of_its_file(tmp_path):
    robot, said = _loaded(tmp_path, ARM.format("", "").replace('name="g"', ""), HELD)
    assert (robot.name, said) == ("m", [])


def test_an_origin_turned_by_a_quaternion(tmp_path):
    """Version 1.2 of URDF: a half turn about z, and lengths of quaternions do not matter."""
    origin = '<origin xyz="1 0 0" quat_xyzw="{}"{}/>'
    robot, said = _loaded(tmp_path, ARM.format(origin.format("0 0 2 0", ""), ""), HELD)
    assert np.allclose(rs.stiffness(robot).reference_point, [0.5, 0, 0])
    assert np.allclose(rs.stiffness(robot).pose, [1, 0, 0, 0, 0, np.pi])
    assert not said
    for quaternion, beside in (("0 0 0 0", ""), ("0 0 0 1", ' rpy="0 0 0"')):
        with pytest.raises(rs.FileError, match="quat_xyzw in the origin of joint 'j': got"):
            _loaded(tmp_path, ARM.format(origin.format(quaternion, beside), ""), HELD)


def test_names_with_brackets_are_no_patterns(tmp_path):
    """0.3 rad/(N m) of two joints in series of 10 and 5 N m/rad."""
    urdf = ARM.format("", "").replace('name="j"', 'name="finger[0]/base"')
    second = """<link name="tip"/><joint name="finger[0]/tip" type="revolute"><parent link="a"/>
    <child link="tip"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
    </joint></robot>"""
    side = "robostiff: 1\nsource: chosen here\ntool: tip\njoints:\n"
    names = '  "finger[0]/base": {stiffness: 10}\n  "finger[0]/tip": {stiffness: 5}\n'
    robot, _ = _loaded(tmp_path, urdf.replace("</robot>", second), side + names)
    assert rs.compliance(robot)[4, 4] == pytest.approx(0.3)
    patterns = '  "finger?0?/[a-t]*": {stiffness: 10}\n'
    robot, _ = _loaded(tmp_path, urdf.replace("</robot>", second), side + patterns)
    assert rs.compliance(robot)[4, 4] == pytest.approx(0.2)


def test_macros_that_are_not_expanded_are_named(tmp_path):
    _, said = _loaded(tmp_path, ARM.format("", '<xacro:arm n="2"/>'), HELD)
    words = "not read: <xacro:arm> (expanded in a file that is called .xacro)"
    assert [words in text for text in said] == [True]
    _, said = _loaded(tmp_path, ARM.format("", '<xacro:property name="n" value="2"/>'), HELD)
    assert not said
