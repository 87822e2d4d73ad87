"""A map by a Dask scheduler and two workers of this machine: rate, a killed worker, and resuming.

Scheduler and workers are processes of their own, as on a cluster. The same map as Zarr is made by
one worker, by two, by two of which one is killed, and by two after an interruption, and each is
compared with that of one process, bit by bit. The clock runs from the first blocks done to the
last. Other work on the machine spoils the ratio: the load is printed.

    python benchmarks/map_workers.py [values an axis of a grid of six axes]
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import robostiff as rs
from robostiff.io.map_files import read_map

# A worker keeps the memory of its arrays for the next block, see docs/maps.md.
_ALLOCATOR = {"MALLOC_TRIM_THRESHOLD_": str(2**28), "MALLOC_MMAP_THRESHOLD_": str(2**25)}
PORT = 8799


@contextmanager
def cluster(workers: int) -> Iterator[tuple[str, list[Any]]]:
    """Address of a scheduler, and the processes of its workers."""
    address = f"tcp://127.0.0.1:{PORT}"
    commands = [["scheduler", "--host", "127.0.0.1", "--port", str(PORT), "--no-dashboard"]]
    commands += workers * [["worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]]
    running = [
        subprocess.Popen(  # noqa: S603 - Dask
            [sys.executable, "-m", "dask", *words],
            env={**os.environ, **_ALLOCATOR},
            stderr=subprocess.DEVNULL,
        )
        for words in commands
    ]
    try:
        from distributed import Client

        with Client(address, timeout="60s", set_as_default=False) as client:
            client.wait_for_workers(workers)
        yield address, running[1:]
    finally:
        for process in reversed(running):
            process.kill()
            process.wait()


class Interruption(Exception):
    """Stands for anything that ends the process that asks for a map."""


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    x, turn = rs.Axis(-0.05, 0.05, count), rs.Axis(-0.1, 0.1, count)
    grid = rs.Grid(x=x, y=x, z=rs.Axis(0.85, 0.95, count), rx=turn, ry=turn, rz=turn)
    robot: Any = rs.load("hexapod")
    poses = count**6
    load = os.getloadavg()[0]
    print(f"{poses} poses, {os.cpu_count()} processors, load before {load:.1f}")

    def made(path: Path, address: Any, event: Any = None, **options: Any) -> float:
        """Poses a second after the first blocks, of which `event` is called after a third."""
        seen: list[tuple[float, int]] = []

        def progress(p: rs.Progress) -> None:
            seen.append((time.perf_counter(), p.done - p.resumed))
            if event is not None and 3 * p.done > p.total:
                event()

        rs.stiffness_map(
            robot,
            grid,
            method=rs.Compiled(),
            store=path,
            scheduler=address,
            progress=progress,
            **options,
        )
        (started, before), (ended, done) = seen[min(3, len(seen) // 4)], seen[-1]
        return (done - before) / (ended - started)

    with tempfile.TemporaryDirectory(dir=os.environ.get("ROOM")) as folder:
        alone, other = Path(folder) / "alone.zarr", Path(folder) / "other.zarr"
        print(f"one process, one thread  {made(alone, rs.Threads(1)):12.0f} poses a second")
        size = sum(own.stat().st_size for own in alone.rglob("*") if own.is_file())
        print(f"on disk                  {size / poses:12.1f} bytes a pose")
        whole = read_map(alone)

        def compared(words: str, rate: float) -> float:
            found = read_map(other)
            same = all(
                bool((found[name].fillna(-1) == whole[name].fillna(-1)).all()) for name in whole
            )
            print(f"{words:25}{rate:12.0f} poses a second, {'equal' if same else 'NOT EQUAL'}")
            subprocess.run(["rm", "-r", other], check=True)  # noqa: S603, S607
            return rate

        rates = []
        for workers in (1, 2):
            with cluster(workers) as (address, _):
                words = f"{workers} of Dask"
                rates.append(compared(words, made(other, address)))
        print(f"efficiency of two        {rates[1] / rates[0] / 2:12.2f}")
        with cluster(2) as (address, processes):

            def kill() -> None:
                processes[0].send_signal(signal.SIGKILL)

            compared("2, one killed at a third", made(other, address, kill))

        def interrupt() -> None:
            raise Interruption

        with cluster(2) as (address, _), suppress(Interruption):
            made(other, address, interrupt)
        with cluster(2) as (address, _):
            compared("2, resumed at a third", made(other, address, resume=True))


if __name__ == "__main__":
    main()
