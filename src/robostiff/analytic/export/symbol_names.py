"""Names of symbols taken apart: letter, subscripts, Greek."""

from __future__ import annotations

import re
from dataclasses import dataclass

GREEK = [
    "alpha",
    "beta",
    "gamma",
    "delta",
    "epsilon",
    "zeta",
    "eta",
    "theta",
    "iota",
    "kappa",
    "lambda",
    "mu",
    "nu",
    "xi",
    "omicron",
    "pi",
    "rho",
    "sigma",
    "tau",
    "upsilon",
    "phi",
    "chi",
    "psi",
    "omega",
]

_GREEK_CHARACTERS = dict(zip("αβγδεζηθικλμνξοπρστυφχψω", GREEK, strict=True))
_GREEK_CAPITALS = {
    name.capitalize(): name.capitalize()
    for name in ("gamma", "delta", "theta", "lambda", "xi", "pi", "sigma", "phi", "psi", "omega")
}


@dataclass(frozen=True)
class NameParts:
    """A letter or word with its subscripts.

    Attributes
    ----------
    letter : str
        A letter, a word, or the English name of a Greek letter.
    subscripts : tuple of str
        Likewise, from left to right.
    primes : int
        How many primes follow the letter.
    """

    letter: str
    subscripts: tuple[str, ...] = ()
    primes: int = 0


def name_parts(name: str) -> NameParts:
    """Take a name apart at underscores, commas and trailing digits.

    Examples
    --------
    >>> name_parts("K_1_13")
    NameParts(letter='K', subscripts=('1', '13'), primes=0)
    >>> name_parts("K_C,1").subscripts
    ('C', '1')
    >>> name_parts("φ12")
    NameParts(letter='phi', subscripts=('12',), primes=0)
    >>> name_parts("x'_E").primes
    1
    """
    pieces = [piece for piece in re.split(r"[_,\s{}^]+", name) if piece]
    if not pieces:
        return NameParts(name)
    head, subscripts = pieces[0], pieces[1:]
    stripped = head.rstrip("'′")
    primes = len(head) - len(stripped)
    matched = re.fullmatch(r"(\D+?)(\d+)", stripped)
    if matched:
        stripped, subscripts = matched[1], [matched[2], *subscripts]
    return NameParts(_spelled(stripped or head), tuple(map(_spelled, subscripts)), primes)


def differential_parts(name: str) -> tuple[str, str] | None:
    """Numerator and denominator of derivative names such as dK_1_11_dR; None for other names.

    Examples
    --------
    >>> differential_parts("dK_1_11_dR"), differential_parts("d_a")
    (('K_1_11', 'R'), None)
    """
    matched = re.fullmatch(r"d([A-Za-z][^,\s]*)_d([A-Za-z].*)", name)
    return (matched[1], matched[2]) if matched else None


def is_greek(word: str) -> bool:
    """Whether a word is the English name of a Greek letter.

    Examples
    --------
    >>> is_greek("tau"), is_greek("Omega"), is_greek("tip")
    (True, True, False)
    """
    return word in GREEK or word in _GREEK_CAPITALS


def _spelled(word: str) -> str:
    """A Greek character by its English name; other characters unchanged."""
    if len(word) != 1:
        return word
    if word in _GREEK_CHARACTERS:
        return _GREEK_CHARACTERS[word]
    lower = word.lower()
    if lower in _GREEK_CHARACTERS and _GREEK_CHARACTERS[lower].capitalize() in _GREEK_CAPITALS:
        return _GREEK_CHARACTERS[lower].capitalize()
    return word
