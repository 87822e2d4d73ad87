"""General poses of robots with legs that close by iteration: their coordinates are symbols."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.analytic.export import python_function

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
