"""Postures belong to the assembly mode of home: a path without singularity leads there."""

from __future__ import annotations

import numpy as np
import pytest

import robostiff as rs


def capaman_poses(count: int, size: float, seed: int) -> np.ndarray:
    """Poses x, y, rz around home, up to some shift [m] and eight times as many radians."""
    return size * np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * [1, 1, 8]


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
