"""Models and results are equal where their values are: copies, and answers to the same question."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.elastostatics import Block

FORCE = [300.0, 100.0, -200.0, 0.0, 0.0, 0.0]
POSES = [[0, 0, 0.9, 0, 0, 0], [0, 0, 3.0, 0, 0, 0]]  # the second one is out of reach
ANSWERS: dict[str, Callable[[Any], Any]] = {
    "stiffness": rs.stiffness,
    "stiffness at poses": lambda robot: rs.stiffness(robot, POSES),
    "deflection": lambda robot: rs.deflection(robot, wrench=FORCE),
    "deflection at poses": lambda robot: rs.deflection(robot, POSES, FORCE),
    "equilibrium": lambda robot: rs.equilibrium(robot, wrench=FORCE),
    "modes": rs.modes,
    "modes at poses": lambda robot: rs.modes(robot, POSES),
    "indices": rs.indices,
    "verification": rs.verify,
    "posture": rs.find_posture,
}


def _pickled(what: Any) -> Any:
    return pickle.loads(pickle.dumps(what))  # noqa: S301  # of our own


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_is_equal_to_its_copies_and_to_the_same_answer(name: str) -> None:
    answer, again = (ANSWERS[name](rs.load("hexapod")) for _ in range(2))
    copies = [copy.copy(answer), copy.deepcopy(answer), _pickled(answer), again]
    for other in copies:
        assert answer == other
    assert answer != ANSWERS[name](rs.load("hexapod", {"k_joint": "100 N/um"}))


@pytest.mark.parametrize("name", ["hexapod", "delta", "six-joint-arm", "cable-8", "capaman"])
def test_a_robot_is_equal_to_one_of_the_same_values(name: str) -> None:
    robot = rs.load(name)
    assert robot == rs.load(name)
    assert robot == _pickled(robot)
    assert robot != rs.load("3-rps")
    assert robot != name


def test_a_robot_with_another_value_is_another_one() -> None:
    assert rs.load("hexapod") != rs.load("hexapod", {"R": "400.001 mm"})
    low, again, high = (rs.Frame(np.eye(3), np.array([0, 0, z])) for z in (0.5, 0.5, 0.6))
    assert low == again
    assert low != high


def test_another_question_has_another_answer() -> None:
    robot = rs.load("hexapod")
    assert rs.stiffness(robot) != rs.stiffness(robot, at=[0, 0, 1])
    assert rs.stiffness(robot) != rs.stiffness(robot, method=Block())
    assert rs.stiffness(robot, POSES)[0] != rs.stiffness(robot, POSES)[1]


def test_modes_of_a_pickle_are_those_of_the_robot() -> None:
    found = rs.modes(rs.load("delta"))
    kept = _pickled(found)
    assert [str(mode) for mode in kept] == [str(mode) for mode in found]
