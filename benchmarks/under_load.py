"""How long one equilibrium under load takes, and its parts.

python benchmarks/under_load.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import robostiff as rs

LOAD = np.array([30.0, -20, -50, 1, 2, -0.5])
ROBOTS = ("hexapod", "hexapod-pus", "delta", "3-rps", "orthoglide", "six-joint-arm", "3-rrr")


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


if __name__ == "__main__":
    main()
