"""--near chooses a posture on the command line."""

import json

import numpy as np
from typer.testing import CliRunner

import robostiff as rs
from robostiff.cli.main import app


def test_near_chooses_the_other_posture():
    robot, pose = rs.load("3-rrr"), [0.02, 0.01, 0.1]
    other = [own[-1].coordinates for own in rs.postures(robot, pose).values()]
    words = " ".join(f"{value:.17g}" for q in other for value in q)
    command = ["stiffness", "3-rrr", "--pose", "0.02 0.01 0.1", "--json"]
    home = CliRunner().invoke(app, command)
    near = CliRunner().invoke(app, [*command, "--near", words])
    assert home.exit_code == near.exit_code == 0
    expected = rs.stiffness(robot, pose, near=other).K
    K = np.array(json.loads(near.stdout)["stiffness"])
    assert np.allclose(K, expected, rtol=1e-9)
    apart = K - np.array(json.loads(home.stdout)["stiffness"])
    assert np.abs(apart).max() > 1e-3 * np.abs(K).max()


def test_near_of_a_wrong_count():
    result = CliRunner().invoke(app, ["stiffness", "3-rrr", "--near", "1 2"])
    assert result.exit_code == 2
