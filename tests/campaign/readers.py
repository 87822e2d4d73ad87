"""Mutated files of every format: an answer, or an `InputError` with its place, soon."""

# ruff: noqa: S311
from __future__ import annotations

import json
import random
import re
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import robostiff as rs
from robostiff.errors import FileError, InputError, NoAnswerError
from robostiff.io.document import parse_document
from robostiff.io.expression import parameter_values
from robostiff.io.map_files import read_poses
from robostiff.io.units import Dimension, parse_quantities
from robostiff.robots import robot_file, shipped_cable_robots, shipped_linkages, shipped_robots
from tests.campaign.answers import Complaint
from tests.campaign.mutations import mutated_bytes, mutated_text, mutated_tree, mutated_xml

ROOT = Path(__file__).parents[2]
SECONDS, BY_THE_CLOCK = 5, 60
MEMORY = 1_000_000_000
# Of a thousand files, those that start a process of their own.
_SLOW = 25


@dataclass(frozen=True)
class Source:
    """Files of a robot, of which one is to be mutated.

    Attributes
    ----------
    kind : str
        What the first file is: ``data``, ``xml``, ``poses`` or ``expression``.
    files : tuple of (str, bytes)
        Names and contents; the first is mutated, the one to load has the number `loaded`.
    loaded : int
    """

    kind: str
    files: tuple[tuple[str, bytes], ...]
    loaded: int = 0


def _read(*paths: Path) -> tuple[tuple[str, bytes], ...]:
    return tuple((path.name, path.read_bytes()) for path in paths)


@cache
def quick_sources() -> tuple[Source, ...]:
    """Model files, snapshots, graphs, side files, URDF, poses and expressions."""
    examples = ROOT / "examples"
    names = (*shipped_robots(), *shipped_cable_robots())
    found = [Source("data", _read(robot_file(name))) for name in names]
    for name in ("rocking-table.yaml", "three-slides.yaml", "orthoglide-3-puu.yaml"):
        found.append(Source("data", _read(examples / name)))
    found.append(Source("data", _read(examples / "wall-crane.json")))
    found.append(Source("data", _read(ROOT / "tests/model/star-platform.yaml")))
    for folder in ("data", "graphs"):
        cases = sorted((ROOT / "tests/cases" / folder).glob("*.json"))
        found += [Source("data", _read(case)) for case in cases]
    arm = (examples / "ur5.urdf", examples / "ur5.stiffness.yaml")
    found += [Source("xml", _read(*arm))] * 4
    found += [Source("data", _read(*reversed(arm)), 1)] * 4
    poses = b"time, x [mm], y [m], rz [deg]\n0, 10, 0, 0\n0.5, 20, 0.01, 10\n# note\n1, 0, 0, -5\n"
    found += [Source("poses", (("poses.csv", poses),))] * 3
    texts = set()
    for name in names:
        texts.update(
            re.findall(r"\w+: ([^:{}\[\],#\n]*\d[^:{}\[\],#\n]*)", robot_file(name).read_text())
        )
    texts |= {"R*cos(phi) + 10 mm", "hypot(1 m, 2 m, L)", "-(2^-3)*atan2(1, 2)/pi", "1 N/(m rad)"}
    row = "10 mm, 0, 0.5 m 0 0 10 deg"
    found += [Source("expression", (("text", text.encode()),)) for text in sorted(texts)[:12]]
    found += [Source("row", (("text", row.encode()),))] * 2
    return tuple(found)


@cache
def slow_sources() -> tuple[Source, ...]:
    """MJCF and xacro, which are read in processes of their own, and their side files."""
    examples = ROOT / "examples"
    pairs = [
        (examples / "four-bar.xml", examples / "four-bar.stiffness.yaml"),
        (examples / "two-ur5.urdf.xacro", examples / "two-ur5.stiffness.yaml"),
    ]
    found = []
    for name in shipped_linkages():  # their side files name them
        side = robot_file(name)
        found.append(Source("xml", _read(side.with_suffix(".xml"), side), 1))
        found.append(Source("data", _read(side, side.with_suffix(".xml")), 0))
    for description, side in pairs:
        found.append(Source("xml", _read(description, side), 0))
        found.append(Source("data", _read(side, description), 1))
    return tuple(found)


