"""Linkages on the command line: joints by name or in a row, parameters, maps."""

from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.io.map_files import read_map
from tests.cli.running import Running

FOUR_BAR = str(Path(__file__).parents[2] / "examples" / "four-bar.xml")
PANTOGRAPH = "double-pantograph"
run = Running()


@pytest.mark.parametrize("joints", ["screw=-50 mm", "-50 mm"])
def test_stiffness_and_deflection_at_values_of_joints(joints):
    linkage = rs.load_linkage(PANTOGRAPH, {"k": 1e5})
    network = rs.network_at(linkage, {"screw": -0.05})
    K = rs.stiffness(network).K
    options = (PANTOGRAPH, "--set", "k=1e5", "--joints", joints)
    found = run.answer("stiffness", *options)
    np.testing.assert_allclose(found["stiffness"], K, rtol=1e-9, atol=1e-9 * K.max())
    assert found["joint_coordinates"]["screw"] == [-0.05]
    found = run.answer("deflection", *options, "--wrench", "0 0 -100 0 0 0")
    bent = rs.deflection(network, None, [0, 0, -100, 0, 0, 0])
    np.testing.assert_allclose(found["deflection"], bent.twist, rtol=1e-9, atol=1e-15)


def test_a_map_over_a_joint_also_of_legs(tmp_path):
    path = tmp_path / "map.nc"
    outcome = run("map", FOUR_BAR, "--joint", "crank -10 deg 10 deg 3", "-o", str(path))
    assert outcome.exit_code == 0, outcome.stderr
    with read_map(path) as stored:
        assert stored.crank.attrs["units"] == "rad"
        assert stored.translational_stiffness.attrs["units"] == "N/m"
        assert (stored.status == 0).all()
        assert np.allclose(stored.crank, np.radians([-10, 0, 10]))
