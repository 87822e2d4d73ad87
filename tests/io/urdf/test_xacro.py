"""Xacro runs Python: only where the user asks for it, and fenced in."""

import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.cli.main import app
from robostiff.io.urdf import expand_xacro

HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
ARM = f"""{HEAD}<link name="a"/><link name="b"/>
  <joint name="j" type="revolute"><parent link="a"/><child link="b"/>
    <origin xyz="0 0 ${{0.5*2}}"/><axis xyz="0 1 0"/></joint></robot>"""
SIDE = "robostiff: 1\nsource: chosen here\nrobot: arm.urdf.xacro\ntool: b\n"
SIDE += 'joints: {"*": {stiffness: 1e4}}\n'


@pytest.fixture
def innocent(tmp_path):
    (tmp_path / "arm.urdf.xacro").write_text(ARM)
    path = tmp_path / "innocent.yaml"
    path.write_text(SIDE)
    return path


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
