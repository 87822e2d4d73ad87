"""Time a pose takes: compiled robots beside other ways to the same K_C, in one run.

The first table has one robot, the Stewart-Gough platform of case B whose legs are flexible tubes
with elastic actuators. Every row begins with platform poses and ends with K_C, inverse kinematics
included, in one thread. Rows are run in turns, and the fastest run of each counts. K_C must be the
same to 1e-9 of sqrt(K_ii K_jj), or the row says WRONG. The second table has other robots.

    python benchmarks/kernels.py            about a minute
    python benchmarks/kernels.py --quick    few poses
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from batched_stiffness import (
    K_ACTUATOR,
    legs_stacked,
    loop,
    numbers_of,
    random_poses,
    with_elastic_actuators,
)
from kernel_peers import c_closed_form

import robostiff as rs
from robostiff.analysis.compiled_robot import compile_robot
from robostiff.compiled import Backend, Kernel, StiffnessMatrix, kernel_of
from robostiff.compiled.machine import machine_code_is_available
from robostiff.kinematics import PostureFinder
from robostiff.recorded import record_at_joints, record_at_pose

PLACES = [(i, j) for i in range(6) for j in range(i, 6)]
SHORT = 0.05  # s
OTHERS = ("hexapod", "3-puu", "3-rrr", "3-rpr-beams", "tripteron", "six-joint-arm")


@dataclass
class Row:
    """A way to K_C at a number of poses: it gives the 21 entries (21, N)."""

    name: str
    count: int
    run: Callable[[], np.ndarray]
    best: float = np.inf
    found: Any = None


def kernel_run(kernel: Kernel, inputs: np.ndarray) -> Callable[[], np.ndarray]:
    out = np.empty((kernel.rows, inputs.shape[1]))
    return lambda: kernel.evaluate(inputs, out, threads=1)


def hexapod_rows(count: int) -> list[Row]:
    robot = with_elastic_actuators(rs.load("gough-stewart-b-beams"), K_ACTUATOR)
    numbers = numbers_of(robot)
    poses = random_poses(count)
    inputs = np.ascontiguousarray(poses.T)
    few, fewer = poses[: max(count // 20, 1)], poses[: max(count // 400, 1)]
    recorded = record_at_pose(robot, PostureFinder(robot))
    rows: list[Row] = []
    if machine_code_is_available():
        for name, check_rank in (("kernel, K", False), ("kernel, K and checks of rank", True)):
            kernel = kernel_of(
                recorded, [StiffnessMatrix()], Backend.MACHINE, check_rank=check_rank
            )
            label = f"{name} ({kernel.operations} operations)"
            rows.append(Row(label, count, kernel_run(kernel, inputs)))
    closed = c_closed_form(numbers.base, numbers.platform, K_ACTUATOR, numbers.E * numbers.A)
    if closed is not None:
        rows.append(Row("closed form (25) in C, by hand", count, lambda: closed(inputs)))
    arrays = kernel_of(recorded, [StiffnessMatrix()], Backend.ARRAYS, check_rank=False)
    rows.append(Row("the record on NumPy arrays, K", count, kernel_run(arrays, inputs)))
    compiled = compile_robot(robot)

    def whole() -> np.ndarray:
        K = compiled.evaluate(poses).values["K"]
        return np.array([K[:, i, j] for i, j in PLACES])

    def batched() -> np.ndarray:
        K = rs.stiffness(robot, few).K
        return np.array([K[:, i, j] for i, j in PLACES])

    def lean() -> np.ndarray:
        K = loop(numbers, fewer, legs_stacked)
        return np.array([K[:, i, j] for i, j in PLACES])

    rows.append(Row("rs.compile, as (N, 6, 6) and back", count, whole))
    rows.append(Row("rs.stiffness, all poses at once", len(few), batched))
    rows.append(Row("lean NumPy loop, eq. (7)", len(fewer), lean))
    return rows


def timed(rows: list[Row], turns: int) -> None:
    for _ in range(turns):
        for row in rows:
            # A short run after a long one finds nothing in the cache.
            for _ in range(5 if row.best < SHORT else 1):
                start = time.perf_counter()
                row.found = row.run()
                row.best = min(row.best, time.perf_counter() - start)


def report(rows: list[Row]) -> None:
    reference = rs_reference(rows)
    first = rows[0].best / rows[0].count
    print(f"{'':44}{'us a pose':>11}{'ratio':>10}{'K':>10}")
    for row in rows:
        each = row.best / row.count
        n = min(row.count, reference.shape[1])
        size = np.sqrt([reference[PLACES.index((i, i)), :n] for i in range(6)])
        allowed = np.array([size[i] * size[j] for i, j in PLACES])
        apart = float(np.max(np.abs(row.found[:21, :n] - reference[:, :n]) / allowed))
        mark = f"{apart:10.0e}" if apart <= 1e-9 else "     WRONG"
        print(f"{row.name:44}{1e6 * each:11.4f}{each / first:10.1f}{mark}")


def rs_reference(rows: list[Row]) -> np.ndarray:
    return next(row.found for row in rows if row.name.startswith("rs.stiffness"))


def other_robots(count: int, turns: int) -> None:
    print(f"\n{'robot':24}{'inputs':>7}{'operations':>11}{'record s':>9}{'compile s':>10}", end="")
    print(f"{'us, K':>9}{'and rank':>10}")
    for name in OTHERS:
        robot: Any = rs.load(name)
        finder = PostureFinder(robot)
        start = time.perf_counter()
        closed = robot.home is not None and all(s.closed_form for s in finder.solvers)
        recorded = (record_at_pose if closed else record_at_joints)(robot, finder)
        record_time = time.perf_counter() - start
        base = recorded.record
        samples = np.array([base.input(x).sample for x in base.inputs])
        inputs = np.ascontiguousarray(np.tile(samples, -(-count // samples.shape[1])))
        kernels = [
            kernel_of(recorded, [StiffnessMatrix()], check_rank=check) for check in (False, True)
        ]
        start = time.perf_counter()
        kernels[0].evaluate(samples)
        compile_time = time.perf_counter() - start
        rows = [Row("", inputs.shape[1], kernel_run(kernel, inputs)) for kernel in kernels]
        timed(rows, turns)
        K, rank = (1e6 * row.best / row.count for row in rows)
        print(f"{name:24}{len(base.inputs):7}{kernels[0].operations:11}", end="")
        print(f"{record_time:9.2f}{compile_time:10.2f}{K:9.4f}{rank:10.4f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="Time a pose takes, by many ways.")
    parser.add_argument("--quick", action="store_true", help="few poses")
    options = parser.parse_args()
    count, turns = (2_000, 2) if options.quick else (20_000, 25)
    rows = hexapod_rows(count)
    timed(rows, turns)
    print(f"Stewart-Gough B, flexible legs and elastic actuators, {count} random poses, 1 thread")
    if not machine_code_is_available():
        print("heyoka is not installed: no machine code")
    report(rows)
    other_robots(count, turns)


if __name__ == "__main__":
    main()
