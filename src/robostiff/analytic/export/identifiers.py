"""Names of symbols as identifiers of a programming language."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable


class Identifiers:
    """Gives out identifiers, none of them twice and none that the language keeps for itself.

    Parameters
    ----------
    reserved : iterable of str
        Keywords and names that are not to be hidden.

    Examples
    --------
    >>> names = Identifiers({"lambda"})
    >>> [names.take(name) for name in ("lambda", "K_C,1", "K_C_1", "φ", "2a", "λ")]
    ['lambda_', 'K_C_1', 'K_C_1_2', 'phi', 'v2a', 'lambda_2']
    """

    def __init__(self, reserved: Iterable[str]) -> None:
        self._reserved = frozenset(reserved)
        self._taken: set[str] = set()

    def take(self, name: str) -> str:
        """An identifier like a name."""
        plain = ascii_identifier(name)
        if plain in self._reserved:
            plain = f"{plain}_"
        identifier, number = plain, 2
        while identifier in self._taken or identifier in self._reserved:
            identifier = f"{plain.rstrip('_')}_{number}"
            number += 1
        self._taken.add(identifier)
        return identifier


def ascii_identifier(name: str) -> str:
    """Letters, digits and underscores, a letter first; Greek letters by their names.

    Examples
    --------
    >>> [ascii_identifier(name) for name in ("Δx'", "__x", "é", "")]
    ['Deltax_', 'v__x', 'e', 'v']
    """
    spelled = "".join(map(_spelled, unicodedata.normalize("NFKD", name)))
    plain = re.sub(r"[^A-Za-z0-9_]", "_", spelled)
    return plain if plain[:1].isalpha() else f"v{plain}"


def _spelled(character: str) -> str:
    if character.isascii():
        return character
    if unicodedata.combining(character):
        return ""
    matched = re.fullmatch(r"GREEK (SMALL|CAPITAL) LETTER (FINAL )?(\w+)", _unicode_name(character))
    if matched is None:
        return "_"
    letter = "lambda" if matched[3] == "LAMDA" else matched[3].lower()
    return letter if matched[1] == "SMALL" else letter.capitalize()


def _unicode_name(character: str) -> str:
    return unicodedata.name(character, "")
