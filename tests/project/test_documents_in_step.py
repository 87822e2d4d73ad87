"""Pages that repeat what the code says repeat it rightly."""

import re
import runpy
import subprocess
import sys
import tomllib
from importlib import import_module
from typing import Any

import pytest
import yaml

import robostiff as rs
from robostiff.elastostatics import IndexRules, Recursive
from tests.project.shown_output import ROOT, first_difference

FORMS = (rs.WrenchBasis(), rs.SaddlePoint(), rs.Block(), Recursive(), IndexRules())
PACKAGES = sorted(
    path.parent.name
    for path in (ROOT / "src/robostiff").glob("*/__init__.py")
    if any(p.name not in {"__init__.py", "__pycache__"} for p in path.parent.iterdir())
)


def document(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("status", rs.Status, ids=str)
def test_every_status_has_its_advice_on_the_page(status: rs.Status):
    section = document("docs/status.md").partition(f"\n## {status.name}\n")[2].partition("\n## ")[0]
    assert f"> {status.advice[0]}\n" in section


@pytest.mark.parametrize("status", [rs.Status.OK, *rs.Status], ids=str)
def test_table_of_statuses(status: rs.Status):
    row = next(
        line
        for line in document("docs/status.md").splitlines()
        if line.startswith(f"| `{status.name}` |")
    )
    _, _, name, bad, matrix, _ = (cell.strip() for cell in row.split("|"))
    assert name == f"`{status}`"
    assert bad == ("yes" if status.is_bad else "no")
    if status is not rs.Status.UNBALANCED:
        assert matrix.startswith("yes" if status.has_stiffness else "no")


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_every_form_is_explained(form: Any):
    page = document("docs/choosing-a-method.md")
    assert f"| `{type(form).__name__}()` `{form.name}` |" in page


@pytest.mark.parametrize("name", ["robots", "arguments"])
def test_page_is_what_its_script_writes(name: str):
    script = runpy.run_path(str(ROOT / f"docs/make_{name}_page.py"))
    difference = first_difference(document(f"docs/{name}.md"), script["page"]())
    assert difference is None, f"{difference}\n\n'make outputs' writes the page again"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_has_its_line_in_the_tree_and_its_page(package: str):
    assert re.search(rf"^  {package}/ +\S", document("ARCHITECTURE.md"), re.MULTILINE)
    if package != "cli":
        assert f"automodule:: robostiff.{package}" in document(f"docs/api/{package}.md")


def test_arrows_of_imports_are_the_contracts():
    settings = tomllib.loads(document("pyproject.toml"))
    text = " ".join(document("ARCHITECTURE.md").split())
    for contract in settings["tool"]["importlinter"]["contracts"]:
        if contract["type"] != "layers":
            continue
        layers = [layer.replace("robostiff.", "") for layer in contract["layers"]]
        layers = [layer for layer in layers if " : " not in layer]  # beside the folders
        arrow = " > ".join(f"({layer})" if "|" in layer else layer for layer in layers)
        assert arrow in text, contract["name"]


def test_names_in_the_nomenclature_exist():
    rows = re.findall(r"^\|(.+)\|$", document("docs/nomenclature.md"), re.MULTILINE)[2:]
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])}
    modules = [import_module(f"robostiff.{p}") for p in PACKAGES if p != "cli"]
    functions = {
        "compliance", "leg_compliance", "passive_jacobian", "twist_transport",
        "skew", "rotate_stiffness", "transmitted_wrenches", "JointCoordinates",
    }  # fmt: skip
    assert functions <= named
    assert all(any(hasattr(module, name) for module in modules) for name in functions)


def test_version_is_the_same_everywhere():
    citation = yaml.safe_load(document("CITATION.cff"))
    assert citation["version"] == rs.__version__
    assert f"## [{rs.__version__}]" in document("CHANGELOG.md")
    for path in ROOT.glob("extras/*/pyproject.toml"):
        project = tomllib.loads(path.read_text("utf-8"))["project"]
        assert project["version"] == rs.__version__
        assert f"robostiff>={rs.__version__}" in project["dependencies"]


def test_citation_has_what_its_format_requires():
    citation = yaml.safe_load(document("CITATION.cff"))
    assert citation["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= citation.keys()
    for reference in citation["references"]:
        assert {"type", "title", "authors"} <= reference.keys()


def test_constraints_are_names_and_versions_only():
    lines = document("constraints.txt").splitlines()
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9._+!]+", line) for line in lines)
    names = [line.partition("==")[0].lower() for line in lines]
    assert len(set(names)) == len(names)


def test_constraints_hold_every_dependency():
    project = tomllib.loads(document("pyproject.toml"))["project"]
    wanted = [*project["dependencies"]]
    for path in ROOT.glob("extras/*/pyproject.toml"):
        wanted += tomllib.loads(path.read_text("utf-8"))["project"]["dependencies"]
    wanted += [one for extra in project["optional-dependencies"].values() for one in extra]
    names = {re.split(r"[\[<>=!~; ]", one)[0].lower().replace("_", "-") for one in wanted}
    pinned = {line.partition("==")[0].lower() for line in document("constraints.txt").splitlines()}
    pinned = {name.replace("_", "-") for name in pinned}
    assert {"viser", "mujoco"} <= names
    assert names - {"robostiff"} <= pinned  # the extra `all` is made of the others


def test_the_hook_for_ruff_has_the_version_of_the_constraints():
    (pinned,) = re.findall(r"^ruff==\S+$", document("constraints.txt"), re.MULTILINE)
    hooks = yaml.safe_load(document(".pre-commit-config.yaml"))["repos"][0]["hooks"]
    assert [hook["id"] for hook in hooks] == ["ruff-check", "ruff-format"]
    assert all(hook["additional_dependencies"] == [pinned] for hook in hooks)


def test_hosted_checks_run_every_version_of_python_and_the_targets_of_everywhere():
    jobs = yaml.safe_load(document(".github/workflows/checks.yml"))["jobs"]
    matrix = jobs["test"]["strategy"]["matrix"]
    listed = tomllib.loads(document("pyproject.toml"))["project"]["classifiers"]
    assert [f"Programming Language :: Python :: {version}" for version in matrix["python"]] == [
        one for one in listed if "Python :: 3." in one
    ]
    systems = {*matrix["system"], *(more["system"] for more in matrix["include"])}
    assert {name.partition("-")[0] for name in systems} == {"ubuntu", "macos", "windows"}
    targets = set(re.findall(r"^([a-z]+):", document("Makefile"), re.MULTILINE))
    called = {step["run"] for job in jobs.values() for step in job["steps"] if "run" in step}
    made = {line.removeprefix("make ") for line in called if line.startswith("make ")}
    assert {"demo", "test"} <= made <= targets
    assert "bash .ci/run" in called


@pytest.mark.skipif(sys.platform == "win32", reason="its make is another one")
def test_make_reads_the_recipe_of_every_target():
    targets = re.findall(r"^([a-z]+):", document("Makefile"), re.MULTILINE)
    command = ["make", "--dry-run", *targets]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "tests/peers/" in done.stdout
