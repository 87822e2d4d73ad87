"""Postures belong to the assembly mode of home: a path without singularity leads there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.kinematics import Posture, PostureFinder
from robostiff.record import CLOSED
from robostiff.recorded import record_closure

RADIUS, CRANK, BAR = 0.120, 0.090, 0.110
SWING = CRANK * np.sin(np.radians(20))
UNITS = np.diag([0, 0, 0.1, 1.0, 1.0, 0])[[2, 3, 4]]
TURNED = np.radians([-120.0, 0.0, 120.0])


def capaman_poses(count: int, size: float, seed: int) -> np.ndarray:
    """Poses x, y, rz around home, up to some shift [m] and eight times as many radians."""
    return size * np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * [1, 1, 8]


def lean_of_couplers(posture: Posture) -> np.ndarray:
    """By how much the couplers of CaPaMan lean (N, 3): none does in a parallelogram."""
    return np.array([np.abs(q[:, 0] + q[:, 1]) for q in posture.coordinates]).T


def swings(six: np.ndarray) -> np.ndarray:
    """Where the ball joints are, seen from the feet of their legs: across and up (N, 3, 2).

    With level couplers they run on circles of the radius of the cranks.
    """
    R = Rotation.from_rotvec(six[:, 3:]).as_matrix()
    found = []
    for phi in TURNED:
        outward = np.array([np.cos(phi), np.sin(phi), 0])
        across = np.array([-np.sin(phi), np.cos(phi), 0])
        ball = six[:, :3] + R @ (RADIUS * outward)
        found.append(np.stack([ball @ across - SWING, ball[:, 2] - BAR], axis=-1))
    return np.stack(found, axis=1)


def on_circles(six: np.ndarray) -> np.ndarray:
    return (np.sum(swings(six) ** 2, axis=-1) - CRANK**2) / CRANK**2


def rates_of_circles(six: np.ndarray) -> np.ndarray:
    """Rates of `on_circles` by z in tenths of a metre, rx and ry (N, 3, 3)."""
    sides = [(on_circles(six + 1e-6 * u) - on_circles(six - 1e-6 * u)) for u in UNITS]
    return np.stack(sides, axis=-1) / 2e-6


def tracked(poses: np.ndarray, steps: int = 150) -> tuple[np.ndarray, np.ndarray]:
    """Where z, rx, ry follow the straight way from home, and how singular they came to be."""
    six = np.zeros((len(poses), 6))
    six[:, 2] = CRANK * np.cos(np.radians(20)) + BAR
    alive = np.ones(len(poses), dtype=bool)
    nearest = singular = np.full(len(poses), np.inf)
    for k in range(1, steps + 1):
        six[:, [0, 1, 5]] = k / steps * poses
        for _ in range(4):
            J = rates_of_circles(six)
            singular = np.linalg.svd(J)[1][:, -1]
            J[singular < 1e-6] = np.eye(3)
            step = np.linalg.solve(J, -on_circles(six)[..., None])[..., 0]
            six = np.where(alive[:, None], six + np.clip(step, -0.2, 0.2) @ UNITS, six)
        alive &= np.abs(on_circles(six)).max(axis=1) < 1e-9
        # Cranks that are level are flat parallelograms, where the crossed ones begin.
        level = swings(six)[..., 1].min(axis=1) / CRANK
        nearest = np.where(alive, np.minimum(nearest, np.minimum(singular, level)), nearest)
        alive &= level > 0
    return alive, nearest


@pytest.mark.parametrize(
    ("size", "seed"),
    [(0.02, 1), pytest.param(0.05, 2, marks=pytest.mark.slow),
     pytest.param(0.08, 3, marks=pytest.mark.slow)],
)  # fmt: skip
def test_parallelograms_of_capaman_do_not_cross(size: float, seed: int) -> None:
    """What is reached has level couplers, and it is what a way in small steps reaches."""
    poses = capaman_poses(60, size, seed)
    posture = rs.find_posture(rs.load("capaman"), poses)
    reached = posture.reached
    assert lean_of_couplers(posture)[reached].max(initial=0) < 1e-9
    assert np.abs(on_circles(posture.pose[reached])).max() < 1e-9
    found, nearest = tracked(poses)
    clear = ~found | (nearest > 0.1)
    np.testing.assert_array_equal(reached[clear], found[clear])
    assert np.sum(clear) > 45
    if size > 0.02:
        crossed = lean_of_couplers(posture).max(axis=1) > 1e-6
        assert np.any(posture.elsewhere)
        assert np.all(crossed[posture.elsewhere])


def test_a_crossed_parallelogram_is_another_assembly_mode() -> None:
    """It closes as well, and no smooth way leads there from home."""
    posture = rs.find_posture(rs.load("capaman"), capaman_poses(8, 0.05, 2)[1:3])
    np.testing.assert_array_equal(posture.reached, [True, False])
    np.testing.assert_array_equal(posture.elsewhere, [False, True])
    level, crossed = lean_of_couplers(posture).max(axis=1)
    assert level < 1e-9
    assert crossed > 1e-2


def test_another_assembly_mode_is_no_answer() -> None:
    robot = rs.load("capaman")
    poses = capaman_poses(8, 0.05, 2)
    posture = rs.find_posture(robot, poses)
    away = np.flatnonzero(posture.elsewhere)
    assert 1 <= away.size < 7
    result = rs.stiffness(robot, poses)
    assert np.all(result.status_codes[away] & int(rs.Status.UNREACHABLE))
    one = rs.stiffness(robot, poses[away[0]])
    assert any("another assembly mode" in sentence for sentence in one.advice)
    with pytest.raises(rs.NoAnswerError, match="another assembly mode"):
        _ = one.K
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    answer = compiled.evaluate(poses)
    np.testing.assert_array_equal(answer.status_codes, result.status_codes)
    assert np.all(answer.guarded[away])
    assert np.mean(answer.guarded[result.answered]) < 0.2
    ok = result.answered
    K, reference = answer.values["K"][ok], result[ok].K
    scale = np.abs(reference).max(axis=(1, 2), keepdims=True)
    assert np.abs((K - reference) / scale).max() < 1e-9


def test_recorded_steps_know_the_assembly_mode() -> None:
    """Where they arrive, couplers are level and cranks upright; elsewhere they may close, too."""
    robot = rs.load("capaman")
    joints = [f"{leg.name}/{i}" for leg in robot.legs for i in range(leg.chain.size)]
    closure = record_closure(robot, PostureFinder(robot), joints)
    assert closure is not None
    poses = np.concatenate([capaman_poses(3000, size, 4) for size in (0.03, 0.06, 0.1)])
    values = dict(zip(closure.inputs, poses.T, strict=True)) | closure.state
    with np.errstate(all="ignore"):
        for _ in range(closure.most_steps):
            values |= zip(closure.state, closure.step.evaluated(values), strict=True)
        *q, gap, mode = closure.arrival.evaluated(values)
    names = ("x", "y", "z", "rx", "ry", "rz")
    six = np.stack([np.broadcast_to(values[name], len(poses)) for name in names], axis=-1)
    closed, arrived = gap < CLOSED, (gap < CLOSED) & (mode > 0)
    lean = [np.abs(q[k] + q[k + 1]) for k in range(0, len(q), len(q) // 3)]
    assert np.sum(arrived) > 3000
    assert np.max(lean, axis=0)[arrived].max() < 1e-9
    assert np.abs(on_circles(six[arrived])).max() < 1e-9
    assert swings(six[arrived])[..., 1].min() > 0
    home = np.array([[0, 0, CRANK * np.cos(np.radians(20)) + BAR, 0, 0, 0]])
    sign = np.linalg.det(rates_of_circles(six)) / np.linalg.det(rates_of_circles(home))
    assert sign[arrived].min() > 0
    down = np.any(swings(six)[..., 1] < 0, axis=1)
    assert np.any(down[closed])


@pytest.mark.slow
def test_postures_do_not_depend_on_the_poses_beside_them() -> None:
    """Nor does the assembly mode, whether a pose comes alone or beside some out of reach."""
    finder, poses = PostureFinder(rs.load("capaman")), capaman_poses(8, 0.05, 2)
    whole = finder.find(poses)
    assert 0 < np.sum(whole.reached) < 8
    for rows in (np.arange(8)[::-1], np.flatnonzero(whole.reached)[:1]):
        part = finder.find(poses[rows])
        np.testing.assert_array_equal(part.reached, whole.reached[rows])
        np.testing.assert_array_equal(part.elsewhere, whole.elsewhere[rows])
        # Arrays of another length may be rounded otherwise.
        np.testing.assert_allclose(part.pose, whole.pose[rows], rtol=0, atol=1e-13)
        for few, many in zip(part.coordinates, whole.coordinates, strict=True):
            np.testing.assert_allclose(few, many[rows], rtol=0, atol=1e-13)


TURNTABLE = """\
robostiff: 1
name: turntable
source: a test
home: {at: [0.12, 0, 0.5]}
legs:
  - name: leg
    chain:
      - {type: revolute, axis: z, role: actuated, stiffness: 1e5 N m/rad}
      - {type: rigid, to: [0.5, 0, 0]}
      - {type: prismatic, axis: z, role: actuated, stiffness: 5e7 N/m, home: 0.2}
      - {type: revolute, axis: y, role: actuated, stiffness: 1e5 N m/rad, home: -0.9}
      - {type: beam, to: [0, 0, 0.5], material: steel, section: {circle: {diameter: 40 mm}}}
      - {type: spherical, role: passive, home: [0, 0.9, 0]}
"""


@pytest.mark.parametrize("aside", [0.03, 0.003, 0.001, 0.0003])
def test_a_way_that_passes_a_singularity_nearby(tmp_path, aside):
    """The end of the rod passes the axis of the table, which turns by half a turn then."""
    file = tmp_path / "turntable.yaml"
    file.write_text(TURNTABLE)
    found = rs.stiffness(rs.load(file), [-0.12, aside, 0.5, 0, 0, 0])
    assert not found.status.is_bad
    (turn, _, hinge), out = found.joint_coordinates["leg"][:3], np.hypot(0.12, aside)
    np.testing.assert_allclose(turn, np.pi - np.arctan2(aside, 0.12), rtol=1e-12)
    np.testing.assert_allclose(0.5 + 0.5 * np.sin(hinge), out, rtol=1e-12)
