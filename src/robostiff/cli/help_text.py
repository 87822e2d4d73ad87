r"""Help of commands: examples on lines of their own, which a terminal does not break.

A paragraph that begins with ``\b`` is left as it is by the command line library.
"""

from __future__ import annotations

import inspect

_HEADS = ("Example:", "Examples\n--------", "Examples:")


def laid_out(doc: str | None) -> str:
    r"""A docstring with each example in one line.

    Examples
    --------
    >>> laid_out("Do it.\n\nExample: robostiff do hexapod\n\nExit status: 0.")
    'Do it.\n\n\x08\nExample:\n  robostiff do hexapod\n\nExit status: 0.'
    """
    found: list[str] = []
    for paragraph in inspect.cleandoc(doc or "").split("\n\n"):
        head = next((head for head in _HEADS if paragraph.startswith(head)), None)
        words = " ".join(paragraph.removeprefix(head or "").split())
        if head is not None:
            line = "\b\nExamples:" if head.startswith("Examples") else "\b\nExample:"
            found.append(f"{line}\n  {words}" if words else line)
        elif words.startswith("robostiff ") and found and found[-1].startswith("\b\nExample"):
            found[-1] += f"\n  {words}"
        else:
            found.append(paragraph)
    return "\n\n".join(found)
