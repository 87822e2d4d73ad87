"""Natural vibrations as text and as plain data."""

from __future__ import annotations

from typing import Any

from robostiff.io.results.data import order
from robostiff.markup import text_of
from robostiff.statics import Modes
from robostiff.version import __version__

_SHARES = 3  # parts that bend most, of each mode


def modes_text(found: Modes, most: int = 10) -> str:
    """Natural vibrations, slowest first, as lines of text.

    Parameters
    ----------
    found : Modes
    most : int
        How many to list.
    """
    lines = [f"natural vibrations of {found.name}", f"status: {found.status}"]
    for number, mode in enumerate(found.each[:most], start=1):
        lines.append(f"{number:3}. {mode}")
        bending = [own for own in mode.shares[:_SHARES] if own.share >= 0.005]
        if bending:
            shares = ", ".join(f"{own.leg}/{own.part} {own.share:.0%}" for own in bending)
            lines.append(f"     bending: {shares}")
    if len(found) > most:
        lines.append(f"{len(found) - most} faster ones")
    lines += [f"advice: {advice}" for advice in found.status.advice]
    return text_of(lines)


def modes_data(found: Modes) -> dict[str, Any]:
    """Natural vibrations, slowest first, as plain data.

    Parameters
    ----------
    found : Modes

    Returns
    -------
    dict
        JSON-ready; without modes where there is no equilibrium.
    """
    return {
        "robot": found.name,
        "status": str(found.status),
        "advice": list(found.status.advice),
        "order": order(found.space),
        "units": {"length": "m", "angle": "rad", "frequency": "Hz", "growth": "1/s"},
        "modes": [
            {
                "frequency": mode.frequency,
                "growth": mode.growth,
                "twist": mode.twist.tolist(),
                "words": mode.words,
                "shares": [
                    {"leg": own.leg, "part": own.part, "share": own.share} for own in mode.shares
                ],
            }
            for mode in found
        ],
        "robostiff": __version__,
    }
