"""A derivation as a function in C."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.code_printer import (
    CodePrinter,
    Identifiers,
    about_argument,
    ascii_identifier,
    checks_of,
    convention,
    named_symbols,
    plain_text,
    where_it_holds,
)
from robostiff.analytic.export.derivative_outline import refuse_derivative
from robostiff.analytic.export.entries import symbols_of
from robostiff.analytic.export.program import FormulaProgram, program
from robostiff.errors import InputError

_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while main
    alignas alignof and and_eq asm atomic bitand bitor bool catch class compl concept constexpr
    const_cast delete dynamic_cast explicit export false friend mutable namespace new noexcept not
    not_eq nullptr operator or or_eq private protected public reinterpret_cast requires
    static_assert static_cast template this thread_local throw true try typeid typename typeof
    using virtual wchar_t xor xor_eq NULL
"""

_MATHEMATICS = """
    acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs
    fdim floor fma fmax fmin fmod frexp hypot ilogb ldexp lgamma llrint llround log log10 log1p log2
    logb lrint lround modf nan nearbyint nextafter nexttoward pow remainder remquo rint round
    scalbln scalbn sin sinh sqrt tan tanh tgamma trunc
"""

_OTHER_MATHEMATICS = """
    abs labs j0 j1 jn y0 y1 yn gamma signgam isfinite isinf isnan isnormal signbit fpclassify
    isgreater isgreaterequal isless islessequal islessgreater isunordered double_t float_t
    math_errhandling HUGE_VAL HUGE_VALF HUGE_VALL INFINITY NAN FP_INFINITE FP_NAN FP_NORMAL
    FP_SUBNORMAL FP_ZERO FP_FAST_FMA FP_FAST_FMAF FP_FAST_FMAL FP_ILOGB0 FP_ILOGBNAN MATH_ERRNO
    MATH_ERREXCEPT M_E M_PI M_PI_2 M_PI_4 M_SQRT2 M_SQRT1_2 M_LN2 M_LN10 M_LOG2E M_LOG10E M_1_PI
    M_2_PI M_2_SQRTPI linux unix i386
"""

#: Identifiers that generated C must not define.
C_WORDS: frozenset[str] = frozenset(
    [
        *_KEYWORDS.split(),
        *(name + suffix for name in _MATHEMATICS.split() for suffix in ("", "f", "l")),
        *_OTHER_MATHEMATICS.split(),
    ]
)


_WIDTH = 96

# Powers of a symbol up to this one are written as products.
_LARGEST_PRODUCT = 4

_C_NAMES = {"abs": "fabs"}
_CONSTANTS = {"pi": "3.14159265358979323846", "e": "2.71828182845904523536"}


