"""Rate of a whole map in memory, grid to Dataset: K, principal stiffnesses, rank and status.

python benchmarks/map_rate.py [values an axis of a grid of six axes]
"""

from __future__ import annotations

import sys
import time

import robostiff as rs

ROBOT = "gough-stewart-b-beams"
QUANTITIES = (rs.Quantity.STIFFNESS, rs.Quantity.PRINCIPAL_STIFFNESS)


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    x, z, turn = rs.Axis(-0.1, 0.1, n), rs.Axis(0.7, 0.9, n), rs.Axis(-0.2, 0.2, n)
    grid = rs.Grid(x=x, y=x, z=z, rx=turn, ry=turn, rz=turn)
    robot = rs.load(ROBOT)
    rs.stiffness_map(robot, rs.Grid(x=x))  # imports
    print(f"{ROBOT}, {n**6} poses: K in float64, principal stiffnesses, rank and status")
    for threads in (1, 2):
        rates = []
        for _ in range(3):
            start = time.perf_counter()
            rs.stiffness_map(robot, grid, QUANTITIES, scheduler=rs.Threads(threads))
            rates.append(n**6 / (time.perf_counter() - start) / 1e6)
        print(f"{threads} threads {max(rates):8.2f} million poses a second")


if __name__ == "__main__":
    main()
