"""MJCF files that would exhaust memory, spin or open other files."""

import pytest

import robostiff as rs
from robostiff_interop import read_mjcf

JOINT = '<body name="a"><joint name="j"/></body>'


def _read(folder, body, before="", after=""):
    path = folder / "m.xml"
    path.write_text(f"<mujoco>\n{before}\n<worldbody>\n{body}\n</worldbody>\n{after}</mujoco>")
    return read_mjcf(path)


@pytest.mark.parametrize(
    ("body", "message", "line"),
    [
        ('<replicate count="999999999"><body/></replicate>', "more elements after replicate", 4),
        ('<replicate count="1e9"><body/></replicate>', "more elements after replicate", 4),
        ("<body><joint/></body>" * 2500, "at most 4000 bodies", 4),
        ('<body pos="0 nan 0"/>', "pos of <body>: got '0 nan 0', expected finite numbers", 4),
        ('<body pos="0 0 0">\n<joint axis="inf 0 0"/></body>', "axis of <joint>", 5),
        ('<body quat="1e300 0 0 0"/>', "quat of <body>", 4),
        ('<body>\n<joint tipe="hinge"/></body>', "MJCF: got XML Error: Schema violation", 5),
        ("<bodi/>", "MJCF: got XML Error: Schema violation", 4),
        ('<attach model="m" body="b" prefix="x"/>', "attach: got a body of another model", 4),
    ],
)
def test_files_are_refused_at_their_line(body, message, line, tmp_path):
    with pytest.raises(rs.FileError, match=message) as error:
        _read(tmp_path, body)
    assert error.value.location.line == line


@pytest.mark.parametrize(
    "before",
    [
        '<asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>',
        '<size nuserdata="2000000000" memory="900G" nuser_body="1000000000"/>',
        '<asset><texture type="2d" builtin="flat" width="100000" height="100000"/></asset>',
        '<asset><mesh name="x" file="/dev/zero"/></asset>',
        '<custom><numeric name="n" size="2000000000"/></custom>',
        '<option timestep="nan"/>',
    ],
)
def test_what_takes_memory_by_its_numbers_never_reaches_mujoco(before, tmp_path):
    assert _read(tmp_path, JOINT, before).links == ("world", "a")


def test_names_may_look_like_numbers(tmp_path):
    driven = '<actuator><motor joint="inf"/></actuator>'
    tree = _read(tmp_path, '<body name="nan"><joint name="inf"/></body>', after=driven)
    assert tree.joints[0].role == rs.Actuated()


def test_included_files_obey_the_same_rules(tmp_path):
    part = tmp_path / "parts" / "arm.xml"
    part.parent.mkdir()
    include = '<include file="parts/arm.xml"/>'
    part.write_text('<mujocoinclude><body name="a"><include file="b.xml"/></body></mujocoinclude>')
    (tmp_path / "parts/b.xml").write_text("<x><joint name='j'/></x>")
    assert _read(tmp_path, include).joints[0].name == "j"
    for text, message, line in (
        ('<!DOCTYPE r [<!ENTITY a "aa">]><x/>', "document type", 1),
        ("<x>\n" + "<body>" * 300, "inside each other", 2),
        ("<x>\n<include file='parts/arm.xml'/></x>", "a file that does not include itself", 2),
        (
            "<x>\n<include file='../../gone.xml'/></x>",
            "file of an include: got '../../gone.xml'",
            2,
        ),
        ("<x>\n<body pos='nan 0 0'/></x>", "pos of <body>", 2),
        ("<x>\n<body><joint tipe='hinge'/></body></x>", "Schema violation", 2),
    ):
        part.write_text(text)
        with pytest.raises(rs.FileError, match=message) as error:
            _read(tmp_path, include)
        assert error.value.location.file.endswith("arm.xml")
        assert error.value.location.line == line
