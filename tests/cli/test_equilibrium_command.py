"""``robostiff equilibrium`` as a user types it."""

# pyright: reportArgumentType=false

import json
import re

import numpy as np
import pytest

import robostiff as rs
from tests.cli.running import Running

run = Running("equilibrium")
answer = run.answer


def test_json_is_the_answer_of_python():
    found = answer(
        "hexapod",
        *("--wrench", "0 0 -50 kN 0 0 0", "--at", "0 0 1", "--gravity=-z"),
        *("--weight", "leg1/strut=12 kg", "--weight", "platform=80 kg"),
        *("--load", "leg2/strut=0 10 N 0", "--preload", "leg3/strut=2 kN", "--critical"),
    )
    robot = rs.load("hexapod")
    options = {
        "at": [0, 0, 1],
        "gravity": "-z",
        "loads": {"leg1/strut": rs.Mass(12.0), "platform": rs.Mass(80.0), "leg2/strut": [0, 10, 0]},
        "preload": {"leg3/strut": 2000.0},
    }
    F = [0, 0, -5e4, 0, 0, 0]
    wanted = rs.equilibrium(robot, None, F, **options)
    critical = rs.critical_load(robot, None, F, **options)
    assert np.allclose(found["displacement"], wanted.displacement, rtol=1e-12, atol=1e-18)
    assert np.allclose(found["K_total"], wanted.K_total, rtol=1e-12)
    assert np.isclose(found["energy"], wanted.energy)
    assert found["status"] == str(wanted.status) == "ok"
    assert found["stable"] is True
    assert len(found["reactions"]) == 6
    assert np.isclose(found["critical_load"]["factor"], critical.factor)
    assert found["critical_load"]["mode"] == critical.mode
    assert {part["part"] for part in found["parts"]} >= {"strut", "strut.beam1"}


def test_text_lists_what_a_person_asks():
    text = run("six-joint-arm", "--gravity=-z", "--wrench", "0 0 -150 N 0 0 0").stdout
    for words in (
        "status: ok",
        "\nFz    -150 N  dz ",
        "stable, margin 0.998",
        "K under load",
        "elastic energy",
        "arm/joint2",
        "elastic drive",
    ):
        assert words in text, words


def test_nothing_is_strained_without_load():
    text = run("hexapod").stdout
    assert "\nFz      0 N  dz              0 µm\n" in text
    assert "elastic" not in text
    least = run("hexapod", "--wrench", "0 0 -1e-6 N 0 0 0").stdout
    assert "dz            -3.1" in least
    assert "elastic energy" in least


def test_beyond_the_critical_load_is_a_bad_status_with_advice():
    outcome = run("gough-stewart-b", "--wrench", "0 0 -1e8 0 0 0", "--critical")
    assert outcome.exit_code == 1
    assert "status: unstable+beyond-critical-load" in outcome.stdout
    assert "advice: at 0.716" in outcome.stdout
    factor = outcome.stdout.partition("critical load: ")[2].partition(" times")[0]
    assert np.isclose(float(factor), 0.716, atol=5e-4)


def test_curve_has_a_status_for_every_factor():
    found = answer("gough-stewart-b", "--wrench", "0 0 -5e7 0 0 0", "--factors", "0 2 3", status=0)[
        "load_path"
    ]
    assert found["factors"] == [0, 1, 2]
    assert found["status"][:2] == ["ok", "ok"]
    assert "beyond-critical-load" in found["status"][2]
    text = run("gough-stewart-b", "--wrench", "0 0 -5e7 0 0 0", "--factors", "0 2 3").stdout
    assert "beyond-critical-load" in text


def test_a_network_comes_to_rest_at_its_own_pose():
    wrench = "100 50 -30 1 1 1"
    found = answer("double-pantograph", "--wrench", wrench, "--preload", "screw=10 N")
    wanted = rs.equilibrium(
        rs.load("double-pantograph"), None, [100, 50, -30, 1, 1, 1], preload={"screw": 10.0}
    )
    assert np.allclose(found["displacement"], wanted.displacement, rtol=1e-12, atol=1e-18)


