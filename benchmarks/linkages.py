"""Linkages: values of driven joints to K_C, rank and status, one process, one thread.

"Network": the loops are closed and the network is solved, configuration by configuration. "Kernel":
recorded once, `rs.compile(linkage)`, by NumPy and as machine code. Both must give the same K_C.
Times are those of the processor.

    python benchmarks/linkages.py [number of configurations]
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.compiled import machine_code_is_available

EXAMPLES = Path(__file__).parent.parent / "examples"
# Of each drive, from and to [m, rad]: near home, and nearly all of its range.
LINKAGES: dict[Any, tuple[tuple[float, float], tuple[float, float]]] = {
    "double-pantograph": ((-0.02, 0.02), (-0.3, 0.09)),
    EXAMPLES / "four-bar.xml": ((-0.1, 0.1), (-1.0, 1.0)),
}
FEW, TURNS = 5, 3


def main() -> None:
    """Print a table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 16_384
    backends = {"NumPy": rs.Backend.ARRAYS}
    if machine_code_is_available():
        backends["machine"] = rs.Backend.MACHINE
    print(f"{'linkage':18}{'drive':>15}{'backend':>9}{'operations':>11}{'network us':>12}", end="")
    print(f"{'kernel us':>11}{'ratio':>9}{'guarded':>9}{'K':>9}")
    for source, ranges in LINKAGES.items():
        linkage = rs.load_linkage(source)
        for name, backend in backends.items():
            fast = rs.compile(linkage, backend=backend)
            (drive,) = fast.inputs
            for low, high in ranges:
                rows = np.linspace(low, high, count)[:, None]
                answer = fast.evaluate(rows, again=False)
                some = np.flatnonzero(~answer.guarded)[:: count // FEW][:FEW]
                slow, quick = np.inf, np.inf
                for _ in range(TURNS):
                    slow = min(slow, seconds(networks, linkage, drive, rows[some, 0]))
                    quick = min(quick, seconds(fast.attempt, rows))
                network, kernel = 1e6 * slow / len(some), 1e6 * quick / count
                off = distance(answer.values["K"][some], networks(linkage, drive, rows[some, 0]))
                print(f"{linkage.name:18}{f'{low:g} to {high:g}':>15}{name:>9}", end="")
                print(f"{fast.kernel.operations:11}{network:12.0f}{kernel:11.3f}", end="")
                print(f"{network / kernel:9.0f}{answer.guarded_share:9.2%}{off:9.0e}", flush=True)
                if off > 1e-9:
                    raise SystemExit(f"{linkage.name}: K differs from that of the network")


def networks(linkage: Any, drive: str, values: np.ndarray) -> np.ndarray:
    return np.array([rs.stiffness(linkage.network_at({drive: x})).K for x in values.tolist()])


def distance(K: np.ndarray, other: np.ndarray) -> float:
    size = np.sqrt(np.einsum("nii->ni", other))
    return float(np.max(np.abs(K - other) / (size[:, :, None] * size[:, None, :])))


def seconds(work: Callable[..., Any], *arguments: Any) -> float:
    start = time.process_time()
    work(*arguments)
    return time.process_time() - start


if __name__ == "__main__":
    main()
