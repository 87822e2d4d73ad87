"""Legs whose dimensions and stiffnesses are inputs of the record as well."""

from typing import Any

import numpy as np
import pytest
import sympy as sp

from robostiff import load
from robostiff.kinematics import JointCoordinates, PostureFinder
from robostiff.kinematics.formula import place_leg, place_leg_at_joints
from robostiff.model import Robot
from robostiff.model.entries import with_entries
from robostiff.record import Record, arc_cosine, cosine, sine, square_root
from tests.kinematics.recorded_legs import SIX, at_samples, difference, recorded_pose, recording

COUNT = 4
FUNCTIONS = {"sqrt": square_root, "sin": sine, "cos": cosine, "acos": arc_cosine}


def varied(robot: Robot, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Parameters around those of the model file, a value a sample."""
    near = 1 + 0.02 * rng.uniform(-1, 1, (len(robot.nominal), COUNT))
    return {name: value * k for (name, value), k in zip(robot.nominal.items(), near, strict=True)}


def in_entries(robot: Robot, record: Record) -> Robot:
    """The same robot with entries of a record in place of its symbols."""

    def convert(value: Any) -> Any:
        names = sorted(str(s) for s in getattr(value, "free_symbols", ()))
        if not names:
            return float(value)
        formula = sp.lambdify(names, sp.N(value, 20), modules=[FUNCTIONS, "math"])
        return formula(*(record.input(name) for name in names))

    return with_entries(robot, convert)


@pytest.mark.parametrize(
    ("name", "symbols"),
    [
        ("gough-stewart-b-beams", "R r h D d"),
        ("hexapod", "R r h alpha k_screw k_joint"),
        ("3-puu", "R r l k"),
        ("3-rrr", "R r l1 l2 k"),
        ("tripteron", "l d e k"),
    ],
)
def test_legs_of_parallel_robots(name: str, symbols: str):
    robot, twin = load(name, symbols=symbols.split()), load(name)
    rng = np.random.default_rng(0)
    finder, parameters = PostureFinder(twin), varied(robot, rng)
    free = [coordinate.value for coordinate in robot.coordinates]
    poses = np.tile(finder.home_pose, (COUNT, 1))
    chosen = [SIX.index(name) for name in free]
    poses[:, chosen] += 0.03 * rng.uniform(-1, 1, (COUNT, len(free)))
    record, pose = recorded_pose(poses, free, parameters)
    recorded = in_entries(robot, record)
    placed = [
        at_samples(place_leg(leg, pose, solver).leg, COUNT)
        for leg, solver in zip(recorded.legs, finder.solvers, strict=True)
    ]
    for k in range(COUNT):
        numeric = robot.substituted({name: float(own[k]) for name, own in parameters.items()})
        posture = PostureFinder(numeric).find(poses[k])
        assert posture.reached.all()
        for leg, computed in zip(placed, posture.snapshot.one(0).legs, strict=True):
            assert difference(leg[k], computed) <= 1e-10


def test_a_serial_arm():
    symbols = ("height", "offset", "upper", "fore", "flange")
    robot = load("six-joint-arm", symbols=symbols)
    rng = np.random.default_rng(0)
    parameters = varied(robot, rng)
    q = rng.uniform(-1, 1, (COUNT, 6))
    record = recording({**parameters, **{f"q{i}": own for i, own in enumerate(q.T)}})
    (leg,) = in_entries(robot, record).legs
    formula = place_leg_at_joints(leg, np.array([record.input(f"q{i}") for i in range(6)]))
    for k, recorded in enumerate(at_samples(formula.leg, COUNT)):
        numeric = robot.substituted({name: float(own[k]) for name, own in parameters.items()})
        (computed,) = PostureFinder(numeric).find(JointCoordinates(q[k])).snapshot.one(0).legs
        assert difference(recorded, computed) <= 1e-10
