"""Time a pose takes: compiled robots beside other ways to the same K_C, in one run.

The first table has one robot, the Stewart-Gough platform of case B whose legs are flexible tubes
with elastic actuators. Every row begins with platform poses and ends with K_C, inverse kinematics
included, in one thread and float64. Kernels and C write into arrays that are allocated before; the
rows of `rs.compile` include its checks and the arrays of its answer. Ratios are to C by hand, which
writes one triangle of K and checks nothing. Rows are run in turns, and the
fastest run of each counts; what is compiled is compiled before. K_C must be the same to 1e-9 of
sqrt(K_ii K_jj), or the row says WRONG. Ways that others wrote the tools for are in `peers/`, and
come with the extra `bench`; a row says which is not installed. The second table has other robots.

    python benchmarks/kernels.py            about a minute
    python benchmarks/kernels.py --quick    few poses
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

# XLA makes as many threads as it may use processors.
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import argparse
from collections.abc import Callable

import numpy as np
from batched_stiffness import (
    K_ACTUATOR,
    Hexapod,
    legs_stacked,
    loop,
    numbers_of,
    random_poses,
    with_elastic_actuators,
)
from kernels_of_robots import ALLOWED, robots_table
from peers.closed_form_in_c import closed_form_in_c
from peers.jax_recursion import jax_recursion
from peers.numba_recursion import numba_recursion
from peers.opensees_model import opensees_model
from peers.pinocchio_jacobians import pinocchio_jacobians
from peers.way import PeerMissing, Way
from timed_rows import Row, kernel_run, timed

import robostiff as rs
from robostiff.analysis.compiled_stiffness import compile_stiffness
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.compiled import Backend, StiffnessMatrix, kernel_of, machine_code_is_available
from robostiff.kinematics import PostureFinder
from robostiff.recorded import record_robot

PLACES = [(i, j) for i in range(6) for j in range(i, 6)]
BY_HAND = "closed form (25) in C, by hand"
DIRECT = "the direct form, all poses at once"
# Peers, and how many times fewer poses than the kernel they get.
PEERS: dict[str, tuple[Callable[[Hexapod], Way], int]] = {
    BY_HAND: (closed_form_in_c, 1),
    "JAX: recursion (15), jit and vmap": (jax_recursion, 1),
    "numba: recursion (15) in loops": (numba_recursion, 1),
    "pinocchio: its Jacobians, eq. (7)": (pinocchio_jacobians, 20),
    "OpenSees: a model of beams a pose": (opensees_model, 400),
}


def peer_rows(robot: Hexapod, inputs: np.ndarray) -> tuple[list[Row], list[str]]:
    """Rows of the peers that are here, and a line for each that is not."""
    rows, missing = [], []
    for name, (peer, fewer) in PEERS.items():
        count = max(inputs.shape[1] // fewer, 1)
        some = np.ascontiguousarray(inputs[:, :count])
        try:
            way = peer(robot)
        except (ImportError, PeerMissing) as error:
            missing.append(f"{name:56}not installed ({error})")
            continue
        rows.append(Row(name, count, lambda way=way, some=some: way(some)))
    return rows, missing


def hexapod_rows(count: int) -> tuple[list[Row], list[str]]:
    robot = with_elastic_actuators(rs.load("gough-stewart-b-beams"), K_ACTUATOR)
    numbers = numbers_of(robot)
    poses = random_poses(count)
    inputs = np.ascontiguousarray(poses.T)
    few, fewer = poses[: max(count // 20, 1)], poses[: max(count // 400, 1)]
    recorded = record_robot(robot, PostureFinder(robot))
    rows: list[Row] = []
    if machine_code_is_available():
        for has_flags, name in ((False, "K"), (True, "K, rank and trust")):
            kernel = kernel_of(recorded, [StiffnessMatrix()], Backend.MACHINE, has_flags=has_flags)
            label = f"kernel, {name} ({kernel.operations} operations)"
            rows.append(Row(label, count, kernel_run(kernel, inputs)))
    arrays = kernel_of(recorded, [StiffnessMatrix()], Backend.ARRAYS, has_flags=False)
    rows.append(Row("the record on NumPy arrays, K", count, kernel_run(arrays, inputs)))
    compiled = compile_stiffness(robot)

    for words, given in (("poses side by side", inputs.T), ("a pose a row", poses)):
        name = f"rs.compile, (N, 6, 6), rank, status, {words}"
        rows.append(Row(name, count, lambda x=given: compiled.evaluate(x).matrix))
    rows.append(Row(DIRECT, len(few), lambda: direct_stiffness(robot, few).K))
    rows.append(
        Row("lean NumPy loop, eq. (7)", len(fewer), lambda: loop(numbers, fewer, legs_stacked))
    )
    others, missing = peer_rows(numbers, inputs)
    return [*rows, *others], missing


def upper_triangle(found: np.ndarray) -> np.ndarray:
    """The 21 entries (21, N), of those or of matrices (N, 6, 6) or rows of a kernel."""
    if found.ndim == 3:
        found = np.moveaxis(found, 0, -1).reshape(36, -1)
    return found if len(found) == 21 else found[[6 * i + j for i, j in PLACES]]


def report(rows: list[Row]) -> None:
    reference = upper_triangle(next(row.found for row in rows if row.name == DIRECT))
    by_hand = [row.microseconds for row in rows if row.name == BY_HAND]
    first = by_hand[0] if by_hand else rows[0].microseconds
    print(f"{'':56}{'us a pose':>11}{'ratio':>10}{'K':>10}")
    for row in rows:
        n = min(row.count, reference.shape[1])
        size = np.sqrt([reference[PLACES.index((i, i)), :n] for i in range(6)])
        allowed = np.array([size[i] * size[j] for i, j in PLACES])
        apart = float(np.max(np.abs(upper_triangle(row.found)[:, :n] - reference[:, :n]) / allowed))
        mark = f"{apart:10.0e}" if apart <= ALLOWED else "     WRONG"
        print(f"{row.name:56}{row.microseconds:11.4f}{row.microseconds / first:10.1f}{mark}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Time a pose takes, by many ways.")
    parser.add_argument("--quick", action="store_true", help="few poses")
    options = parser.parse_args()
    count, turns = (2_000, 2) if options.quick else (20_000, 25)
    rows, missing = hexapod_rows(count)
    timed(rows, turns)
    print(f"Stewart-Gough B, flexible legs and elastic actuators, {count} random poses, 1 thread")
    if not machine_code_is_available():
        print("llvmlite is not installed: no machine code")
    report(rows)
    print("\n".join(missing), end="\n" if missing else "")
    robots_table(count, turns)


if __name__ == "__main__":
    main()
