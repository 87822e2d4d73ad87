"""Answers of the library for all shipped robots, the examples and some random machines.

What it answers today, not what is right: other tests say that. A change of any of these numbers
shows in the diff of `answers.json`.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from tests.campaign import placed

ROOT = Path(__file__).parents[2]
FILE = Path(__file__).parent / "answers.json"
EXAMPLES = (
    "ball-screws.yaml",
    "bevel-wrist.yaml",
    "exechon.yaml",
    "four-bar.xml",
    "orthoglide-3-puu.yaml",
    "portal.json",
    "rocking-table.yaml",
    "three-slides.yaml",
    "tricept-with-head.yaml",
    "tricept.yaml",
    "ur5-dh.yaml",
    "ur5.urdf",
    "wall-crane.json",
)
#: Of the largest entry of an answer, by its name; others are equal.
TOLERANCES = {
    "K": 1e-9,
    "C": 1e-9,
    "deflection": 1e-9,
    "equilibrium": 1e-7,
    "margin": 1e-6,
    "frequencies": 1e-6,
    "kernel": 1e-9,
}
_DIGITS = 12
_SEED = 20261128
_WRENCH = np.array([100.0, 50.0, -80.0, 5.0, -3.0, 4.0])
_SHIFTS = np.array([0.01, -0.008, 0.012, 0.02, -0.015, 0.01])

Answers = dict[str, Any]


def all_answers() -> dict[str, Answers]:
    """By machine and question, numbers as they are written."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return {name: own for name, own in _machines() if own}


def _machines() -> Iterator[tuple[str, Answers]]:
    for name in rs.shipped_robots():
        yield from _of_robot(name, rs.load(name))
    for name in EXAMPLES:
        machine: Any = rs.load(ROOT / "examples" / name)
        if isinstance(machine, rs.Robot):
            yield from _of_robot(name, machine)
        else:
            yield name, _at(machine, None) | _loaded(machine, None)
    for name in (*rs.shipped_cable_robots(), *rs.shipped_linkages()):
        machine = rs.load(name)
        yield name, _at(machine, None) | _loaded(machine, None)
    for i, kind in enumerate(sorted(placed.KINDS) * 2):
        snapshot = placed.random_snapshot(np.random.default_rng([_SEED, i]), kind)
        yield f"random {i}, {kind}", _at(snapshot, None)


def _of_robot(name: str, robot: rs.Robot) -> Iterator[tuple[str, Answers]]:
    home: Any = None
    posture = rs.find_posture(robot)
    if robot.is_posed_by_joints:
        q = posture.coordinates[0][0]
        aside: Any = rs.JointCoordinates(q + 0.05 * robot.legs[0].chain.free)
    else:
        places = robot.coordinate_places
        aside = posture.pose[0][places] + _SHIFTS[places]
    heavy = {"platform": rs.Mass(10.0, inertia=[0.1, 0.2, 0.3])}
    own = _at(robot, home) | _loaded(robot, home)
    own |= _asked("frequencies", lambda: rs.modes(robot, home, heavy).frequencies[:6])
    yield name, own | _asked("operations", lambda: _kernel(robot).kernel.operations)
    if not len(np.atleast_1d(getattr(aside, "values", aside))):
        return
    own = _at(robot, aside) | _loaded(robot, aside)
    yield f"{name}, aside", own | _asked("kernel", lambda: _entries(_kernel(robot), aside))


_kernels: dict[int, Any] = {}


def _kernel(robot: rs.Robot) -> rs.CompiledStiffness:
    if id(robot) not in _kernels:
        _kernels.clear()
        _kernels[id(robot)] = rs.compile(robot, backend=rs.Backend.ARRAYS)
    return _kernels[id(robot)]


def _entries(kernel: rs.CompiledStiffness, pose: Any) -> list[float]:
    return _half(kernel.evaluate(pose).values["K"])


def _at(machine: Any, pose: Any) -> Answers:
    """Stiffness and deflection at a pose."""
    found: Any = rs.stiffness(machine, pose)
    answers: Answers = {"status": str(found.status), "rank": int(found.rank)}
    answers |= _asked("K", lambda: _half(found.K))
    answers |= _asked("C", lambda: _half(found.compliance))
    F = _wrench(machine)
    return answers | _asked("deflection", lambda: rs.deflection(machine, pose, F).twist)


def _loaded(machine: Any, pose: Any) -> Answers:
    found: Any = rs.equilibrium(machine, pose, _wrench(machine))
    answers: Answers = {"loaded status": str(found.status)}
    if found.has_answer:
        answers |= _asked("equilibrium", lambda: found.displacement)
        answers |= _asked("margin", lambda: [found.margin])
    return answers


def _wrench(machine: Any) -> np.ndarray:
    return _WRENCH[[0, 1, 5]] if machine.space.size == 3 else _WRENCH


def _half(K: np.ndarray) -> list[float]:
    return np.asarray(K, dtype=float)[np.triu_indices(len(K))].tolist()


def _asked(name: str, ask: Callable[[], Any]) -> Answers:
    """An answer, or the kind of the refusal."""
    try:
        value = ask()
    except (rs.RobostiffError, TypeError) as error:
        return {name: type(error).__name__}
    if isinstance(value, int | str):
        return {name: value}
    return {name: [float(f"{x:.{_DIGITS - 1}e}") + 0.0 for x in np.ravel(value).tolist()]}


def written(answers: dict[str, Answers]) -> str:
    """As the file has them, a line each."""
    machines = []
    for name, own in answers.items():
        lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in own.items()]
        machines.append(f"{json.dumps(name)}: {{\n" + ",\n".join(lines) + "\n}")
    return "{\n" + ",\n".join(machines) + "\n}\n"


def differences(name: str, now: Answers, before: Answers) -> list[str]:
    """What is not as it was."""
    found = []
    for question in dict.fromkeys((*before, *now)):
        one, other = now.get(question), before.get(question)
        limit = TOLERANCES.get(question)
        if not (isinstance(one, list) and isinstance(other, list) and limit):
            if one != other:
                found.append(f"{name}, {question}: {one} for {other}")
            continue
        a, b = np.array(one), np.array(other)
        if a.shape != b.shape or not np.all(np.abs(a - b) <= limit * _sizes(question, b)):
            found.append(f"{name}, {question}: {one} for {other}")
    return found


def _sizes(question: str, values: np.ndarray) -> np.ndarray | float:
    """What entries are compared with: of a matrix the roots of its diagonal."""
    if question not in ("K", "C", "kernel"):
        return float(np.max(np.abs(values), initial=0.0))
    n = 6 if len(values) == 21 else 3
    rows, columns = np.triu_indices(n)
    d = np.sqrt(np.abs(values[rows == columns]))
    d = np.maximum(d, 1e-6 * np.max(d, initial=0.0))
    return np.outer(d, d)[rows, columns]
