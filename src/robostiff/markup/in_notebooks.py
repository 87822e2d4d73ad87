"""What notebooks show of a result: its tables and, in front of a reader, its picture."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Protocol

# Pictures are drawn far above the results, and need Matplotlib: imported when one is shown.
_PICTURES = "robostiff.plot.in_notebooks"


class _ShownAsHtml(Protocol):
    def _repr_html_(self) -> str: ...


class InNotebooks:
    """A result that notebooks show as HTML, with its picture where it has one.

    A notebook shows one format of a result only, so the picture is part of the HTML. A terminal
    asks for no HTML, and no picture is drawn there.
    """

    def _repr_mimebundle_(
        self: _ShownAsHtml, include: Any = None, exclude: Any = None
    ) -> dict[str, str]:
        del include, exclude  # IPython selects by itself
        if not _shows_html():
            return {}
        picture = ""
        if find_spec("matplotlib") is not None:
            picture = import_module(_PICTURES).picture_html(self)
        return {"text/html": self._repr_html_() + picture}


def _shows_html() -> bool:
    """Whether the running IPython shows HTML; what asks without IPython does."""
    ipython: Any = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is None or "text/html" in shell.display_formatter.active_types
