"""The architecture and its page agree; rules of the source that no linter knows."""

import ast
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

PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
TABLE = PAGE.partition("## Equations and their places")[2].partition("### ")[0]
ROWS = [row.split("|")[1:-1] for row in TABLE.splitlines() if row.startswith("| (")]
NAMED = re.findall(r"`((?:tests/)?[a-z_]+/[\w/*.-]*)`", PAGE.partition("## Equations")[2])
PLACES = sorted({place for place in NAMED if "NAME" not in place})


def test_named_files_exist():
    roots = (ROOT, ROOT / "src/robostiff")
    assert [x for x in PLACES if not any(any(root.glob(x.rstrip("/"))) for root in roots)] == []


def test_every_equation_has_one_formula():
    """Numbers 4 to 28; (1) to (3) define the minimum of energy that (4) states."""
    numbers = []
    for row in ROWS:
        for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", row[0]):
            numbers += range(int(first), int(last or first) + 1)
        formula = re.findall(r"`([^`]+)`", row[2])
        assert len(formula) == 1, row[0]
    assert sorted(numbers) == list(range(4, 29))


def test_formulas_name_their_equations():
    for row in ROWS:
        places = re.findall(r"`([^`]+\.py)`", row[2])
        for place in (*places, *(re.findall(r"`([^`]+\.py)`", row[3]) if places else ())):
            text = (ROOT / "src/robostiff" / place).read_text(encoding="utf-8")
            named = {int(n) for n in re.findall(r"\((\d{1,2})\)", text)}
            wanted = {int(n) for n in re.findall(r"\((\d+)\)", row[0])}
            assert named & wanted, place


WALK = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
WALK = WALK.partition("## How a kind of joint is added")[2].partition("\n## ")[0]
CHANGED = sorted(set(re.findall(r"`((?:io|kinematics|model)/[\w/]+\.py)`", WALK)))


@pytest.mark.parametrize("place", [place for place in CHANGED if "__init__" not in place])
def test_files_of_the_walk_are_about_the_helical_joint(place):
    text = (ROOT / "src/robostiff" / place).read_text(encoding="utf-8")
    assert re.search(r"helical|pitch|\bslides\b|ADVANCE_PER_TURN|no pitch", text, re.IGNORECASE)


def test_no_other_file_names_the_helical_joint():
    files = [*(ROOT / "src/robostiff").rglob("*.py")]
    named = [file for file in files if "helical" in file.read_text(encoding="utf-8").lower()]
    places = {file.relative_to(ROOT / "src/robostiff").as_posix() for file in named}
    assert places <= {*CHANGED, "__init__.py"}


def test_counted_rows_of_the_proof_are_what_is_measured():
    command = [sys.executable, "benchmarks/proof.py", "--counts"]
    printed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    table = PAGE.partition("## Proof")[2].partition("\n## ")[0]
    for row in printed.splitlines()[2:]:
        what, goal, measured = (cell.strip() for cell in row.split("|")[1:-1])
        (own,) = (line for line in table.splitlines() if line.startswith(f"| {what} |"))
        cells = [cell.strip() for cell in own.split("|")[1:-1]]
        assert cells[1] == goal
        assert re.findall(r"^\d+", cells[2]) == re.findall(r"^\d+", measured), what


TESTS = Path(__file__).parents[1]
SOURCE = TESTS.parent / "src"
#: Modules in packages; packages are faces, and so are modules beside them.
INNER = {
    ".".join(path.relative_to(SOURCE).with_suffix("").parts)
    for path in SOURCE.glob("robostiff/*/**/*.py")
    if path.name != "__init__.py"
}
EXCEPTIONS = Path(__file__).parent / "inner_modules.txt"


def _imported(path: Path) -> set[str]:
    """Modules of the package that a file imports, or imports from."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found.update(own.name for own in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module)
            # from a package either a name that it offers, or a module in it
            found.update(f"{node.module}.{own.name}" for own in node.names)
    return found & INNER


def test_tests_import_what_packages_offer():
    listed = EXCEPTIONS.read_text(encoding="utf-8").split()
    found = {name for path in TESTS.rglob("*.py") for name in _imported(path)}
    new, gone = sorted(found - set(listed)), sorted(set(listed) - found)
    assert not new, f"import from the package, not from inside it: {', '.join(new)}"
    assert not gone, f"no test imports these any more, delete them there: {', '.join(gone)}"
    assert listed == sorted(set(listed))


def test_extras_import_what_packages_offer():
    """Names of modules inside packages, and names with an underscore, are not for them."""
    files = sorted((TESTS.parent / "extras").rglob("*.py"))
    assert files
    assert {str(path): own for path in files if (own := _imported(path))} == {}


def test_a_module_inside_a_package_is_seen(tmp_path):
    path = tmp_path / "test_one.py"
    path.write_text(
        "import robostiff as rs\n"
        "from robostiff.analysis import stiffness\n"
        "from robostiff.errors import InputError\n"
        "from robostiff.kinematics.frames import place_chain\n"
        "from robostiff.elastostatics import tolerance\n"
        "import robostiff.model.mass\n"
    )
    inner = ("kinematics.frames", "elastostatics.tolerance", "model.mass")
    assert _imported(path) == {f"robostiff.{own}" for own in inner}


PACKAGE = ROOT / "src/robostiff"
EXTRAS = ROOT / "extras"
MODULES = sorted([*PACKAGE.rglob("*.py"), *EXTRAS.rglob("*.py")])
VAGUE = {"core", "utils", "util", "common", "helpers", "helper", "misc"}


def named(path: Path) -> str:
    return str(path.relative_to(PACKAGE if path.is_relative_to(PACKAGE) else EXTRAS))


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