@dataclass(frozen=True)
class Trial:
    """A source and the seeds of its mutations, one after the other."""

    source: Source
    seeds: tuple[int, ...]

    @property
    def files(self) -> dict[str, bytes]:
        """Names and contents of the files, the first mutated."""
        name, content = self.source.files[0]
        for seed in self.seeds:
            content = _mutated(self.source.kind, name, content, random.Random(seed))
        return {name: content, **dict(self.source.files[1:])}

    @property
    def loaded(self) -> str:
        """Name of the file to load."""
        return self.source.files[self.source.loaded][0]


def _mutated(kind: str, name: str, content: bytes, random_: random.Random) -> bytes:
    if random_.random() < 0.1:
        return mutated_bytes(content, random_)
    text = content.decode(errors="surrogateescape")
    if kind == "data" and random_.random() < 0.75:
        try:
            data = parse_document(text, name).data
        except InputError:
            return mutated_bytes(content, random_)
        changed = json.dumps(
            mutated_tree(data, random_), indent=1, ensure_ascii=random_.random() < 0.5
        )
    elif kind == "xml" and random_.random() < 0.75:
        changed = mutated_xml(text, random_)
    else:
        changed = mutated_text(text, random_)
    return changed.encode(errors="surrogatepass")


def trial(seed: int, number: int) -> Trial:
    """The trial of that number."""
    random_ = random.Random(f"{seed}/{number}")
    slow = random_.randrange(1000) < _SLOW
    source = random_.choice(slow_sources() if slow else quick_sources())
    seeds = [random_.randrange(2**32) for _ in range(random_.choice((1, 1, 1, 2, 4)))]
    return Trial(source, tuple(seeds))


class _OverTimeError(BaseException):
    """A trial takes too long; no `Exception`, so that nobody catches it on the way."""


@contextmanager
def _within(seconds: float, by_the_clock: float) -> Iterator[None]:
    """Stop what takes more processor time, or more by the clock."""

    def stop(*_: object) -> None:
        raise _OverTimeError

    before = [(kind, signal.signal(kind, stop)) for kind in (signal.SIGPROF, signal.SIGALRM)]
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, by_the_clock)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        for kind, handler in before:
            signal.signal(kind, handler)


@contextmanager
def _within_memory(more: int) -> Iterator[None]:
    """Let this process have so much more memory than it has now, where the system can limit it."""
    if not sys.platform.startswith("linux"):
        yield
        return
    import resource

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + more, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@cache
def _hexapod() -> Any:
    return rs.load("hexapod")


def _asked(given: Trial, folder: Path) -> str:
    """What comes of the files: ``answer``, or the class of the refusal."""
    content = given.files[given.loaded]
    try:
        if given.source.kind == "expression":
            text = content.decode(errors="replace")
            parameter_values({"L": "1 m", "phi": "10 deg", "R": 2, "value": text})
            return "answer"
        if given.source.kind == "row":
            dimensions = [Dimension.LENGTH] * 3 + [Dimension.ANGLE] * 3
            parse_quantities(content.decode(errors="replace"), dimensions, list("xyzabc"))
            return "answer"
        path = folder / given.loaded
        if given.source.kind == "poses":
            read_poses(_hexapod(), path)
            return "answer"
        robot = rs.load(path, allow_xacro=True)
    except FileError as error:
        if not error.location.file:
            raise AssertionError("a FileError without a place") from error
        return "refused, with a place"
    except InputError:
        if given.source.kind in ("expression", "row", "poses"):
            return "refused"
        raise
    try:
        rs.stiffness(robot)
    except (InputError, NoAnswerError):
        return "loaded, then refused"
    return "answer"


def outcome(given: Trial) -> str | Complaint:
    """What comes of a trial."""
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(name)
        for file, content in given.files.items():
            (folder / file).write_bytes(content)
        try:
            with _within_memory(MEMORY), _within(SECONDS, BY_THE_CLOCK):
                return _asked(given, folder)
        except _OverTimeError:
            what = f"over {SECONDS} s"
        except Exception as error:
            what = type(error).__name__
        return Complaint(given.loaded, what, traceback.format_exc())


def judged_file(seed: int, number: int) -> list[Complaint]:
    """What is wrong with the answer to mutated files."""
    found = outcome(trial(seed, number))
    return [found] if isinstance(found, Complaint) else []
