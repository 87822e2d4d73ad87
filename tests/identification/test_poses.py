"""Choice of poses."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import robostiff as rs
from robostiff.identification.choice_of_poses import _exchanged, _Judge

MARKS = {"m1": [0.08, 0.1, 0.0], "m2": [0.05, -0.09, 0.08], "m3": [0.05, -0.05, -0.1]}


@pytest.mark.parametrize("criterion", ["d", "a", "test"])
def test_exchange_finds_the_best_of_all_sets(criterion):
    """Of 16 matrices of information 4 are chosen: the best of all 1,820 sets, from any start."""
    random = np.random.default_rng(2)
    J = random.standard_normal((16, 6, 5)) * random.uniform(0.3, 3, (16, 1, 5))
    M = np.swapaxes(J, 1, 2) @ J
    kinds = {"d": rs.DOptimal(), "a": rs.AOptimal(), "test": rs.DOptimal()}
    T = random.standard_normal((3, 3)) if criterion == "test" else None
    judge = _Judge(M.sum(axis=0), np.zeros((5, 5)), 3, T, kinds[criterion])
    sets = np.array(list(combinations(range(16), 4)))
    values = judge.of(M[sets].sum(axis=1))
    starts = [
        _exchanged(M, judge, random.choice(16, 4, replace=False), repeats=False) for _ in range(8)
    ]
    assert min(value for value, _ in starts) == pytest.approx(values.min(), rel=1e-12)


def test_information_is_that_of_the_fit_without_frames():
    """Expected standard deviations are those of an identification at these poses."""
    robot = rs.load("hexapod")
    candidates = rs.random_postures(robot, 30)
    force = np.array([[900.0, -500, -2000]])
    found = rs.choose_poses(
        robot, candidates, 8, ["leg*/strut"], MARKS, forces=force, hook=[0.2, 0.1, 0], sigma=1e-6,
        repeats=False,
    )  # fmt: skip
    poses = found.postures
    assert len(set(found.rows)) == 8
    assert found.value < found.random
    loads = np.vstack([np.zeros(3), force])
    measured = rs.Measurements(
        np.repeat(poses, 6, axis=0), np.zeros((48, 3)),
        forces=np.tile(np.repeat(loads, 3, axis=0), (8, 1)), hooks=[0.2, 0.1, 0],
        markers=list(MARKS) * 16, sigma=1e-6,
    )  # fmt: skip
    again = rs.identify(robot, _read(robot, measured), ["leg*/strut"])
    for name, value in found.std.items():
        assert again.std[name] == pytest.approx(value, rel=1e-3)


def _read(robot, measured):
    """The readings of the nominal robot, with frames at the world's."""
    from dataclasses import replace

    from robostiff.identification.readings import ReadingModel
    from robostiff.identification.states import FiniteLoads, States
    from robostiff.identification.unknowns import with_unknowns

    changed, unknowns = with_unknowns(robot, ["leg1/strut"], by_joints=False)
    statics = FiniteLoads(States.of(changed, measured), changed, ("leg1/strut",))
    marks = np.array([*MARKS.values()])
    model = ReadingModel(measured, statics, unknowns, np.zeros(6), marks, np.eye(3), tuple(MARKS))
    y, _ = model.predicted(np.array([unknowns[0].nominal]))
    return replace(measured, values=y.reshape(-1, 3))


def test_loads_that_cannot_tell():
    robot = rs.load("six-joint-arm")
    with pytest.raises(rs.NoAnswerError, match="no measurement depends on arm/joint1"):
        rs.choose_poses(
            robot, rs.random_postures(robot, 12), 4, ["arm/joint1", "arm/joint2"], MARKS,
            forces=[0, 0, -1500],
        )  # fmt: skip
