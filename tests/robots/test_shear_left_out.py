"""Shear that beams of no chosen theory leave out is said where it makes a robot much softer."""

import warnings

import numpy as np
import pytest

import robostiff as rs

HALF = "{share: 0.5, section: {circle: {diameter: 40 mm}}}"
ARM = """robostiff: 1
name: arm
source: chosen here
legs:
  - name: arm
    chain:
      - {type: revolute, axis: z, role: actuated, stiffness: STIFFNESS}
"""
BEAM = "      - {type: beam, to: [80 mm, 0, 0], material: steel, PART}\n"
SECTION = "section: {circle: {diameter: 40 mm}}"
QUILL = """      - type: telescope
        direction: x
        role: {locked: 1e12 N/m}
        home: 50 mm
        beams: [{share: 1, fixed: 30 mm, material: steel, section: {circle: {diameter: 40 mm}}}]
"""


def loaded(tmp_path, text):
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    return rs.load(str(path))


def compliance_across(robot):
    return rs.stiffness(robot).compliance[2, 2]


@pytest.mark.parametrize(
    "part",
    [
        BEAM.replace("PART", SECTION),
        BEAM.replace("PART", f"taper: [{HALF}, {HALF}]"),
        QUILL.replace("{locked: 1e12 N/m}", "locked\n        stiffness: 1e12 N/m"),
    ],
    ids=["beam", "taper", "telescope"],
)
def test_stubby_beams_of_no_chosen_theory(tmp_path, part):
    """Of a steel rod as long as two diameters, shear adds 14 % to what a force bends."""
    stiff = ARM.replace("STIFFNESS", "1e12 N m/rad") + part
    with pytest.warns(rs.PlausibilityWarning, match=r"arm.yaml:1:1: shear, .* 55% softer at home"):
        plain = loaded(tmp_path, stiff)
    with warnings.catch_warnings():
        warnings.simplefilter("error", rs.PlausibilityWarning)
        same, sheared = (
            loaded(tmp_path, stiff.replace("material: steel", f"theory: {name}, material: steel"))
            for name in ("euler-bernoulli", "timoshenko")
        )
        # A soft drive about z does not bend across it; a longer beam needs no shear.
        loaded(tmp_path, stiff.replace("80 mm", "300 mm").replace("fixed: 30 mm", "fixed: 250 mm"))
    assert compliance_across(plain) == compliance_across(same)
    assert 0.135 < compliance_across(sheared) / compliance_across(plain) - 1 < 0.145
    # The largest: a force and a couple that do not turn the tip, L^3 / (12 E I) + L / (k G A).
    C, more = (rs.stiffness(robot).compliance for robot in (plain, sheared))
    worst = np.linalg.eigvals(np.linalg.solve(C, more)).real.max()
    assert 1.54 < worst < 1.56


def test_what_is_soft_in_other_places_does_not_warn(tmp_path):
    """A stubby beam on a ball joint carries no force across it."""
    text = ARM.replace("STIFFNESS", "2e3 N m/rad") + BEAM.replace("PART", SECTION)
    joints = [f"{{type: revolute, axis: {a}, role: locked, stiffness: 1e3 N m/rad}}" for a in "xyz"]
    text += "".join(f"      - {joint}\n" for joint in joints)
    text += "".join(
        f"      - {{type: prismatic, axis: {a}, role: locked, stiffness: 1e4 N/m}}\n" for a in "xyz"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error", rs.PlausibilityWarning)
        loaded(tmp_path, text)
