"""The section on natural frequencies: what it lists, and pictures that move."""

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.markup import Table
from robostiff.report.contents import report_contents
from robostiff.report.figures import figures_in
from robostiff.report.results import vibrations_section

pytest.importorskip("plotly")

PALETTE = rs.plot.Theme.LIGHT.palette


def test_slowest_modes_are_listed_and_move():
    robot = rs.load("scara")
    contents = report_contents(robot)
    section = vibrations_section(contents)
    assert section is not None
    assert contents.modes is not None
    (table,) = [part for part in section.blocks if isinstance(part, Table)]
    frequencies = rs.modes(robot, gravity=[0, 0, 0]).frequencies
    assert len(table.rows) == min(10, len(frequencies))
    for row, frequency in zip(table.rows, frequencies, strict=False):
        assert np.isclose(row[1].value, frequency)  # type: ignore[union-attr]
    (figure,) = figures_in(section.blocks)
    for level, drawn in zip(figure.levels, figure.data(PALETTE)["levels"], strict=True):
        assert level.other is not None
        assert len(drawn["other"]) == len(drawn["drawn"]["data"])
        one, other = drawn_points(level.picture), drawn_points(level.other)
        # both ends are as far from rest, on opposite sides
        rest = 0.5 * (one + other)
        assert np.abs(one - rest).max() > 0.01


def drawn_points(picture: Any) -> np.ndarray:
    return np.concatenate([item.points for item in picture.items if hasattr(item, "points")])


def test_nothing_is_said_of_a_robot_without_masses():
    assert vibrations_section(report_contents(rs.load("gough-stewart-b"))) is None
