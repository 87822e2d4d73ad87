"""How long one equilibrium under load takes, and its parts; and a pose by the recorded kernel.

python benchmarks/under_load.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import robostiff as rs

LOAD = np.array([30.0, -20, -50, 1, 2, -0.5])
ROBOTS = ("hexapod", "hexapod-pus", "delta", "3-rps", "orthoglide", "six-joint-arm", "3-rrr")
KERNELS = ("gough-stewart-b", "hexapod")


def milliseconds(run: Callable[[], object], turns: int = 20) -> float:
    """Processor time of the fastest run [ms]."""
    run()
    best = np.inf
    for _ in range(turns):
        start = time.process_time()
        run()
        best = min(best, time.process_time() - start)
    return 1e3 * best


def main() -> None:
    """Print a table."""
    print(
        f"{'robot':<16}{'unknowns':>9}{'steps':>7}{'posture':>9}{'whole':>8}  ms of the processor"
    )
    for name in ROBOTS:
        robot = rs.load(name)
        wrench = LOAD[list(robot.space.rows)]
        answer = rs.equilibrium(robot, wrench=wrench)
        if not isinstance(answer, rs.Equilibrium) or answer.problem is None or answer.found is None:
            raise RuntimeError(f"no equilibrium of {name}")
        unknowns = sum(group.count * group.size for group in answer.problem.groups)
        posture = milliseconds(lambda robot=robot: rs.find_posture(robot, None))
        whole = milliseconds(lambda robot=robot, wrench=wrench: rs.equilibrium(robot, None, wrench))
        print(f"{name:<16}{unknowns:>9}{answer.found.steps:>7}{posture:>9.1f}{whole:>8.1f}")
    print(f"\n{'kernel of':<16}{'operations':>11}{'guarded':>9}{'error of K':>12}{'ns a pose':>11}")
    for name in KERNELS:
        kernel(name)


def kernel(name: str) -> None:
    """Print a row: random poses, under wrenches up to half the critical load along -z."""
    robot = rs.load(name)
    fast = rs.compile_loaded(robot)
    home = rs.find_posture(robot).pose[0]
    down = np.array([0, 0, -1e4, 0, 0, 0])
    half = 0.5 * rs.critical_load(robot, wrench=down, up_to=1e5).factor
    random = np.random.default_rng(1)
    poses = home + 0.02 * random.uniform(-1, 1, (8192, 6))
    wrenches = half * random.uniform(0, 1, (8192, 1)) * down
    answer = fast.evaluate(poses, wrenches)
    off = 0.0
    for k in np.flatnonzero(~answer.guarded)[:20]:
        one = rs.equilibrium(robot, poses[k], wrenches[k])
        K = np.asarray(one.K)
        size = np.sqrt(np.diag(K))
        off = max(off, float(np.max(np.abs(answer.K[k] - K) / np.outer(size, size))))
    rows = np.ascontiguousarray(np.concatenate([poses.T, wrenches.T]))
    out = np.empty((fast.kernel.rows, rows.shape[1]))
    nanoseconds = 1e6 * milliseconds(lambda: fast.kernel.evaluate(rows, out)) / rows.shape[1]
    print(
        f"{name:<16}{fast.kernel.operations:>11}{answer.guarded_share:>9.4f}{off:>12.1e}"
        f"{nanoseconds:>11.0f}"
    )


if __name__ == "__main__":
    main()
