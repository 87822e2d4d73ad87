"""Time to compile a robot for the first time, and with its record on disk, on NumPy.

python benchmarks/records_on_disk.py [robot] ...
"""

from __future__ import annotations

import os
import sys
import tempfile
import time

import robostiff as rs

ROBOTS = ("hexapod", "3-prs", "six-joint-arm", "gough-stewart-b", "h4")


def seconds(name: str) -> float:
    """Of processor time."""
    robot = rs.load(name)
    start = time.process_time()
    rs.compile(robot, backend=rs.Backend.ARRAYS)
    return time.process_time() - start


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ROBOSTIFF_CACHE"] = folder
        seconds("3-rpr")  # imports
        print(f"{'robot':20}{'recorded':>12}{'from disk':>12}")
        for name in sys.argv[1:] or ROBOTS:
            first, *others = (seconds(name) for _ in range(11))
            print(f"{name:20}{first:10.3f} s{1e3 * min(others):9.1f} ms", flush=True)


if __name__ == "__main__":
    main()
