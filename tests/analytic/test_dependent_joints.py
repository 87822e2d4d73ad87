"""Joints that depend on one another, and legs without closed form: where formulas hold."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.analytic.export import derivation_text, python_function
from tests.files import FILES


@pytest.mark.parametrize("turn", [0.0, np.pi])
def test_slides_that_come_to_be_parallel(turn):
    robot = rs.load(FILES / "parallel-slides.yaml", symbols=rs.ALL_PARAMETERS)
    K = rs.derive(robot, pose=rs.AtSymbols()).lambdify()
    q = np.array([0.02, turn, 0.05, 1.2])
    at = {**robot.nominal, **{f"q{i + 1}": x for i, x in enumerate(q)}}
    at = {name: at[name] for name in K.arguments}
    numbers = rs.stiffness(robot.numeric, rs.JointCoordinates(q))
    assert numbers.status & rs.Status.REDUNDANT_JOINTS
    assert not K.holds(**at)
    with pytest.raises(rs.NoAnswerError):
        K(**at)
    # Beside it the formula holds.
    q[1] += 1e-3
    expected = rs.stiffness(robot.numeric, rs.JointCoordinates(q)).K
    assert K(**at | {"q2": q[1]}) == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize(("aside", "holds"), [(0.0, False), (1e-3, True)])
def test_a_strut_along_the_first_axis_of_its_universal_joint(aside, holds):
    robot = rs.load("gough-stewart-b-beams", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=rs.AtSymbols())
    K = derivation.lambdify()
    numeric = robot.numeric
    leg = numeric.legs[0]
    along = leg.base.R @ leg.chain.moving[0][0].freedoms[0].axis
    p = leg.base.p + 0.9 * along + [0, 0, aside] - leg.attachment.p
    result = rs.stiffness(numeric, RigidTransform.from_components(p, Rotation.identity()))
    assert bool(result.status & rs.Status.REDUNDANT_JOINTS) is not holds
    at = {**robot.nominal, **dict(zip("xyz", p, strict=True)), "alpha": 0, "beta": 0, "gamma": 0}
    at = {name: at[name] for name in K.arguments}
    assert bool(K.holds(**at)) is holds
    if holds:
        assert K(**at) == pytest.approx(result.K, abs=1e-8 * np.abs(result.K).max())
    words = " ".join(derivation_text(derivation).split())
    assert "the passive joints of each leg are independent" in words


@pytest.mark.parametrize("name", ["tripteron", "t3r1"])
def test_a_positive_length_is_not_zero_where_joints_coincide_there(name):
    # Rail joint and platform joint coincide: numbers have another mobility, K no limit there.
    derivation = rs.derive(name)
    nominal = rs.load(name, symbols=rs.ALL_PARAMETERS).nominal
    K = derivation.lambdify()
    at = {x: nominal[x] for x in K.arguments}
    assert K.holds(**at)
    assert not K.holds(**at | {"d": 0.0})
    assert "Delta_1 = 2*l - d" in derivation_text(derivation)


TRICEPT = Path(__file__).parents[2] / "examples" / "tricept.yaml"
ROBOTS = {TRICEPT: ("R", "h", "k"), "t3r1": rs.ALL_PARAMETERS, "us-ups": rs.ALL_PARAMETERS}


def values_at(robot, formula, pose):
    """Values of all symbols at the closed posture of a pose, and its stiffness in numbers."""
    posture = rs.find_posture(robot.numeric, pose)
    angles = Rotation.from_rotvec(posture.pose[0, 3:]).as_euler("xyz")
    names = "x", "y", "z", "alpha", "beta", "gamma"
    known = {**robot.nominal, **dict(zip(names, (*posture.pose[0, :3], *angles), strict=True))}
    for leg, q in zip(robot.legs, posture.coordinates, strict=True):
        known |= {re.sub(r"\W", "_", f"q_{leg.name}_{j}"): x for j, x in enumerate(q[0], start=1)}
    K = rs.stiffness(robot.numeric, posture.pose[0]).K
    return {s.name: known[s.name] for s in formula.symbols}, K


@pytest.mark.parametrize("name", ROBOTS)
def test_formulas_agree_with_numbers_where_the_legs_close(name):
    robot = rs.load(name, symbols=ROBOTS[name])
    formula = rs.derive(robot, pose=rs.AtSymbols())
    assert any(x.startswith("q_") for x in formula.following)
    space: dict = {}
    exec(python_function(formula), space)  # noqa: S102
    function, numeric = space["stiffness"], robot.numeric
    places = robot.coordinate_places
    home = np.array([*numeric.home.p, 0.0, 0.0, 0.0])[places]
    values: dict = {}
    for shift in np.random.default_rng(3).uniform(-0.02, 0.02, (3, len(places))):
        values, K = values_at(robot, formula, home + shift)
        scale = np.sqrt(np.diag(K))
        assert np.max(np.abs(function(**values) - K) / np.outer(scale, scale)) < 1e-9
    other = next(x for x in formula.following if x.startswith("q_"))
    with pytest.raises(ValueError, match="does not hold"):
        function(**{**values, other: values[other] + 0.1})
