"""Tests and extras import what packages offer; exceptions are tests alone, of which none is new.

A test of an inner module holds its name and its arguments fast, so that nothing inside a package
can be written anew without the tests. `inner_modules.txt` lists the exceptions; it only shrinks.
"""

import ast
from pathlib import Path

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
