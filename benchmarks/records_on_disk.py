"""Time to compile a robot for the first time, and with its record on disk, on NumPy.

Without and under load; and equilibria at new poses, alone, without a record and by it.

python benchmarks/records_on_disk.py [robot] ...
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np

import robostiff as rs

ROBOTS = ("hexapod", "3-prs", "six-joint-arm", "gough-stewart-b")


def seconds(name: str, compiled: Callable[..., object]) -> float:
    """Of processor time."""
    robot = rs.load(name)
    start = time.process_time()
    compiled(robot, backend=rs.Backend.ARRAYS)
    return time.process_time() - start


def equilibria(name: str) -> list[float]:
    """Milliseconds of equilibria one by one, each at a pose of its own."""
    robot, found = rs.load(name), list[float]()
    wrench = 10.0 * np.ones(robot.space.size)
    if robot.is_posed_by_joints:
        home = robot.legs[0].chain.home
    else:
        home = np.asarray(rs.stiffness(robot).pose)[list(robot.coordinate_places)]
    for k in range(9):
        pose = home + 1e-3 * k
        start = time.perf_counter()
        at = rs.JointCoordinates(pose) if robot.is_posed_by_joints else pose
        _ = rs.equilibrium(robot, at, wrench).displacement
        found.append(1e3 * (time.perf_counter() - start))
    return found[3:]  # by the record, where there is one


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ROBOSTIFF_CACHE"] = folder
        seconds("3-rpr", rs.compile)  # imports
        seconds("3-rpr", rs.compile_loaded)
        heads = ("recorded", "from disk", "under load", "from disk", "equilibrium", "by record")
        print(f"{'robot':20}" + "".join(f"{head:>14}" for head in heads))
        for name in sys.argv[1:] or ROBOTS:
            row = []
            direct = min(equilibria(name))
            for compiled in (rs.compile, rs.compile_loaded):
                first, *others = (seconds(name, compiled) for _ in range(11))
                row += [f"{first:11.3f} s", f"{1e3 * min(others):10.1f} ms"]
            row += [f"{direct:10.1f} ms", f"{min(equilibria(name)):10.1f} ms"]
            print(f"{name:20}" + "".join(f"{cell:>14}" for cell in row), flush=True)


if __name__ == "__main__":
    main()
