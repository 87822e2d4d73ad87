"""``python -m tests.campaign``: robots, robots under load, linkages, readers, stores, or all."""

from __future__ import annotations

import argparse
from importlib import import_module

from tests.campaign.answers import run_each

#: Parts of machines that are judged one by one: where, by what function, and what they are.
JUDGED = {
    "coupled_joints": ("coupled_joints", "judged_robot", "robots with coupled joints"),
    "loads": ("loads", "loaded_machine", "machines under loads"),
    "under_load": ("under_load", "loaded_robot", "robots under load"),
    "linkages_under_load": ("under_load", "loaded_linkage", "linkages under load"),
    "moved_linkages": ("moved_linkages", "moved_linkage", "linkages"),
}
PARTS = ("robots", *JUDGED, "readers", "stores")
#: How many of each where no number is given.
COUNTS = {
    "robots": 20000,
    "coupled_joints": 400,
    "loads": 2000,
    "under_load": 400,
    "linkages_under_load": 400,
    "moved_linkages": 400,
    "readers": 20000,
    "stores": 400,
}


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
        where, judged, what = JUDGED.get(part, (part, "", ""))
        module = import_module(f"tests.campaign.{where}")
        count = given.count or COUNTS[part]
        if judged:
            failed += run_each(
                getattr(module, judged), what, count, given.seed, given.first, given.processes
            )
            continue
        is_robots = part == "robots"
        more = {"processes": given.processes, "first": given.first} if is_robots else {}
        failed += module.run(count, given.seed, **more)
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
