"""Records of robots on flexible platforms, against the network of all bodies."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic import rank_formula
from robostiff.elasticity import Elasticity
from robostiff.elastostatics import Status
from robostiff.model import PlatformNode
from robostiff.network import network_of_snapshot
from tests.generators.platforms import shipped_on_platform

# Struts, couples (UPU), parallelograms that steps close, a robot posed in part.
ROBOTS = {
    "two loops": ("hexapod", 2, ("beam", "spring"), 2),
    "rigid members in loops": ("us-ups", 3, ("beam", "rigid"), 2),
    "hinges": ("gough-stewart-b-beams", 4, ("beam", "hinge"), 1),
    "legs with couples": ("3-upu", 29, ("beam", "hinge", "spring"), 1),
    "loops in legs, closed by steps": ("capaman", 24, ("beam", "spring"), 1),
}


@pytest.mark.parametrize("case", ROBOTS)
def test_kernels_give_the_stiffness_of_the_network(case):
    robot = shipped_on_platform(*ROBOTS[case])
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    assert compiled.verified
    rng = np.random.default_rng(7)
    home = rs.find_posture(robot).pose.reshape(-1)
    poses = home + rng.uniform(-1, 1, (6, 6)) * np.repeat([0.02, 0.05], 3)
    poses = poses[:, [c for c in robot.coordinate_places if c in robot.space.rows]]
    answer = compiled.evaluate(poses)
    assert not answer.guarded.any()  # none is left to the batched form
    for k, pose in enumerate(poses):
        network = network_of_snapshot(rs.find_posture(robot, pose).snapshot.one(0))
        expected = rs.stiffness(network)
        assert answer.rank[k] == expected.rank
        gap = np.abs(answer.values["K"][k] - expected.K).max()
        assert gap < 1e-11 * np.abs(expected.K).max()


def test_hinges_that_no_leg_holds_are_redundant():
    robot = shipped_on_platform("gough-stewart-b-beams", 1)
    platform = robot.platform
    assert platform is not None
    about_z = Elasticity(np.diag([1e-9] * 5 + [0.0]), np.eye(6)[:, 5:])
    flap = replace(platform.parts[0], name="flap", a="hub", b="flap", elasticity=about_z)
    nodes = (*platform.nodes, PlatformNode("flap", np.array([0, 0, 0.3])))
    other = replace(robot, platform=replace(platform, nodes=nodes, parts=(*platform.parts, flap)))
    whole, more = (rs.compile(own, backend=rs.Backend.ARRAYS) for own in (robot, other))
    assert (whole.status, more.status) == (Status.OK, Status.OK | Status.REDUNDANT_JOINTS)
    poses = np.array([[0.02, 0.01, 0.8, 0.05, 0.02, 0.1]])
    K, same = (own.evaluate(poses).values["K"][0] for own in (whole, more))
    np.testing.assert_allclose(same, K, rtol=0, atol=1e-12 * np.abs(K).max())


def test_parameters_of_a_platform_are_inputs():
    """Dimensions, and the section of its arms."""
    text = "docs/star-platform.yaml"
    robot = rs.load(text, symbols=("r", "h"))
    compiled = rs.compile(robot, parameters=("r",), backend=rs.Backend.ARRAYS)
    poses = np.array([[0.02, 0.01, 0.8, 0.05, 0.02, 0.1]]).repeat(3, axis=0)
    radii = np.array([0.25, 0.3, 0.35])
    K = compiled.evaluate(poses, parameters={"r": radii}).values["K"]
    for own, r in zip(K, radii, strict=True):
        expected = rs.stiffness(rs.load(text, {"r": f"{r} m"}), poses[0]).K
        np.testing.assert_allclose(own, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_rates_by_a_coordinate_are_differences():
    robot = shipped_on_platform("hexapod", 2, ("beam", "spring"), 2)
    rate = rs.Derivative(rs.StiffnessMatrix(), "z")
    compiled = rs.compile(robot, [rate], backend=rs.Backend.ARRAYS)
    home = rs.find_posture(robot).pose.reshape(-1)
    step = 1e-4 * np.eye(6)[2]
    before, after = (rs.stiffness(robot, home + sign * step).K for sign in (-1, 1))
    found = compiled.evaluate(home[None]).values[rate.name][0]
    expected = (after - before) / 2e-4
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("pose", [rs.AtHome(), rs.AtSymbols()])
def test_formulas_have_the_arms_of_the_platform(pose):
    """Each is compared with numbers as it is derived."""
    assert "platform/arm1" in rs.derive("docs/star-platform.yaml", pose=pose).legs[0].elastic


def test_formulas_refuse_platforms_with_motions_of_their_own():
    with pytest.raises(rs.InputError, match="leaves motions free"):
        rs.derive(shipped_on_platform("gough-stewart-b-beams", 4, ("hinge",)))


def test_compliances_of_conjugate_wrenches_are_no_singularities():
    """What the wrenches are divided by, to share no energy, is positive."""
    found = rank_formula(rs.derive("docs/star-platform.yaml"))
    assert found.rank == 6
    assert sorted(map(str, found.exceptions)) == ["R", "h", "r"]


def test_formulas_and_kernels_refuse_arms_that_do_not_exist(tmp_path):
    text = Path("docs/star-platform.yaml").read_text()
    text = text.replace("wall: 4 mm", "wall: wall").replace(
        "\nsections:", "  wall: 4 mm\n\nsections:"
    )
    (tmp_path / "star.yaml").write_text(text)
    robot = rs.load(tmp_path / "star.yaml", symbols=rs.ALL_PARAMETERS)
    values = {"R": 0.5, "r": 0.3, "h": 0.8}
    formula = rs.derive(robot)
    usual = np.array(formula.substituted({**values, "wall": 0.004}), dtype=float)
    expected = rs.stiffness(rs.load("docs/star-platform.yaml")).K
    np.testing.assert_allclose(usual, expected, rtol=0, atol=1e-10 * expected.max())
    words = "wall of the box of 'arm1' is less than half the"
    with pytest.raises(rs.InputError, match=words):
        formula.substituted({**values, "wall": 0.03})
    with pytest.raises(rs.NoAnswerError, match=words):
        formula.lambdify()(**values, wall=0.03)
    kernel = rs.compile(robot, parameters=("wall",), backend=rs.Backend.ARRAYS)
    with pytest.raises(rs.InputError, match="wall of the box of 'arm1'"):
        kernel.evaluate(np.array([[0, 0, 0.8, 0, 0, 0.0]]), parameters={"wall": 0.03})
