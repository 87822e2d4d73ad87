"""Beams that bend far, with the number of their elements left open: as exact as elsewhere."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import robostiff as rs
from robostiff.elasticity import CrossSection, circle
from robostiff.network import Network, Node, beam_between
from tests.statics.robots_under_load import loaded

L = 0.7
STEEL = rs.material("steel")
SECTION = circle(2e-3)
EI = STEEL.E * SECTION.Iy
X, Y, _ = np.eye(3)


def cantilever(section: CrossSection = SECTION) -> Network:
    wall, tip = Node("wall", np.zeros(3)), Node("tip", L * X)
    bar = beam_between(wall, tip, STEEL, section, y_axis=Y.tolist(), name="rod")
    return Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(bar,))


def elastica(turn: float) -> tuple[float, np.ndarray]:
    """Force across the tip that turns it so far, and how the tip moves, by elliptic integrals.

    ``EI t'^2 / 2 = F (sin(turn) - sin(t))``, from the moment that vanishes at the tip.
    """

    def along(f: Any) -> float:
        def rate(u: float) -> float:  # with t = turn - u^2
            product = 2 * np.sin(u * u / 2) * np.cos(turn - u * u / 2)
            return float(f(turn - u * u) * 2 * u / np.sqrt(product))

        return quad(rate, 0, np.sqrt(turn), epsabs=1e-13, epsrel=1e-12)[0]

    length = along(np.ones_like)
    x, y = (L * along(f) / length for f in (np.cos, np.sin))
    return EI / 2 * (length / L) ** 2, np.array([x - L, y, turn])


@pytest.mark.parametrize("turn", [0.05, 0.08, 0.1, 0.25, 0.5, 0.8, 1.5])
def test_a_cantilever_under_a_force_across_it_is_the_elastica(turn: float):
    """Within 0.3 %; what it carries is that of one part, whatever the number of elements."""
    F, exact = elastica(turn)
    bent = loaded(cantilever(), wrench=[0, F, 0, 0, 0, 0])
    assert bent.status == 0
    assert not bent.advice
    assert np.abs(bent.displacement[[0, 1, 5]] - exact).max() < 3e-3 * np.abs(exact).max()
    assert bool(bent.divisions) == (turn > 0.085)
    (part,) = bent.parts
    assert (part.part, part.number, part.of) == ("rod", 1, 1)
    assert np.allclose(part.motion, bent.displacement, rtol=0, atol=1e-12)
    assert np.allclose(part.wrench, bent.wrench, rtol=0, atol=1e-9 * F)
    assert np.isclose(part.energy, bent.energy, rtol=1e-12)
    (share,) = bent.shares
    assert share.share == 1
    # the work of a force that grows from zero, by Simpson's rule over the exact curve
    turns = turn * np.linspace(0, 1, 201)[1:]
    forces, moved = zip(*map(elastica, turns), strict=True)
    shifts = np.array([0, *(m[1] for m in moved)])
    work = np.trapezoid([0, *forces], shifts)
    assert np.isclose(bent.energy, work, rtol=5e-3)


DOCUMENT = (Path(__file__).parents[2] / "docs/under-load.md").read_text("utf-8")
ROWS = re.findall(r"^\| ([\d.]+) rad \|(.*)\|$", DOCUMENT, re.MULTILINE)


@pytest.mark.parametrize(("turn", "cells"), ROWS, ids=[turn for turn, _ in ROWS])
def test_errors_are_those_of_the_documents(turn: str, cells: str):
    F, exact = elastica(float(turn))
    for elements, cell in zip((None, 1, 2, 4, 8), cells.split("|"), strict=True):
        if not cell.strip():
            continue
        beams = rs.Bowing(elements, inner_modes=True)
        bent = loaded(cantilever(), wrench=[0, F, 0, 0, 0, 0], beams=beams)
        error = np.abs(bent.displacement[[0, 1, 5]] - exact).max() / np.abs(exact).max()
        said = float(cell.replace("%", "")) * (0.01 if "%" in cell else 1.0)
        assert np.isclose(error, said, rtol=0.1), elements


def test_an_explicit_number_stays_and_the_advice_says_what_to_write():
    F, exact = elastica(0.8)
    one = loaded(cantilever(), wrench=[0, F, 0, 0, 0, 0], beams=rs.Bowing(1, inner_modes=True))
    assert "write beams=rs.Bowing()" in one.advice[0]
    assert not one.divisions
    assert np.abs(one.displacement[[0, 1, 5]] - exact).max() > 0.05 * exact[2]
    four = loaded(cantilever(), wrench=[0, F, 0, 0, 0, 0], beams=rs.Bowing(4))
    assert [(part.number, part.of) for part in four.parts] == [(i, 4) for i in range(1, 5)]
    assert "write beams=rs.Bowing()" in four.advice[0]


def test_a_strip_buckles_sideways_by_default():
    """Prandtl (1899): one element shows nothing of it."""
    thin = CrossSection(A=1e-4, Iy=1e-12, Iz=1e-8, J=2e-12)
    exact = 4.0126 * np.sqrt(STEEL.E * thin.Iy * STEEL.G * thin.J) / L**2
    found = rs.critical_load(cantilever(thin), wrench=[0, 0.1, 0, 0, 0, 0])
    assert 0 < 0.1 * found.factor / exact - 1 < 0.005
    # a little beside it: sideways as with many elements, before that load
    for part, most in ((0.1, 0.01), (0.5, 0.01), (0.9, 0.03)):
        F = part * exact * np.array([0, 1, 1e-4, 0, 0, 0])
        own = loaded(cantilever(thin), wrench=F)
        fine = loaded(cantilever(thin), wrench=F, beams=rs.Bowing(32, inner_modes=True))
        assert abs(own.displacement[2] / fine.displacement[2] - 1) < most


def test_a_column_that_is_loaded_aside_before_and_beyond_eulers_load():
    """A curve that one element follows to another load; it agrees with that of many."""
    euler = np.pi**2 * EI / (4 * L**2)
    wrench, factors = euler * np.array([-1, 0.05, 0, 0, 0, 0]), [0.5, 1.2]
    own = rs.load_path(cantilever(), None, wrench, factors)
    many = rs.load_path(cantilever(), None, wrench, factors, beams=rs.Bowing(8, inner_modes=True))
    assert np.allclose(own.displacement, many.displacement, rtol=0, atol=5e-3 * L)
    assert own.stable.all()
    assert np.allclose(own.energy, many.energy, rtol=0.01)
    assert not rs.critical_load(cantilever(), wrench=wrench, up_to=1.2).is_found


def test_modes_about_a_bent_equilibrium():
    F, _ = elastica(0.6)
    given = {"masses": {"platform": 0.1}, "wrench": [0, F, 0, 0, 0, 0]}
    own = rs.modes(cantilever(), **given)
    many = rs.modes(cantilever(), **given, beams=rs.Bowing(16, inner_modes=True))
    assert np.allclose(own.frequencies[:4], many.frequencies[:4], rtol=3e-3)


ARM = """
robostiff: 1
name: arm
title: Arm of two slender rods
source: Dimensions are chosen here.
legs:
  - name: arm
    chain:
      - {type: revolute, name: shoulder, axis: z, role: actuated, stiffness: 50 N m/rad}
      - {type: beam, name: upper, to: [400 mm, 0, 0], material: steel,
         section: {circle: {diameter: 8 mm}}}
      - {type: revolute, name: elbow, axis: z, role: actuated, stiffness: 50 N m/rad, home: 0.5 rad}
      - {type: beam, name: fore, to: [300 mm, 0, 0], material: steel,
         section: {circle: {diameter: 6 mm}}}
