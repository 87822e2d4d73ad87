"""Legs in numbers: their stiffness, and which of them are turns of others."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic.placement import agreement
from robostiff.analytic.placement.agreement import numbers_of
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.analytic.placement.turned_legs import images_of_legs
from robostiff.analytic.springs.unit_wrenches import SampledLeg, WrenchSearch
from robostiff.robots import robot_file
from tests.files import FILES

ALL = rs.ALL_PARAMETERS


def legs_of(robot):
    placed = place_robot(robot, rs.AtHome())
    space, length = placed.entries.space, placed.length
    search = WrenchSearch(placed.record, placed.reference, space, length)
    each: list[Any] = [SampledLeg.of(own.leg, search) for own in placed.legs]
    return placed, each


def stiffness_of(leg):
    """W (W^T C W)^-1 W^T over the wrenches that a leg transmits (samples, n, n)."""
    W = np.linalg.svd(leg.J)[0][:, :, leg.C.shape[1] - leg.transmitted :]
    return W @ np.linalg.inv(W.mT @ leg.C @ W) @ W.mT


def images(robot):
    placed = place_robot(robot, rs.AtHome())
    return images_of_legs(robot, numbers_of(placed).leg_stiffness, placed.length)


def turned(robot):
    each = images(robot).items()
    return {i: (first, str(way.part), way.mirror is not None) for i, (first, way) in each}


def test_legs_of_a_hexapod_are_turns_and_mirror_images_of_the_first():
    found = turned(rs.load("gough-stewart-b", symbols=ALL))
    assert {i: own[1:] for i, own in found.items() if not own[2]} == {
        2: ("1/3", False),
        4: ("2/3", False),
    }
    assert sorted(i for i, own in found.items() if own[2]) == [1, 3, 5]
    assert {first for first, *_ in found.values()} == {0}


@pytest.mark.parametrize("name", ["gough-stewart-b", "3-rrr", "3-upu", "3-puu", "hexapod"])
def test_a_turned_leg_that_is_closed_by_itself_holds_as_the_image_of_the_first(name):
    robot = rs.load(name, symbols=ALL)
    placed, each = legs_of(robot)
    rows = np.array(placed.entries.space.rows)
    assert images(robot)
    for i, (first, way) in images(robot).items():
        T = way.of(np.eye(6)).T[np.ix_(rows, rows)]
        image = T @ stiffness_of(each[first]) @ T.T
        assert each[first].redundant == each[i].redundant
        assert np.max(np.abs(image - stiffness_of(each[i]))) < 1e-12 * np.max(np.abs(image))


def test_legs_that_differ_in_the_tenth_digit_or_in_their_working_mode_are_no_turns():
    robot = rs.load("3-rrr", symbols=ALL)
    assert turned(robot) == {1: (0, "1/3", False), 2: (0, "2/3", False)}
    first, second, third = robot.legs
    assert turned(replace(robot, legs=(first, replace(second, elbow=rs.Elbow.MINUS), third))) == {}
    x, y, z = second.base.p
    nearly = replace(second.base, p=np.array([x * (1 + sp.Rational(1, 10**10)), y, z]))
    assert turned(replace(robot, legs=(first, replace(second, base=nearly), third))) == {}


def test_legs_that_are_alike_at_the_values_of_the_model_alone_are_no_turns(monkeypatch):
    monkeypatch.setattr(agreement, "_SPREADS", (0.0,))
    robot = rs.load("gough-stewart-b", symbols=ALL)
    R, other = sp.Symbol("R", positive=True), sp.Symbol("other", positive=True)
    first, second, *others = robot.legs
    base = replace(second.base, p=np.array([sp.sympify(x).subs(R, other) for x in second.base.p]))
    nominal = {**robot.nominal, "other": robot.nominal["R"]}
    robot = replace(robot, legs=(first, replace(second, base=base), *others), nominal=nominal)
    assert other in rs.derive(robot).K.free_symbols


def test_stiffnesses_that_are_equal_in_numbers_alone_are_no_turns(tmp_path):
    """All legs were taken for turns of the first: an error, as the formula and numbers differ."""
    text = robot_file("gough-stewart-b").read_text(encoding="utf-8")
    text = text.replace("  k: 1e8 N/m", "  k: 1e8 N/m\n  soft: 1e8 N/m")
    for i in range(1, 7):
        text = text.replace(f"name: leg{i},", f"name: leg{i}, odd: {int(i == 6)},")
    page = tmp_path / "two-stiffnesses.yaml"
    page.write_text(text.replace("stiffness: k}", "stiffness: k + (soft - k)*odd}"), "utf-8")
    robot = rs.load(page, symbols=ALL)
    assert turned(robot) == {2: (0, "1/3", False), 4: (0, "2/3", False)}
    formula, values = rs.derive(robot), {**robot.nominal, "soft": 3e7}
    K = formula.lambdify()(**{s.name: values[s.name] for s in formula.symbols})
    np.testing.assert_allclose(K, rs.stiffness(robot.substituted(values)).K, rtol=1e-9, atol=1e-3)


def test_springs_on_the_platform_that_do_not_turn_with_their_legs(tmp_path):
    text = robot_file("hexapod").read_text(encoding="utf-8")
    head, mark, tail = text.rpartition("compliance: [1/k_joint, 1/k_joint")
    assert mark
    page = tmp_path / "hexapod.yaml"
    page.write_text(f"{head}compliance: [1/k_joint, 2/k_joint{tail}", encoding="utf-8")
    assert turned(rs.load(page, symbols=ALL)) == {}


def test_mirror_images_count_only_where_all_of_them_are_there():
    robot = rs.load("gough-stewart-b", symbols=ALL)
    found = turned(replace(robot, legs=robot.legs[:5]))
    assert found == {2: (0, "1/3", False), 4: (0, "2/3", False)}


def test_a_leg_that_is_rigid_in_a_direction_is_refused():
    with pytest.raises(rs.InputError, match="meets no compliance"):
        rs.derive(rs.load(FILES / "rigid-across.yaml", symbols=ALL))
