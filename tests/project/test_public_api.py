"""What `import robostiff as rs` offers: pinned, documented, and cheap."""

import ast
import os
import re
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import robostiff as rs
from tests.project.shown_output import ROOT

#: The page of the API lists them, so that none is added or lost unseen.
PUBLIC = [name for name in rs.__all__ if name != "__version__"]
HEAVY = {
    *("numpy", "scipy", "pydantic", "pint", "click", "rich", "yaml", "sympy", "matplotlib"),
    *("xarray", "zarr", "dask", "distributed", "llvmlite", "jaxtyping", "flint", "mujoco"),
    *("yourdfpy", "plotly"),
}


def test_type_checkers_read_the_same_names_from_the_same_places():
    stub = ast.parse((ROOT / "src/robostiff/__init__.pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    imported = {name.asname: node.module for node in imports for name in node.names}
    assert set(imported) == {*rs.__all__, "plot"}
    for name, home in imported.items():
        public = getattr(rs, str(name))
        assert getattr(import_module(str(home)), str(name)) is public


def test_public_names_are_documented():
    page = (ROOT / "docs/api/robostiff.md").read_text(encoding="utf-8")
    documented = re.findall(
        r"auto(?:function|class|exception|data):: robostiff\.(\w+)$", page, re.M
    )
    assert sorted(documented) == PUBLIC


def test_public_names_can_be_imported_and_have_docstrings():
    assert not [name for name in PUBLIC if not getattr(rs, name).__doc__]
    assert set(PUBLIC) <= set(dir(rs))
    assert sorted(set(PUBLIC)) == PUBLIC


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="stifness"):
        _ = rs.stifness  # pyright: ignore[reportAttributeAccessIssue]


def test_modules_do_not_hide_functions_of_their_names():
    named = {"statics": ("cable_response", "equilibrium")}
    named |= {"analysis": ("cable_stiffness", "cable_tensions", "stiffness")}
    code = "import robostiff as rs, robostiff.cli.arguments\n"
    code += "assert callable(rs.deflection) and callable(rs.compliance)\n"
    for package, names in named.items():
        for name in names:
            if find_spec(f"robostiff.{package}.{name}"):
                code += f"import robostiff.{package}.{name}\n"
            code += f"from robostiff.{package} import {name} as function\n"
            code += f"assert callable(function) and function is rs.{name}\n"
    subprocess.run([sys.executable, "-c", code], check=True)


#: One after the other in one process: what is loaded by them, and by those before, is no more.
LOADED = {
    "": set(),
    "--help": {"click"},
    "robots": {"click", "yaml"},
    "stiffness hexapod": (small := {"click", "numpy", "pydantic", "yaml"}),
    "stiffness gough-stewart-a --json": small,
    "deflection hexapod --wrench 100,0,0,0,0,0": small,
    "equilibrium hexapod --wrench 100,0,0,0,0,0": small | {"threadpoolctl"},
    "check 3-rpr": small | {"rich"},
    "indices hexapod": small | {"rich"},
}
COMMANDS = """
import contextlib, io, sys
import robostiff
for words in {commands}:
    if words:
        sys.argv = ["robostiff", *words.split()]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
            from robostiff.cli.main import main; main()
    print(*sys.modules)
"""


def test_commands_load_what_they_use():
    program = [sys.executable, "-c", COMMANDS.format(commands=list(LOADED))]
    printed = subprocess.run(program, check=True, capture_output=True, text=True).stdout
    lines = dict(zip(LOADED, map(set, map(str.split, printed.splitlines())), strict=True))
    for command, needed in LOADED.items():
        assert lines[command] & HEAVY <= needed, command
    page = lines["stiffness hexapod"]
    others = {"cables", "compensation", "compiled", "linkage", "network", "recorded", "statics"}
    assert not {f"robostiff.{name}" for name in others} & page
    assert {"robostiff.kinematics", "robostiff.page"} <= page


#: What is run, and what it loads: of all modules none of these, and of robostiff this one.
IMPORTS: dict[str, tuple[set[str], str]] = {
    "rs.plot.matrix": ({"matplotlib", "plotly", "xarray"}, "plot"),
    "from robostiff import robots; robots.shipped_robots()": (
        {"pydantic", "pint", "yaml", "numpy", "scipy"},
        "robots",
    ),
    "import robostiff.report, robostiff_view.page; rs.plot.robot": (
        {"zarr", "google_crc32c", "xarray", "dask", "h5py", "robostiff.analysis.maps.store"},
        "report",
    ),
    "rs.stiffness(rs.load('hexapod')).K": (
        {
            "robostiff.model.cable",
            "robostiff.io.model_file.cables",
            "robostiff.network.network",
            "robostiff.linkage.linkage",
            "robostiff.kinematics.formula",
            "robostiff.kinematics.postures",
        },
        "model.robot",
    ),
    "rs.compile_loaded(rs.load('3-rpr-beams'), backend=rs.Backend.ARRAYS)": (
        {"sympy"},
        "recorded.robot",
    ),
}


@pytest.mark.parametrize("code", IMPORTS)
def test_no_more_is_loaded_than_is_needed(code):
    program = [sys.executable, "-c", f"import sys, robostiff as rs; {code}; print(*sys.modules)"]
    off = os.environ | {"ROBOSTIFF_CACHE": "off"}
    done = subprocess.run(program, check=True, capture_output=True, text=True, env=off)
    absent, there = IMPORTS[code]
    assert not absent & set(done.stdout.split())
    assert f"robostiff.{there}" in done.stdout.split()


def test_a_package_and_its_names_are_in_step():
    for package in ("analysis", "kinematics", "linkage", "network", "statics"):
        module = import_module(f"robostiff.{package}")
        stub = ast.parse(Path(str(module.__file__)).with_suffix(".pyi").read_text("utf-8"))
        listed = next(node.value for node in stub.body if isinstance(node, ast.Assign))
        assert ast.literal_eval(listed) == module.__all__
        assert set(module.__all__) <= set(dir(module))
        with pytest.raises(AttributeError, match="no attribute 'stifness'"):
            _ = module.stifness
