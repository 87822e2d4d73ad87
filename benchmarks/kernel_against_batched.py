"""Compiled robots against the wrench basis form at very many poses, singular ones among them.

Every robot of the tests and every shipped one; random poses, some out of reach, and poses planted
on singularities, at the limits of reach and of actuators, and 1e-3 to 1e-12 away from them. Status
and rank must be the same, and K to 1e-9 of sqrt(K_ii K_jj).

    python -m benchmarks.kernel_against_batched [poses a robot] [robot] ...

A million poses a robot take an hour or two, most of it in the wrench basis form.
"""

import sys
import time

import numpy as np
from tests.compiled.agreement import agreement
from tests.generators.kernel_robots import ALL_ROBOTS, robot_called
from tests.generators.planted_poses import PoseSpace

from robostiff.analysis.compiled_stiffness import compile_stiffness
from robostiff.compiled import Backend

CHUNK = 20_000


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
    names = sys.argv[2:] or ALL_ROBOTS
    print(f"{'':24}{'backend':9}{'poses':>9}{'reached':>9}{'guarded':>9}", end="")
    print(f"{'status':>8}{'rank':>6}{'K':>9}{'s':>7}")
    wrong = False
    for name in names:
        robot = robot_called(name)
        space, rng = PoseSpace(robot), np.random.default_rng(7)
        planted = space.planted(rng)
        for backend in (Backend.MACHINE, Backend.ARRAYS):
            start = time.perf_counter()
            compiled = compile_stiffness(robot, backend=backend)
            totals = np.zeros(5, dtype=int)
            K = 0.0
            for left in range(count, 0, -CHUNK):
                size = float(rng.choice([0.2, 0.6, 1.5]))
                rows = space.drawn(rng, min(left, CHUNK), size)
                if left == count:
                    rows = np.concatenate([planted, rows])
                found = agreement(compiled, space, rows)
                totals += [
                    found.poses,
                    found.reached,
                    found.guarded,
                    len(found.status),
                    len(found.rank),
                ]
                K = max(K, float(found.K.max()))
            poses, reached, guarded, status, rank = totals
            wrong = wrong or bool(status or rank or K > 1e-9)
            mark = "" if compiled.verified else " not trusted"
            print(f"{name:24}{backend.value:9}{poses:9}{reached:9}{guarded:9}", end="")
            print(f"{status:8}{rank:6}{K:9.1e}{time.perf_counter() - start:7.1f}{mark}", flush=True)
    if wrong:
        raise SystemExit("compiled robots and the wrench basis form differ")


if __name__ == "__main__":
    main()
