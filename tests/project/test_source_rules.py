"""Rules of the source that no linter knows."""

import re
from pathlib import Path

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
