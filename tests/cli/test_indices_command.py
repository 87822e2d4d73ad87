"""``robostiff indices`` as a user types it."""

import numpy as np

import robostiff as rs
from tests.cli.running import Running

run = Running("indices")
answer = run.answer


def test_json_has_every_index_with_its_unit_and_status():
    found = answer("gough-stewart-b", "--length", "200 mm")
    expected = rs.indices(rs.stiffness(rs.load("gough-stewart-b")), length=0.2)
    assert found["length"] == 0.2
    listed = found["indices"]
    assert set(listed) == {
        "along_axes",
        "principal",
        "collinear",
        "worst_deflection",
        "anisotropy",
        "eigenscrews",
        "centre_of_stiffness",
        "centre_of_compliance",
        "eigenstiffness",
        "condition",
        "virtual_work",
    }
    assert np.isclose(listed["condition"]["two_norm"], expected.condition.two_norm or 0.0)
    assert listed["eigenstiffness"]["unit"] == "N/m"
    assert listed["principal"]["units"] == ["N/m", "N m/rad"]
    assert listed["centre_of_stiffness"]["status"] == "ok"
    assert listed["eigenscrews"]["wrenches"][0]["screw"]["pitch"] == 0.0


def test_what_is_unlimited_is_null_in_json_and_said_in_words():
    found = answer("gough-stewart-a")
    assert found["status"] == "free-motions"
    assert found["indices"]["worst_deflection"]["translational"] is None
    text = run("gough-stewart-a").stdout
    assert "moves freely" in text
    assert "centre of compliance: none" in text
    assert "free: rotation about x through (0, 0, 2) m" in text


def test_a_pose_out_of_reach_is_a_bad_status():
    found = answer("3-puu", "--pose", "0.8 0 0.3", status=1)
    assert found["indices"] is None
    assert found["status"] == "unreachable"
    outcome = run("3-puu", "--pose", "0.8 0 0.3")
    assert outcome.exit_code == 1
    assert "falls short of the pose" in outcome.stdout
