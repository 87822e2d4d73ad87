"""Every job that people wait for, its goal, and what it takes here, in one run.

Ratios are of rows that run in turns. Of single calls the fastest counts, by the time of the
processor, in one thread; maps take all processors, and are timed by the clock on the wall. Other
benchmarks tell more of each row.

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
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from map_reductions import NAME, ROBOT
from startup import median_time

import robostiff as rs
from robostiff.compiled import machine_code_is_available

HERE = Path(__file__).parent
A_POSE = [0.05, 0.02, 0.9, 0.05, 0.02, 0.1]  # of the hexapod [m, rad]
WRENCH = [30.0, -20, -50, 1, 2, -0.5]
TURNS = dict.fromkeys(("rx", "ry", "rz"), (-0.2, 0.2))
BOX = {"x": (-0.1, 0.1), "y": (-0.1, 0.1), "z": (0.7, 0.9), **TURNS}
# Run in processes of their own: calls after `load` with the record on disk, and what memory takes.
CALLS = f"""
import time, numpy as np, robostiff as rs
def timed(run):
    start = time.process_time(); run(); return 1e3 * (time.process_time() - start)
rs.compile(rs.load("3-rpr"), backend=rs.Backend.ARRAYS)  # imports
pose, robot, other = {A_POSE}, rs.load("hexapod"), rs.load("hexapod")
first, *calls = (timed(lambda: rs.stiffness(robot, pose).K) for _ in range(23))
poses = np.tile(pose, (100_000, 1))
whole, *many = (timed(lambda: rs.stiffness(other, poses).K) for _ in range(15))
print(f"{{first:.1f}} ms, then {{np.median(calls):.2f}}; 10^5 poses {{whole:.0f}} ms, then "
      f"{{np.median(many[:4]) / 100:.2f}} us a pose, {{min(many[8:]) / 100:.2f}} by machine code")
"""
RECORDS = """
import time, numpy as np, robostiff as rs
for name in ("hexapod", "six-joint-arm", "3-rps", "delta", "h4"):
    robot, start = rs.load(name), time.process_time()
    fast, home, made = rs.compile_loaded(robot), rs.find_posture(robot), time.process_time()
    poses = np.tile(home.pose[:, robot.coordinate_places], (1000, 1))
    if robot.is_posed_by_joints:
        poses = rs.JointCoordinates(np.tile(home.coordinates[0], (1000, 1)))
    fast.evaluate(poses, np.zeros(robot.space.size))
    print(f"{name} {made - start:.2f} + {time.process_time() - made:.2f}",
          end=", " if name != "h4" else " s")
"""
NETWORK = """
import time
from network import lattice, condense
from timed_rows import largest_memory
start = time.process_time(); found = lattice((15, 15, 13), hinged=False); condense(found)
print(f"{time.process_time() - start:.2f} s, {len(found.beams)} beams,",
      f"{largest_memory():.0f} MB")
