"""The table "Proof" of ARCHITECTURE.md: what was promised, and what is measured here.

Rows that are counted in the sources take a second, those of size, which every commit changes, some
seconds, and rows of time some minutes on a quiet machine.

    python benchmarks/proof.py            all rows
    python benchmarks/proof.py --counts   those that are counted
    python benchmarks/proof.py --sizes    those of size
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import ast
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import Path
from typing import Any

from size import SOURCE, Size, size_of, sizes

ROOT = Path(__file__).parent.parent
AN_INDEX = "anisotropy"
TURNS = 5
A_POSE = [0.05, 0.02, 0.9, 0.05, 0.02, 0.1]  # of the hexapod [m, rad]
MECHANICS = (
    *("kinematics", "linkage", "recorded", "compiled", "network", "cables", "elastostatics"),
    *("statics", "analysis"),
)
KINDS = {"Robot", "Snapshot", "Network", "Linkage", "CableRobot"}
WORDS = {"robot", "snapshot", "network", "linkage", "cable robot"}  # `kind` of each


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


def mechanics() -> list[Path]:
    """Files of the rooms of mechanics; maps and indices are left out."""
    files = [file for room in MECHANICS for file in sorted((SOURCE / room).rglob("*.py"))]
    return [f for f in files if not {"maps", "indices"} & set(f.relative_to(SOURCE).parts)]


def size_of_mechanics() -> str:
    whole = Size.total(map(size_of, mechanics()))
    return f"{whole.files} / {whole.lines:,}"


def nodes(files: list[Path]) -> Iterator[ast.AST]:
    for file in files:
        yield from ast.walk(ast.parse(file.read_text(encoding="utf-8")))


def kind_tests(files: list[Path]) -> int:
    """Calls of isinstance that name a kind of machine, and comparisons of its word for it."""
    found = 0
    for node in nodes(files):
        if isinstance(node, ast.Compare) and re.search(
            r"(^|\.)kind$|\W'kind'", ast.unparse(node.left)
        ):
            words = {own.value for own in ast.walk(node) if isinstance(own, ast.Constant)}
            found += bool(words & WORDS)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
            names = {own.id for own in ast.walk(node.args[1]) if isinstance(own, ast.Name)}
            found += bool(names & KINDS)
    return found


def tests_on_kinds() -> str:
    return f"{kind_tests(mechanics())} / {kind_tests(sorted(SOURCE.rglob('*.py')))}"


def results_with_K() -> str:
    classes = []
    for node in nodes(mechanics()):
        if isinstance(node, ast.ClassDef):
            named = [
                getattr(own, "name", getattr(getattr(own, "target", 0), "id", ""))
                for own in node.body
            ]
            classes += [node.name] if "K" in named else []
    return f"{len(classes)}: {', '.join(sorted(classes))}"


def imports() -> dict[str, set[str]]:
    """Modules of the package that each module imports: in functions and for types, too."""
    files = {file.relative_to(SOURCE.parent).with_suffix(""): file for file in SOURCE.rglob("*.py")}
    named = {".".join(own.parts).removesuffix(".__init__"): file for own, file in files.items()}
    found: dict[str, set[str]] = {}
    for name, file in named.items():
        found[name] = own = set()
        for node in nodes([file]):
            if isinstance(node, ast.ImportFrom) and (node.module or "") in named:
                full = (f"{node.module}.{one.name}" for one in node.names)
                own.update(one if one in named else str(node.module) for one in full)
        own.discard(name)
    return found


def circles() -> str:
    """Circles of imports, and how many modules each has."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    found = imports()
    places = {name: i for i, name in enumerate(found)}
    ends = [(places[a], places[b]) for a, own in found.items() for b in own]
    ones = csr_array(([1] * len(ends), tuple(zip(*ends, strict=True))), shape=[len(found)] * 2)
    _, labels = connected_components(ones, connection="strong")
    sizes = sorted((size for size in Counter(labels).values() if size > 1), reverse=True)
    return f"{len(sizes)}: of {', '.join(map(str, sizes)) or 'no'} modules"


