"""The directive ``derived``: a formula that robostiff derives while the documentation is built.

```{derived} case-b
:show: Names for recurring expressions; Sum of the legs
```

Its argument is a name of `theory_formulas.FORMULAS`; `show` chooses parts of the exported
derivation by their headings, between semicolons; all but the nomenclature when left out.
"""

from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import directives
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from theory_formulas import FORMULAS

import robostiff
from robostiff.analytic.export import derivation_markdown

_SOURCES = (
    *Path(robostiff.__file__).parent.glob("analytic/**/*.py"),
    *Path(__file__).parent.iterdir(),
)


class Derived(SphinxDirective):
    """Parts of a derivation, as Markdown that the page goes on with."""

    required_arguments = 1
    option_spec = {"show": directives.unchanged_required}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        for source in _SOURCES:
            self.env.note_dependency(str(source))
        name = self.arguments[0]
        if name not in FORMULAS:
            raise self.error(f"no formula {name!r}; there are {', '.join(FORMULAS)}")
        parts = parts_of(derivation_markdown(FORMULAS[name]()))
        shown = self.options.get("show")
        wanted = [part.strip() for part in shown.split(";")] if shown else list(parts)
        missing = [heading for heading in wanted if heading not in parts]
        if missing:
            raise self.error(f"no part {missing[0]!r} in {name}; there are {', '.join(parts)}")
        lines: list[str] = []
        for heading in wanted:
            # The heading of a single part would repeat the text around it.
            lines += ([f"**{heading}**", ""] if len(wanted) > 1 else []) + parts[heading]
        container = nodes.container(classes=["derived"])
        self.state.nested_parse(StringList(lines, source=name), self.content_offset, container)
        return container.children


def parts_of(markdown: str) -> dict[str, list[str]]:
    """Lines below each heading of the second level, without the nomenclature."""
    parts: dict[str, list[str]] = {}
    for line in markdown.splitlines():
        if line.startswith("## "):
            parts[line.removeprefix("## ")] = []
        elif parts:
            parts[list(parts)[-1]].append(line)
    parts.pop("Nomenclature", None)
    return parts


def setup(app: Sphinx) -> dict[str, bool]:
    """Give Sphinx the directive."""
    app.add_directive("derived", Derived)
    return {"parallel_read_safe": True}
