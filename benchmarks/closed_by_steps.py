"""Robots whose legs are closed by iteration: poses to K_C, rank and status, in one thread.

"In the kernel": Newton steps from home are recorded in front of the stiffness, and the kernel takes
poses. "Before it": postures are found on batches by the iterative closure, and the kernel takes
coordinates of the legs. Both must give the K_C of `rs.stiffness`. Poses out of reach, of a box one
length of the robot and 2 rad to each side of home, are answered by the direct form, and by recorded
steps up to where their way ends. Times are those of the processor, so that other programs disturb
them less.

    python benchmarks/closed_by_steps.py [number of poses]
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.compiled import Kernel, kernel_of
from robostiff.compiled.codes import POSES_A_CHUNK
from robostiff.kinematics import PostureFinder, posture_finder
from robostiff.model import Robot
from robostiff.record import CLOSED
from robostiff.recorded import record_at_joints, record_robot

MODELS = Path(__file__).parent.parent / "tests" / "recorded" / "models"
ROBOTS = (
    *("3-prs", "3-rps", "t3r1", "us-ups", "h4", "capaman"),
    *(MODELS / "tricept.yaml", MODELS / "exechon.yaml"),
)
FEW = 400  # poses of the slow way, and of the comparison
UNREACHED = 1000
SPREADS = ((0.02, 0.02), (0.1, 0.2))  # m and rad to each side of home
TURNS = 7
CHUNK = POSES_A_CHUNK


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 16_384
    print(f"{'robot':10}{'spread':>15}{'operations':>11}{'compile s':>10}{'before it':>11}", end="")
    print(f"{'in the kernel':>15}{'ratio':>8}{'computed again':>16}{'K':>9}")
    for name in ROBOTS:
        robot, finder, of_joints, of_poses = kernels(name)
        start = time.perf_counter()
        of_poses.evaluate(np.zeros((len(of_poses.inputs), 8)))
        compile_time = time.perf_counter() - start
        for spread in SPREADS:
            poses = random_poses(robot, finder, count, spread)
            slow, quick = np.inf, np.inf
            for _ in range(TURNS):
                slow = min(slow, seconds(by_iteration, finder, of_joints, poses[:FEW]))
                quick = min(quick, seconds(in_chunks, of_poses, poses))
            before, within = 1e6 * slow / FEW, 1e6 * quick / count
            again, apart = comparison(robot, of_poses, poses)
            around = f"{1e3 * spread[0]:g} mm, {spread[1]:g}"
            print(f"{robot.name:10}{around:>15}{of_poses.operations:11}", end="")
            print(f"{compile_time:10.2f}{before:11.1f}{within:15.3f}", end="")
            print(f"{before / within:8.0f}{again:16.2%}{apart:9.0e}", flush=True)
            if apart > 1e-9:
                raise SystemExit(f"{robot.name}: K differs from that of rs.stiffness")
    print(f"{'out of reach':25}{'direct form us':>16}{'by its way us':>15}{'ratio':>8}{'left':>8}")
    for name in ROBOTS:
        out_of_reach(rs.load(name))


def out_of_reach(robot: Robot) -> None:
    """A row of times of poses out of reach, of a robot that has some in the box."""
    finder, fast = posture_finder(robot), rs.compile(robot)
    poses = random_poses(robot, finder, 5 * UNREACHED // 2, (finder.length, 2.0))
    poses = poses[~finder.find(poses).reached][:UNREACHED]
    if len(poses) < FEW:
        return
    direct = seconds(direct_stiffness, robot, poses)
    quick = min(seconds(fast.evaluate, poses) for _ in range(2))
    answer = fast.evaluate(poses)
    if np.mean(answer.status_codes == rs.Status.UNREACHABLE) < 0.99:
        raise SystemExit(f"{robot.name}: poses out of reach have another status")
    print(f"{robot.name:10}{len(poses):9} poses{1e6 * direct / len(poses):16.0f}", end="")
    print(
        f"{1e6 * quick / len(poses):15.0f}{direct / quick:8.1f}{answer.guarded_share:8.1%}",
        flush=True,
    )


def kernels(name: str | Path) -> tuple[Robot, PostureFinder, Kernel, Kernel]:
    """A robot, and its kernels from coordinates of the legs and from poses."""
    robot: Any = rs.load(name)
    finder = PostureFinder(robot)
    recorded = record_at_joints(robot, finder)
    of_poses = record_robot(robot, finder)
    if of_poses.closure is None:
        raise SystemExit(f"{name}: no record of its closure")
    outputs = [rs.StiffnessMatrix()]
    return robot, finder, kernel_of(recorded, outputs), kernel_of(of_poses, outputs)


def kernel_time(name: str | Path, spread: tuple[float, float], count: int = 16_384) -> float:
    """Microseconds a pose of the kernel that takes poses."""
    robot, finder, _, of_poses = kernels(name)
    poses = random_poses(robot, finder, count, spread)
    in_chunks(of_poses, poses)  # compiled when first used
    return 1e6 * min(seconds(in_chunks, of_poses, poses) for _ in range(TURNS)) / count


def random_poses(
    robot: Robot, finder: PostureFinder, count: int, spread: tuple[float, float]
) -> np.ndarray:
    chosen = robot.coordinate_places
    step = np.where(np.array(chosen) < 3, *spread)
    shifts = np.random.default_rng(0).uniform(-1, 1, (count, len(chosen)))
    return finder.home_pose[chosen] + step * shifts


def by_iteration(finder: PostureFinder, kernel: Kernel, poses: np.ndarray) -> None:
    posture = finder.find(poses)
    kernel.evaluate(np.concatenate([q.T for q in posture.coordinates]))


def in_chunks(kernel: Kernel, poses: np.ndarray) -> None:
    out = np.empty((kernel.rows, CHUNK))
    for start in range(0, len(poses) - CHUNK + 1, CHUNK):
        kernel.evaluate(np.ascontiguousarray(poses[start : start + CHUNK].T), out)


def seconds(work: Callable[..., Any], *arguments: Any) -> float:
    start = time.process_time()
    work(*arguments)
    return time.process_time() - start


def comparison(robot: Robot, kernel: Kernel, poses: np.ndarray) -> tuple[float, float]:
    """Share of poses left to `rs.stiffness`, and how far K is from its own at the others."""
    results = kernel.evaluate(np.ascontiguousarray(poses.T))
    closed = (results[-2] < CLOSED) & (results[-1] > 0)
    n = robot.space.size
    K = np.moveaxis(results[: n * n, :FEW].reshape(n, n, FEW), -1, 0)
    result = rs.stiffness(robot, poses[:FEW])
    own = closed[:FEW] & result.answered
    expected = result.details().matrix[own]
    size = np.sqrt(np.einsum("nii->ni", expected))
    apart = np.abs(K[own] - expected) / (size[:, :, None] * size[:, None, :])
    return 1 - float(np.mean(closed)), float(np.max(apart))


if __name__ == "__main__":
    main()
