"""`rs.stiffness` by the robot's record: at 100,000 poses against its kernel, and at one pose.

The first table is the time of K, rank and status of many poses, from platform poses to matrices
(N, 6, 6), in one thread, as a multiple of the kernel alone, which writes 36 rows of numbers and its
checks into given arrays. A robot is asked often before: its record is made, and machine code where
there is any. The second table is what else is asked of many poses, by the record and by the direct
form. The third table is one call at one pose with the robot loaded, K, rank and status.
Ways are run in turns, and the fastest run of each counts.

    python benchmarks/one_pose_and_many.py            a minute
    python benchmarks/one_pose_and_many.py --quick    few poses and robots
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
from dataclasses import dataclass
from typing import Any

import numpy as np
from timed_rows import Row, kernel_run, timed

import robostiff as rs
from robostiff.analysis import Deflection
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.questions import PosesOfRobot
from robostiff.compiled import machine_code_is_available
from robostiff.kinematics import posture_finder

GOAL = 3.0
# A robot makes its record when it pays; here it has been asked often before.
PosesOfRobot.pays = 250, 0, 2**20


@dataclass(frozen=True)
class Times:
    """Microseconds a pose, and how far the matrices of the last two are apart."""

    kernel: float
    stiffness: float
    direct: float
    apart: float


def poses_of(robot: Any, count: int) -> Any:
    """Poses near home, one a row."""
    random = np.random.default_rng(0)
    if robot.is_posed_by_joints:
        home = robot.legs[0].chain.home
        return rs.JointCoordinates(home + random.uniform(-0.1, 0.1, (count, home.size)))
    finder, places = posture_finder(robot), robot.coordinate_places
    size = np.where(np.array(places) < 3, 0.02 * finder.length, 0.02)
    return finder.home_pose[places] + size * random.uniform(-1, 1, (count, len(places)))


def asked(result: rs.Stiffness) -> np.ndarray:
    """What is timed: K, rank and status."""
    _ = result.rank, result.status_codes
    return result.K


def backends() -> list[rs.Backend]:
    return [rs.Backend.ARRAYS, *[rs.Backend.MACHINE] * machine_code_is_available()]


def many(name: str, backend: rs.Backend, count: int, turns: int) -> Times:
    PosesOfRobot.pays = 250, 0, 0 if backend is rs.Backend.MACHINE else 10**12
    robot: Any = rs.load(name)
    poses = poses_of(robot, count)
    kernel = rs.compile(robot, backend=backend).kernel
    inputs = np.ascontiguousarray(poses.T)
    few = poses[: count // 20]
    rows = [
        Row("kernel", count, kernel_run(kernel, inputs)),
        Row("rs.stiffness", count, lambda: asked(rs.stiffness(robot, poses))),
        Row("direct form", len(few), lambda: asked(direct_stiffness(robot, few))),
    ]
    timed(rows, turns)
    K = rows[2].found
    apart = np.max(np.abs(rows[1].found[: len(few)] - K)) / np.max(np.abs(K))
    return Times(*(row.microseconds for row in rows), float(apart))


def questions(name: str, count: int, turns: int) -> list[tuple[str, float, float]]:
    """Microseconds a pose of questions beside K, by `rs` and from a result of the direct form."""
    robot: Any = rs.load(name)
    poses, F = poses_of(robot, count), np.arange(1.0, robot.space.size + 1)
    few = poses[: count // 20]

    def of(found: rs.IndicesOfPoses) -> Any:
        return found.principal_stiffness, found.collinear_stiffness, found.anisotropy

    def direct() -> rs.Stiffness:
        return direct_stiffness(robot, few)

    pairs: dict[str, tuple[Any, Any]] = {
        "compliance": (lambda: rs.compliance(robot, poses), lambda: direct().compliances),
        "deflection": (
            lambda: rs.deflection(robot, poses, F).twist,
            lambda: Deflection(np.tile(F, (len(few), 1)), direct()).twist,
        ),
        "indices": (lambda: of(rs.indices(robot, poses)), lambda: of(rs.indices(direct()))),
    }
    found = []
    for question, (by_record, by_direct) in pairs.items():
        rows = [Row("", count, by_record), Row("", len(few), by_direct)]
        timed(rows, turns)
        found.append((question, rows[0].microseconds, rows[1].microseconds))
    return found


def one(name: str, turns: int) -> tuple[float, float]:
    """Milliseconds of a call of the direct form, and of `rs.stiffness`."""
    robot: Any = rs.load(name)
    poses: Any = poses_of(robot, 1)
    if robot.is_posed_by_joints:
        pose: Any = rs.JointCoordinates(np.asarray(poses.values)[0])
    else:
        pose = poses[0]
    for _ in range(250):  # asked often before: operations are one function of Python
        rs.stiffness(robot, pose)
    rows = [
        Row("direct form", 1, lambda: asked(direct_stiffness(robot, pose))),
        Row("rs.stiffness", 1, lambda: asked(rs.stiffness(robot, pose))),
    ]
    timed(rows, turns)
    return 1e3 * rows[0].best, 1e3 * rows[1].best


def main() -> None:
    parser = argparse.ArgumentParser(description="Time of rs.stiffness by the robot's record.")
    parser.add_argument("--quick", action="store_true", help="few poses and robots")
    options = parser.parse_args()
    count, turns = (5_000, 1) if options.quick else (100_000, 5)
    print(f"{count} poses, K, rank and status, 1 thread, us a pose; goal: {GOAL:g} x the kernel")
    print(
        f"{'':18}{'':>10}{'kernel':>12}{'rs.stiffness':>14}{'direct form':>14}"
        f"{'ratio':>10}{'before':>10}{'K':>9}"
    )
    for name in ("hexapod", "3-puu") if options.quick else ("hexapod", "3-puu", "delta"):
        for backend in backends():
            own = many(name, backend, count, turns)
            print(
                f"{name:18}{backend.value:>10}{own.kernel:12.4f}{own.stiffness:14.4f}"
                f"{own.direct:14.2f}{own.stiffness / own.kernel:10.1f}"
                f"{own.direct / own.kernel:10.0f}{own.apart:9.0e}"
            )
    print(f"\n{count // 10} poses, us a pose")
    print(f"{'':18}{'':>12}{'by record':>12}{'direct':>12}{'ratio':>10}")
    for name in ("hexapod", "3-puu"):
        for question, now, before in questions(name, count // 10, turns):
            print(f"{name:18}{question:>12}{now:12.2f}{before:12.1f}{before / now:10.1f}")
    print("\none pose, K, rank and status, ms a call")
    print(f"{'':24}{'direct form':>12}{'rs.stiffness':>14}{'ratio':>10}")
    for name in ("hexapod", "3-prs") if options.quick else rs.shipped_robots():
        before, now = one(name, turns)
        print(f"{name:24}{before:12.2f}{now:14.2f}{before / now:10.1f}")


if __name__ == "__main__":
    main()
