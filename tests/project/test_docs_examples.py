"""The documents: their examples, what they say that is printed, and where their links lead."""

import doctest
import re
from pathlib import Path

import numpy as np
import pytest

from tests.project.shown_output import (
    DOCUMENTS,
    ROOT,
    Shown,
    first_difference,
    produced_output,
    shown_outputs,
)

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
