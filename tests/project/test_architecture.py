"""ARCHITECTURE.md names what exists and is measured; tests and extras import what packages offer.

A test of an inner module holds its name and its arguments fast, so that nothing inside a package
can be written anew without the tests. `inner_modules.txt` lists the exceptions; it only shrinks.
"""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

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
