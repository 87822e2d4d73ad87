"""What a URDF, a xacro or an MJCF file may not do, and how slips in them are reported."""

import sys

import pytest

import robostiff as rs
from robostiff import extras
from robostiff.io.rigid_tree import XmlLimits, read_xml
from tests.files import text_of
from tests.io.urdf.examples import with_side

SIDE = 'robostiff: 1\nsource: chosen here\ntool: b\njoints: {"*": {stiffness: 1e4}}\n'
ARM = text_of("arm-of-one-joint.urdf")


def _file(folder, text, name="arm.urdf"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def _refused(folder, text, match, name="arm.urdf"):
    with pytest.raises(rs.FileError, match=match) as error:
        rs.load(_file(folder, text, name), side=with_side(folder, SIDE))
    return error.value.location


STEALING = '<!DOCTYPE robot [<!ENTITY secret SYSTEM "file:///etc/hostname">]>'


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be", "iso-8859-1"])
def test_entities_in_other_encodings_are_refused(encoding, tmp_path):
    text = f'<?xml version="1.0" encoding="{encoding[:6]}"?>{STEALING}{ARM}'
    if encoding == "iso-8859-1":
        text = text.replace("iso-88", encoding)
    _refused(tmp_path, text.encode(encoding), "document type|XML")


def test_files_are_bounded(tmp_path):
    path = _file(tmp_path, ARM)
    with pytest.raises(rs.FileError, match=r"file too large: got .* bytes, expected at most 100"):
        read_xml(path, XmlLimits(size=100))
    with pytest.raises(rs.FileError, match="at most 4, 200 inside each other"):
        read_xml("arm.urdf", XmlLimits(elements=4), ARM.encode())
    with pytest.raises(rs.FileError, match="inside each other"):
        read_xml("arm.urdf", content=b"<robot>" * 300)
    with pytest.raises(rs.FileError, match="a folder"):
        rs.load(_folder(tmp_path, "cell.urdf"), side=with_side(tmp_path, SIDE))


def _folder(folder, name):
    path = folder / name
    path.mkdir()
    return path


def test_copies_in_mjcf_are_counted_and_what_mujoco_refuses_is_said(tmp_path):
    many = '<mujoco><worldbody><replicate count="9999"><replicate count="9999"><body/>'
    many += "</replicate></replicate></worldbody></mujoco>"
    _refused(tmp_path, many, "more elements after replicate", "arm.xml")
    broken = "<mujoco><worldbody><body><joint tipe='hinge'/></body></worldbody></mujoco>"
    _refused(tmp_path, broken, "MJCF: got XML Error: Schema violation", "arm.xml")


def test_a_missing_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "xacrodoc", None)
    path = _file(tmp_path, ARM, "arm.xacro")
    with pytest.raises(rs.InputError, match=r"pip install 'robostiff\[urdf\]'"):
        rs.load(path, side=with_side(tmp_path, SIDE))


@pytest.mark.parametrize("name", ["m.xml", "m.mjcf"])
def test_a_missing_reader_is_named(name, tmp_path, monkeypatch):
    monkeypatch.setattr(extras, "entry_points_of", lambda _: {})
    path = _file(tmp_path, "<mujoco/>", name)
    expected = r"^MJCF files need 'robostiff-interop', .* \./extras/robostiff-interop in a checkout"
    with pytest.raises(rs.InputError, match=expected):
        rs.load(path, side=with_side(tmp_path, SIDE))
    if name == "m.mjcf":
        with pytest.raises(rs.InputError, match=expected):
            rs.load(path)


def test_xacro_is_expanded_with_what_it_includes(tmp_path, monkeypatch):
    macros = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
      <xacro:macro name="segment" params="n parent length">
        <link name="${n}"/>
        <joint name="to_${n}" type="continuous"><parent link="${parent}"/><child link="${n}"/>
          <origin xyz="0 0 ${2*length}"/><axis xyz="0 1 0"/></joint>
      </xacro:macro></robot>"""
    arm = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
      <xacro:include filename="parts/segment.xacro"/>
      <link name="a"/><xacro:segment n="b" parent="a" length="0.25"/></robot>"""
    (tmp_path / "parts").mkdir()
    _file(tmp_path / "parts", macros, "segment.xacro")
    monkeypatch.chdir("/")
    robot = rs.load(_file(tmp_path, arm, "arm.urdf.xacro"), side=with_side(tmp_path, SIDE))
    assert rs.find_posture(robot).pose[0].tolist() == [0, 0, 0.5, 0, 0, 0]


def test_numbers_that_nobody_reads_may_be_anything(tmp_path):
    text = ARM.replace('effort="1" velocity="1"', 'effort="28 N m" velocity="fast"')
    assert len(rs.load(_file(tmp_path, text), side=with_side(tmp_path, SIDE)).legs) == 1


def test_a_urdf_needs_no_extra(tmp_path, monkeypatch):
    for module in ("yourdfpy", "xacrodoc", "xacro", "lxml"):
        monkeypatch.setitem(sys.modules, module, None)
    assert rs.load(_file(tmp_path, ARM, "arm.urdf"), side=with_side(tmp_path, SIDE)).name == "arm"
