"""What a map costs beside the computation: poses a second around an evaluator that only fills.

python benchmarks/map_overhead.py [values an axis of a grid of six axes]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.analysis.maps.evaluator import DirectForm, MapEvaluator
from robostiff.analysis.maps.job import MapJob, MapSummary
from robostiff.analysis.maps.map import MapArrays
from robostiff.analysis.maps.pose_columns import SIX, pose_columns
from robostiff.analysis.maps.run import Threads, run_with_progress, workforce
from robostiff.analysis.maps.store import MapStore, create_store


def filling(asked: MapEvaluator, poses: np.ndarray) -> dict[str, np.ndarray]:
    """Numbers that do not compress well for each variable, poses side by side in memory."""
    found = {v.name: np.zeros((*v.shape, len(poses)), v.dtype) for v in asked.variables}
    for variable in asked.variables:
        for k, entry in enumerate(np.ndindex(variable.shape) if variable.is_float else ()):
            found[variable.name][entry] = poses[:, k % 6] + 1.234 * poses[:, (k + 1) % 6]
    return {name: np.moveaxis(array, -1, 0) for name, array in found.items()}


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    robot: Any = rs.load("hexapod")
    grid = rs.Grid({name: rs.Axis(-0.1, 0.1, count) for name in SIX})
    columns = pose_columns(robot, grid.names)
    print(f"{count**6} poses, {rs.Threads().number} threads, million poses a second")
    print(f"{'quantity':20} {'memory':>10} {'Zarr':>10}")
    for quantity in (rs.Quantity.PRINCIPAL_STIFFNESS, rs.Quantity.STIFFNESS):
        form = DirectForm(filling, "none", 2**20)
        job = MapJob(MapEvaluator(robot, columns, (quantity,), form=form), grid)
        blocks = range(len(job.partition))

        def rate(work, finish, job=job, blocks=blocks):
            started = time.perf_counter()
            with workforce(None, Threads()) as run:
                running = run(work.compute, blocks)
                finish(run_with_progress(running, MapSummary(), job.partition.poses, None))
            return job.partition.poses / (time.perf_counter() - started) / 1e6

        arrays = MapArrays(job)
        rate(arrays, arrays.dataset)  # the first touch of memory is the system's time
        in_memory = rate(arrays, arrays.dataset)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "map.zarr"
            create_store(path, job)
            store = MapStore(path, job)
            on_disk = rate(store, store.finish)
        print(f"{quantity.value:20} {in_memory:10.2f} {on_disk:10.2f}")


if __name__ == "__main__":
    main()
