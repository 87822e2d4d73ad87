"""Links inside the documents lead somewhere: files exist, and so do the headings in them."""

import re
from pathlib import Path

from tests.project.shown_output import DOCUMENTS, ROOT

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
