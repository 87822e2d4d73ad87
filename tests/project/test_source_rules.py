"""Rules of the source that no linter knows."""

import ast
from pathlib import Path

import pytest

from tests.project.shown_output import ROOT

SOURCE = ROOT / "src/robostiff"
EXTRAS = ROOT / "extras"
MODULES = sorted([*SOURCE.rglob("*.py"), *EXTRAS.rglob("*.py")])
VAGUE = {"core", "utils", "util", "common", "helpers", "helper", "misc"}


def named(path: Path) -> str:
    return str(path.relative_to(SOURCE if path.is_relative_to(SOURCE) else EXTRAS))


@pytest.mark.parametrize("module", MODULES, ids=named)
def test_module_has_a_docstring_and_at_most_500_lines(module: Path):
    text = module.read_text(encoding="utf-8")
    assert ast.get_docstring(ast.parse(text)), "a module says in a line what it is about"
    assert text.count("\n") <= 500, "more than one idea: split it"


@pytest.mark.parametrize("module", MODULES, ids=named)
def test_library_does_not_print(module: Path):
    if module.is_relative_to(SOURCE / "cli"):
        return
    called = [
        node.func
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    ]
    assert not [name.lineno for name in called if name.id == "print"]


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
        for node in ast.parse(module.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(named(module))
    assert {name: own for name, own in places.items() if len(own) > 1} == {}