def test_free_motions_have_no_critical_load_and_no_rounding_in_K():
    outcome = run("planar-link", "--wrench", "1 kN 0 0", "--critical")
    assert "no critical load is determined: hold the free motions of the platform" in outcome.stdout
    entries = [line.split()[1:] for line in outcome.stdout.splitlines() if line[:5] == "  Mz "]
    assert entries == [["0", "0", "0"]]


def test_cables_are_answered_too():
    outcome = run("cable-8", "--wrench", "0 0 -200 0 0 0")
    assert outcome.exit_code == 0, outcome.stderr
    assert "status: slack" in outcome.stdout
    assert re.search(r"cables:\n.*tension.*\ncable1 +142\.64 N ", outcome.stdout)
    low = run("cable-8", "--wrench", "0 0 -100 0 0 0")
    assert low.exit_code == 1
    words = "advice: the tension of 'cable5' is 17.51 N, outside its limits 50 to 720 N"
    assert words in low.stdout
    lifted = run("cable-8-suspended", "--wrench", "0 0 1.5 kN 0 0 0", "--critical")
    assert lifted.exit_code == 1
    assert "critical load: 0.57829 times the wrench" in lifted.stdout


def test_plot_of_the_curve(tmp_path):
    path = tmp_path / "curve.svg"
    asked = ("gough-stewart-b", "--wrench", "0 0 -5e7 0 0 0", "--plot", str(path))
    outcome = run(*asked, "--factors", "0 1 3")
    assert outcome.exit_code == 0, outcome.stderr
    assert "stable" in path.read_text(encoding="utf-8")
    again = run(*asked, "--factors", "0 1 3")
    assert again.exit_code == 2
    assert "--overwrite" in again.stderr


@pytest.mark.parametrize("robot", ["3-puu", "cable-8"])
def test_plot_of_the_loaded_shape(tmp_path, robot: str):
    path = tmp_path / "shape.svg"
    outcome = run(robot, "--wrench", "0 0 -200 0 0 0", "--plot", str(path))
    assert outcome.exit_code == 0, outcome.stderr
    assert "under load" in path.read_text(encoding="utf-8")


def test_plot_of_a_mode_moves(tmp_path):
    path = tmp_path / "mode.html"
    words = ("3-rrr", "--mass", "platform=5 kg", "--plot", str(path), "--mode", "2")
    outcome = Running("modes")(*words)
    assert outcome.exit_code == 0, outcome.stderr
    page = path.read_text(encoding="utf-8")
    assert "mode 2" in page
    assert "swing(document.getElementById(" in page


def test_report_on_finite_loads(tmp_path):
    path = tmp_path / "report.html"
    words = ("gough-stewart-b", "--wrench", "0 0 -5e7 0 0 0", "--finite-load", "-o", str(path))
    outcome = Running("report")(*words)
    assert outcome.exit_code == 0, outcome.stderr
    page = path.read_text(encoding="utf-8")
    assert "Under finite load" in page
    assert "Critical load: 1.43" in page
    assert "K under load" in page
    assert "plot-load-curve" in page
    assert "Status ok: stable, margin" in page


def test_rigid_links_have_an_answer_and_a_compliance(tmp_path):
    """Elastic drive, rigid link: no K exists, and the text and the data say C."""
    file = tmp_path / "slide.yaml"
    file.write_text(
        """
robostiff: 1
name: slide
source: a test
home: {at: [0.5, 0, 0]}
legs:
  - name: arm
    chain:
      - {type: prismatic, name: drive, axis: x, role: actuated, stiffness: 1e6 N/m}
      - {type: rigid, to: [0.5, 0, 0]}
"""
    )
    found = run(str(file), "--wrench", "100 N 0 0 0 0 0")
    assert found.exit_code == 1
    assert "C under load" in found.output
    assert re.search(r"dx +100 µm\n", found.output)
    data = json.loads(run(str(file), "--wrench", "100 N 0 0 0 0 0", "--json").output)
    assert data["K"] is None
    assert data["compliance"][0][0] == pytest.approx(1e-6)
