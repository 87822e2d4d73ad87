"""Struts about a centre post: formulas, the network, and K written down by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.kinematics import posture_finder
from robostiff.kinematics.closure import Post
from robostiff.model import ALL_COORDINATES
from robostiff.network import network_of_snapshot
from tests.files import FILES

WRIST = Path(__file__).parent / "data" / "3-sps-s.yaml"
STEEL_E = 210e9
SETS = 100
DIMENSIONS = {"R": 0.2, "r": 0.12, "h": 0.3, "t": 0.04, "tau": np.radians(20), "k": 2e7}

# A universal joint turns the platform about x, then about y; its point is above the platform.


def by_hand(values: dict[str, float], R_platform: np.ndarray) -> np.ndarray:
    """K of the wrist about its centre: a cantilever that only feels forces, and three struts."""
    R, r, h, t, tau, k = (values[name] for name in ("R", "r", "h", "t", "tau", "k"))
    A, inertia = np.pi * (0.03**2 - 0.022**2), np.pi / 4 * (0.03**4 - 0.022**4)
    bending = 3 * STEEL_E * inertia / h**3
    K = np.diag([bending, bending, STEEL_E * A / h, 0, 0, 0])
    for phi in np.arange(3) * 2 * np.pi / 3:
        b = R_platform @ [r * np.cos(phi + tau), r * np.sin(phi + tau), t]
        d = b - [R * np.cos(phi), R * np.sin(phi), -h]
        u = d / np.linalg.norm(d)
        w = np.concatenate([u, np.cross(b, u)])
        K += k * np.outer(w, w)
    return K


def is_same(a: np.ndarray, b: np.ndarray, size: float = 1e-11) -> bool:
    """Relative to both ends of an entry."""
    ends = np.sqrt(np.diagonal(b))
    return bool(np.all(np.abs(a - b) <= size * np.outer(ends, ends)))


@pytest.fixture(scope="module")
def wrist() -> rs.Robot:
    robot = rs.load(WRIST)
    assert isinstance(robot, rs.Robot)
    return robot


def test_the_wrist_in_symbols_is_what_is_written_by_hand():
    found = rs.derive(str(WRIST), pose=rs.AtSymbols())
    assert found.where == "at alpha, beta, gamma"
    random = np.random.default_rng(3)
    values = {name: x * random.uniform(0.7, 1.4, SETS) for name, x in DIMENSIONS.items()}
    angles = random.uniform(-0.3, 0.3, (SETS, 3))
    values |= dict(zip(("alpha", "beta", "gamma"), angles.T, strict=True))
    K = found.lambdify(*found.symbols)(*(values[str(s)] for s in found.symbols))
    for i, turn in enumerate(Rotation.from_euler("xyz", angles).as_matrix()):
        assert is_same(K[i], by_hand({name: x[i] for name, x in values.items()}, turn))


def test_the_wrist_at_home_needs_no_names_for_its_closure():
    found = rs.derive(str(WRIST))
    assert found.named is not None
    known = {str(d.symbol): str(d.expression) for d in found.named.definitions}
    assert known["L_a"] == "sqrt(d_a**2 + p_a)"
    assert (known["d_a"], known["p_a"]) == ("h + t", "R**2 - 2*R*r*cos(tau) + r**2")
    assert sum(entry == 0 for entry in found.K) == 20


def test_all_ways_agree_at_poses_of_the_wrist(wrist):
    finder = posture_finder(wrist)
    assert isinstance(finder.solvers[0].closed_form, Post)
    poses = np.random.default_rng(1).uniform(-0.3, 0.3, (6, 3))
    result = rs.stiffness(wrist, poses)
    compiled = rs.compile(wrist, backend=rs.Backend.ARRAYS)
    assert compiled.verified
    assert not compiled.takes_joints
    answer = compiled.evaluate(poses)
    assert not answer.guarded.any()
    for i, pose in enumerate(poses):
        expected = by_hand(DIMENSIONS, Rotation.from_rotvec(pose).as_matrix())
        assert is_same(result.K[i], expected)
        assert is_same(answer.values["K"][i], expected)
        network = network_of_snapshot(rs.find_posture(wrist, pose).snapshot.one(0))
        assert is_same(np.asarray(rs.stiffness(network).K), expected, 1e-9)


def test_a_post_holds_one_point_alone(wrist):
    free = replace(wrist, coordinates=ALL_COORDINATES)
    assert rs.find_posture(free, [0, 0, 0.3, 0.1, 0.2, 0.1]).reached.all()
    away = rs.find_posture(free, [0.01, 0, 0.3, 0.1, 0.2, 0.1])
    assert not away.reached.any()
    assert away.shift_gaps[0] == pytest.approx([0.01, 0, 0, 0], abs=1e-12)


def test_a_universal_joint_below_the_platform_moves_it():
    robot = rs.load(FILES / "3-sps-u.yaml")
    assert isinstance(robot, rs.Robot)
    finder = posture_finder(robot)
    assert isinstance(finder.solvers[0].closed_form, Post)
    poses = np.random.default_rng(2).uniform(-0.3, 0.3, (8, 2))
    posture = rs.find_posture(robot, poses)
    assert posture.reached.all()
    for pose, q in zip(posture.pose, posture.coordinates[0], strict=True):
        turn = Rotation.from_euler("XY", q).as_matrix()
        np.testing.assert_allclose(Rotation.from_rotvec(pose[3:]).as_matrix(), turn, atol=1e-12)
        np.testing.assert_allclose(pose[:3], [0, 0, 0.3] - turn @ [0, 0, 0.04], atol=1e-12)
    result, compiled = rs.stiffness(robot, poses), rs.compile(robot, backend=rs.Backend.ARRAYS)
    assert compiled.verified
    for K, expected in zip(compiled.evaluate(poses).values["K"], result.K, strict=True):
        assert is_same(K, expected)
