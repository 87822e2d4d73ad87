"""Files of measurements: what they say, and the place of every mistake."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import robostiff as rs

JOINTS = "joint1 [deg],joint2 [deg],joint3 [deg],joint4 [deg],joint5 [deg],joint6 [deg]"
DATA = Path(__file__).parent / "data"


@pytest.fixture(scope="module")
def arm():
    return rs.load("six-joint-arm")


def read(arm, folder: Path, text: str, **more) -> rs.Measurements:
    file = folder / "campaign.csv"
    file.write_text(text, encoding="utf-8")
    return rs.Measurements.read(file, arm, **more)


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
    latin = tmp_path / "latin.csv"
    latin.write_bytes((DATA / "tracker.csv").read_text("utf-8").encode("latin-1"))
    again = rs.Measurements.read(latin, arm, joints=joints)
    np.testing.assert_array_equal(again.values, found.values)


GOOD = "10,20,15,10,50,0,m,1,2,3"
HEAD = f"{JOINTS},marker,x [mm],y [mm],z [mm]"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"{JOINTS},marker,x,y [mm],z [mm]\n{GOOD}\n", r"csv:1:.*unit of x: got 'none'"),
        (f"{HEAD}\n10,20,15,nan,50,0,m,1,2,3\n", r"csv:2:10: joint4.*got 'nan'"),
        (f"{HEAD}\n10,20,15,,50,0,m,1,2,3\n", r"csv:2: joint4: got 'nothing'"),
        (f"posture,{HEAD}\na,{GOOD}\na,11,20,15,10,50,0,m,1,2,4\n",
         r"csv:3: posture 'a': got 'other coordinates than before', expected 'those of line 2"),
        (f"{HEAD}\n{GOOD}\n{GOOD}\n", r"csv:3: reading: got 'the same as line 2"),
        (f"{HEAD}\n10,20,15,10,50,0,m,,,\n", r"csv:2: reading: got 'nothing', expected one kind"),
        (f"{JOINTS},marker\n10,20,15,10,50,0,m\n", r"csv:1:1: names of columns.*what was read"),
        (f"{JOINTS},pose_x [mm],x [mm]\n10,20,15,10,50,0,1,2\n", r"got 'joints and poses'"),
        (f"row,reference,{HEAD}\n1,7,{GOOD}\n", r"csv:2: reference: got '7'"),
        (f"at_x [mm],{HEAD}\n5,{GOOD}\n", r"csv:2: hook: got 'a part of it'"),
        (f"{HEAD},sigma [deg]\n{GOOD},1\n", r"csv:1:.*unit of sigma"),
    ],
)  # fmt: skip
def test_mistakes_are_named_with_their_place(arm, tmp_path, text, words):
    with pytest.raises(rs.FileError) as error:
        read(arm, tmp_path, text)
    import re

    assert re.search(words.replace("'", "'?"), str(error.value)), str(error.value)


def test_a_tracker_export_needs_joints(arm):
    with pytest.raises(rs.FileError, match="postures and loads of a tracker export"):
        rs.Measurements.read(DATA / "tracker.csv", arm)


def test_a_marker_that_is_seen_once(arm, tmp_path):
    rows = [f"{k}0,20,15,10,50,0,{m},1,2,{k}" for k, m in ((1, "a"), (2, "a"), (3, "b"))]
    measured = read(arm, tmp_path, "\n".join([HEAD, *rows]))
    with pytest.raises(rs.InputError, match=r"marker 'b' of .*csv:4: got 'one reading'"):
        rs.identify(arm, measured, ["arm/joint1"])


def test_a_posture_beyond_limits(arm, tmp_path):
    rows = [f"{k},20,15,10,50,0,m,1,2,{k}" for k in (10, 20, 175, 30)]
    measured = read(arm, tmp_path, "\n".join([HEAD, *rows]))
    with pytest.raises(rs.InputError, match=r"posture of .*csv:4: got 'beyond-limits'"):
        rs.identify(arm, measured, ["arm/joint1"])
