"""``robostiff modes`` as a user types it."""

import json
import re

import numpy as np

import robostiff as rs
from tests.cli.running import Running

run = Running("modes")


def test_json_is_the_answer_of_python():
    outcome = run(
        "six-joint-arm",
        *("--mass", "platform=8 kg", "--mass", "arm/joint3=2 kg"),
        *("--gravity=-z", "--wrench", "0 0 -150 N 0 0 0", "--json"),
    )
    assert outcome.exit_code == 0, outcome.stderr
    found = json.loads(outcome.stdout)
    wanted = rs.modes(
        rs.load("six-joint-arm"),
        masses={"platform": 8.0, "arm/joint3": 2.0},
        wrench=[0, 0, -150, 0, 0, 0],
        gravity="-z",
    )
    assert found["status"] == "ok"
    assert np.allclose([own["frequency"] for own in found["modes"]], wanted.frequencies)
    assert found["modes"][0]["words"] == wanted[0].words
    assert sum(own["share"] for own in found["modes"][0]["shares"]) - 1 < 1e-12


def test_text_lists_the_slowest_first():
    text = run("hexapod", "--mass", "platform=150 kg").stdout
    # two of one frequency are along the axes
    about = "the platform moves: rotation about"
    through = "through (0, 0, 1.727) m "
    assert f"\n1     49.645 Hz  {about} y {through}  leg2/strut 17 %, leg5/strut 17 %" in text
    assert f"\n2     49.645 Hz  {about} x {through}  leg3/strut 17 %, leg4/strut 17 %" in text
    assert "more at higher frequencies" in text
    # those of bodies that only the command line has are not of the model
    *_, of_model, beside = text.splitlines()
    assert of_model.startswith("masses of the model: 6 x strut.beam1 13.81 kg, 6 x")
    assert beside == "beside them: platform 150 kg"
    assert "masses of" not in run("gough-stewart-b", "--mass", "platform=150 kg").stdout


def test_a_bad_status_and_cables():
    nowhere = run("hexapod", "--pose", "0 0 9 0 0 0")
    assert nowhere.exit_code == 1
    assert "status: beyond-limits" in nowhere.stdout
    cables = run("cable-8", "--mass", "platform=1 kg")
    assert cables.exit_code == 0
    assert re.search(r" 28.51\d Hz +the platform moves: translation along z", cables.stdout)
