"""Files of measurements: what they say, and the place of every mistake."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics.turn import turn_by_vector
from tests.files import written

JOINTS = "joint1 [deg],joint2 [deg],joint3 [deg],joint4 [deg],joint5 [deg],joint6 [deg]"
DATA = Path(__file__).parent / "data"


@pytest.fixture(scope="module")
def arm():
    return rs.load("six-joint-arm")


def read(arm, folder: Path, text: str, **more) -> rs.Measurements:
    return rs.Measurements.read(written(folder / "campaign.csv", text), arm, **more)


def test_a_campaign_with_postures_that_repeat(arm, tmp_path):
    found = read(
        arm,
        tmp_path,
        "# by hand\n"
        f"posture;{JOINTS.replace(',', ';')};Fz [N];mass [kg];at_x [mm];at_y [mm];at_z [mm];"
        "marker;x [mm];y [mm];z [mm];sigma [um]\n"
        "a;10;20;15;10;50;0;;;;;;m1;1500,1;2;3;20\n"
        "a;;;;;;;;100;120;0;50;m1;1500;;2,5;20\n"
        "b;20;20;15;10;50;0;-500;;;;;m2;1;2;3;30\n",
    )
    assert len(found) == 3
    np.testing.assert_allclose(np.rad2deg(found.coordinates[:, 0]), [10, 10, 20])
    np.testing.assert_allclose(found.values[0], [1.5001, 0.002, 0.003])
    assert found.is_read.tolist() == [[True] * 3, [True, False, True], [True] * 3]
    np.testing.assert_allclose(found.forces[1], [0, 0, -980.665])
    np.testing.assert_allclose(found.hooks[1], [0.12, 0, 0.05])
    np.testing.assert_allclose(found.wrenches[2], [0, 0, -500, 0, 0, 0])
    np.testing.assert_allclose(found.sigma[:, 0], [2e-5, 2e-5, 3e-5])
    assert found.markers == ("m1", "m1", "m2")
    assert found.place(2).endswith("campaign.csv:5")


def test_displacements_gauges_and_distances(tmp_path):
    robot = rs.load("hexapod")
    found = read(
        robot,
        tmp_path,
        "row,reference,pose_z [mm],Fz [N],marker,dx [um],dy [um],dz [um],along [um],u_x,u_y,u_z,"
        "distance [mm],from_x [mm],from_y [mm],from_z [mm]\n"
        "1,,900,-100,m,1,2,3,,,,,,,,\n"
        "2,1,900,-900,m,,,,7,0,0,1,,,,\n"
        "3,,900,-900,m,,,,,,,,500.5,100,0,0\n",
    )
    assert [kind.value for kind in found.kinds] == ["displacement", "along", "distance"]
    assert found.references == (-1, 0, -1)
    np.testing.assert_allclose(found.values[:, 0], [1e-6, 7e-6, 0.5005])
    np.testing.assert_allclose(found.toward[1:], [[0, 0, 1], [0.1, 0, 0]])
    assert not found.has_sigma


OF_HEXAPOD = """pose_z [mm];Fx [N];Fz [N];dx [um];dy [um];dz [um]
900,5;100;-200,5;1,5;2;3
910;;;1;;3
"""


@pytest.mark.parametrize(
    "content",
    [
        OF_HEXAPOD.encode("utf-8-sig"),
        OF_HEXAPOD.replace("\n", "\r\n").encode("utf-16"),
        OF_HEXAPOD.replace(";", "\t").replace(",", ".").encode("utf-16"),
        f"sep=;\n{OF_HEXAPOD};;;;;\n;;;;;\n".encode(),
        OF_HEXAPOD.replace("[um]", "[µm]").encode("latin-1"),
        OF_HEXAPOD.replace("[um]", "[Âµm]").encode(),
    ],
)
def test_what_programs_write_around_a_table(content, tmp_path):
    (tmp_path / "campaign.csv").write_bytes(content)
    found = rs.Measurements.read(tmp_path / "campaign.csv", rs.load("hexapod"))
    assert len(found) == 2
    np.testing.assert_allclose(found.wrenches[:, :3], [[100, 0, -200.5], [0, 0, 0]])
    np.testing.assert_allclose(found.values[0], [1.5e-6, 2e-6, 3e-6])
    assert found.is_read.tolist() == [[True] * 3, [True, False, True]]


@pytest.mark.parametrize(
    ("was", "becomes", "said"),
    [
        ("100;-200", "100;;", "2: reading: got 7 fields, expected 6"),
        ("100;-200,5", "100;", "2: Fz: got nothing, expected a number, or nothing in all of Fx, F"),
        (";", ",", "2:1: reading: got 9 fields.* numbers have points, or semicolons between"),
        (";", " ", "1: names of columns: got .*, expected names between tabs, semicolons or com"),
        (";", "|", "1: names of columns: got .*, expected names between tabs, semicolons or com"),
    ],
)
def test_tables_that_are_refused(was, becomes, said, tmp_path):
    with pytest.raises(rs.FileError, match=f"csv:{said}".replace("2: reading", "2:1: reading")):
        read(rs.load("hexapod"), tmp_path, OF_HEXAPOD.replace(was, becomes))


@pytest.mark.filterwarnings("ignore:.*'(Name|Image RMS|Time Stamp)' is not read")
def test_export_of_a_tracker(arm, tmp_path):
    joints = tmp_path / "joints.csv"
    joints.write_text(f"{JOINTS},Fz [N],marker\n" + "".join(
        f"{k}0,20,15,10,50,0,-{k}00,m\n" for k in (1, 2, 3)))  # fmt: skip
    found = rs.Measurements.read(DATA / "tracker.csv", arm, joints=joints)
    assert len(found) == 2
    np.testing.assert_allclose(found.values, [[1.5001, -0.2002, 0.3003], [1.4999, -0.2, 0.2995]])
    np.testing.assert_allclose(found.sigma, [[1e-5, 1.5e-5, 2e-5], [2e-5, 1.5e-5, 2e-5]])
    np.testing.assert_allclose(found.wrenches[:, 2], [-100, -300])
    assert found.place(1).endswith("tracker.csv:4")
    rounded = tmp_path / "rounded.csv"
    rounded.write_text((DATA / "tracker.csv").read_text("utf-8").replace("0.0200,0.0300", "0,0.03"))
    first = rs.Measurements.read(rounded, arm, joints=joints)
    np.testing.assert_allclose(first.sigma[:, 0], [2e-5, 2e-5])  # that of the other line
    latin = tmp_path / "latin.csv"
    latin.write_bytes((DATA / "tracker.csv").read_text("utf-8").encode("latin-1"))
    again = rs.Measurements.read(latin, arm, joints=joints)
    np.testing.assert_array_equal(again.values, found.values)


JOINT_NAMES = [f"joint{k} [deg]" for k in range(1, 7)]
THREE = [f"{m}.{a} [mm]" for m in ("n1", "n2", "n3") for a in "xyz"]
IN_ORDER = [*THREE, *JOINT_NAMES, "", "", ""]


def off(arm, found: rs.Measurements, marker: str, place: list[float]) -> np.ndarray:
    """Distances of readings from a marker on the unloaded arm, seen in world axes."""
    rows = [k for k, name in enumerate(found.markers) if name == marker]
    pose = rs.find_posture(arm, found.chosen(rows).postures).pose
    points = pose[:, :3] + turn_by_vector(pose[:, 3:]) @ place - [-0.4, 0.2, 0.1]
    return np.linalg.norm(found.values[rows, :3] - points, axis=1)


def test_three_markers_a_line_without_headings(arm, tmp_path):
    """Blanks between numbers; unused columns have no heading."""
    file = DATA / "three_markers.txt"
    found = rs.Measurements.read(file, arm, columns=IN_ORDER)
    assert repr(found) == "<Measurements: 15 readings of 3 markers at 5 postures>"
    for name, place in (("n1", [0.08, 0.1, 0]), ("n3", [0.05, -0.05, -0.1])):
        assert off(arm, found, name, place).max() < 1e-12
    assert found.place(4) == f"{file}:2"
    with pytest.raises(rs.FileError, match=r"txt:1:1: reading: got 18 fields, expected 15"):
        rs.Measurements.read(file, arm, columns=IN_ORDER[:-3])
    lines, other = file.read_text().splitlines(), tmp_path / "other.txt"
    fields = lines[1].split()
    other.write_text("\n".join([lines[0], " ".join([*fields[:10], "east", *fields[11:]])]))
    with pytest.raises(rs.FileError, match=r"txt:2:.*joint2.*got 'east'"):
        rs.Measurements.read(other, arm, columns=IN_ORDER)


def test_three_markers_under_headings(arm, tmp_path):
    """A marker that is hidden has empty fields."""
    text = "\n".join([
        ",".join([*THREE, *JOINT_NAMES]),
        "1,2,3,4,5,6,7,8,9,10,20,15,10,50,0",
        "1,2,3,,,,7,8,10,20,20,15,10,50,0",
    ])  # fmt: skip
    found = read(arm, tmp_path, text)
    assert found.markers == ("n1", "n2", "n3", "n1", "n3")
    np.testing.assert_allclose(found.values[4], [0.007, 0.008, 0.010])
    assert found.place(4).endswith("csv:3")


@pytest.mark.parametrize("begins", [0, 1], ids=["headings", "no headings"])
def test_auto_id(arm, tmp_path, begins):
    """Roll about x, pitch about y, yaw about z, in this order about axes that stay."""
    lines = (DATA / "auto_id.txt").read_text().splitlines()[begins:]
    file = written(tmp_path / "auto.txt", "\n".join(lines) + "\n")
    found = rs.Measurements.read(file, arm, sigma=(2e-5, 1e-4))
    assert set(found.kinds) == {rs.Reading.POSE}
    assert off(arm, found, "tool", [0.08, 0.1, 0]).max() < 1e-9
    pose = rs.find_posture(arm, found.postures).pose
    np.testing.assert_allclose(
        turn_by_vector(found.values[:, 3:]), turn_by_vector(pose[:, 3:]), atol=1e-7
    )
    np.testing.assert_allclose(found.sigma[0], [2e-5] * 3 + [1e-4] * 3)
    assert found.place(0) == f"{file}:{2 - begins}"
    with pytest.raises(rs.InputError, match="sigma: got none, or one for all"):
        rs.Measurements.read(file, arm)
    file.write_text("\n".join([*lines, "P6\t1\t2\t3"]))
    with pytest.raises(rs.FileError, match=rf"txt:{7 - begins}:1: point: got 'P6"):
        rs.Measurements.read(file, arm, sigma=(2e-5, 1e-4))


def test_auto_id_of_points_alone(arm, tmp_path):
    """Turns that are zero in all lines were not measured."""
    file = written(tmp_path / "auto.txt", "P1\t1\t2\t3\t0\t0\t0\t10\t20\t15\t10\t50\t0\n")
    found = rs.Measurements.read(file, arm)
    assert found.kinds == (rs.Reading.POINT,)
    np.testing.assert_allclose(found.values, [[0.001, 0.002, 0.003]])


def test_drives_poses_and_directions(arm, tmp_path):
    found = read(
        arm,
        tmp_path,
        f"{JOINTS},drive,torque [N m],angle [deg],sigma_torque [N m],sigma_turn [mrad],axes,"
        "direction,at,Fz [N],sigma_F [N],marker,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg],"
        "sigma [um]\n"
        "10,20,15,10,50,0,joint2,12.5,,1,,platform,loading,hook,-5,0.1,,,,,,,,\n"
        "10,20,15,10,50,0,joint3,,15.1,,0.1,,unloading,tip,-5,,,,,,,,,\n"
        "10,20,15,10,50,0,,,,,0.2,instrument,,,,,m,1,2,3,0,0,90,20\n",
        hooks={"hook": [0, 0, 0.1]},
    )
    assert [kind.value for kind in found.kinds] == ["torque", "joint", "pose"]
    np.testing.assert_allclose(found.values[:2, 0], [12.5, np.radians(15.1)])
    np.testing.assert_allclose(found.values[2], [0.001, 0.002, 0.003, 0, 0, np.pi / 2])
    np.testing.assert_allclose(found.sigma[2], [2e-5] * 3 + [2e-4] * 3)
    np.testing.assert_allclose(found.sigma[:2, 0], [1, 1e-4])
    assert found.drives == ("joint2", "joint3", "")
    assert [own.value for own in found.axes] == ["platform", "world", "instrument"]
    assert found.directions == (1, -1, 0)
    np.testing.assert_allclose(found.hooks[0], [0, 0, 0.1])
    np.testing.assert_allclose(found.forces[0], [0, 0, -5])
    np.testing.assert_allclose(found.wrenches[1], [0, 0, -5, 0, 0, 0])
    np.testing.assert_allclose(found.sigma_wrench[0], [0.1] * 3 + [0] * 3)


def test_loads_on_bodies(arm, tmp_path):
    """By a name with a slash, or by that of a hook on a body."""
    found = read(
        arm,
        tmp_path,
        f"{JOINTS},at,at_x [mm],at_y [mm],at_z [mm],Fz [N],mass [kg],marker,x [mm],y [mm],z [mm]\n"
        "10,20,15,10,50,0,arm/joint3,10,0,20,-50,,m,1,2,3\n"
        "10,20,15,10,50,0,elbow,,,,,8,m,1,2,3\n"
        "10,20,15,10,50,0,arm/joint2,,,,-50,,m,1,2,3\n",
        hooks={"elbow": ("arm/joint3", [0.1, 0, 0])},
    )
    assert found.bodies == ("arm/joint3", "arm/joint3", "arm/joint2")
    np.testing.assert_allclose(found.hooks[:2], [[0.01, 0, 0.02], [0.1, 0, 0]])
    np.testing.assert_allclose(found.forces[:, 2], [-50, -8 * 9.80665, -50])
    assert not found.wrenches.any()


GOOD = "10,20,15,10,50,0,m,1,2,3"
HEAD = f"{JOINTS},marker,x [mm],y [mm],z [mm]"


def test_columns_that_are_not_read_are_said(arm, tmp_path):
    text = f"remark,{HEAD},Marker,joint1_cmd [deg],\ncold,{GOOD},q,11,\n"
    with pytest.warns(rs.PlausibilityWarning) as warned:
        found = read(arm, tmp_path, text)
    assert found.markers == ("m",)
    assert [str(own.message).rpartition("campaign.csv:")[2] for own in warned] == [
        "1:1: column 'remark' is not read",
        "1:114: column 'Marker' is not read",
        "1:121: column 'joint1_cmd' is not read",
    ]
    with pytest.warns(rs.PlausibilityWarning, match="column '' is not read"):
        read(arm, tmp_path, f"{HEAD},\n{GOOD},7\n")
    many = ",".join(f"other{k}" for k in range(30))
    with pytest.warns(rs.PlausibilityWarning) as warned:
        read(arm, tmp_path, f"{HEAD},{many}\n{GOOD}{',1' * 30}\n")
    assert len(warned) == 13
    assert str(warned[-1].message).endswith(": 18 more columns not read")


def test_coordinates_of_a_pose_that_are_not_free(tmp_path):
    text = "pose_x [mm],pose_z [mm],pose_rx [deg],marker,x [mm],y [mm],z [mm]\n1,{z},5,m,1,2,3\n"
    robot = rs.load("delta")
    z = 1e3 * rs.find_posture(robot).pose[0, 2]
    with pytest.warns(rs.PlausibilityWarning, match=r"csv:1:25: column 'pose_rx' is not read"):
        found = read(robot, tmp_path, text.format(z=z))
    np.testing.assert_allclose(found.coordinates, [[1e-3, 0, 1e-3 * z]])


def test_columns_of_a_tracker_that_are_not_read_are_said(arm, tmp_path):
    """Of the joints, too: there readings and their deviations are those of the tracker."""
    joints = tmp_path / "joints.csv"
    joints.write_text(f"{JOINTS},sigma [um],x [mm]\n" + "".join(
        f"{k}0,20,15,10,50,0,7,8\n" for k in (1, 2, 3)))  # fmt: skip
    with pytest.warns(rs.PlausibilityWarning) as warned:
        rs.Measurements.read(DATA / "tracker.csv", arm, joints=joints)
    assert [str(own.message).rpartition("column ")[2] for own in warned] == [
        f"{name!r} is not read" for name in ("Name", "Image RMS", "Time Stamp", "sigma", "x")
    ]


def test_a_tracker_export_needs_joints(arm):
    warned = pytest.warns(rs.PlausibilityWarning, match="is not read")
    with warned, pytest.raises(rs.FileError, match="postures and loads of a tracker export"):
        rs.Measurements.read(DATA / "tracker.csv", arm)


def test_a_marker_that_is_seen_once(arm, tmp_path):
    rows = [f"{k}0,20,15,10,50,0,{m},1,2,{k}" for k, m in ((1, "a"), (2, "a"), (3, "b"))]
    measured = read(arm, tmp_path, "\n".join([HEAD, *rows]))
    with pytest.raises(rs.InputError, match=r"marker 'b' of .*csv:4: got one reading"):
        rs.identify(arm, measured, ["arm/joint1"])


def test_a_posture_beyond_limits(tmp_path):
    robot = rs.load("scara")
    head = "shoulder [deg],elbow [deg],spline [deg],quill [mm],marker,x [mm],y [mm],z [mm]"
    rows = [f"{k},20,15,10,m,1,2,{k}" for k in (10, 20, 175, 30)]
    measured = read(robot, tmp_path, "\n".join([head, *rows]))
    with pytest.raises(rs.InputError, match=r"posture of .*csv:4: got 'beyond-limits'"):
        rs.identify(robot, measured, ["arm/shoulder"])


def test_a_structure_has_no_posture(tmp_path):
    """It has one pose, which a file need not have; a column of it is not read, with a warning."""
    lines = ["Fx [N],marker,dx [um],dy [um],dz [um],sigma [um]", "4,m1,476,0,0,1", "8,m1,952,0,0,1"]
    stage = rs.load("examples/flexure-stage.yaml", symbols=("t",))
    measured = read(stage, tmp_path, "\n".join(lines))
    assert measured.coordinates.shape == (2, 0)
    found = rs.identify(stage, measured, ["t"], frames=rs.KnownFrames({"m1": [0, 0, 0]}))
    x = rs.deflection(found.robot, wrench=[8, 0, 0, 0, 0, 0]).twist[0]
    assert x == pytest.approx(952e-6, rel=2e-3)
    with_pose = [
        f"{begin},{line}" for begin, line in zip(["pose_x [mm]", 0, 0], lines, strict=True)
    ]
    with pytest.warns(rs.PlausibilityWarning, match="'pose_x' is not read"):
        assert read(stage, tmp_path, "\n".join(with_pose)).coordinates.shape == (2, 0)
