"""Networks under loads, from the command line."""

import json
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from tests.cli.running import Running

PORTAL = str(Path(__file__).parents[2] / "examples" / "portal.json")


run = Running("response")


def test_numbers_are_those_of_python():
    shown = run(
        PORTAL, "--json", "--along", "beam=0 0 -2 kN/m", "--on", "left post=200 mm 50 N 0 0",
        "--load", "corner=0 0 0 0 1 N m 0", "--settle", "right foot=0 0 -1 mm 0 0 1 deg",
    )  # fmt: skip
    assert shown.exit_code == 0
    data = json.loads(shown.stdout)
    expected = rs.network_response(
        rs.load(PORTAL),
        {
            "beam": rs.DistributedForce([0, 0, -2000]),
            "left post": rs.ForceOnBeam([50, 0, 0], 0.2),
            "corner": [0, 0, 0, 0, 1, 0],
        },
        settlements={"right foot": [0, 0, -1e-3, 0, 0, np.deg2rad(1)]},
    )
    assert data["schema"] == "robostiff response 1"
    assert np.allclose(data["displacements"]["corner"], expected.twists["corner"], rtol=1e-12)
    assert np.allclose(data["reactions"]["left foot"], expected.reactions["left foot"], rtol=1e-12)
    assert data["beams"]["beam"]["end"]["N"] == pytest.approx(expected.beams["beam"].end[0])
    assert data["energy"] == pytest.approx(expected.energy)


def test_what_is_rounding_is_shown_as_none():
    text = run(PORTAL, "--load", "top=0 1 kN 0").stdout
    assert "left foot   none" in text
    assert "elastic energy" in text
