"""The double pantograph: statics of scissors by hand, and its one freedom."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.linkage import Linkage

BAR, SPAN, SCREW = 0.5, 0.4, 1e6
E, SECTION = 70e9, rs.circle(0.030)


def linkage(k: float = SCREW) -> Linkage:
    return rs.load_linkage("double-pantograph", {"k": f"{k} N/m"})


def test_it_loads_by_its_name_as_a_network():
    network = rs.load("double-pantograph")
    assert isinstance(network, rs.Network)
    assert rs.verify(network).agree
    assert rs.shipped_linkages() == ("double-pantograph",)
    at_home = rs.compliance(rs.network_at(linkage()))
    np.testing.assert_allclose(rs.compliance(network), at_home, rtol=1e-9, atol=1e-15)


def test_a_load_in_the_middle_bends_the_bars_as_statics_tells():
    """Castigliano over eight half bars, each held where it crosses another, and the screw.

    The scissors are symmetric, so each end of the platform carries half. Moments about a crossing
    give the force across at the knees, cot(q) of the load, and at the feet, twice as much.
    """
    cos, sin, half = SPAN / BAR, np.sqrt(1 - (SPAN / BAR) ** 2), BAR / 2
    ends = {  # force on the outer end of a half bar per load: across, and up
        "top": (0, -1 / 2, (1, 1)),
        "knee, upper scissors": (-cos / sin, 1 / 2, (1, -1)),
        "knee, lower scissors": (cos / sin, -1 / 2, (1, 1)),
        "foot": (-2 * cos / sin, 1 / 2, (1, -1)),
    }
    expected = (2 * cos / sin) ** 2 / SCREW
    for across, up, side in ends.values():
        along = np.array([cos, sin]) * side
        pressed = np.array([across, up]) @ along
        bent = np.array([across, up]) @ [-along[1], along[0]]
        stretched = pressed**2 * half / (E * SECTION.A)
        expected += 2 * (stretched + bent**2 * half**3 / (3 * E * SECTION.Iy))
    C = rs.compliance(rs.network_at(linkage()))
    assert C[2, 2] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("stroke", [-0.25, -0.1, 0.05])
def test_the_screw_is_compliant_by_its_transmission(stroke):
    """h = 2 l sin q above feet that are l cos q apart: dh = -2 cot q ds."""
    span = SPAN + stroke
    transmission = 2 * span / np.sqrt(BAR**2 - span**2)
    soft, hard = (rs.compliance(rs.network_at(linkage(k), {"screw": stroke})) for k in (SCREW, 1e9))
    difference = transmission**2 * (1 / SCREW - 1 / 1e9)
    assert soft[2, 2] - hard[2, 2] == pytest.approx(difference, rel=1e-6)


def test_without_its_screw_it_collapses_upright():
    given = linkage()
    loose = rs.prismatic([1, 0, 0], rs.Passive(), name="screw")
    connections = (replace(c, element=loose) if c.name == "screw" else c for c in given.connections)
    network = rs.network_at(replace(given, connections=tuple(connections)), {"screw": -0.1})
    result = rs.stiffness(network)
    assert result.status == rs.Status.FREE_MOTIONS
    assert [str(motion) for motion in result.free_motions] == ["translation along z"]
