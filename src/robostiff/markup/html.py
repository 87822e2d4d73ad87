"""Small pieces of HTML; what is text comes out escaped."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from robostiff.errors import printable


def escaped(text: object) -> str:
    """Text that HTML takes for text.

    Examples
    --------
    >>> escaped("k < 2 & 'so on'")
    'k &lt; 2 &amp; &#x27;so on&#x27;'
    """
    return escape(printable(str(text), kept="\n\t"))


def element(tag: str, content: str, **attributes: str) -> str:
    """An element around content that is HTML already; ``_`` in names of attributes is ``-``.

    Examples
    --------
    >>> element("td", "12", class_="number", data_unit="N/m")
    '<td class="number" data-unit="N/m">12</td>'
    """
    told = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{escaped(value)}"'
        for name, value in attributes.items()
    )
    return f"<{tag}{told}>{content}</{tag}>"


def listing(items: Iterable[str]) -> str:
    """A bulleted list of texts; nothing for none.

    Examples
    --------
    >>> listing(["a < b"]), listing([])
    ('<ul><li>a &lt; b</li></ul>', '')
    """
    entries = "".join(element("li", escaped(item)) for item in items)
    return element("ul", entries) if entries else ""