def c_function(derivation: Derivation, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function in C99.

    Parameters
    ----------
    derivation : Derivation
    name : str
        Name of the function ``int name(double *restrict K_out, const double *restrict p)``:
        it writes the n * n entries of K, row after row, for the values p of the given symbols
        in alphabetical order, as the comment in front of it says, and returns 0. Where the
        formula does not hold it returns 1, and writes nothing.

    Returns
    -------
    str
        Source that needs only the mathematical library (``-lm``).

    Raises
    ------
    InputError
        When the name is no identifier, or an expression is not of the vocabulary.

    Examples
    --------
    >>> k, d = sp.symbols("k d")
    >>> K = sp.ImmutableMatrix([[k, 0, 0], [0, 0, 0], [0, 0, k * d**2 / 3]])
    >>> lines = c_function(Derivation("K_C", K, (), K)).splitlines()
    >>> print("\n".join(lines[16:24]))
    int stiffness(double *restrict K_out, const double *restrict p)
    {
        const double d = p[0];
        const double k = p[1];
        double K[9];
    <BLANKLINE>
        K[0] = k;
        K[1] = 0.0;
    >>> lines[-9]
    '    K[8] = (1.0/3.0)*(d*d)*k;'
    """
    refuse_derivative(derivation)
    if ascii_identifier(name) != name or name in C_WORDS:
        raise InputError("name of the function", got=name, expected="an identifier of C")
    compute = program(derivation)
    identifiers = Identifiers({*C_WORDS, name})
    names = named_symbols(compute, identifiers)
    K, p = identifiers.take("K"), identifiers.take("p")
    out = identifiers.take("K_out")
    lines = [
        *_comment(derivation, compute, out, p),
        "#include <math.h>",
        "",
        f"int {name}(double *restrict {out}, const double *restrict {p});",
        "",
        f"int {name}(double *restrict {out}, const double *restrict {p})",
        "{",
        *_body(compute, names, K, p),
        *_guard(compute, _CPrinter(names), (K, p, out), identifiers),
        "}",
    ]
    return "\n".join(lines) + "\n"


def _comment(derivation: Derivation, compute: FormulaProgram, out: str, p: str) -> list[str]:
    n = derivation.K.rows
    words = f"{out}, {n} x {n}, row after row, {convention(n)}"
    order = [f"{p}[{i}] {plain_text(symbol.name)}" for i, symbol in enumerate(compute.arguments)]
    about = [about_argument(x.name, x, compute.meanings) for x in compute.arguments]
    if any(about):
        each = zip(order, about, strict=True)
        values = ["Values:", *("  " + f"{own}: {words}".removesuffix(": ") for own, words in each)]
    else:
        text = f"Values: {', '.join(order)}." if order else f"{p} is not used and may be null."
        values = wrapped_words(text, _WIDTH - 3)
    returns = f"Returns 0; 1, and writes nothing, {where_it_holds(compute)}."
    lines = [
        f"Stiffness matrix {plain_text(derivation.name)} about the reference point.",
        "",
        *wrapped_words(words, _WIDTH - 3),
        "",
        *values,
        "",
        *wrapped_words(plain_text(returns), _WIDTH - 3),
    ]
    return ["/*", *(f" * {line}".rstrip() for line in lines), " */"]


def _body(compute: FormulaProgram, names: Mapping[sp.Symbol, str], K: str, p: str) -> list[str]:
    printer = _CPrinter(names)
    K_rows = compute.entries.tolist()
    n = len(K_rows)
    beside = [*(a.expression for a in compute.assignments), *(x for _, x, _ in compute.conditions)]
    used = symbols_of([compute.entries, *beside])
    lines = [
        f"    const double {names[symbol]} = {p}[{i}];"
        for i, symbol in enumerate(compute.arguments)
        if symbol in used
    ]
    lines += [] if compute.arguments else [f"    (void){p};"]
    for assignment in compute.assignments:
        target = f"const double {names[assignment.symbol]}"
        lines += _assigned(target, printer.write(assignment.expression))
    lines += [f"    double {K}[{n * n}];", ""]
    for i, row in enumerate(K_rows):
        for j, entry in enumerate(row):
            place = f"{K}[{n * i + j}]"
            if j < i and entry == K_rows[j][i] and not entry.is_number:
                lines.append(f"    {place} = {K}[{n * j + i}];")
            else:
                lines += _assigned(place, printer.write(entry))
    return lines


def _guard(
    compute: FormulaProgram,
    printer: _CPrinter,
    arrays: tuple[str, str, str],
    identifiers: Identifiers,
) -> list[str]:
    """Lines that return K; 1 where a value is not finite, or a denominator or condition fails."""
    K, p, out = arrays
    fails, i = identifiers.take("fails"), identifiers.take("i")
    n = compute.entries.rows
    lines = ["", f"    int {fails} = 0;"]
    every = f"    for (int {i} = 0; {i} < {n * n}; ++{i})"
    if given := len(compute.arguments):
        each = f"    for (int {i} = 0; {i} < {given}; ++{i})"
        lines.append(f"{each} {fails} |= !isfinite({p}[{i}]);")
    lines.append(f"{every} {fails} |= !isfinite({K}[{i}]);")
    for test in checks_of(compute, printer.write, "fabs", "0.0"):
        lines += wrapped_formula(f"!({test});", _WIDTH, f"    {fails} |= ", " " * 8)
    return [
        *lines,
        f"    if (!{fails})",
        f"    {every} {out}[{i}] = {K}[{i}];",
        f"    return {fails};",
    ]


def _assigned(target: str, expression: str) -> list[str]:
    return wrapped_formula(f"{expression};", _WIDTH, f"    {target} = ", " " * 8)


class _CPrinter(CodePrinter):
    """All numbers are doubles; small powers of a symbol are products."""

    def integer(self, value: int) -> str:
        return f"{value}.0"

    def call(self, function: str, arguments: list[str]) -> str:
        return f"{_C_NAMES.get(function, function)}({', '.join(arguments)})"

    def constant(self, name: str) -> str:
        return _CONSTANTS[name]

    def power(self, base: Any, exponent: Any) -> str:
        if base.is_Symbol and exponent.is_Integer and exponent <= _LARGEST_PRODUCT:
            return f"({'*'.join([self.factor(base)] * int(exponent))})"
        return self.call("pow", [self.write(base), self.write(exponent)])
