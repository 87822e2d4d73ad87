"""Rules of the source that no linter knows, and what is said of tests that are left out."""

import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests import conftest
from tests.other_programs import PEERS, command, is_there
from tests.project.shown_output import ROOT

SOURCE = ROOT / "src/robostiff"
EXTRAS = ROOT / "extras"
MODULES = sorted([*SOURCE.rglob("*.py"), *EXTRAS.rglob("*.py")])
VAGUE = {"core", "utils", "util", "common", "helpers", "helper", "misc"}


def named(path: Path) -> str:
    return str(path.relative_to(SOURCE if path.is_relative_to(SOURCE) else EXTRAS))


def test_modules_have_at_most_500_lines():
    """A longer one is more than one idea."""
    assert not [named(path) for path in MODULES if path.read_text("utf-8").count("\n") > 500]


def test_names_say_what_is_inside():
    names = {path.stem for path in MODULES} | {path.parent.name for path in MODULES}
    assert not names & VAGUE


def test_slow_tests_exist():
    listed = (ROOT / "tests/slow_tests.txt").read_text("utf-8").split("\n")
    functions = sorted({line.split("[", 1)[0] for line in listed if line})
    gone = []
    for file, name in (function.split("::") for function in functions):
        text = (ROOT / file).read_text("utf-8") if (ROOT / file).exists() else ""
        if f"def {name}(" not in text:
            gone.append(f"{file}::{name}")
    assert gone == []
    # Names that hold a path of the machine are no names elsewhere.
    assert [line for line in listed if "[/" in line] == []


def test_one_name_is_one_class():
    places: dict[str, list[str]] = {}
    for module in MODULES:
        for name in re.findall(r"^class (\w+)", module.read_text(encoding="utf-8"), re.MULTILINE):
            places.setdefault(name, []).append(named(module))
    assert {name: own for name, own in places.items() if len(own) > 1} == {}


def test_what_is_left_out_is_said_once(tmp_path):
    words = ("-q", "-p", "no:cacheprovider", "-p", "no:xdist", "tests/peers/test_calculix.py")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words],
        cwd=ROOT,
        env={**os.environ, "PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    said = re.findall(r"^tests left out, as this is not installed: (.*)$", done.stdout, re.M)
    assert said == ["5 that need CalculiX"]
    assert "SKIPPED" not in done.stdout
    assert re.search(r"^1 passed", done.stdout.splitlines()[-1])


def test_two_workers_say_what_one_has_left_out():
    """Each tells it when it ends; both have left out the same."""
    worker: Any = SimpleNamespace(stash=pytest.Stash(), workeroutput={})
    worker.stash[conftest._LEFT_OUT] = {"CalculiX": 5}
    conftest.pytest_sessionfinish(cast(Any, SimpleNamespace(config=worker)))
    main: Any = SimpleNamespace(stash=pytest.Stash())
    for _ in range(2):
        conftest.pytest_testnodedown(SimpleNamespace(config=main, **vars(worker)))
    lines: list[str] = []
    conftest.pytest_terminal_summary(SimpleNamespace(write_line=lines.append), main)
    assert lines == ["tests left out, as this is not installed: 5 that need CalculiX"]


def test_a_program_that_is_not_in_the_list_is_an_error():
    assert is_there("no such program") is False
    with pytest.raises(KeyError):
        command("no such program")


def test_peers_are_no_packages_of_make_test():
    """They are marked, and come with the extra `peers`."""
    assert {"llvmlite", "pinocchio", "OpenSees", "Playwright"} <= PEERS
