"""The functions and numbers that an exported formula may contain."""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Iterable
from typing import Any

import sympy as sp
from sympy.printing.c import get_math_macros, known_functions_C99, reserved_words

from robostiff.analytic.export.entries import spelled
from robostiff.errors import InputError

_FUNCTIONS = "acos asin atan atan2 cos cosh exp log sin sinh tan tanh"
#: Functions by the name under which they are written.
FUNCTIONS: dict[str, Any] = {
    "abs": sp.Abs,
    **{name: getattr(sp, name) for name in _FUNCTIONS.split()},
}

#: Numbers that have a name.
CONSTANTS: dict[str, Any] = {"pi": sp.pi, "e": sp.E}

_FUNCTION_NAMES = {function: name for name, function in FUNCTIONS.items()}
_CONSTANT_NAMES = {constant: name for name, constant in CONSTANTS.items()}


def function_name(expression: sp.Basic) -> str | None:
    """Name of the outermost function of an expression; None for other expressions."""
    return _FUNCTION_NAMES.get(expression.func)


def constant_name(expression: sp.Basic) -> str | None:
    """Name of a constant; None for other expressions."""
    return _CONSTANT_NAMES.get(expression)


def unknown(part: sp.Basic) -> InputError:
    """The error for a part of a formula that is not in the vocabulary."""
    allowed = ", ".join(("sums, products, rational powers", *sorted(CONSTANTS, reverse=True)))
    return InputError("formula", got=str(part), expected=f"{allowed}, {', '.join(FUNCTIONS)}")


_NUMBERS = 8  # letters for a number behind an identifier

# Of C, beside those that SymPy knows: functions and macros of mathematics.
_C_OTHER = """
    abs labs cbrt ceil copysign fdim fmax fmin fmod frexp ilogb ldexp lgamma llrint llround logb
    lrint lround modf nan nearbyint nextafter nexttoward remainder remquo rint round scalbln scalbn
    tgamma trunc
    inline restrict main fabs pow gamma j0 j1 jn y0 y1 yn isfinite isinf isnan isnormal signbit NULL
    HUGE_VAL HUGE_VALF HUGE_VALL INFINITY NAN FP_INFINITE FP_NAN FP_NORMAL FP_SUBNORMAL FP_ZERO
    FP_FAST_FMA FP_FAST_FMAF FP_FAST_FMAL FP_ILOGB0 FP_ILOGBNAN MATH_ERRNO MATH_ERREXCEPT
    math_errhandling M_LOG10E linux unix i386
"""
_JULIA_KEYWORDS = """
    abstract baremodule begin break catch const continue do else elseif end export false finally for
    function global if import in isa let local macro module mutable primitive quote return struct
    true try type using where while
    sqrt pi zeros all isfinite throw DomainError float typeof Float64 Inf NaN im missing nothing
"""
_MATLAB_KEYWORDS = """
    break case catch classdef continue do else elseif end endfunction endif endwhile endfor
    end_try_catch end_unwind_protect for function global if otherwise parfor persistent return spmd
    switch try until unwind_protect unwind_protect_cleanup while
    sqrt pi zeros all isfinite error NaN eps
"""

#: Identifiers that generated functions must not define.
C_WORDS: frozenset[str] = frozenset(
    [*reserved_words, *known_functions_C99, *get_math_macros().values(), *_C_OTHER.split()]
)
PYTHON_WORDS: frozenset[str] = frozenset([*keyword.kwlist, *keyword.softkwlist, "np", "float"])
JULIA_WORDS: frozenset[str] = frozenset([*_JULIA_KEYWORDS.split(), *FUNCTIONS])
MATLAB_WORDS: frozenset[str] = frozenset([*_MATLAB_KEYWORDS.split(), *FUNCTIONS])


class Identifiers:
    """Unique identifiers that are not reserved in the language.

    `reserved`: keywords and names that are not to be hidden; `longest`: most letters of an
    identifier.

    Examples
    --------
    >>> names = Identifiers({"lambda"})
    >>> [names.take(name) for name in ("lambda", "K_C,1", "K_C_1", "φ", "2a", "λ")]
    ['lambda_', 'K_C_1', 'K_C_1_2', 'phi', 'v2a', 'lambda_2']
    """

    def __init__(self, reserved: Iterable[str], longest: int | None = None) -> None:
        self._reserved = frozenset(reserved)
        self._longest = longest
        self._taken: set[str] = set()

    def take(self, name: str) -> str:
        """An identifier like a name."""
        plain = ascii_identifier(name)
        if self._longest is not None:
            plain = plain[: self._longest - _NUMBERS]
        if plain in self._reserved:
            plain = f"{plain}_"
        identifier, number = plain, 2
        while identifier in self._taken or identifier in self._reserved:
            identifier = f"{plain.rstrip('_')}_{number}"
            number += 1
        self._taken.add(identifier)
        return identifier


def ascii_identifier(name: str) -> str:
    """Letters, digits and underscores, a letter first; Greek letters by their names."""
    each = (c if c.isascii() else spelled(c) for c in unicodedata.normalize("NFKD", name))
    kept = "".join(c for c in each if not unicodedata.combining(c[0]))
    plain = re.sub(r"[^A-Za-z0-9_]", "_", kept)
    return plain if plain[:1].isalpha() else f"v{plain}"