def called_once() -> str:
    """Private functions and methods that one expression of their file names."""
    found = 0
    for file in sorted(SOURCE.rglob("*.py")):
        tree = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
        private = {
            own.name
            for own in tree
            if isinstance(own, ast.FunctionDef) and re.match(r"_[^_]", own.name)
        }
        used = Counter(getattr(own, "id", getattr(own, "attr", "")) for own in tree)
        found += sum(used[name] == 1 for name in private)
    return str(found)


def entered(call: Callable[[], Any]) -> str:
    """Functions of the package that a call enters, and their files."""
    found = set()

    def note(frame: Any, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(SOURCE)):
            found.add((code.co_filename, code.co_firstlineno, code.co_name))

    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(None)
    functions = {own for own in found if not own[2].startswith("<")}
    return f"{len(functions)} / {len({file for file, *_ in found})}"


def walk_of_stiffness() -> str:
    import robostiff as rs

    robot = rs.load("hexapod")
    walks = [entered(lambda: rs.stiffness(robot, A_POSE).K) for _ in range(2)]
    for _ in range(30):  # from here on the record answers
        rs.stiffness(robot, A_POSE)
    return f"{walks[1]}; {entered(lambda: rs.stiffness(robot, A_POSE).K)} by the record"


def walk_of_equilibrium() -> str:
    import robostiff as rs

    robot = rs.load("hexapod")
    wrench = [10.0, 0, 0, 0, 0, 0]
    return [entered(lambda: rs.equilibrium(robot, wrench=wrench)) for _ in range(2)][1]


class Kind(Enum):
    """What a row takes."""

    COUNT = "counted in the sources"
    SIZE = "changed by every commit"
    TIME = "measured by the clock"


ROWS: tuple[tuple[str, str, Callable[[], str], Kind], ...] = (
    ("a helical joint: source files changed", "6", helical_joint, Kind.COUNT),
    ("a new index: source files changed", "3", new_index, Kind.COUNT),
    ("equation to file: places of a formula", "1", equations, Kind.COUNT),
    (
        "hexapod at 100,000 poses, K, rank and status, one thread, against its own kernel",
        "3 x",
        many_poses,
        Kind.TIME,
    ),
    ("one pose, robot loaded: hexapod / slowest shipped robot", "1 / 3 ms", one_pose, Kind.TIME),
    ("robots closed by steps, by kernel, us a pose", "0.4 (H4: 0.9)", slowest_kernels, Kind.TIME),
    ("files / lines of `src`", "300 / 45,000", size, Kind.SIZE),
    (
        "files / lines of mechanics: kinematics to analysis, without maps and indices",
        "115 / 22,500",
        size_of_mechanics,
        Kind.SIZE,
    ),
    ("tests on kinds of machines: mechanics / `src`", "10 / 60", tests_on_kinds, Kind.SIZE),
    ("classes of results that carry K", "1", results_with_K, Kind.SIZE),
    ("circles of imports, those in functions and for types counted", "0", circles, Kind.COUNT),
    ("private functions called once", "400", called_once, Kind.SIZE),
    (
        "`rs.stiffness(hexapod, pose).K`, second call: functions / files",
        "120 / 20",
        walk_of_stiffness,
        Kind.SIZE,
    ),
    (
        "`rs.equilibrium(hexapod, wrench=...)`, second call: functions / files",
        "120 / 20",
        walk_of_equilibrium,
        Kind.SIZE,
    ),
)


def rows(kinds: set[Kind]) -> Iterator[str]:
    for what, goal, measured, kind in ROWS:
        if kind in kinds:
            yield f"| {what} | {goal} | {measured()} |"


def main() -> None:
    parser = argparse.ArgumentParser(description='The table "Proof" of ARCHITECTURE.md.')
    parser.add_argument("--counts", action="store_true", help="only what is counted")
    parser.add_argument("--sizes", action="store_true", help="only what every commit changes")
    given = parser.parse_args()
    kinds = {Kind.COUNT} if given.counts else {Kind.SIZE} if given.sizes else set(Kind)
    print("| what | goal | measured |\n|---|---|---|")
    for row in rows(kinds):
        print(row, flush=True)


if __name__ == "__main__":
    main()
