"""Colours on light and on dark ground, distinguishable with all kinds of colour vision."""

from __future__ import annotations

from dataclasses import fields
from enum import Enum
from typing import Any

from robostiff.frozen import field, frozen


@frozen
class Palette:
    """Colours of one theme, as #rrggbb."""

    ground: str  # behind everything
    ink: str  # text
    muted: str  # what is beside the point
    faint: str  # grids and the base
    plate: str  # the platform
    categories: tuple[str, ...]  # of Okabe and Ito, those that stand out best on this ground first
    values: tuple[str, ...]  # low to high: cividis
    signed: tuple[str, ...]  # negative to positive; the middle is near the ground

    def along(self, stops: tuple[str, ...], where: float) -> str:
        """Colour at a place from 0 to 1 along some stops."""
        place = min(max(where, 0.0), 1.0) * (len(stops) - 1)
        i = min(int(place), len(stops) - 2)
        low, high = _channels(stops[i]), _channels(stops[i + 1])
        mixed = (round(a + (place - i) * (b - a)) for a, b in zip(low, high, strict=True))
        return "#" + "".join(f"{channel:02x}" for channel in mixed)

    def on(self, colour: str) -> str:
        """White or nearly black, whichever has more contrast on a colour."""
        return max(("#ffffff", "#111111"), key=lambda ink: contrast(ink, colour))


def luminance(colour: str) -> float:
    """Relative luminance, 0 (black) to 1 (white): W3C, Web Content Accessibility Guidelines 2.1."""
    shares = (c / 255 for c in _channels(colour))
    linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    """Contrast of two colours, 1 to 21, by their `luminance`."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def _channels(colour: str) -> tuple[int, int, int]:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


# Cividis: J. R. Nuñez, C. R. Anderton, R. S. Renslow, PLoS ONE 13(7), 2018.
_CIVIDIS = (
    "#00224e",
    "#123570",
    "#3b496c",
    "#575d6d",
    "#707173",
    "#8a8678",
    "#a59c74",
    "#c3b369",
    "#e1cc55",
    "#fee838",
)
# Okabe and Ito: Color universal design, 2008.
_SKY, _GREEN, _YELLOW, _BLUE = "#56B4E9", "#009E73", "#F0E442", "#0072B2"
_VERMILION, _PURPLE, _ORANGE = "#D55E00", "#CC79A7", "#E69F00"

_LIGHT = Palette(
    ground="#ffffff",
    ink="#222222",
    muted="#6e6e6e",
    faint="#d9d9d9",
    plate=_SKY,
    categories=(_BLUE, _VERMILION, _GREEN, _PURPLE, _ORANGE, _SKY, "#000000", _YELLOW),
    values=_CIVIDIS,
    signed=("#4a2377", "#8073ac", "#d8daeb", "#f9f9f9", "#fee0b6", "#e08214", "#8c3f04"),
)
_DARK = Palette(
    ground="#16191d",
    ink="#e8e8e8",
    muted="#a0a4a8",
    faint="#43484e",
    plate=_SKY,
    categories=(_SKY, _ORANGE, _GREEN, _PURPLE, _YELLOW, _VERMILION, "#ffffff", "#8b7cf0"),
    # the darkest steps would not stand out from the ground
    values=(
        "#2f4f87",
        "#4e5a73",
        "#656870",
        "#797875",
        "#8d8878",
        "#a29a74",
        "#b9ab6d",
        "#d0be60",
        "#e7d24f",
        "#fee838",
    ),
    signed=("#b9a6e3", "#8573b8", "#4b4468", "#24282d", "#5f4528", "#c0741c", "#fdb863"),
)


class Theme(Enum):
    """Light or dark ground."""

    LIGHT = "light"
    DARK = "dark"

    @property
    def palette(self) -> Palette:
        """Its colours."""
        return _LIGHT if self is Theme.LIGHT else _DARK


@frozen
class NamedColours(Palette):
    """Names in place of colours, so that what is drawn once is shown in every theme.

    A name is a colour that no theme has, ``hsl(N,0%,0%)`` of number N in the list of its colours.
    """

    # light and dark colour of each name given so far
    pairs: list[tuple[str, ...]] = field(default_factory=list)

    def along(self, stops: tuple[str, ...], where: float) -> str:
        """Name of the colours at a place from 0 to 1 along some stops."""
        parts = zip(*(self.pairs[int(name[4:-7])] for name in stops), strict=True)
        colours = (t.palette.along(stop, where) for t, stop in zip(Theme, parts, strict=True))
        return _name(self.pairs, tuple(colours))


def named_colours() -> NamedColours:
    """Names of all colours of a palette, to which those are added that are mixed of them."""
    pairs: list[tuple[str, ...]] = []
    names: dict[str, Any] = {}
    for entry in fields(Palette):
        values = [getattr(theme.palette, entry.name) for theme in Theme]
        single = isinstance(values[0], str)
        named = [
            _name(pairs, pair) for pair in zip(*([o] if single else o for o in values), strict=True)
        ]
        names[entry.name] = named[0] if single else tuple(named)
    return NamedColours(**names, pairs=pairs)


def _name(pairs: list[tuple[str, ...]], colours: tuple[str, ...]) -> str:
    if colours not in pairs:
        pairs.append(colours)
    return f"hsl({pairs.index(colours)},0%,0%)"
