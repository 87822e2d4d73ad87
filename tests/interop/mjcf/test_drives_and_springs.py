"""Stiffness that MJCF gives, what is not read, and references, on which no compliance depends."""

import json
import re
import warnings
from typing import Any

import mujoco as _mujoco
import numpy as np
import pytest

import robostiff as rs
from tests.io.urdf.examples import matrix_distance

mujoco: Any = _mujoco  # a module in C without annotations

ARM = """<mujoco>{head}<worldbody><body name="a"><joint name="j1" axis="0 1 0"{spring}/>
<geom size="0.01"/><body name="b" pos="0 0 1"><joint name="j2" axis="0 1 0"/>{body}
<geom size="0.01"/><site name="tip" pos="1 0 0"/></body></body></worldbody>
{foot}<actuator>{drives}</actuator></mujoco>"""
SIDE = "robostiff: 1\nsource: chosen here\ntool: tip\n"
SPRING = ' stiffness="300"'
SERVOS = '<position joint="j1" kp="1000"/><position joint="j2" kp="500" gear="10"/>'


def _arm(drives, spring="", head="", foot="", body=""):
    return ARM.format(drives=drives, spring=spring, head=head, foot=foot, body=body)


def _stiffnesses(folder, mjcf, side=""):
    """Stiffness of each joint of an arm with rigid links, from its compliance, and the warnings."""
    (folder / "m.xml").write_text(mjcf, encoding="utf-8")
    (folder / "s.yaml").write_text(SIDE + side, encoding="utf-8")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", rs.PlausibilityWarning)
        robot = rs.load(folder / "m.xml", side=folder / "s.yaml")
    roles = robot.legs[0].chain.roles
    return [getattr(role, "stiffness", 0) for role in roles], [str(w.message) for w in caught]


def test_a_spring_acts_beside_the_servo_of_its_joint(tmp_path):
    """C of two joints at (0, 0, 0) and (0, 0, 1), tip at (1, 0, 1): kp gear^2, and 1000 + 300."""
    found, said = _stiffnesses(tmp_path, _arm(SERVOS, SPRING))
    assert found == [1300, 5e4]
    assert "drives j1 (1000 N m/rad), j2 (50000 N m/rad) have the stiffness kp gear^2" in said[0]
    with pytest.warns(rs.PlausibilityWarning, match="kp gear"):
        C = rs.compliance(rs.load(tmp_path / "m.xml", side=tmp_path / "s.yaml"))
    assert C[0, 0] == pytest.approx(1 / 1300)
    assert C[2, 2] == pytest.approx(1 / 1300 + 1 / 5e4)


def test_a_spring_acts_beside_the_stiffness_in_the_side_file(tmp_path):
    side = "joints: {{j1: {{stiffness: 1000{}}}, j2: {{stiffness: 2000 N m/rad}}}}\n"
    found, said = _stiffnesses(tmp_path, _arm(SERVOS, SPRING), side.format(""))
    assert found == [1300, 2000]
    assert len(said) == 1
    assert "springs j1 (300 N m/rad) act beside the stiffness in the side file" in said[0]
    for spring, total in (("0", 1000), ("400 N m/rad", 1400)):
        found, said = _stiffnesses(
            tmp_path, _arm(SERVOS, SPRING), side.format(f", spring: {spring}")
        )
        assert found == [total, 2000]
        assert not said


def test_roles_of_joints_with_springs(tmp_path):
    passive = "joints: {j1: {role: passive}, j2: {role: locked, stiffness: 7}}\n"
    found, said = _stiffnesses(tmp_path, _arm(SERVOS, SPRING), passive)
    assert found == [300, 7]
    assert not said
    locked = "joints: {j1: {role: locked}, j2: {role: locked, stiffness: 7, spring: 2}}\n"
    assert _stiffnesses(tmp_path, _arm(SERVOS, SPRING), locked) == ([None, 9], [])
    motors = '<motor joint="j1"/><motor joint="j2"/>'
    found, said = _stiffnesses(tmp_path, _arm(motors, SPRING))
    assert found == [300, None]
    assert "springs j1 (300 N m/rad) act alone" in said[0]