"""


def test_many_equilibria_are_those_of_each(tmp_path):
    """Where a record bends a beam too far, the equilibrium is that of more elements."""
    file = tmp_path / "arm.yaml"
    file.write_text(ARM)
    robot = rs.load(file)
    F = np.linspace(0, 90, 7)[:, None] * [0, 0.3, 1, 0, 0, 0]
    pose = rs.JointCoordinates(np.tile([0.1, 0.5], (len(F), 1)))
    fast = rs.compile_loaded(robot, backend=rs.Backend.ARRAYS)
    many = fast.evaluate(pose, F)
    each = [rs.equilibrium(robot, rs.JointCoordinates([0.1, 0.5]), own) for own in F]
    assert not many.guarded.all()
    assert {n for one in each for n in one.divisions.values()} >= {2, 4}
    for own, guarded, one in zip(many, many.guarded, each, strict=True):
        assert guarded or not one.divisions
        assert np.allclose(own.displacement, one.displacement, rtol=1e-9, atol=1e-12)
        assert np.allclose(own.K, one.K, rtol=1e-7, atol=1e-9 * np.abs(one.K).max())
        assert {part.part for part in own.parts} == {"shoulder", "upper", "elbow", "fore"}
        assert not own.advice
    fine = rs.equilibrium(
        robot, rs.JointCoordinates([0.1, 0.5]), F[-1], beams=rs.Bowing(16, inner_modes=True)
    )
    assert np.allclose(many[-1].displacement, fine.displacement, rtol=0, atol=2e-3)
    shares = {share.part: share.share for share in fine.shares}
    for share in many[-1].shares:
        assert np.isclose(share.share, shares[share.part], atol=2e-3)
