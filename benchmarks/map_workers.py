"""A map on one Dask worker and on two: how much faster two are.

Both write the same map as Zarr with `method=Batched()`, which is all computation. The clock runs
from the first block done to the last, so that starting processes does not count. Other work on the
machine spoils the ratio: the load is printed.

    python benchmarks/map_workers.py [values an axis of a grid of six axes]
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import robostiff as rs
from robostiff.analysis.maps.pose_columns import SIX


def poses_a_second(grid: rs.Grid, workers: int) -> float:
    """Rate of the blocks after the first of each worker."""
    seen: list[tuple[float, int]] = []
    robot: Any = rs.load("hexapod")
    with tempfile.TemporaryDirectory() as folder:
        rs.stiffness_map(
            robot,
            grid,
            method=rs.Batched(),
            store=Path(folder) / "map.zarr",
            workers=workers,
            progress=lambda p: seen.append((time.perf_counter(), p.done)),
        )
    (started, before), (ended, done) = seen[workers - 1], seen[-1]
    return (done - before) / (ended - started)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 9
    grid = rs.Grid({name: rs.Axis(-0.1, 0.1, count) for name in SIX})
    load = os.getloadavg()[0]
    one, two = (poses_a_second(grid, workers) for workers in (1, 2))
    print(f"{count**6} poses, {os.cpu_count()} processors, load before {load:.1f}")
    print(f"one worker {one:10.0f} poses a second\ntwo workers{two:10.0f}    ratio {two / one:.2f}")


if __name__ == "__main__":
    main()