"""
NETCDF = f"""
import sys, robostiff as rs
from robostiff.io.map_files import write_map_netcdf
from timed_rows import largest_memory
poses = rs.RandomPoses(1_000_000, {BOX})
found = rs.stiffness_map(rs.load("{ROBOT}"), poses, store=sys.argv[1] + "/map.zarr")
before = largest_memory()
write_map_netcdf(found, sys.argv[1] + "/map.nc")
print(f"{{largest_memory():.0f}} MB, {{before:.0f}} before")
"""


def seconds(run: Callable[[], Any], turns: int = 5, clock: Any = time.process_time) -> float:
    """Of the fastest run, after a first one."""
    run()
    times = []
    for _ in range(turns):
        start = clock()
        run()
        times.append(clock() - start)
    return min(times)


def mapped(robot: Any, count: int, box: Any, **options: Any) -> float:
    poses = rs.RandomPoses(count, box)
    return seconds(lambda: rs.stiffness_map(robot, poses, **options), 2, time.perf_counter)


@cache
def ratios() -> dict[str, float]:
    """Rows of `kernels.py` as multiples of C by hand."""
    from kernels import BY_HAND, hexapod_rows
    from timed_rows import timed

    wanted = ("kernel", "rs.compile", BY_HAND)
    rows = [row for row in hexapod_rows(20_000)[0] if row.name.startswith(wanted)]
    timed(rows, 25)
    by_hand = [row.best for row in rows if row.name == BY_HAND]
    return {row.name: row.best / by_hand[0] for row in rows} if by_hand else {}


def against_C(start: str, end: str = "") -> str:
    found = [x for name, x in ratios().items() if name.startswith(start) and end in name]
    return f"{found[0]:.2f}" if found else "no C compiler, or no llvmlite"


def alone(code: str, runs: int = 1) -> str:
    """What code prints in its last run, in processes with a folder of records of their own."""
    path = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"ROBOSTIFF_CACHE": f"{folder}/records", "PYTHONPATH": path}
        command, printed = [sys.executable, "-c", code, folder], ""
        for _ in range(runs):
            done = subprocess.run(command, check=True, capture_output=True, env=environment)  # noqa: S603
            printed = done.stdout.decode().strip()
    return printed


def asked_often(machine: Any, pose: Any = None) -> Callable[[], Any]:
    """A question to a machine that has its record by then, where it ever has one."""
    for _ in range(30):
        rs.stiffness(machine, pose)
    return lambda: rs.stiffness(machine, pose).K


def one_pose() -> str:
    return f"{1e3 * seconds(asked_often(rs.load('hexapod'), A_POSE), 500):.3f} ms"


def near(count: int) -> np.ndarray:
    return np.array(A_POSE) + np.random.default_rng(0).uniform(-0.01, 0.01, (count, 6))


PLATFORM = {"platform": rs.Mass(10, inertia=[0.1, 0.1, 0.2])}


def many_poses() -> str:
    robot, poses = rs.load("hexapod"), near(100_000)

    def of(found: Any) -> Any:
        return found.principal_stiffness, found.collinear_stiffness, found.anisotropy

    for _ in range(13):  # machine code takes over
        rs.stiffness(robot, poses)
    runs: dict[str, Callable[[], Any]] = {
        "K": lambda: rs.stiffness(robot, poses).K,
        "compliance": lambda: rs.compliance(robot, poses),
        "deflection": lambda: rs.deflection(robot, poses, WRENCH).twist,
        "indices": lambda: of(rs.indices(robot, poses)),
    }
    return ", ".join(f"{name} {10 * seconds(run):.2f}" for name, run in runs.items()) + " us"


def cables() -> str:
    robot, random = rs.load("cable-8"), np.random.default_rng(0)
    low, high = [-0.6, -0.6, 0.4, -0.1, -0.1, -0.1], [0.6, 0.6, 1.8, 0.1, 0.1, 0.1]
    poses = random.uniform(low, high, (100_000, 6))  # a fifth of them without tensions
    kernel = rs.compile(robot)
    direct = 1e6 * seconds(lambda: rs.stiffness(robot, poses[:10_000]), 2) / 10_000
    return f"{direct:.0f} us a pose, {10 * seconds(lambda: kernel.evaluate(poses)):.2f} compiled"


def loads() -> str:
    robot, poses = rs.load("hexapod"), near(8_192)
    fast = rs.compile_loaded(robot)
    many = 1e6 * seconds(lambda: fast.evaluate(poses, WRENCH), 2) / len(poses)
    new, masses = iter(near(100)), {"platform": 10.0}
    one = 1e3 * seconds(lambda: rs.equilibrium(robot, next(new), WRENCH), 20)
    modes = 1e3 * seconds(lambda: rs.modes(robot, next(new), masses), 20)
    of_many = 1e3 / 64 * seconds(lambda: rs.modes(robot, near(64), masses), 2)
    without_masses = rs.load("gough-stewart-b")  # of its legs
    at = np.array([0, 0, 0.8, 0, 0, 0]) + poses - A_POSE
    rs.modes(without_masses, at, PLATFORM)
    each = 1e6 * seconds(lambda: rs.modes(without_masses, at, PLATFORM), 2) / len(at)
    return (
        f"equilibrium at a new pose {one:.1f} ms, {many:.1f} us compiled; modes {modes:.1f} ms, "
        f"{of_many:.1f} at each of many, {each:.0f} us of a platform"
    )


def other_machines() -> str:
    examples = HERE.parent / "examples"
    machines: dict[str, tuple[Any, Any]] = {
        "four-bar": (rs.load_linkage(examples / "four-bar.xml"), {"crank": 0.1}),
        "double pantograph": (rs.load_linkage("double-pantograph"), {"screw": -0.02}),
        "hybrid": (rs.load(examples / "tricept-with-head.yaml"), None),
        "parallelograms": (rs.load("delta"), None),
        "flexible platform": (rs.load(examples / "flexure-stage.yaml"), None),
        "cables": (rs.load("cable-8"), None),
    }
    times = {name: 1e3 * seconds(asked_often(*own), 50) for name, own in machines.items()}
    return ", ".join(f"{name} {own:.2f}" for name, own in times.items()) + " ms"


def maps() -> str:
    box = {**BOX, "z": (0.85, 0.95)}
    times = [mapped(rs.load("hexapod"), count, box) for count in (49_000, 51_000)]
    return " / ".join(f"{own:.2f}" for own in times) + " s"


def map_to_disk() -> str:
    with tempfile.TemporaryDirectory() as folder:
        start, store = time.perf_counter(), Path(folder) / "map.zarr"
        rs.stiffness_map(rs.load(ROBOT), rs.RandomPoses(1_000_000, BOX), store=store)
        elapsed = time.perf_counter() - start
        size = sum(own.stat().st_size for own in store.rglob("*") if own.is_file())
    return f"{elapsed:.2f} us, {size / 1e6:.0f} B"


def reductions() -> str:
    """By what more poses take, without what is done once."""
    kept = [rs.Extremes(), rs.Quantiles(), rs.ShareAbove(NAME, [1e7, 1e8])]
    few, many = (
        mapped(rs.load(ROBOT), count, BOX, reduce=kept) for count in (2_000_000, 100_000_000)
    )
    return f"{few + (many - few) * 998 / 98:.0f} s, as 10^8 take"


def cold() -> str:
    robostiff = str(Path(sys.executable).with_name("robostiff"))
    return f"{median_time((robostiff, 'stiffness', 'hexapod'), 7):.2f} s"


ROWS: tuple[tuple[str, str, Callable[[], str]], ...] = (
    ("kernel, K / C by hand", "0.95", lambda: against_C("kernel, K (")),
    ("kernel, K with rank and trust / C", "1.25", lambda: against_C("kernel, K, rank")),
    ("compile.evaluate, matrices / C", "1.5", lambda: against_C("rs.compile", "side by side")),
    ("hexapod: calls after load", "1 ms; 10 ms, then 0.2 us", lambda: alone(CALLS, runs=2)),
    ("hexapod: one pose", "0.1 ms", one_pose),
    ("hexapod: 10^5 poses, by machine code", "1 us a pose", many_poses),
    ("cables: 10^5 poses", "1 us a pose", cables),
    ("hexapod: under load", "2 ms, 5 us compiled", loads),
    ("recorded under load + first 1000 poses", "", lambda: alone(RECORDS)),
    ("other machines: one pose", "1 ms", other_machines),
    ("network of 10^4 beams: build and K", "1.5 s, 200 MB", lambda: alone(NETWORK)),
    ("map of 49,000 / 51,000 poses", "no step", maps),
    ("map to Zarr: a pose", "0.9 us", map_to_disk),
    ("map to NetCDF: 10^6 poses", "300 MB", lambda: alone(NETCDF)),
    ("map reduced: 10^9 poses", "60 s, two processors", reductions),
    ("cold `robostiff stiffness hexapod`", "0.6 s", cold),
)


def main() -> None:
    code = "machine code" if machine_code_is_available() else "NumPy alone"
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    print(f"{os.cpu_count()} processors{load}, {code}\n\n| job | goal | measured |\n|---|---|---|")
    for what, goal, measured in ROWS:
        if len(sys.argv) < 2 or any(word in what for word in sys.argv[1:]):
            print(f"| {what} | {goal} | {measured()} |", flush=True)


if __name__ == "__main__":
    main()
