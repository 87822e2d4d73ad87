"""Tolerances and gradients of a hexapod of 42 parameters, and compensation of a path.

    python benchmarks/design.py

Seconds of the processor. Tolerances beside the bare kernel on the same robots; a number with all of
its rates beside the number alone; points of a path a second beside the kernel under load.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.stats import qmc

import robostiff as rs
from robostiff.compensation.compensate import _Commands
from robostiff.design.tolerances import _CHUNK as CHUNK
from robostiff.design.tolerances import _DrawnRobots
from robostiff.kinematics import posture_finder

CASE = Path(__file__).parents[1] / "tests" / "design" / "data" / "gradient_and_optimum.json"


def seconds(work: Callable[[], object], turns: int = 3) -> float:
    """The least of some turns."""
    each = []
    for _ in range(turns):
        began = time.process_time()
        work()
        each.append(time.process_time() - began)
    return min(each)


def platform() -> tuple[rs.Robot, list[str]]:
    """The hexapod of the reference case, with all parameters but the pose as symbols."""
    case = json.loads(CASE.read_text("utf-8"))["gradient"]
    names = [name for name in case["rates"] if name not in ("x", "y", "z")]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "hexapod.yaml"
        file.write_text(case["model_yaml"], encoding="utf-8")
        return rs.load(file, symbols=names), names


def tolerances() -> None:
    robot, names = platform()
    spread = {
        name: rs.Normal(1e-3) if robot.nominal[name] else rs.Normal("0.1 mm") for name in names
    }
    drawn = _DrawnRobots.of(robot, spread, [rs.WorstDeflection()], None)
    n, count, kernel = len(names), 2**20, drawn.compiled.kernel
    part = min(count, CHUNK)
    points = qmc.Sobol(n, rng=np.random.default_rng(1))
    u = points.random(part).T.copy()
    values = drawn.values(u)
    out = {"worst_deflection": np.empty((part, 1))}
    inputs = np.concatenate([np.repeat(drawn.rows.T, part, axis=1), values])
    room = np.empty((kernel.rows, part))
    rs.tolerances(robot, spread, samples=8)  # what it compiles

    def drawn_points() -> np.ndarray:
        return points.random(part).T.copy()

    def bare() -> None:
        np.copyto(inputs[-n:], drawn.values(drawn_points()))
        kernel.evaluate(inputs, room, threads=1)

    each = {
        "the kernel alone": lambda: kernel.evaluate(inputs, room, threads=1),
        "Sobol points, a row a parameter": drawn_points,
        "normally distributed by these": lambda: drawn.values(u),
        "the kernel with the draws it needs": bare,
        "the kernel with its checks": lambda: drawn.fill(values, out),
    }
    for name, work in each.items():
        points.reset()
        spent = 1e6 / part * seconds(work, 100)
        print(f"10^6 robots of {n} parameters, {name}: {spent:.2f} s")
    whole = 1e6 / count * seconds(lambda: rs.tolerances(robot, spread, samples=count))
    print(f"10^6 robots of {n} parameters, rs.tolerances: {whole:.2f} s")


def gradient() -> None:
    robot, names = platform()
    worst = rs.WorstDeflection()
    pose = posture_finder(robot.numeric).find(None).pose[:, robot.coordinate_places]
    poses = pose + 1e-3 * np.random.default_rng(1).uniform(-1, 1, (100_000, pose.shape[1]))
    each = []
    for outputs in ([worst], [worst, rs.Gradient(worst, names)]):
        compiled = rs.compile(robot, outputs, parameters=tuple(names))
        values = [[robot.nominal[x]] for x in compiled.kernel.inputs[pose.shape[1] :]]
        inputs = np.concatenate([poses.T, np.repeat(values, len(poses), axis=1)])
        spent = seconds(lambda c=compiled, i=inputs: c.kernel.evaluate(i, threads=1))
        each.append((compiled.kernel.operations, spent))
    (few, short), (many, long) = each
    print(f"{len(names)} rates: {many / few:.2f} times the operations, {long / short:.2f} the time")


def compensation(count: int = 40_000) -> None:
    robot, random = rs.load("hexapod"), np.random.default_rng(1)
    path = np.array([0, 0, 0.9, 0, 0, 0]) + 0.02 * random.uniform(-1, 1, (count, 6))
    wrenches = np.tile([100.0, 50, -1000, 10, 20, 0], (count, 1))
    commands = _Commands(robot, rs.compile_loaded(robot), path, None, wrenches)
    for method in (rs.Mirror(), rs.Exact()):
        rate = count / seconds(lambda m=method: commands.correct(m))
        print(f"{type(method).__name__} of a hexapod: {rate:,.0f} points a second")
    arm = rs.load(Path(__file__).parents[1] / "examples" / "loaded-arm.yaml")
    home = posture_finder(arm).find(None).coordinates[0][0]
    joints = home + 0.1 * random.uniform(-1, 1, (2000, 6))
    path = rs.find_posture(arm, rs.JointCoordinates(joints)).pose
    spent = seconds(lambda: rs.compensate(arm, path, [0, 0, -1e3, 0, 0, 0], near=home), 1)
    print(f"Exact of an arm, compilation and all: {1e3 * spent / len(path):.2f} ms a point")


def main() -> None:
    gradient()
    tolerances()
    compensation()


if __name__ == "__main__":
    main()
