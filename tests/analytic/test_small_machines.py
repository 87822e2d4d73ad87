"""Formulas at a general pose do not depend on how large a machine is."""

import re
from pathlib import Path

import pytest

import robostiff as rs
from robostiff.robots import robot_file


@pytest.mark.parametrize("name", ["3-rrr", "3-puu", "delta"])
def test_a_machine_of_a_hundredth_of_the_size_has_the_same_vectors(name, tmp_path):
    text = Path(robot_file(name)).read_text(encoding="utf-8")
    small = tmp_path / "small.yaml"
    small.write_text(re.sub(r"([\d.]+) mm\b", lambda own: f"{float(own[1]) / 100:g} mm", text))
    one, other = (rs.derive(robot, pose=rs.AtSymbols()) for robot in (name, small))
    assert one.vectors is not None
    assert other.vectors is not None
    assert other.vectors.leg == one.vectors.leg