def test_springs_that_cannot_be(tmp_path):
    for spring, message in (
        ("-3", r"joints\.j1\.spring: spring: got -3, expected a stiffness, or 0 for none"),
        ("3 N/m", r"joints\.j1\.spring: .*N m/rad"),
    ):
        with pytest.raises(rs.FileError, match=message):
            _stiffnesses(tmp_path, _arm(SERVOS), f"joints: {{j1: {{spring: {spring}}}}}\n")
    law = "stiffness: '1e4 N m/rad * (2 + q/(1 rad))', limits: [-1, 1], role: actuated"
    with pytest.raises(rs.FileError, match="beside a spring of 300, expected one law of both"):
        _stiffnesses(tmp_path, _arm(SERVOS, SPRING), f"joints: {{j1: {{{law}}}}}\n")


@pytest.mark.parametrize(
    ("drives", "k"),
    [
        ('<general joint="j1" gainprm="7" biastype="affine" biasprm="0 -7 -1" gear="3"/>', 63),
        ('<general joint="j1" gainprm="7" biasprm="0 -7 -1"/>', 7),  # affine by its class
        ('<general joint="j1" gainprm="7" biastype="none" biasprm="0 -7 -1"/>', None),
        ('<intvelocity joint="j1" kp="5" actrange="-1 1"/>', 5),
        ('<cylinder joint="j1" bias="1 -2 3"/>', 2),
        ('<velocity joint="j1" kv="5"/>', None),
        ('<position joint="j1" kp="5" dampratio="1" timeconst="0.1" inheritrange="1"/>', 5),
        ('<position joint="j1" kp="5" kv="2"/><position jointinparent="j1" kp="3"/>', 8),
        ('<position joint="j1" class="strong"/>', 70),
        ('<position joint="j1"/>', 20),  # the class of all
        ('<motor joint="j1"/>', None),
        ('<position joint="j1" class="geared" kp="2"/>', 200),  # all kinds share their defaults
        ('<position joint="j1" class="slow" kp="2"/>', 18),
        ('<position joint="j1" class="gain"/>', 630),
        ('<position joint="j1" class="motors"/>', 20),  # the last of its defaults is a motor
    ],
)
def test_stiffness_of_drives_is_that_of_mujoco(drives, k, tmp_path):
    """The moment by the motion of a joint at a constant command, by MuJoCo itself."""
    strong = '<default class="strong"><position kp="70"/></default>'
    strong += '<default class="geared"><motor gear="10"/></default>'
    strong += '<default class="slow"><velocity kv="4" gear="3"/></default>'
    strong += '<default class="gain"><general gainprm="70" biastype="affine" gear="3"/></default>'
    strong += '<default class="motors"><position kp="50"/><motor ctrlrange="-1 1"/>'
    strong += '<damper kv="2" gear="1" ctrlrange="0 1"/></default>'
    head = f'<default><position kp="20"/>{strong}</default>'
    mjcf = _arm(drives, head=head).replace('name="j1"', 'name="j1" range="-60 60"')
    found, _ = _stiffnesses(tmp_path, mjcf, "joints: {j2: {role: locked, stiffness: 1}}\n")
    assert found[0] == k
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    moments = []
    for q in (0.0, 1e-3):
        data.qpos[0] = q
        mujoco.mj_forward(model, data)
        moments.append(data.qfrc_actuator[0])
    assert np.diff(moments)[0] / -1e-3 == pytest.approx(k or 0, abs=1e-9)


