"""Random robots through every way: run, shrink what fails, save it.

    python -m tests.campaign.robots --count 300 --seed 1
    python -m tests.campaign.robots --count 500 --first 1500 --seed 1
    python -m tests.campaign.robots --seed 1 --only 17

Robot i of a run is made from (seed, i) alone.
"""
# pyright: reportArgumentType=false

from __future__ import annotations

import argparse
import json
import time
import warnings
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.model import Snapshot
from tests.campaign import mechanisms, placed, posed, posed_ways, ways
from tests.campaign.answers import Complaint
from tests.campaign.posed import Posed
from tests.campaign.save import save_posed, save_snapshot
from tests.campaign.shrink import shrunk_posed, shrunk_snapshot

FOLDER = Path("build/campaign")
#: How often each kind is drawn; what costs much is drawn less.
SHARES = {
    **dict.fromkeys(placed.KINDS, 32),
    **dict.fromkeys(("nested", "nested planar"), 24),
    **dict.fromkeys(posed.KINDS, 12),
    **dict.fromkeys(mechanisms.KINDS, 6),
    **dict.fromkeys(("several legs", "hand-made"), 4),
    **dict.fromkeys(("driven arm", "shipped"), 2),
    "coupled legs": 0.5,
}
_CHUNK = 25


@dataclass
class Tally:
    """What was run, and what failed."""

    kinds: Counter[str] = field(default_factory=Counter)
    ways: Counter[str] = field(default_factory=Counter)
    seconds: Counter[str] = field(default_factory=Counter)
    failures: dict[tuple[str, str, str], list[int]] = field(default_factory=dict)
    details: dict[tuple[str, str, str], str] = field(default_factory=dict)
    failed: set[int] = field(default_factory=set)
    processor: float = 0.0

    def add(self, other: Tally) -> None:
        """Join the counts of another part of the run."""
        self.kinds += other.kinds
        self.ways += other.ways
        self.seconds += other.seconds
        self.failed |= other.failed
        self.processor += other.processor
        for key, numbers in other.failures.items():
            self.failures.setdefault(key, []).extend(numbers)
            self.details.setdefault(key, other.details[key])


def kind_of(seed: int, number: int) -> tuple[str, np.random.Generator]:
    """Kind of robot `number` of a run, and what it is drawn with."""
    rng = np.random.default_rng([seed, number])
    names, weights = list(SHARES), np.array(list(SHARES.values()), dtype=float)
    return names[rng.choice(len(names), p=weights / weights.sum())], rng


def trial(seed: int, number: int) -> tuple[str, Any, list[Complaint], list[str]]:
    """Robot `number` of a run: its kind, itself, what is wrong, and which ways it took."""
    kind, rng = kind_of(seed, number)
    own = [seed, number, 1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if kind in placed.KINDS:
            snapshot = placed.random_snapshot(rng, kind)
            judge, taken = ways.judged(snapshot, own)
            return kind, snapshot, judge.complaints, taken
        if kind in mechanisms.KINDS:
            complaints, taken, text = mechanisms.judged_mechanism(rng, kind)
            return kind, text, complaints, taken
        robot = posed.random_posed(rng, kind)
        if robot is None:
            return kind, None, [], []
        complaints, taken = posed_ways.judged_posed(robot, own)
        return kind, robot, complaints, taken


def run_part(seed: int, numbers: Iterable[int], folder: Path | None) -> Tally:
    """Some robots of a run."""
    tally = Tally()
    for number in numbers:
        start = time.process_time()
        kind, robot, complaints, taken = trial(seed, number)
        tally.kinds[kind] += 1
        tally.ways.update(taken)
        if complaints:
            tally.failed.add(number)
            for complaint in complaints:
                key = (kind, *complaint.key)
                if key not in tally.failures and folder is not None:
                    _keep(folder, seed, number, kind, robot, complaints)
                tally.failures.setdefault(key, []).append(number)
                tally.details.setdefault(key, complaint.detail)
        spent = time.process_time() - start
        tally.seconds[kind] += spent
        tally.processor += spent
    return tally


def _keep(
    folder: Path, seed: int, number: int, kind: str, robot: Any, complaints: list[Complaint]
) -> None:
    """Save a failure, shrunk, once."""
    name = f"{seed}-{number}-{kind.replace(' ', '-')}"
    if (folder / f"{name}.txt").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    own = [seed, number, 1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        saved = ""
        try:
            if isinstance(robot, Snapshot):
                smaller, complaints = shrunk_snapshot(robot, own, complaints)
                saved = save_snapshot(folder / name, smaller)
            elif isinstance(robot, Posed):
                smaller, complaints = shrunk_posed(robot, own, complaints)
                saved = save_posed(folder / name, smaller)
            elif isinstance(robot, dict):
                for file, text in robot.items():
                    (folder / f"{name}-{file}").write_text(text)
                saved = "as written"
        except Exception as error:
            saved = f"not saved: {type(error).__name__}: {error}"
    lines = [
        f"kind: {kind}",
        f"again: python -m tests.campaign.robots --seed {seed} --only {number}",
        f"robot: {saved}",
        *(str(complaint) for complaint in complaints),
    ]
    (folder / f"{name}.txt").write_text("\n".join(lines) + "\n")


def run(
    count: int, seed: int, processes: int = 1, folder: Path | None = FOLDER, first: int = 0
) -> int:
    """Run `count` robots of a seed from `first` on, print what came, and give how many failed."""
    began, total = time.perf_counter(), Tally()
    end = first + count
    parts = [range(i, min(i + _CHUNK, end)) for i in range(first, end, _CHUNK)]
    if processes == 1:
        for part in parts:
            total.add(run_part(seed, part, folder))
    else:
        with ProcessPoolExecutor(processes) as pool:
            jobs = [pool.submit(run_part, seed, list(part), folder) for part in parts]
            for job in jobs:
                total.add(job.result())
    report(total, count, seed, time.perf_counter() - began, folder)
    return len(total.failed)


def report(total: Tally, count: int, seed: int, elapsed: float, folder: Path | None) -> None:
    """Counts of kinds and ways, and failures."""
    spent = total.processor / max(count, 1)
    print(f"{count} robots of seed {seed} in {elapsed:.0f} s, {spent:.3f} s of processor a robot")
    for kind, number in sorted(total.kinds.items()):
        print(f"  {number:6d} {kind}, {total.seconds[kind] / number:.3f} s")
    print("ways:")
    for way, number in total.ways.most_common():
        print(f"  {number:6d} {way}")
    print(f"{len(total.failed)} robots failed")
    for key, numbers in sorted(total.failures.items(), key=lambda item: -len(item[1])):
        words = f"{' / '.join(key)}: first {min(numbers)}; {total.details[key][:160]}"
        print(f"  {len(numbers):5d} {words}")
    if total.failed and folder is not None:
        print(f"saved in {folder}/")


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first robot")
    parser.add_argument("--only", type=int, help="one robot of the run, in full")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    given = parser.parse_args(arguments)
    if given.only is None:
        failed = run(given.count, given.seed, given.processes, given.folder, given.first)
        return 1 if failed else 0
    kind, robot, complaints, taken = trial(given.seed, given.only)
    print(json.dumps({"kind": kind, "ways": taken}))
    print(robot if not isinstance(robot, dict) else "\n".join(robot.values()))
    for complaint in complaints:
        print(complaint)
    return 1 if complaints else 0


if __name__ == "__main__":
    raise SystemExit(main())
