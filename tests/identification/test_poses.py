"""Choice of poses."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs

MARKS = {"m1": [0.08, 0.1, 0.0], "m2": [0.05, -0.09, 0.08], "m3": [0.05, -0.05, -0.1]}
FORCE, SIGMA = np.array([900.0, -500, -2000]), 1e-6


def _read(robot: rs.Robot, poses: np.ndarray, force: np.ndarray = FORCE) -> rs.Measurements:
    """What is read of the nominal robot without and with the force, in world axes."""
    loads = np.tile([[0.0] * 6, [*force, 0, 0, 0]], (len(poses), 1))
    wrenches = loads[:, robot.space.rows]
    loaded = np.asarray(rs.equilibrium(robot, np.repeat(poses, 2, axis=0), wrenches).pose)
    R = Rotation.from_rotvec(loaded[:, 3:]).as_matrix()
    points = loaded[:, None, :3] + np.array([*MARKS.values()]) @ np.swapaxes(R, 1, 2)
    return rs.Measurements(
        np.repeat(poses, 6, axis=0),
        points.reshape(-1, 3),
        wrenches=np.repeat(loads, 3, axis=0),
        markers=list(MARKS) * len(loads),
        sigma=SIGMA,
    )


@pytest.fixture(scope="module")
def hexapod() -> rs.Robot:
    return rs.load("hexapod")


@pytest.fixture(scope="module")
def candidates(hexapod):
    return rs.random_postures(hexapod, 14)


@pytest.fixture(scope="module")
def information(hexapod, candidates):
    """Of each pose that the robot can take, about the logarithms, by a fit to all of them."""
    robot = hexapod
    reached = rs.find_posture(robot, candidates)
    able = np.asarray(candidates)[reached.reached & reached.within_limits]
    found = rs.identify(robot, _read(robot, able), ["leg*/strut"])
    x = found.fit.x
    J = found.model.prediction(x)[1] / SIGMA
    J[:, :6] *= x[:6]
    return np.array([own.T @ own for own in np.split(J, len(able))])


@pytest.mark.parametrize("criterion", [rs.DOptimal(), rs.AOptimal()], ids=["D", "A"])
def test_the_best_of_all_sets(criterion, hexapod, candidates, information):
    """Of nine poses four: the best of all 126 sets."""
    how = {"criterion": criterion, "forces": FORCE, "sigma": SIGMA}
    chosen = rs.choose_poses(hexapod, candidates, 4, ["leg*/strut"], MARKS, **how)
    assert chosen.value < chosen.random

    def value(rows: tuple[int, ...]) -> float:
        C = np.linalg.inv(information[list(rows)].sum(axis=0))[:6, :6]
        if isinstance(criterion, rs.DOptimal):
            return float(np.exp(np.linalg.slogdet(C)[1] / 12))
        return float(np.trace(C) / 6) ** 0.5

    best = min(map(value, combinations(range(len(information)), 4)))
    assert chosen.value == pytest.approx(best, rel=1e-4)


def test_slides_without_limits_stay_near_home():
    rows = [rs.DHRow(d=0.4), rs.DHRow(a=0.6, slides=True)]
    arm = rs.serial_arm(rows, convention=rs.DHConvention.STANDARD, joint_stiffness=[1e4, 1e6])
    postures = rs.random_postures(arm, 200)
    assert isinstance(postures, rs.JointCoordinates)
    turn, slide = np.ptp(postures.values, axis=0)
    assert turn > 4
    assert slide < 0.2


@pytest.mark.parametrize(
    ("name", "asked", "force"),
    [("hexapod", "leg*/strut", FORCE), ("3-rrr", "leg*/motor", np.array([60.0, -40, 0]))],
)
def test_expected_errors_are_those_of_an_identification(name, asked, force):
    """Also of a planar robot, whose readings do not tell how high the instrument stands."""
    robot = rs.load(name)
    chosen = rs.choose_poses(
        robot, rs.random_postures(robot, 20), 6, [asked], MARKS, forces=force, sigma=SIGMA
    )
    assert len(set(chosen.rows)) == 6
    found = rs.identify(robot, _read(robot, chosen.postures, force), [asked])
    for name, expected in chosen.std.items():
        assert found.std[name] == pytest.approx(expected, rel=1e-3)


def test_loads_that_cannot_tell():
    here, parts = rs.Frame.identity(), []
    for i, (axis, to) in enumerate((("z", [0, 0, 0.4]), ("y", [0.5, 0, 0]), ("y", [0.4, 0, 0]))):
        turn = np.eye(3)["xyz".index(axis)].tolist()
        parts.append(rs.revolute(turn, rs.Actuated(1e4), name=f"joint{i + 1}"))
        parts.append(rs.beam_link(to, rs.material("steel"), rs.circle(0.05)))
    arm = rs.Robot("arm", (rs.Leg("arm", here, rs.Chain(tuple(parts)), here),), coordinates=())
    candidates, asked = rs.random_postures(arm, 12), ["arm/joint1", "arm/joint2"]
    with pytest.raises(rs.NoAnswerError, match="no measurement depends on arm/joint1"):
        rs.choose_poses(arm, candidates, 4, asked, MARKS, forces=[0, 0, -150])


def test_play_needs_loads_to_both_sides():
    """Where all torques have one sign, no posture distinguishes play from the zero."""
    robot = rs.load(Path(__file__).parents[2] / "examples" / "loaded-arm.yaml")
    asked = ["arm/joint3.zero", "arm/joint3.play"]
    down = rs.JointCoordinates(np.radians([[20.0 * k, 20, 15, 10 * k, 50, 0] for k in range(6)]))
    with pytest.raises(rs.NoAnswerError, match=r"joint3\.play"):
        rs.choose_poses(robot, down, 6, asked, MARKS)
    found = rs.choose_poses(robot, down, 6, asked, MARKS, forces=[0, 0, 3000])
    assert found.std["arm/joint3.play"] < 1e-3
