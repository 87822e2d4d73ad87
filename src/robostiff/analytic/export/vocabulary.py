"""The functions and numbers that an exported formula may contain."""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Iterable
from typing import Any

import sympy as sp

from robostiff.errors import InputError

_FUNCTIONS = "acos asin atan atan2 cos cosh exp log sin sinh tan tanh"
#: Functions by the name under which they are written.
FUNCTIONS: dict[str, Any] = {
    "abs": sp.Abs,
    **{name: getattr(sp, name) for name in _FUNCTIONS.split()},
}

#: Numbers that have a name.
CONSTANTS: dict[str, Any] = {"pi": sp.pi, "e": sp.E}

#: Largest numerator and denominator of an exponent.
LARGEST_EXPONENT = 1000

_FUNCTION_NAMES = {function: name for name, function in FUNCTIONS.items()}
_CONSTANT_NAMES = {constant: name for name, constant in CONSTANTS.items()}


def function_name(expression: sp.Basic) -> str | None:
    """Name of the outermost function of an expression; None for other expressions."""
    return _FUNCTION_NAMES.get(expression.func)


def constant_name(expression: sp.Basic) -> str | None:
    """Name of a constant; None for other expressions."""
    return _CONSTANT_NAMES.get(expression)


def check_vocabulary(expressions: Iterable[sp.Basic]) -> None:
    """Refuse expressions that cannot be written in another language.

    Raises
    ------
    InputError
        For a function, number or power that is not of the vocabulary.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> check_vocabulary([sp.sqrt(x) / 3, sp.sin(x)])
    >>> check_vocabulary([sp.gamma(x)])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    robostiff.errors.InputError: formula: got 'gamma(x)', expected sums, products, ...
    """
    for expression in expressions:
        for part in sp.preorder_traversal(expression):
            if not _is_known(part):
                raise unknown(part)


def unknown(part: sp.Basic) -> InputError:
    """The error for a part of a formula that is not in the vocabulary."""
    allowed = ", ".join(("sums, products, rational powers", *sorted(CONSTANTS, reverse=True)))
    return InputError("formula", got=str(part), expected=f"{allowed}, {', '.join(FUNCTIONS)}")


def _is_known(part: sp.Basic) -> bool:
    if isinstance(part, sp.Pow):
        power = part.exp
        is_ratio = isinstance(power, sp.Rational)
        return is_ratio and max(abs(int(power.p)), int(power.q)) <= LARGEST_EXPONENT
    if isinstance(part, sp.Float):
        return bool(part.is_finite)
    if isinstance(part, sp.Add | sp.Mul | sp.Rational):
        return True  # what is infinite in a sum is a part of its own; to ask SymPy takes minutes
    if isinstance(part, sp.Symbol):
        return not isinstance(part, sp.Dummy)
    return function_name(part) is not None or constant_name(part) is not None


_NUMBERS = 8  # letters for a number behind an identifier

_C_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while main
    alignas alignof and and_eq asm atomic bitand bitor bool catch class compl concept constexpr
    const_cast delete dynamic_cast explicit export false friend mutable namespace new noexcept not
    not_eq nullptr operator or or_eq private protected public reinterpret_cast requires
    static_assert static_cast template this thread_local throw true try typeid typename typeof
    using virtual wchar_t xor xor_eq NULL
"""
_C_MATHEMATICS = """
    acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs
    fdim floor fma fmax fmin fmod frexp hypot ilogb ldexp lgamma llrint llround log log10 log1p log2
    logb lrint lround modf nan nearbyint nextafter nexttoward pow remainder remquo rint round
    scalbln scalbn sin sinh sqrt tan tanh tgamma trunc
"""
_C_OTHER = """
    abs labs j0 j1 jn y0 y1 yn gamma signgam isfinite isinf isnan isnormal signbit fpclassify
    isgreater isgreaterequal isless islessequal islessgreater isunordered double_t float_t
    math_errhandling HUGE_VAL HUGE_VALF HUGE_VALL INFINITY NAN FP_INFINITE FP_NAN FP_NORMAL
    FP_SUBNORMAL FP_ZERO FP_FAST_FMA FP_FAST_FMAF FP_FAST_FMAL FP_ILOGB0 FP_ILOGBNAN MATH_ERRNO
    MATH_ERREXCEPT M_E M_PI M_PI_2 M_PI_4 M_SQRT2 M_SQRT1_2 M_LN2 M_LN10 M_LOG2E M_LOG10E M_1_PI
    M_2_PI M_2_SQRTPI linux unix i386
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
    [
        *_C_KEYWORDS.split(),
        *(name + suffix for name in _C_MATHEMATICS.split() for suffix in ("", "f", "l")),
        *_C_OTHER.split(),
    ]
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
    spelled = "".join(map(_spelled, unicodedata.normalize("NFKD", name)))
    plain = re.sub(r"[^A-Za-z0-9_]", "_", spelled)
    return plain if plain[:1].isalpha() else f"v{plain}"


def _spelled(character: str) -> str:
    if character.isascii():
        return character
    if unicodedata.combining(character):
        return ""
    matched = re.fullmatch(
        r"GREEK (SMALL|CAPITAL) LETTER (FINAL )?(\w+)", unicodedata.name(character, "")
    )
    if matched is None:
        return "_"
    letter = "lambda" if matched[3] == "LAMDA" else matched[3].lower()
    return letter if matched[1] == "SMALL" else letter.capitalize()
