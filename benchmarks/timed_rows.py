"""Rows of a table of times: run in turns, and the fastest run of each counts; and memory."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.compiled import Kernel, room_for

SHORT = 0.05  # s


@dataclass
class Row:
    """A way to K_C at a number of poses."""

    name: str
    count: int
    run: Callable[[], np.ndarray]
    best: float = np.inf
    found: Any = None

    @property
    def microseconds(self) -> float:
        """Time a pose takes."""
        return 1e6 * self.best / self.count


def timed(rows: list[Row], turns: int) -> None:
    for row in rows:
        row.run()  # what is compiled when first used
    for _ in range(turns):
        for row in rows:
            # A short run after a long one finds nothing in the cache.
            for _ in range(5 if row.best < SHORT else 1):
                start = time.perf_counter()
                row.found = row.run()
                row.best = min(row.best, time.perf_counter() - start)


def kernel_run(kernel: Kernel, inputs: np.ndarray) -> Callable[[], np.ndarray]:
    out = room_for(kernel.rows, inputs.shape[1])
    return lambda: kernel.evaluate(inputs, out, threads=1)


def largest_memory() -> float:
    """The most that this process has had until now [MiB].

    What `getrusage` says begins with what the process had that started it.
    """
    status = Path("/proc/self/status")
    if not status.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    words = dict(line.split(":") for line in status.read_text().splitlines())
    return int(words["VmHWM"].split()[0]) / 1024