LEFT_OUT = [
    (
        {"drives": SERVOS + '<position tendon="t" kp="10"/>', "foot": "<tendon><fixed name='t'>"
         '<joint joint="j1" coef="1"/></fixed></tendon>'},
        "not read: tendons t",
    ),
    (
        {"drives": SERVOS, "foot": '<tendon><spatial name="rope" stiffness="9"><site site="tip"/>'
         '<site site="root"/></spatial></tendon>', "body": '<site name="root"/>'},
        "not read: tendons rope",
    ),
    ({"drives": SERVOS, "head": '<option gravity="0 -9.81 0"/>'}, "not read: gravity 0 -9.81 0"),
    ({"drives": SERVOS, "head": '<option actuatorgroupdisable="1"><flag spring="disable"/>'
      '</option>'}, "switch off springs, drives or loops, "),
    ({"drives": SERVOS + '<position site="tip" name="s" kp="3"/>'}, "drives of sites or bodies s"),
    ({"drives": SERVOS + '<muscle joint="j1" name="m" lengthrange="0 1"/>'},
     "forces that a drive has by its position m"),
    (
        {"drives": SERVOS + '<dcmotor joint="j1" name="m" motorconst="0.1" resistance="1" '
         'cogging="1 3 0"/>'},
        "forces that a drive has by its position m",
    ),
    (
        {"drives": SERVOS + '<dcmotor joint="j1" name="m" motorconst="0.1" resistance="1" '
         'controller="5 0 0" input="pos"/>'},
        "forces that a drive has by its position m",
    ),
    (
        {"drives": SERVOS, "foot": '<worldbody><body name="c"><geom size="0.1"/>'
         '<flexcomp name="cloth" type="grid" dim="1" '
         'count="3 1 1" spacing=".1 .1 .1" radius="0.01" mass="1"/></body></worldbody>'},
        "not read: flexible bodies cloth",
    ),
    (
        {"drives": SERVOS, "foot": '<worldbody><body name="held" gravcomp="1"><geom size="0.1"/>'
         '</body><body gravcomp="0.0"><geom size="0.1"/></body></worldbody>'},
        r"not read: lifts of weights (gravcomp) held",
    ),
    (
        {"drives": SERVOS, "body": '<body pos="1 0 0"><joint name="ball" type="ball"/>'
         '<geom size="0.1"/></body>', "foot": "", "more": '<position joint="ball" kp="3"/>'},
        "servos of ball or free joints ball",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("parts", "words"), LEFT_OUT)
def test_what_holds_a_robot_and_is_not_read_is_named(parts, words, tmp_path):
    parts = dict(parts)
    mjcf = _arm(parts.pop("drives") + parts.pop("more", ""), **parts)
    side = "joints: {j1: {stiffness: 1000}, j2: {stiffness: 2000}}\n"
    found, said = _stiffnesses(tmp_path, mjcf, side)
    assert found == [1000, 2000]
    assert len(said) == 1
    assert words in said[0]
    model = mujoco.MjModel.from_xml_string(mjcf)
    named = words if "flexible" not in words else "not read: flexible bodies 0"
    with pytest.warns(rs.PlausibilityWarning, match=re.escape(named.replace("not read: ", ""))):
        rs.load(model, side=tmp_path / "s.yaml")


def test_the_gravity_of_mujoco_and_none_are_passed_over(tmp_path):
    side = "joints: {j1: {stiffness: 1000}, j2: {stiffness: 2000}}\n"
    for gravity in ("0 0.0 -9.81", "0 0 0"):
        head = f'<option gravity="{gravity}"><flag constraint="disable"/></option>'  # of no loops
        assert _stiffnesses(tmp_path, _arm(SERVOS, head=head), side) == ([1000, 2000], [])


def test_drives_and_springs_of_which_a_part_is_not_read(tmp_path):
    for drives, spring, words in (
        ('<muscle joint="j1" name="m"/>', "", "forces that a drive has by its position m"),
        ('<general joint="j1" biastype="affine" biasprm="0 4 0"/>', "", "of negative stiffness j1"),
        ('<motor joint="j1"/>', SPRING + ' springref="20"', "springs with a springref, j1"),
        ('<plugin joint="j1" plugin="mujoco.pid"/>', "", "plugins mujoco.pid"),
        ('<motor joint="j1"/>', ' stiffness="300 5"', "the powers of the deflection of springs j1"),
    ):
        side = "joints: {j1: {stiffness: 1000, spring: 0}, j2: {stiffness: 2000}}\n"
        found, said = _stiffnesses(tmp_path, _arm(drives, spring), side)
        assert found == [1000, 2000]
        assert [words in text for text in said] == [True]


def test_a_model_may_have_more_controls_than_drives(tmp_path):
    model = mujoco.MjModel.from_xml_string(_arm('<pid joint="j1" name="p"/>'))
    (tmp_path / "s.yaml").write_text(SIDE + 'joints: {"*": {stiffness: 9}}', encoding="utf-8")
    assert rs.load(model, side=tmp_path / "s.yaml").legs[0].chain.roles[0] == rs.Actuated(9)


def test_a_follower_of_two_joints_is_refused(tmp_path):
    both = "".join(f'<joint joint1="j2" joint2="{own}"/>' for own in ("j1", "j3"))
    body = '<body><joint name="j3"/><geom size="0.01"/></body>'
    mjcf = _arm('<motor joint="j1"/>', body=body, foot=f"<equality>{both}</equality>")
    with pytest.raises(rs.FileError, match="joint 'j2': got a joint that follows 'j1' and 'j3'"):
        _stiffnesses(tmp_path, mjcf)


def test_the_joint_with_the_drive_leads(tmp_path):
    """q1 = 0.1 + q2/2 with the drive on j1: the tip moves by J1 + 2 J2, turned by q2 = -0.2."""
    foot = '<equality><joint joint1="j1" joint2="j2" polycoef="0.1 0.5 0 0 0"/></equality>'
    (tmp_path / "m.xml").write_text(_arm('<motor joint="j1"/>', foot=foot), encoding="utf-8")
    (tmp_path / "s.yaml").write_text(SIDE + "joints: {j1: {stiffness: 9}}", encoding="utf-8")
    robot = rs.load(tmp_path / "m.xml", side=tmp_path / "s.yaml")
    x, z = np.cos(0.2), 1 + np.sin(0.2)
    J = np.array([z, 0, -x, 0, 1, 0]) + 2 * np.array([z - 1, 0, -x, 0, 1, 0])
    assert np.allclose(rs.stiffness(robot).pose, [x, 0, z, 0, -0.2, 0], atol=1e-12)
    load = np.array([3.0, 0, 2, 0, 7, 0])
    assert np.allclose(rs.deflection(robot, wrench=load).twist, J * (J @ load) / 9)


def test_a_follower_keeps_its_own_spring(tmp_path):
    """mcp drives pip by 0.7; the spring of pip stands beside its rigid coupling or its drive."""
    mjcf = _arm('<position joint="j1" kp="50"/>').replace('name="j2"', 'name="j2" stiffness="30"')
    coupled = mjcf.replace(
        "<actuator>",
        '<equality><joint joint1="j2" joint2="j1" polycoef="0 0.5 0 0 0"/></equality><actuator>',
    )
    side = "tool: tip\nbase: a\n"
    (tmp_path / "m.xml").write_text(coupled, encoding="utf-8")
    (tmp_path / "s.yaml").write_text(f"robostiff: 1\nsource: chosen here\n{side}")
    robot = rs.load(tmp_path / "m.xml", side=tmp_path / "s.yaml")
    (joint,) = robot.legs[0].chain.moving
    assert joint[0].role == rs.Actuated(50 / 0.5**2 + 30)


# One joint leads to the tip, the other one to nothing; q2 = r q1 or q1 = q2 / r, r = 2.
BESIDE = """<mujoco><worldbody><body><joint name="j1" axis="0 1 0"{one}/><geom size="0.01"/>
<site name="tip" pos="1 0 0"/></body><body><joint name="j2"{other}/><geom size="0.01"/></body>
</worldbody><equality><joint {follows} 0 0 0"/></equality><actuator>{drives}</actuator></mujoco>"""
FOLLOWS = 'joint1="j2" joint2="j1" polycoef="0 2'
LEADS = 'joint1="j1" joint2="j2" polycoef="0 0.5'


@pytest.mark.parametrize("follows", [FOLLOWS, LEADS])
@pytest.mark.parametrize(
    ("one", "other", "drives", "k"),
    [
        ("", ' stiffness="30"', "j1", 50 + 4 * 30),
        (' stiffness="7"', ' stiffness="30"', "", 7 + 4 * 30),
        (' stiffness="7"', "", "j1 j2", 7 + 50 + 4 * 50),
        ("", ' stiffness="30"', "j2", 4 * (30 + 50)),
        ("", ' stiffness="30"', "j1 j2", 50 + 4 * (30 + 50)),
    ],
)
def test_what_holds_a_joint_beside_the_path_holds_those_coupled_to_it(
    follows, one, other, drives, k, tmp_path
):
    servos = "".join(f'<position joint="{name}" kp="50"/>' for name in drives.split())
    mjcf = BESIDE.format(follows=follows, one=one, other=other, drives=servos)
    (stiffness,), _ = _stiffnesses(tmp_path, mjcf)
    assert stiffness == pytest.approx(k, rel=1e-12)
    if follows is FOLLOWS and not drives:  # in a linkage no joint follows another
        linkage = rs.load_linkage(tmp_path / "m.xml", side=tmp_path / "s.yaml")
        assert rs.compliance(linkage)[4, 4] == pytest.approx(1 / k, rel=1e-12)


CANTILEVER = """<mujoco><worldbody><body name="arm"><joint name="h" axis="0 1 0"/>
  <body name="car" pos="1 0 0"><joint name="s" type="slide" axis="1 0 0" ref="{ref}"/></body>
</body></worldbody></mujoco>"""
STEEL = {"type": "beam", "material": "steel", "section": {"circle": {"diameter": 0.02}}}


def _loaded(folder, mjcf, **side):
    (folder / "m.xml").write_text(mjcf)
    (folder / "s.yaml").write_text(json.dumps({"robostiff": 1, "source": "chosen here", **side}))
    return rs.load(folder / "m.xml", side=folder / "s.yaml")


@pytest.mark.parametrize("ref", [0, 0.3, -0.3])
def test_a_link_before_a_slide_ends_where_the_slide_is_drawn(ref, tmp_path):
    joints = {"h": {"role": "locked", "stiffness": 1e6}, "s": {"role": "locked", "stiffness": 1e9}}
    side = {"tool": "car", "joints": joints, "links": {"arm": STEEL}}
    robot = _loaded(tmp_path, CANTILEVER.format(ref=ref), **side)
    E, inertia = rs.material("steel").E, np.pi * 0.02**4 / 64
    assert rs.compliance(robot)[1, 1] == pytest.approx(1 / (3 * E * inertia), rel=1e-12)


def _random_arm(random, refs, springs=""):
    """Bodies one after the other, with one or two joints each, drawn at their references."""
    text, ends, names = "", "", []
    for i in range(4):
        at = " ".join(f"{x:.6f}" for x in random.uniform(-0.4, 0.4, 3))
        turn = " ".join(f"{x:.6f}" for x in random.uniform(-1, 1, 3))
        text += f'<body name="b{i}" pos="{at}" euler="{turn}">'
        for j in range(random.integers(1, 3)):
            kind = random.choice(["hinge", "slide"])
            axis = " ".join(f"{x:.6f}" for x in random.normal(size=3))
            place = " ".join(f"{x:.6f}" for x in random.uniform(-0.1, 0.1, 3))
            text += f'<joint name="j{i}{j}" type="{kind}" axis="{axis}" pos="{place}" '
            text += f'ref="{refs[len(names)]:.6f}" {springs}/>'
            names.append(f"j{i}{j}")
        ends += "</body>"
    site = '<site name="tip" pos="0.1 0.2 0.3"/>'
    head = '<mujoco><compiler angle="radian"/><worldbody>'
    return f"{head}{text}{site}{ends}</worldbody></mujoco>", names


@pytest.mark.parametrize("seed", range(3))
def test_compliance_of_random_arms_does_not_depend_on_references(seed, tmp_path):
    side = {
        "tool": "tip",
        "joints": {"*": {"role": "actuated", "stiffness": 1e4, "spring": 0}},
        "links": {"b0": STEEL, "b1": STEEL, "b2": STEEL},
    }
    C = []
    for refs in (np.zeros(8), np.random.default_rng(90 + seed).uniform(-1, 1, 8)):
        mjcf, _ = _random_arm(np.random.default_rng(seed), refs)
        C.append(rs.compliance(_loaded(tmp_path, mjcf, **side)))
    assert matrix_distance(C[0], C[1]) < 1e-9
    sprung, _ = _random_arm(np.random.default_rng(seed), refs, 'stiffness="1" springref="0.4"')
    with pytest.warns(rs.PlausibilityWarning, match="not read: the load at home of springs"):
        robot = _loaded(tmp_path, sprung, **side)
    assert matrix_distance(C[0], rs.compliance(robot)) < 1e-9


def test_keyframes_are_named_until_the_side_file_has_a_home(tmp_path):
    keys = '<keyframe><key name="home" qpos="0.3 -0.6"/><key qpos="0 0"/></keyframe>'
    mjcf = _arm(SERVOS, foot=keys)
    _, said = _stiffnesses(tmp_path, mjcf)
    assert "not read: keyframes home, without a name; write its coordinates under home:" in said[0]
    model = mujoco.MjModel.from_xml_string(mjcf)
    with pytest.warns(rs.PlausibilityWarning) as caught:
        rs.load(model, side=tmp_path / "s.yaml")
    assert "not read: keyframes home, without a name" in str(caught[0].message)
    for start in ("home: {j1: 0.3, j2: -0.6}\n", "start: {j1: 0}\n"):
        _, said = _stiffnesses(tmp_path, mjcf, start)
        assert not any("not read" in words for words in said)
