"""The robots of the page on URDF are what it says, and xacro runs where the user asks for it."""

import re

import numpy as np
import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.cli.main import app
from robostiff.io.urdf import expand_xacro
from tests.files import written
from tests.io.urdf.examples import UR5, UR5_JOINTS, needs_examples, robot_of, with_side
from tests.project.shown_output import ROOT

EXAMPLES = ROOT / "examples"
PAGE = (ROOT / "docs/urdf.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["ur5", "two-ur5"])
def test_side_files_on_the_page_are_those_of_the_examples(name):
    blocks = re.findall(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert (EXAMPLES / f"{name}.stiffness.yaml").read_text(encoding="utf-8") in blocks


@needs_examples
def test_the_ur5_is_that_of_its_maker(tmp_path):
    side = with_side(
        tmp_path, "robostiff: 1\nsource: x\ntool: tool0\njoints: {'*': {stiffness: 1}}"
    )
    maker, own = robot_of(UR5, side), robot_of(EXAMPLES / "ur5.urdf", side)
    assert [joint.name for joint, _ in own.legs[0].chain.moving] == list(UR5_JOINTS)
    q = rs.JointCoordinates(np.random.default_rng(2).uniform(-3, 3, (20, 6)))
    # The maker's file has angles of twelve digits.
    assert np.allclose(rs.find_posture(own, q).pose, rs.find_posture(maker, q).pose, atol=1e-9)


def test_the_left_arm_of_two_is_the_ur5(tmp_path):
    two = robot_of(EXAMPLES / "two-ur5.urdf.xacro", EXAMPLES / "two-ur5.stiffness.yaml")
    side = with_side(
        tmp_path, "robostiff: 1\nsource: x\ntool: tool0\njoints: {'*': {stiffness: 1}}"
    )
    one = robot_of(EXAMPLES / "ur5.urdf", side)
    left = two.legs[0].chain.home
    tool = rs.find_posture(one, rs.JointCoordinates(left)).pose[0]
    assert two.home is not None
    bar = tool[:3] + np.array([-0.8, 0, -0.05])
    assert np.allclose(two.home.p, bar, atol=1e-12)
    assert rs.stiffness(two).status is rs.Status.OK


def test_the_command_line_takes_a_side_file(tmp_path, capsys):
    from robostiff.cli.main import app

    side = with_side(tmp_path, (EXAMPLES / "ur5.stiffness.yaml").read_text(encoding="utf-8"))
    for command in ("stiffness", "check", "verify"):
        with pytest.raises(SystemExit) as done:
            app([command, str(EXAMPLES / "ur5.urdf"), "--side", str(side), "--json"])
        assert done.value.code == 0
        assert '"rank": 6' in capsys.readouterr().out


HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
ARM = f"""{HEAD}<link name="a"/><link name="b"/>
  <joint name="j" type="revolute"><parent link="a"/><child link="b"/>
    <origin xyz="0 0 ${{0.5*2}}"/><axis xyz="0 1 0"/></joint></robot>"""
SIDE = "robostiff: 1\nsource: chosen here\nrobot: arm.urdf.xacro\ntool: b\n"
SIDE += 'joints: {"*": {stiffness: 1e4}}\n'


@pytest.fixture
def innocent(tmp_path):
    (tmp_path / "arm.urdf.xacro").write_text(ARM)
    return written(tmp_path / "innocent.yaml", SIDE)


def test_a_side_file_may_not_name_a_xacro(innocent):
    for load in (rs.load, rs.load_linkage):
        with pytest.raises(rs.FileError, match=r"expected URDF or MJCF: xacro runs.*--allow-xacro"):
            load(innocent)
    assert rs.load(innocent, allow_xacro=True).name == "arm"
    assert rs.load_linkage(innocent, allow_xacro=True).name == "arm"


@pytest.mark.parametrize("command", ["check", "stiffness"])
def test_the_command_line_asks_for_allow_xacro(command, innocent):
    refused = CliRunner().invoke(app, [command, str(innocent)])
    assert refused.exit_code == 2
    assert "--allow-xacro" in refused.output
    assert CliRunner().invoke(app, [command, str(innocent), "--allow-xacro"]).exit_code < 2


def test_the_package_that_is_missing_is_named(tmp_path):
    """Words of another program are shown as far as their point, which comes last."""
    path = tmp_path / "arm.xacro"
    package = "a_package_with_a_name_that_is_rather_long"
    path.write_text(f'{HEAD}<xacro:include filename="$(find {package})/urdf/arm.xacro"/></robot>')
    with pytest.raises(rs.FileError, match=f"not found: {package}") as error:
        expand_xacro(path)
    assert len(str(error.value)) < 1000
    path.write_text(f'{HEAD}<xacro:include filename="$(find {"x" * 5000})/arm.xacro"/></robot>')
    with pytest.raises(rs.FileError) as error:
        expand_xacro(path)
    assert len(str(error.value)) < 1000
