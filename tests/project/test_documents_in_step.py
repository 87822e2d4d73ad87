"""Documents are in step with the code: examples, output, links, tables."""

import doctest
import re
import runpy
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import robostiff as rs
from robostiff.elastostatics import IndexRules, Recursive
from tests.project.shown_output import (
    DOCUMENTS,
    ROOT,
    Shown,
    first_difference,
    produced_output,
    shown_outputs,
)

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


#: Statuses that other pages do not list.
NOT_LISTED = {
    "under-load": rs.Status.FORM_DOES_NOT_HOLD | rs.Status.UNBALANCED | rs.Status.UNTENSIONED
    | rs.Status.INFEASIBLE | rs.Status.SLACK,
    "cables": rs.Status.REDUNDANT_JOINTS | rs.Status.RIGID_DIRECTION
    | rs.Status.BEYOND_CRITICAL_LOAD,
}  # fmt: skip


@pytest.mark.parametrize("page", NOT_LISTED)
def test_statuses_on_other_pages(page: str):
    table = [line.split("|") for line in document(f"docs/{page}.md").splitlines()]
    rows = {cells[1].strip(): cells[2:4] for cells in table if len(cells) > 3}
    for status in (own for own in rs.Status if not own & NOT_LISTED[page]):
        bad, meaning = rows[f"`{status.name}`"]
        assert bad.strip() == ("yes" if status.is_bad else "no")
        assert page != "cables" or ("no matrix" in meaning) == (not status.has_stiffness)
        assert len(status.advice) == 1


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


_PYCON = re.compile(r"^```pycon\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL

WITH_EXAMPLES = [path for path in DOCUMENTS if "```pycon" in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("document", WITH_EXAMPLES, ids=lambda path: path.name)
def test_examples_of_a_document(document: Path):
    text = document.read_text(encoding="utf-8")
    runner = doctest.DocTestRunner(optionflags=_OPTIONS)
    session: dict[str, object] = {}
    complaints: list[str] = []
    with np.printoptions():  # which a document may set for itself
        for block in _PYCON.finditer(text):
            first_line = text[: block.start(1)].count("\n")
            test = doctest.DocTestParser().get_doctest(
                block[1], session, document.name, str(document), first_line
            )
            runner.run(test, out=complaints.append, clear_globs=False)
            session = test.globs
    assert runner.summarize(verbose=False).failed == 0, "".join(complaints)


def test_the_pages_that_need_examples_have_them():
    names = {path.name for path in WITH_EXAMPLES}
    assert names >= {"conventions.md", "getting-started.md", "theory.md", "status.md"}


SHOWN = [shown for document in DOCUMENTS for shown in shown_outputs(document)]


@pytest.mark.parametrize("shown", SHOWN, ids=str)
def test_shown_output_is_what_is_printed(shown: Shown):
    difference = first_difference(shown.output, produced_output(shown))
    assert difference is None, f"{difference}\n\n'make outputs' writes shown output again"


def test_readme_shows_the_library_and_every_command():
    of_readme = [shown.command for shown in SHOWN if shown.document == ROOT / "README.md"]
    commands = {words[1] for words in of_readme if words[0] == "robostiff"}
    assert commands >= {"robots", "check", "stiffness", "deflection"}
    assert any(words[:2] == ("python", "-c") for words in of_readme)


def test_readme_begins_with_its_picture_and_two_commands():
    first_screen = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()[:30]
    assert any("docs/_static/gough-stewart-a.png" in line for line in first_screen)
    assert "make demo" in "\n".join(first_screen)
    assert "make test" in "\n".join(first_screen)


@pytest.mark.parametrize(
    ("shown", "produced", "same"),
    [
        ("rank 6 of 6", "rank 6 of 6", True),
        ("rank 6 of 6", "rank 5 of 6", False),
        ("Fx 1.2345e+07  0", "Fx 1.2346e+07 3.1e-17", True),
        ("Fx 1.2345e+07", "Fx 1.2445e+07", False),
        ("about 12 um", "about 12 mm", False),
        ("one line", "one line\nand another", False),
    ],
)
def test_differences_are_found_beyond_the_last_digits(shown: str, produced: str, same: bool):
    assert (first_difference(shown, produced) is None) is same


_LINK = re.compile(r"(?<!`)\[[^\]]*\]\(([^()\s]+)\)", re.DOTALL)
_HEADING = re.compile(r"^#{1,6} +(.+?) *$", re.MULTILINE)
_FENCED = re.compile(r"^(`{3,}|:{3,}).*?^\1$", re.MULTILINE | re.DOTALL)
_TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_links_resolve():
    lost = []
    for document in DOCUMENTS:
        text = _FENCED.sub("", document.read_text(encoding="utf-8"))
        links = (link for link in _LINK.findall(text) if not _leads_somewhere(document, link))
        lost += [f"{document.name}: {link}" for link in links]
    assert not lost


def test_every_page_is_in_a_table_of_contents():
    docs = ROOT / "docs"
    built = {Path("gallery/index")}  # from the folder of examples
    pages = built | {p.relative_to(docs).with_suffix("") for p in DOCUMENTS if docs in p.parents}
    listed = {Path("index")}
    for document in DOCUMENTS:
        for tree in _TOCTREE.findall(document.read_text(encoding="utf-8")):
            entries = [line for line in tree.splitlines() if line and not line.startswith(":")]
            listed |= {document.relative_to(docs).parent / entry for entry in entries}
    assert pages == listed


def _leads_somewhere(document: Path, link: str) -> bool:
    if re.match(r"https?://|mailto:", link):
        return True
    name, _, anchor = link.partition("#")
    target = (document.parent / name).resolve() if name else document
    if not target.exists():
        return False
    return not anchor or anchor in _anchors(target)


def _anchors(document: Path) -> set[str]:
    text = _FENCED.sub("", document.read_text(encoding="utf-8"))
    return {_slug(heading) for heading in _HEADING.findall(text)}


def _slug(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
