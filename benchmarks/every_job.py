"""Every job that people wait for, its goal, and what it takes here, in one run and one thread.

Ratios are of rows that run in turns, the fastest run of each; single calls are the fastest of some.
What begins in a process of its own is timed by its processor time. Other benchmarks tell more.

    python benchmarks/every_job.py             some minutes on a quiet machine
    python benchmarks/every_job.py WORD ...    the rows whose names have one of these words
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.compiled import machine_code_is_available

EXAMPLES = Path(__file__).parent.parent / "examples"
A_POSE = [0.05, 0.02, 0.9, 0.05, 0.02, 0.1]  # of the hexapod [m, rad]
WRENCH = [30.0, -20, -50, 1, 2, -0.5]
BOX = {"x": (-0.05, 0.05), "y": (-0.05, 0.05), "z": (0.85, 0.95), "rz": (-0.1, 0.1)}


def seconds(run: Callable[[], Any], turns: int = 5) -> float:
    """Of the fastest run, after a first one."""
    run()
    times = []
    for _ in range(turns):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def hexapod_poses(count: int) -> np.ndarray:
    return np.array(A_POSE) + 0.01 * np.random.default_rng(0).uniform(-1, 1, (count, 6))


@cache
def kernels() -> dict[str, float]:
    """Time of the rows of `kernels.py`, as a multiple of C by hand."""
    from kernels import BY_HAND, hexapod_rows
    from timed_rows import timed

    wanted = ("kernel", "rs.compile", BY_HAND)
    rows = [row for row in hexapod_rows(20_000)[0] if row.name.startswith(wanted)]
    timed(rows, 25)
    by_hand = [row.best for row in rows if row.name == BY_HAND]
    return {row.name: row.best / by_hand[0] for row in rows} if by_hand else {}


def against_C(start: str, end: str) -> str:
    found = [x for name, x in kernels().items() if name.startswith(start) and end in name]
    return f"{found[0]:.2f}" if found else "no C compiler, or no llvmlite"


def first_calls() -> str:
    """In a fresh process with the record on disk: 10^5 poses at once, and one pose 23 times."""
    code = (
        "import time, numpy as np, robostiff as rs\n"
        "def timed(run):\n"
        "    start = time.process_time(); run(); return time.process_time() - start\n"
        "rs.compile(rs.load('3-rpr'), backend=rs.Backend.ARRAYS)\n"  # imports
        f"pose, robot = {A_POSE}, rs.load('hexapod')\n"
        "calls = [1e3 * timed(lambda: rs.stiffness(robot, pose).K) for _ in range(23)]\n"
        "robot, poses = rs.load('hexapod'), np.tile(pose, (100_000, 1))\n"
        "many = [1e3 * timed(lambda: rs.stiffness(robot, poses).K) for _ in range(20)]\n"
        "print(f'{calls[0]:.1f} | {np.median(calls):.2f} | {max(calls[1:]):.2f} | '\n"
        "      f'{many[0] - np.median(many[1:5]):.0f} | {min(many[1:]) / 100:.2f}')\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(2):  # the first one records
            found = _output(code, ROBOSTIFF_CACHE=folder)
    first, median, most, record, a_pose = found.split(" | ")
    return (
        f"first {first} ms, then {median} ms (at most {most}); 10^5 poses: first call {record} ms "
        f"longer, then {a_pose} us a pose"
    )


def _output(code: str, **environment: str) -> str:
    command = [sys.executable, "-c", code]
    done = subprocess.run(  # noqa: S603
        command, check=True, capture_output=True, text=True, env=os.environ | environment
    )
    return done.stdout.strip()


def one_pose() -> str:
    robot = asked_often(rs.load("hexapod"), A_POSE)
    return f"{1e3 * seconds(lambda: rs.stiffness(robot, A_POSE).K, 500):.3f} ms"


def asked_often(machine: Any, pose: Any = None) -> Any:
    """A machine with its record, where it has one."""
    for _ in range(30):
        rs.stiffness(machine, pose)
    return machine


def many_poses() -> str:
    robot, poses = asked_often(rs.load("hexapod"), A_POSE), hexapod_poses(100_000)
    for _ in range(12):  # machine code takes over
        rs.stiffness(robot, poses)

    def of(found: Any) -> Any:
        return found.principal_stiffness, found.collinear_stiffness, found.anisotropy

    runs = {
        "stiffness": lambda: rs.stiffness(robot, poses).K,
        "compliance": lambda: rs.compliance(robot, poses),
        "deflection": lambda: rs.deflection(robot, poses, WRENCH).twist,
        "indices": lambda: of(rs.indices(robot, poses)),
    }
    return ", ".join(f"{name} {10 * seconds(run):.2f} us" for name, run in runs.items())


def loads() -> str:
    robot, poses = rs.load("hexapod"), hexapod_poses(5_000)
    runs = {"equilibrium": lambda x: rs.equilibrium(robot, x, WRENCH)}
    runs["modes"] = lambda x: rs.modes(robot, x, gravity=None)
    return ", ".join(
        f"{name} {1e3 * seconds(lambda run=run: run(A_POSE)):.1f} ms alone, "
        f"{1e6 * seconds(lambda run=run: run(poses), 2) / len(poses):.1f} us batched"
        for name, run in runs.items()
    )


def other_machines() -> str:
    machines: dict[str, tuple[Any, Any]] = {
        "linkage": (rs.load_linkage(EXAMPLES / "four-bar.xml"), {"crank": 0.1}),
        "double pantograph": (rs.load_linkage("double-pantograph"), {"screw": -0.02}),
        "hybrid": (rs.load(EXAMPLES / "tricept-with-head.yaml"), None),
        "parallelograms": (rs.load("delta"), None),
        "flexible platform": (rs.load(EXAMPLES / "flexure-stage.yaml"), None),
        "cables": (rs.load("cable-8"), None),
    }
    found = []
    for name, (machine, pose) in machines.items():
        asked_often(machine, pose)
        time_of_one = seconds(lambda own=machine, x=pose: rs.stiffness(own, x).K, 50)
        found.append(f"{name} {1e3 * time_of_one:.2f}")
    return f"{', '.join(found)} ms"


def network() -> str:
    code = (
        "import resource, time\n"
        "from network import lattice, condense\n"
        "start = time.process_time()\n"
        "found = lattice((15, 15, 13), hinged=False)\n"
        "condense(found)\n"
        "memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024\n"
        "print(f'{time.process_time() - start:.2f} s, {memory:.0f} MB, {len(found.beams)} beams')\n"
    )
    return _output(code, PYTHONPATH=_with_benchmarks())


def _with_benchmarks() -> str:
    known = os.environ.get("PYTHONPATH", "")
    return os.pathsep.join([str(Path(__file__).parent), *([known] if known else [])])


def maps() -> str:
    found = []
    for count in (49_000, 51_000):
        poses = rs.RandomPoses(count, BOX)
        found.append(
            f"{seconds(lambda poses=poses: rs.stiffness_map(rs.load('hexapod'), poses), 2):.2f}"
        )
    return " / ".join(found) + " s"


def map_to_disk() -> str:
    robot, count = rs.load("gough-stewart-b-beams"), 1_000_000
    poses = rs.RandomPoses(count, {**BOX, "z": (0.7, 0.9)})
    times, size = [], 0
    for _ in range(3):
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            rs.stiffness_map(robot, poses, store=f"{folder}/map.zarr")
            times.append(time.perf_counter() - start)
            size = sum(own.stat().st_size for own in Path(folder).rglob("*") if own.is_file())
    return f"{1e6 * min(times) / count:.2f} us, {size / count:.0f} B"


def netcdf() -> str:
    code = (
        "import resource, tempfile, robostiff as rs\n"
        "from robostiff.io.map_files import write_map_netcdf\n"
        f"poses = rs.RandomPoses(1_000_000, {dict(BOX, z=(0.7, 0.9))})\n"
        "with tempfile.TemporaryDirectory() as folder:\n"
        "    found = rs.stiffness_map(rs.load('gough-stewart-b-beams'), poses,\n"
        "                             store=folder + '/map.zarr')\n"
        "    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024\n"
        "    write_map_netcdf(found, folder + '/map.nc')\n"
        "    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024\n"
        "print(f'{after:.0f} MB, of which the map {before:.0f}')\n"
    )
    return _output(code)


def reductions() -> str:
    from map_reductions import NAME, ROBOT

    robot, count = rs.load(ROBOT), 4_000_000
    kept = [rs.Extremes(), rs.Quantiles(), rs.ShareAbove(NAME, [1e7, 1e8])]
    turn = dict.fromkeys(("rx", "ry", "rz"), (-0.2, 0.2))
    ranges = {"x": (-0.1, 0.1), "y": (-0.1, 0.1), "z": (0.7, 0.9), **turn}
    rs.stiffness_map(robot, rs.RandomPoses(60_000, ranges), reduce=kept)  # compiles
    start = time.perf_counter()
    rs.stiffness_map(robot, rs.RandomPoses(count, ranges), reduce=kept)
    a_pose = (time.perf_counter() - start) / count
    return f"{1e9 * a_pose:.0f} ns a pose, {1e9 * a_pose:.0f} s for 10^9, computed from {count:.0e}"


def cold() -> str:
    from startup import median_time

    robostiff = str(Path(sys.executable).with_name("robostiff"))
    return f"{median_time((robostiff, 'stiffness', 'hexapod'), 7):.2f} s"


ROWS: tuple[tuple[str, str, Callable[[], str]], ...] = (
    ("kernel, K / C by hand", "0.95", lambda: against_C("kernel, K (", "")),
    ("kernel, K with rank and trust / C", "1.25", lambda: against_C("kernel, K, rank", "")),
    ("compile.evaluate, matrices / C", "1.5", lambda: against_C("rs.compile", "side by side")),
    ("hexapod: calls after load, record on disk", "1 ms; 10 ms, 0.2 us", first_calls),
    ("hexapod: one pose", "0.1 ms", one_pose),
    ("hexapod: 10^5 poses, a pose", "1 us", many_poses),
    ("hexapod: loads, a pose", "2 ms alone, 5 us batched", loads),
    ("other machines: one pose", "1 ms", other_machines),
    ("network of 10,000 beams: build and K", "1.5 s, 200 MB", network),
    ("map of 49,000 / 51,000 poses", "monotonous", maps),
    ("map to Zarr: a pose", "0.9 us", map_to_disk),
    ("map to NetCDF: memory for 10^6 poses", "300 MB", netcdf),
    ("map reduced: 10^9 poses", "60 s on two cores", reductions),
    ("cold command: stiffness hexapod, processor", "0.6 s", cold),
)


def rows(words: list[str]) -> Iterator[str]:
    for what, goal, measured in ROWS:
        if not words or any(word in what for word in words):
            yield f"| {what} | {goal} | {measured()} |"


def main() -> None:
    code = "machine code" if machine_code_is_available() else "NumPy alone"
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    print(f"{os.cpu_count()} processors{load}, {code}\n\n| job | goal | measured |\n|---|---|---|")
    for row in rows(sys.argv[1:]):
        print(row, flush=True)


if __name__ == "__main__":
    main()
