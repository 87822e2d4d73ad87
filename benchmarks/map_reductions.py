"""Rate and memory of a map of which reductions are kept alone: extremes, quantiles and a share.

The time of 10^9 poses is computed from what is measured, unless so many are asked for.

python benchmarks/map_reductions.py [poses]
"""

from __future__ import annotations

import sys
import time

from timed_rows import largest_memory

import robostiff as rs

ROBOT = "gough-stewart-b-beams"
NAME = "translational_stiffness"
REDUCTIONS = {
    "extremes": [rs.Extremes()],
    "extremes, quantiles and a share": [
        *(rs.Extremes(), rs.Quantiles(), rs.ShareAbove(NAME, [1e7, 1e8]))
    ],
}


def main() -> None:
    count = int(float(sys.argv[1])) if len(sys.argv) > 1 else 4_000_000
    robot = rs.load(ROBOT)
    x, turn = (-0.1, 0.1), (-0.2, 0.2)
    ranges = {"x": x, "y": x, "z": (0.7, 0.9), "rx": turn, "ry": turn, "rz": turn}
    threads = rs.Threads()
    print(f"{ROBOT}, {count:.3g} random poses, principal stiffnesses, {threads.number} threads")
    for words, reductions in REDUCTIONS.items():
        rs.stiffness_map(robot, rs.RandomPoses(60_000, ranges), reduce=reductions)  # compiles
        start = time.perf_counter()
        rs.stiffness_map(robot, rs.RandomPoses(count, ranges), reduce=reductions)
        seconds = time.perf_counter() - start
        memory = largest_memory()
        print(
            f"{words:34}{seconds:9.1f} s{1e6 * seconds / count:8.3f} us a pose{memory:8.0f} MiB"
            f"   10^9 poses would take {1e9 * seconds / count / 3600:.2f} h"
        )


if __name__ == "__main__":
    main()
