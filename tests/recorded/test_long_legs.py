"""Records of long legs, and principal values in closed form."""

import numpy as np
import pytest

import robostiff as rs
from robostiff import InputError
from robostiff.analysis import posed_stiffness
from robostiff.errors import NoAnswerError
from robostiff.kinematics import posture_finder
from robostiff.model import Actuated, Chain, Leg, Rigid, Robot, revolute
from robostiff.record import Program, Record
from robostiff.recorded import RecordedRobot, eigenvalues, record_robot
from robostiff.spatial import Frame
from tests.generators.chains import random_rotation


def arm(count: int) -> Robot:
    """A snake of so many elastic turns."""
    elements = []
    for i in range(count):
        axis, home = np.eye(3)[2 - i % 3], np.radians((7 * i) % 11 - 5)
        elements.append(revolute(axis, Actuated(4e5), home=[home], name=f"j{i}"))
        elements.append(Rigid(Frame(np.eye(3), np.array([0.02, 0.005, 0]))))
    leg = Leg("snake", Frame.identity(), Chain(tuple(elements)), Frame.identity())
    return Robot("snake", (leg,))


def recorded(robot: Robot, most: int | None = None) -> RecordedRobot:
    return record_robot(robot, posture_finder(robot), most)


def test_a_record_grows_no_faster_than_its_leg():
    sizes = [recorded(arm(count)).record.size for count in (6, 12, 24)]
    assert sizes[1] < 2.2 * sizes[0]
    assert sizes[2] < 2.2 * sizes[1]


def test_a_long_record_says_what_the_direct_form_says():
    robot = arm(24)
    pose = rs.JointCoordinates(robot.legs[0].chain.home + 0.01 * np.arange(72).reshape(3, 24))
    answer, sure = (
        rs.compile(robot, backend=rs.Backend.ARRAYS).evaluate(pose),
        rs.stiffness(robot, pose),
    )
    assert not answer.guarded.any()
    assert np.allclose(answer.values["K"], sure.K, rtol=1e-9, atol=1e-9 * np.abs(sure.K).max())


def test_a_record_is_given_up_beyond_its_budget(monkeypatch: pytest.MonkeyPatch):
    robot = arm(8)
    size = recorded(robot).record.size
    assert recorded(robot, size).record.size == size
    with pytest.raises(NoAnswerError, match=f"more than {size - 1} operations"):
        recorded(robot, size - 1)
    monkeypatch.setattr(posed_stiffness, "_MOST_OPERATIONS", size // 2)
    kept = posed_stiffness.record_of(robot)
    assert kept.for_poses(10**6, (250, 6000, 2**20)) is None
    assert kept.is_tried
    K = rs.stiffness(robot).K
    assert np.array_equal(rs.stiffness(robot).K, K)


SPECTRA = [
    (1.0, 2.0, 3.0),
    (1.0, 1.0, 2.0),
    (1.0, 2.0, 2.0),
    (2.0, 2.0, 2.0),
    (1.0, 1.0 + 1e-9, 2.0),
    (1.0, 1.0 + 1e-13, 1.0 + 2e-13),
    (1e-12, 1.0, 1.0),
    (0.0, 0.0, 1.0),
    (0.0, 1.0, 1.0 + 1e-7),
    (-1.0, 0.0, 1.0),
    (1e3, 1e6, 1e9),
    (0.0, 0.0, 0.0),
]


@pytest.mark.parametrize("spectrum", SPECTRA)
def test_three_rows(spectrum: tuple[float, ...]):
    for seed in range(5):
        R = random_rotation(np.random.default_rng(seed)) if seed else np.eye(3)
        A = R @ np.diag(spectrum) @ R.T
        A = 0.5 * (A + A.T)
        found = eigenvalues(A.tolist())
        assert np.abs(np.array(found) - spectrum).max() <= 1e-14 * max(1e-300, np.abs(A).max() * 3)
        assert found == sorted(found)


@pytest.mark.parametrize("spectrum", [(1.0, 2.0), (1.0, 1.0), (1.0, 1.0 + 1e-12), (0.0, 3.0)])
def test_two_rows(spectrum: tuple[float, ...]):
    R = random_rotation(np.random.default_rng(1))[:2, :2]
    Q, _ = np.linalg.qr(R)
    A = Q @ np.diag(spectrum) @ Q.T
    found = eigenvalues((0.5 * (A + A.T)).tolist())
    assert np.abs(np.array(found) - spectrum).max() <= 1e-14 * max(spectrum)


def test_recorded_once_for_many_matrices():
    rng = np.random.default_rng(2)
    A = rng.normal(size=(500, 3, 3))
    A = A + np.swapaxes(A, -1, -2)
    A[:100] = A[:100] @ A[:100]
    names = {(i, j): f"a{i}{j}" for i in range(3) for j in range(i, 3)}
    record = Record({name: A[:4, i, j].tolist() for (i, j), name in names.items()})
    entries = [[record.input(names[min(i, j), max(i, j)]) for j in range(3)] for i in range(3)]
    program = Program.of(record, eigenvalues(entries))
    found = np.array(program.evaluate({name: A[:, i, j] for (i, j), name in names.items()}))
    expected = np.linalg.eigvalsh(A).T
    assert np.abs(found - expected).max() <= 1e-14 * np.abs(A).max() * 3


@pytest.mark.parametrize("rows", [2, 3])
def test_diagonal_entries_that_change_their_order(rows: int):
    A = np.random.default_rng(3).normal(size=(500, rows))
    A[:4].sort(axis=1)  # in one order at all samples
    names = [f"a{i}" for i in range(rows)]
    record = Record({name: A[:4, i].tolist() for i, name in enumerate(names)})
    entries = [[record.input(names[i]) if i == j else 0 for j in range(rows)] for i in range(rows)]
    program = Program.of(record, eigenvalues(entries))
    found = np.array(program.evaluate({name: A[:, i] for i, name in enumerate(names)}))
    assert np.allclose(found, np.sort(A, axis=1).T, rtol=0, atol=1e-13)


def test_one_row_and_too_many():
    assert eigenvalues([[4.0]]) == [4.0]
    with pytest.raises(InputError, match="eigenvalues in closed form"):
        eigenvalues(np.eye(4).tolist())
