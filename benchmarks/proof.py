"""The table "Proof" of ARCHITECTURE.md: what was promised, and what is measured here.

Rows that are counted in the sources take a second, rows of time some minutes on a quiet machine.

    python benchmarks/proof.py            all rows
    python benchmarks/proof.py --counts   those that need no clock
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from size import SOURCE, Size, sizes

ROOT = Path(__file__).parent.parent
AN_INDEX = "anisotropy"
TURNS = 5


def files_of_the_walk() -> list[str]:
    """Source files that the walk of the helical joint in CONTRIBUTING.md names."""
    walk = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    walk = walk.partition("## How a kind of joint is added")[2].partition("\n## ")[0]
    named = re.findall(r"`([\w/]+\.py)`", walk)
    found = []
    for name in dict.fromkeys(named):
        files = [file for file in SOURCE.rglob("*.py") if file.as_posix().endswith(f"/{name}")]
        found += [file.relative_to(SOURCE).as_posix() for file in files[:1] if "/" in name]
    return found


def helical_joint() -> str:
    walk = files_of_the_walk()
    exports = [name for name in walk if name.endswith("__init__.py")]
    return f"{len(walk) - len(exports) + bool(exports)}: {', '.join(walk)}"


def new_index() -> str:
    named = [
        file.relative_to(SOURCE).as_posix()
        for file in sorted(SOURCE.rglob("*.py"))
        if AN_INDEX in file.read_text(encoding="utf-8") and file.name != "__init__.py"
    ]
    return f"{len(named)}: {', '.join(named)}"


def equations() -> str:
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    table = page.partition("## Equations and their places")[2].partition("### ")[0]
    rows = [row.split("|")[1:-1] for row in table.splitlines() if row.startswith("| (")]
    most = max(len(re.findall(r"`[^`]+`", row[2])) for row in rows)
    return f"{most} at most, {len(rows)} rows of 'Equations and their places'"


def many_poses() -> str:
    from one_pose_and_many import backends, many

    times = {own.value: many("hexapod", own, 100_000, TURNS) for own in backends()}
    return ", ".join(f"{t.stiffness / t.kernel:.1f} x ({name})" for name, t in times.items())


def one_pose() -> str:
    from one_pose_and_many import one

    import robostiff as rs

    times = {name: one(name, TURNS)[1] for name in rs.shipped_robots()}
    slowest = max(times, key=lambda name: times[name])
    return f"{times['hexapod']:.2f} / {times[slowest]:.2f} ms ({slowest})"


def slowest_kernels() -> str:
    from closed_by_steps import ROBOTS, SPREADS, kernel_time

    times = {Path(name).stem: kernel_time(name, SPREADS[0]) for name in ROBOTS}
    return ", ".join(f"{name} {time:.2f}" for name, time in times.items())


def size() -> str:
    whole = Size.total(sizes().values())
    return f"{whole.files} / {whole.lines:,} ({whole.code:,} of code)"


ROWS: tuple[tuple[str, str, Callable[[], str], bool], ...] = (
    ("a helical joint: source files changed", "6", helical_joint, False),
    ("a new index: source files changed", "3", new_index, False),
    ("equation to file: places of a formula", "1", equations, False),
    (
        "hexapod at 100,000 poses, K, rank and status, one thread, against its own kernel",
        "3 x",
        many_poses,
        True,
    ),
    ("one pose, robot loaded: hexapod / slowest shipped robot", "1 / 3 ms", one_pose, True),
    ("robots closed by steps, by kernel, us a pose", "0.4 (H4: 0.9)", slowest_kernels, True),
    ("files / lines of `src`", "300 / 45,000", size, False),
)


def rows(counts: bool) -> Iterator[str]:
    for what, goal, measured, takes_time in ROWS:
        if not (counts and takes_time):
            yield f"| {what} | {goal} | {measured()} |"


def main() -> None:
    parser = argparse.ArgumentParser(description='The table "Proof" of ARCHITECTURE.md.')
    parser.add_argument("--counts", action="store_true", help="only what needs no clock")
    print("| what | goal | measured |\n|---|---|---|")
    for row in rows(parser.parse_args().counts):
        print(row, flush=True)


if __name__ == "__main__":
    main()
