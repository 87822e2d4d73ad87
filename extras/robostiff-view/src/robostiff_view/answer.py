"""What is shown of a robot: items in the picture, tables beside it, and its status above all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from robostiff.analysis import Deflection
from robostiff.markup import Bullets, Tone, block_html, element, escaped, page_html
from robostiff.page import displacement_table, energy_table, stiffness_page
from robostiff.plot import LAYERS, Item, Layers, Paint, Theme, colour_of

_BARS = 12
UNDER_LOAD = element("p", element("b", "Under the load"))


@dataclass(frozen=True)
class Look:
    """How a robot is to be shown."""

    # of displacements; None for a round number that makes them visible
    exaggeration: float | None = None
    # layers that are wanted
    seen: frozenset[str] = frozenset(name for name, seen in LAYERS.items() if seen)


@dataclass(frozen=True)
class ShownAnswer:
    """What is shown of a robot at a pose, under a load."""

    status: str  # in a word or two
    kind: str  # ok, note or bad
    advice: tuple[str, ...] = ()
    layers: Mapping[str, Sequence[Item]] = field(default_factory=dict)  # in metres
    # HTML of the tables; empty where there is nothing to say
    stiffness: str = ""
    load: str = ""
    notes: tuple[str, ...] = ()  # what the picture shows, a sentence each
    key: str = ""  # HTML of the meaning of its colours

    @property
    def head(self) -> str:
        """Status, advice and notes as HTML."""
        colour = {"ok": "#00694a", "note": "#8a4b00", "bad": "#a01010"}[self.kind]
        look = f"color:{colour};font-weight:700"
        word = element("span", escaped(self.status), style=look, class_="robostiff-status")
        blocks = [element("p", f"status {word}", style="margin:0.2em 0")]
        if self.advice:
            blocks.append(block_html(Bullets(self.advice, Tone.WARNING)))
        blocks.append(self.key)
        if self.notes:
            blocks.append(block_html(Bullets(self.notes, Tone.QUIET)))
        return "".join(blocks)


def answer_of(bent: Deflection, drawn: Layers) -> ShownAnswer:
    """What is shown of a robot under the load of a deflection."""
    return ShownAnswer(
        str(bent.status),
        kind_of(bent.status.is_bad, not bent.status),
        tuple(bent.advice),
        drawn.items,
        page_html(stiffness_page(bent.stiffness)),
        load_html(bent, drawn.colours) if np.any(bent.wrench) else "",
        drawn.notes,
        colour_key(drawn.colours),
    )


def load_html(bent: Deflection, colours: Mapping[str, Paint]) -> str:
    """Displacements under the load, and the elastic energy of parts."""
    if not bent.has_answer:
        return UNDER_LOAD + element("p", f"There is no deflection: status {escaped(bent.status)}.")
    blocks = [UNDER_LOAD, block_html(displacement_table(bent)), energy_bars(bent, colours)]
    if bent.energy > 0 and len({part.part for part in bent.parts}) < len(bent.parts):
        blocks.append(block_html(energy_table(bent.parts, bent.energy, _BARS)))
    return "".join(blocks)


def energy_bars(bent: Deflection, colours: Mapping[str, Paint]) -> str:
    """Shares of the parts in the elastic energy as bars, in the colours of the picture."""
    if not bent.has_answer or not bent.energy > 0:
        return ""
    by_name: dict[str, float] = {}
    for part in bent.parts:
        by_name[part.part] = by_name.get(part.part, 0.0) + part.share
    rows = []
    for name, share in sorted(by_name.items(), key=lambda own: -own[1])[:_BARS]:
        colour = hue(colours[name]) if name in colours else "#888888"
        bar = element("div", "", style=f"width:{100 * share:.2f}%;height:0.7em;background:{colour}")
        number = element("data", f"{100 * share:.1f} %", value=repr(100 * share))
        cells = (
            element("td", escaped(name)),
            element("td", bar, style="width:50%"),
            element("td", number, style="text-align:right"),
        )
        rows.append(element("tr", "".join(cells)))
    of = ", all legs together" if len(by_name) < len(bent.parts) else ""
    title = element("p", f"elastic energy by part{of}", style="margin:0.6em 0 0")
    return title + element("table", "".join(rows), style="width:100%", class_="robostiff-energy")


def colour_key(colours: Mapping[str, Paint]) -> str:
    """Names of parts in the colours of the picture; empty where there is none."""
    if not colours:
        return ""
    spans = (
        element("span", "&#9632;", style=f"color:{hue(paint)}") + f"&nbsp;{escaped(name)}"
        for name, paint in colours.items()
    )
    return element("p", " &nbsp; ".join(spans), style="margin:0.2em 0;line-height:1.4")


def hue(paint: Paint) -> str:
    """The colour of a paint on light ground."""
    return colour_of(paint, Theme.LIGHT.palette)


def kind_of(is_bad: bool, is_plain: bool) -> str:
    """ok, note or bad."""
    return "bad" if is_bad else "ok" if is_plain else "note"
