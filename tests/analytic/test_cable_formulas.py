"""Formulas of cable robots: numbers at random poses and tensions, energies, and closed forms."""

import itertools
import json
import math
import subprocess
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.analytic import CableFormula, differentiate
from robostiff.analytic.export import (
    c_function,
    derivation_data,
    derivation_latex,
    derivation_text,
    latex_snippet,
    python_function,
)
from robostiff.frozen import replace
from robostiff.spatial import Space
from tests.cables.test_compiled_cables import changed, energy

ROBOTS: dict[str, Any] = {
    "plain": lambda: rs.load("cable-8"),
    "off centre": lambda: rs.load("cable-8-suspended"),
    "three": lambda: rs.load("cable-3-suspended"),
    "planar": lambda: rs.load("cable-4-planar"),
    "guides": lambda: changed("cable-8", 1),
    "winches": lambda: of_many_kinds(winches=True),
    "some winches": lambda: of_many_kinds(winches=False),
    "reference point": lambda: replace(changed("cable-8", 2), reference_point=[0.1, 0.02, -0.3]),
    "turned home": lambda: turned(changed("cable-8", 3)),
    "planar, weight beside": lambda: replace(
        changed("cable-4-planar", 1), weight=rs.Weight([5, -30, 0], [0.1, 0.2, 0])
    ),
}


def of_many_kinds(*, winches: bool) -> rs.CableRobot:
    """Cables of other rigidities; winches of all, or of some, and some cables that are rigid."""
    robot = rs.load("cable-8")
    return replace(
        robot,
        cables=tuple(
            replace(
                cable,
                EA=None if not winches and i == 3 else 1e5 + 1e4 * i,
                winch_stiffness=1e6 + 1e5 * i if winches or i > 2 else None,
            )
            for i, cable in enumerate(robot.cables)
        ),
        weight=rs.Weight([1.0, 2.0, -80.0], [0.01, 0.02, -0.1]),
    )


def turned(robot: rs.CableRobot) -> rs.CableRobot:
    R = Rotation.from_rotvec([0.1, -0.2, 0.3]).as_matrix()
    return replace(robot, home=rs.Frame(R, [0.1, 0.0, 1.1]))


def distance(K: np.ndarray, other: np.ndarray) -> float:
    scale = np.sqrt(np.abs(np.diag(other)))
    return float(np.max(np.abs(K - other) / np.outer(scale, scale)))


def numbers(robot: rs.CableRobot, seed: int) -> tuple[np.ndarray, dict[str, float]]:
    """Random tensions, as numbers and by names."""
    t = np.random.default_rng(seed).uniform(10, 600, len(robot.cables))
    return t, {f"t_{i + 1}": x for i, x in enumerate(t.tolist())}


@pytest.mark.parametrize("name", ROBOTS)
def test_formulas_at_home_and_at_any_pose_are_those_of_numbers(name: str) -> None:
    robot = ROBOTS[name]()
    t, named = numbers(robot, 1)
    given = rs.GivenTensions(t)
    at_home = rs.derive(robot)
    assert {str(x) for x in at_home.symbols} == set(named)
    K = rs.cable_stiffness(robot, tensions=given).matrix
    assert distance(at_home.lambdify()(**named), K) < 1e-12
    sequence = "ZYX" if robot.space is Space.PLANAR else "ZXZ"
    for rotation in (None, rs.EulerAngles(sequence)):
        general = rs.derive(robot, pose=rs.AtSymbols(rotation) if rotation else rs.AtSymbols())
        at = np.random.default_rng(2).uniform(-0.3, 0.3, len(general.coordinates))
        place = dict(zip(general.coordinates, at.tolist(), strict=True))
        place |= {x: place[x] + c for x, c in zip("xyz", robot.home.p, strict=True) if x in place}
        angles = list(place.values())[-3:] if robot.space is Space.SPATIAL else [0, 0, at[-1]]
        kind = sequence if rotation and robot.space is Space.SPATIAL else "xyz"
        six = [place["x"], place["y"], place.get("z", 0.0)]
        six += Rotation.from_euler(kind, angles).as_rotvec().tolist()
        pose = np.array(six)[robot.coordinate_places]
        K = rs.cable_stiffness(robot, pose, tensions=given).matrix
        assert distance(general.lambdify()(**place, **named), K) < 1e-12
        chosen = rs.derive(robot, pose=rs.AtCoordinates({"x": place["x"], "y": place["y"]}))
        pose = rs.cable_stiffness(robot).pose[robot.coordinate_places]
        pose[:2] = place["x"], place["y"]
        K = rs.cable_stiffness(robot, pose, tensions=given).matrix
        assert distance(chosen.lambdify()(**named), K) < 1e-12


def test_two_cables_that_pull_against_each_other() -> None:
    """2 EA/L along, 2 t/L across, and 2 t b (L + b)/L about the middle of a bar of length 2 b."""
    L, b, EA, t = sp.Rational(4, 5), sp.Rational(1, 5), 1000, sp.Symbol("t_1", real=True)
    ends = {"left": ([-1, 0, 0], [-0.2, 0, 0]), "right": ([1, 0, 0], [0.2, 0, 0])}
    cables = tuple(rs.Cable(n, *points, EA=1e3) for n, points in ends.items())
    bar = rs.CableRobot("bar", cables, rs.Frame.identity(), space=Space.PLANAR)
    K = rs.derive(bar).subs({"t_2": t}).substituted({})
    assert sp.simplify(K[0, 0] - 2 * (EA + t) / L) == 0
    assert sp.simplify(K[1, 1] - 2 * t / L) == 0
    assert sp.simplify(K[2, 2] - 2 * t * b * (L + b) / L) == 0
    assert all(sp.simplify(K[i, j]) == 0 for i, j in itertools.permutations(range(3), 2))


