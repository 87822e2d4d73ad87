"""What is said of networks that are written for other programs."""

import warnings

import pytest

import robostiff as rs
from robostiff.network import network_of_snapshot
from robostiff_interop import calculix_input, opensees_script


@pytest.mark.parametrize(
    ("write", "program"), [(calculix_input, "CalculiX"), (opensees_script, "OpenSees")]
)
def test_free_motions_are_said_to_have_no_compliance(write, program):
    """Other programs print numbers for them: zeros, or whatever rounding leaves."""
    hinged, hexapod = (
        network_of_snapshot(rs.find_posture(rs.load(name)).snapshot.one(0))
        for name in ("planar-link", "hexapod")
    )
    words = f"'planar-link' can move without meeting stiffness: what {program} prints is no compl"
    with pytest.warns(rs.PlausibilityWarning, match=words):
        write(hinged)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write(hexapod)
