"""How long one equilibrium of every shipped robot takes, and a pose by the recorded kernel.

An equilibrium at home under a small wrench, the finding of the posture in it, on one thread; the
goal is 20 ms.
Where nothing elastic holds the platform, the status says so, and Newton's method takes long.
Nanoseconds of kernels depend on the machine and on what else runs there. The last column does not:
how many times as long as the kernel without load, in turns with it.

    python benchmarks/under_load.py              two minutes
    python benchmarks/under_load.py --kernels    the kernels alone
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np

import robostiff as rs
from robostiff.compiled.closed import ClosedCode

LOAD = np.array([30.0, -20, -50, 1, 2, -0.5])
GOAL = 20.0  # ms of the processor
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
    if "--kernels" not in sys.argv:
        equilibria()
    print(
        f"\n{'kernel of':<16}{'operations':>11}{'a step':>8}{'guarded':>9}{'error of K':>12}"
        f"{'ns a pose':>11}{'times K':>9}"
    )
    for name in KERNELS:
        kernel(name)


def equilibria() -> None:
    """Print a row for each shipped robot."""
    print(
        f"{'robot':<24}{'unknowns':>9}{'steps':>7}{'posture':>9}{'whole':>8}  ms of the processor"
    )
    late = []
    for name in rs.shipped_robots():
        robot = rs.load(name)
        wrench = LOAD[list(robot.space.rows)]
        answer = rs.equilibrium(robot, wrench=wrench)
        if rs.Status.BEYOND_CRITICAL_LOAD in answer.status:
            # Its load has to be followed to the critical one, which is no single equilibrium.
            wrench = wrench / 100
            answer = rs.equilibrium(robot, wrench=wrench)
        posture = milliseconds(lambda robot=robot: rs.find_posture(robot, None))
        whole = milliseconds(lambda robot=robot, wrench=wrench: rs.equilibrium(robot, None, wrench))
        found, problem = answer.found, answer.found.problem
        if found is None or problem is None:
            print(f"{name:<24}{'':>16}{posture:>9.1f}{whole:>8.1f}  {answer.status}")
            continue
        unknowns = problem.legs.numbers.total
        print(f"{name:<24}{unknowns:>9}{found.steps:>7}{posture:>9.1f}{whole:>8.1f}")
        if whole > GOAL:
            late.append(name)
    print(f"above {GOAL:g} ms: {', '.join(late) or 'none'}")


def kernel(name: str) -> None:
    """Print a row: random poses, under wrenches up to half the critical load along -z."""
    robot = rs.load(name)
    fast, plain = rs.compile_loaded(robot), rs.compile(robot).kernel
    home = rs.find_posture(robot).pose[0]
    down = np.array([0, 0, -1e4, 0, 0, 0])
    half = 0.5 * rs.critical_load(robot, wrench=down, up_to=1e5).factor
    random = np.random.default_rng(1)
    poses = home + 0.02 * random.uniform(-1, 1, (8192, 6))
    wrenches = half * random.uniform(0, 1, (8192, 1)) * down
    wrenches[:10] = half * down
    answer = fast.evaluate(poses, wrenches)
    off = 0.0
    for k in np.flatnonzero(~answer.guarded)[:20]:
        one = rs.equilibrium(robot, poses[k], wrenches[k])
        K = np.asarray(one.K)
        size = np.sqrt(np.diag(K))
        off = max(off, float(np.max(np.abs(answer.K[k] - K) / np.outer(size, size))))
    runs = []
    for own, inputs in ((fast.kernel, [poses.T, wrenches.T]), (plain, [poses.T])):
        rows = np.ascontiguousarray(np.concatenate(inputs))
        out = np.empty((own.rows, rows.shape[1]))
        runs.append(lambda own=own, rows=rows, out=out: own.evaluate(rows, out))
    times = np.array([[milliseconds(run, 1) for run in runs] for _ in range(30)])
    loaded, without = 1e6 * times.min(axis=0) / len(poses)
    code = fast.kernel.code
    if not isinstance(code, ClosedCode):
        raise TypeError("a kernel under load takes steps")
    steps = code.few.step.program.operations
    print(
        f"{name:<16}{fast.kernel.operations:>11}{steps:>8}{answer.guarded_share:>9.4f}{off:>12.1e}"
        f"{loaded:>11.0f}{loaded / without:>9.1f}"
    )


if __name__ == "__main__":
    main()
