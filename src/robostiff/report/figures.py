"""Pictures and formulas of a report, which write themselves."""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import Iterable, Sequence
from math import isfinite
from typing import Any

import numpy as np

from robostiff.analytic import RobotDerivation
from robostiff.analytic.export import derivation_html
from robostiff.analytic.export.documents import derivation_in_typst, wants_wide_page
from robostiff.frozen import frozen
from robostiff.markup import Block, element, escaped, inner_blocks, typst_string, typst_text
from robostiff.plot import Matplotlib, Theme, Width
from robostiff.plot.backend import places, plotly_figure
from robostiff.plot.picture import Picture, Scene
from robostiff.plot.theme import Palette, named_colours

# colours of charts that the style of a page has too, by which they follow its theme
_IN_STYLE = ("ground", "ink", "muted", "faint")


@frozen
class Level:
    """One position of a slider."""

    label: str  # such as ``z = 0.4 m``
    picture: Picture
    # the other end of a vibration, between which and `picture` the page moves the lines
    other: Picture | None = None

    def drawing(self, palette: Palette) -> dict[str, Any]:
        """For the script: a chart, or the figure of a scene and its other end if it has one."""
        if not isinstance(self.picture, Scene):
            svg = Matplotlib().svg(self.picture, letters=True)
            for name in _IN_STYLE:
                svg = svg.replace(getattr(Theme.LIGHT.palette, name), f"var(--{name})")
            svg = svg.replace("#000000", "var(--ink)")  # a colour of parts, dark on dark
            return {"chart": svg[svg.index("<svg") :]}
        figure: dict[str, Any] = {"drawn": plotly_figure(self.picture, palette).to_dict()}
        if self.other is not None:
            figure["other"] = places(plotly_figure(self.other, palette))
        return figure


@frozen
class Figure:
    """One picture, or several behind a slider."""

    name: str  # of its place in the page
    caption: str  # what it shows, in a sentence
    levels: tuple[Level, ...]  # one for a figure without a slider
    start: int = 0  # which level is shown first

    def data(self, palette: Palette) -> dict[str, Any]:
        """Data for the script: the name, and each level with its label."""
        return {
            "name": self.name,
            "start": self.start,
            "labels": [level.label for level in self.levels],
            "levels": [level.drawing(palette) for level in self.levels],
        }

    def html(self) -> str:
        """The element in which the script draws the figure, with its slider below."""
        caption, name, start = escaped(self.caption), self.name, self.start
        is_scene = isinstance(self.levels[0].picture, Scene)  # which can be turned
        parts = [element("div", "", class_="plot" if is_scene else "chart", id=f"plot-{name}")]
        if is_scene:
            parts.append(f'<img class="on-paper" id="print-{name}" alt="{caption}">')
        if len(self.levels) > 1:
            slider = (
                f'<input type="range" min="0" max="{len(self.levels) - 1}" value="{start}" '
                f'id="slider-{name}" aria-label="{caption}">'
            )
            label = escaped(self.levels[start].label)
            output = element("output", label, id=f"label-{name}", for_=f"slider-{name}")
            parts.append(element("div", slider + output, class_="slider"))
        parts.append(element("figcaption", caption))
        return element("figure", "".join(parts))

    def typst(self) -> str:
        """The picture that a page shows first."""
        level = self.levels[self.start]
        caption = self.caption + (f" Here {level.label}." if level.label else "")
        # half as wide as a page, alone or beside another, so that its letters stay 8 points high
        source = typst_string(Matplotlib(width=Width.HALF).svg(level.picture))
        image = f'image(bytes({source}), format: "svg", width: 82mm)'
        return f"#figure({image}, caption: [{typst_text(caption)}])"


def one_figure(name: str, caption: str, picture: Picture) -> Figure:
    """A figure without a slider."""
    return Figure(name, caption, (Level("", picture),))


def figures_in(blocks: Iterable[Block | None]) -> list[Figure]:
    """The figures among blocks, in their order."""
    figures: list[Figure] = []
    for block in blocks:
        if isinstance(block, Figure):
            figures.append(block)
        elif block is not None:
            figures += figures_in(inner_blocks(block))
    return figures


def figures_json(figures: Sequence[Figure]) -> str:
    """The figures of a page as JSON, with the colours of each theme for the names in them."""
    named = named_colours()
    drawn = [figure.data(named) for figure in figures]
    colours = {
        theme.value: row for theme, row in zip(Theme, zip(*named.pairs, strict=True), strict=True)
    }
    return json.dumps(_short({"colours": colours, "figures": drawn}), separators=(",", ":"))


def _short(value: Any) -> Any:
    """What Plotly gives, with lists in place of arrays, seven digits a number, and null for NaN."""
    if isinstance(value, np.ndarray):
        return _short(value.tolist())
    if isinstance(value, dict):
        if "bdata" in value:
            flat = np.frombuffer(b64decode(value["bdata"]), dtype=value["dtype"])
            shape = value.get("shape", str(len(flat)))
            return _short(flat.reshape([int(n) for n in shape.split(",")]))
        return {key: _short(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_short(entry) for entry in value]
    if isinstance(value, float):
        return float(f"{value:.7g}") if isfinite(value) else None
    return value


@frozen
class TypesetFormula:
    """A derivation, typeset step by step."""

    derivation: RobotDerivation

    def html(self) -> str:
        """As MathML."""
        return derivation_html(self.derivation, first_heading=3)

    def typst(self) -> str:
        """In small type where it is wide; what is wider than the page still is scaled down."""
        written = derivation_in_typst(self.derivation, first_heading=3)
        if wants_wide_page(self.derivation):
            return f"#[\n#set text(size: 7pt)\n{written}\n]"
        return written
