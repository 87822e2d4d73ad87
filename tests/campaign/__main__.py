"""``python -m tests.campaign``: robots, robots under load, linkages, readers, stores, or all.

Machine i of a part is made from the seed and i alone: ``--first i --count 1`` repeats a failure.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from functools import partial
from importlib import import_module

import numpy as np

from tests.campaign.answers import Complaint

#: Of each part its module, the function that judges one machine, what is judged, and how many
#: where no number is given.
PARTS = {
    "robots": ("robots", "judged_robot", "robots", 20000),
    "loads": ("loads", "loaded_machine", "machines under loads", 2000),
    "moved_linkages": ("moved_linkages", "moved_linkage", "linkages", 400),
    "model_files": ("reread_answers", "judged_file", "model files read twice", 400),
    "readers": ("readers", "judged_file", "mutated files", 20000),
    "stores": ("stores", "judged_store", "damaged maps", 400),
}
#: Their functions take the seed and the number; others take what a machine is drawn with.
BY_NUMBER = ("robots", "model_files", "readers", "stores")


def main() -> int:
    """Run the parts that are named, all when none is; 1 where anything failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="all when none is named")
    parser.add_argument("--count", type=int)
    parser.add_argument("--first", type=int, default=0, help="number of the first machine")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2, help="that share the machines")
    given = parser.parse_args()
    failed = 0
    for part in given.parts or PARTS:
        print(f"== {part}, seed {given.seed}", flush=True)
        where, judge, what, count = PARTS[part]
        judged = getattr(import_module(f"tests.campaign.{where}"), judge)
        if part not in BY_NUMBER:
            judged = partial(_drawn, judged)
        numbers = range(given.first, given.first + (given.count or count))
        failed += _run(partial(_judged, judged, given.seed), what, numbers, given.processes)
    return 1 if failed else 0


def _run(
    judged: Callable[[int], list[Complaint]], what: str, numbers: range, processes: int
) -> int:
    """Judge each; how many were wrong."""
    failed = 0
    with ProcessPoolExecutor(processes) if processes > 1 else nullcontext() as pool:
        found = map(judged, numbers) if pool is None else pool.map(judged, numbers, chunksize=4)
        for number, complaints in zip(numbers, found, strict=True):
            for complaint in complaints:
                print(f"{number}: {complaint}", flush=True)
            failed += bool(complaints)
    print(f"{len(numbers)} {what}, {failed} failed")
    return failed


def _drawn(
    judged: Callable[[np.random.Generator], list[Complaint]], seed: int, number: int
) -> list[Complaint]:
    return judged(np.random.default_rng([seed, number]))


def _judged(
    judged: Callable[[int, int], list[Complaint]], seed: int, number: int
) -> list[Complaint]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return judged(seed, number)
    except Exception as error:  # whatever is raised is a finding
        return [Complaint("machine", type(error).__name__, str(error)[:300])]


if __name__ == "__main__":
    sys.exit(main())