def test_a_formula_is_the_second_derivative_of_the_energy_in_many_digits() -> None:
    robot = changed("cable-8", 1)
    robot = replace(robot, weight=rs.Weight([3.0, -2.0, -90.0], [0.05, 0.02, -0.1]))
    t, named = numbers(robot, 3)
    at = {"x": 0.2, "y": -0.1, "z": 1.1, "alpha": 0.05, "beta": -0.08, "gamma": 0.1}
    found = rs.derive(robot, pose=rs.AtSymbols()).lambdify()(**at, **named)
    with mp.workdps(40):
        x, y, z = (mp.mpf(at[name]) for name in ("alpha", "beta", "gamma"))
        about_x = mp.matrix([[1, 0, 0], [0, mp.cos(x), -mp.sin(x)], [0, mp.sin(x), mp.cos(x)]])
        about_y = mp.matrix([[mp.cos(y), 0, mp.sin(y)], [0, 1, 0], [-mp.sin(y), 0, mp.cos(y)]])
        about_z = mp.matrix([[mp.cos(z), -mp.sin(z), 0], [mp.sin(z), mp.cos(z), 0], [0, 0, 1]])
        R, p = about_z * about_y * about_x, mp.matrix([mp.mpf(at[name]) for name in "xyz"])
        springs = []
        for cable, tension in zip(robot.cables, map(mp.mpf, t.tolist()), strict=True):
            end = p + R * mp.matrix([mp.mpf(float(v)) for v in cable.attachment])
            span = [e - mp.mpf(float(v)) for e, v in zip(end, cable.exit_point, strict=True)]
            length, EA = mp.sqrt(sum(v * v for v in span)), mp.mpf(cable.EA or 0)
            give = 1 / mp.mpf(cable.winch_stiffness or mp.inf)
            natural = (length + mp.mpf(cable.guide_length) - tension * give) / (1 + tension / EA)
            k = 1 / (natural / EA + give)
            springs.append((k, length - tension / k))
        h, K = mp.mpf(10) ** -10, np.empty((6, 6))
        for i, j in itertools.product(range(6), repeat=2):
            steps = []
            for a, c in itertools.product((1, -1), repeat=2):
                moved = [mp.mpf(0)] * 6
                moved[i] += a * h
                moved[j] += c * h
                steps.append(a * c * energy(robot, R, p, springs, moved))
            K[i, j] = float(sum(steps) / (4 * h * h))
    assert distance(found, K) < 1e-12


def test_a_formula_is_written_in_all_ways(tmp_path: Path) -> None:
    robot = rs.load("cable-4-planar")
    general, at_home = rs.derive(robot, pose=rs.AtSymbols()), rs.derive("cable-4-planar")
    assert isinstance(at_home, CableFormula)
    text = derivation_text(at_home)
    assert "K_C = sum over i of ((k_i - q_i) w_i w_i^T + q_i V_i V_i^T + t_i N_i)" in text
    assert "k_i = (t_i + 60000)/L_i" in text
    assert "t_3: tension of cable3 [N], 35.052 N at home" in text
    assert r"q_{i} \mathbf{V}_{i} \mathbf{V}_{i}^{\mathsf{T}}" in latex_snippet(general)
    assert r"\begin{align*}" in derivation_latex(general)
    assert json.loads(json.dumps(derivation_data(general)))["coordinates"] == ["x", "y", "gamma"]
    assert "def stiffness(gamma, t_1, t_2, t_3, t_4, x, y):" in python_function(general)
    rate = differentiate(general, "y")
    t, named = numbers(robot, 4)
    place = {"x": 1.1, "y": 0.7, "gamma": 0.1}
    _, slope = rate.lambdify()(**place, **named)
    up, down = (
        rs.cable_stiffness(robot, [1.1, 0.7 + h, 0.1], tensions=rs.GivenTensions(t)).matrix
        for h in (1e-6, -1e-6)
    )
    np.testing.assert_allclose(slope, (up - down) / 2e-6, atol=1e-6 * np.abs(slope).max())
    source = tmp_path / "K.c"
    source.write_text(c_function(general))
    command = ["cc", "-std=c99", "-Wall", "-Werror", "-c", str(source), "-o", str(tmp_path / "K.o")]
    assert not subprocess.run(command, check=False).returncode


def test_tensions_in_numbers_stand_in_the_table() -> None:
    general = rs.derive("cable-4-planar", pose=rs.AtSymbols())
    own = general.subs(dict.fromkeys(["t_1", "t_2", "t_3", "t_4"], 30))
    assert {str(x) for x in own.symbols} == {"x", "y", "gamma"}
    row = next(line for line in derivation_text(own).splitlines() if line.startswith("cable3"))
    assert row.split()[-1] == "30"
    slack = general.subs({"t_1": 0})
    assert math.isfinite(slack.lambdify()(x=1, y=0.7, gamma=0, t_2=1, t_3=2, t_4=3)[0, 0])


def test_what_a_formula_of_cables_does_not_take() -> None:
    robot: Any = rs.load("cable-4-planar")
    with pytest.raises(rs.InputError, match="expected AtHome"):
        rs.derive(robot, pose=rs.AtJoints())
    with pytest.raises(rs.InputError, match="with Euler angles"):
        rs.derive(robot, pose=rs.AtSymbols(rs.UnitQuaternion()))
    with pytest.raises(rs.InputError, match="a cable robot has vectors and named steps"):
        rs.derive(robot, form=rs.Closed())
    with pytest.raises(rs.InputError, match="one generic cable"):
        rs.derive(robot, leg="cable1")
    steps = derivation_text(rs.derive(robot, pose=rs.AtSymbols(), form=rs.Steps()))
    assert "u_1_x = d_1_x/L_1" in steps
