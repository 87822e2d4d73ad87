"""Names of symbols taken apart: letter, subscripts, Greek."""

from __future__ import annotations

import re
from dataclasses import dataclass

_GREEK_NAMES = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho sigma "
    "tau upsilon phi chi psi omega"
)
#: Greek letters by their English names.
GREEK: dict[str, str] = dict(zip(_GREEK_NAMES.split(), "αβγδεζηθικλμνξοπρστυφχψω", strict=True))
_NAMES_OF_GREEK = {letter: name for name, letter in GREEK.items()}
_GREEK_CAPITALS = {
    name.capitalize(): name.capitalize()
    for name in ("gamma", "delta", "theta", "lambda", "xi", "pi", "sigma", "phi", "psi", "omega")
}


@dataclass(frozen=True)
class NameParts:
    """A letter or word with its subscripts."""

    letter: str  # a letter, a word, or the English name of a Greek letter
    subscripts: tuple[str, ...] = ()  # likewise, from left to right
    primes: int = 0  # how many primes follow the letter


_COORDINATE = re.compile("i(j?[xyz]|j)")


def name_parts(name: str) -> NameParts:
    """Take a name apart at underscores, commas and trailing digits."""
    pieces = [piece for piece in re.split(r"[_,\s{}^]+", name) if piece]
    if not pieces:
        return NameParts(name)
    head, subscripts = pieces[0], pieces[1:]
    stripped = head.rstrip("'′")
    primes = len(head) - len(stripped)
    matched = re.fullmatch(r"(\D+?)(\d+)", stripped)
    if matched:
        stripped, subscripts = matched[1], [matched[2], *subscripts]
    # Of a coordinate of leg i, or of its rod j.
    subscripts = [part for s in subscripts for part in (s if _COORDINATE.fullmatch(s) else (s,))]
    return NameParts(_spelled(stripped or head), tuple(map(_spelled, subscripts)), primes)


def differential_parts(name: str) -> tuple[str, str] | None:
    """Numerator and denominator of derivative names such as dK_1_11_dR; None for other names."""
    matched = re.fullmatch(r"d([A-Za-z][^,\s]*)_d([A-Za-z].*)", name)
    return (matched[1], matched[2]) if matched else None


def is_greek(word: str) -> bool:
    """Whether a word is the English name of a Greek letter."""
    return word in GREEK or word in _GREEK_CAPITALS


def is_word(name: str) -> bool:
    """Whether a name begins with a word, which is set apart from what stands beside it."""
    letter = name_parts(name).letter
    return len(letter) > 1 and not is_greek(letter)


def _spelled(word: str) -> str:
    """A Greek character by its English name; other characters unchanged."""
    if len(word) != 1:
        return word
    if word in _NAMES_OF_GREEK:
        return _NAMES_OF_GREEK[word]
    lower = word.lower()
    if lower in _NAMES_OF_GREEK and _NAMES_OF_GREEK[lower].capitalize() in _GREEK_CAPITALS:
        return _NAMES_OF_GREEK[lower].capitalize()
    return word
