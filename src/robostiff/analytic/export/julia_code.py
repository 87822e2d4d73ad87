"""A derivation as a function of Julia."""

from __future__ import annotations

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.code_printer import (
    NO_ANSWER,
    CaretPrinter,
    Identifiers,
    arguments_in_words,
    ascii_identifier,
    assigned,
    convention,
    filled,
    named_symbols,
    plain_text,
    tests_after,
    title_of_function,
    where_it_holds,
)
from robostiff.analytic.export.program import FormulaProgram, program
from robostiff.analytic.export.vocabulary import FUNCTIONS
from robostiff.errors import InputError

_WIDTH = 92

_KEYWORDS = """
    abstract baremodule begin break catch const continue do else elseif end export false finally for
    function global if import in isa let local macro module mutable primitive quote return struct
    true try type using where while
"""
_USED = (
    "sqrt pi zeros all isfinite throw DomainError float typeof Float64 Inf NaN im missing nothing"
)

#: Identifiers that generated Julia must not define.
JULIA_WORDS: frozenset[str] = frozenset([*_KEYWORDS.split(), *FUNCTIONS, *_USED.split()])


def julia_function(derivation: Derivation | FormulaDerivative, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function of Julia.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative
    name : str
        Name of the function; it returns K, or the pair K, dK of a derivative. Its arguments are
        the given symbols, in alphabetical order, each one number of any real type.

    Returns
    -------
    str
        Source that needs no package. Where the formula does not hold, the function throws a
        DomainError.

    Raises
    ------
    InputError
        When the name is no identifier, or an expression is not of the vocabulary.

    Examples
    --------
    >>> import sympy as sp
    >>> k, d = sp.symbols("k d")
    >>> K = sp.ImmutableMatrix([[k, 0, 0], [0, 0, 0], [0, 0, k * d**2 / 3]])
    >>> lines = julia_function(Derivation("K_C", K, (), K)).splitlines()
    >>> print("\n".join(lines[-11:]))
    function stiffness(d, k)
        d = float(d)
        k = float(k)
        T = typeof(d + k)
        K = zeros(T, 3, 3)
        K[1, 1] = k
        K[3, 3] = (1/3)*d^2*k
        holds = all(isfinite, (d, k)) && all(isfinite, K)
        holds || throw(DomainError((d, k), "the formula does not hold at these values"))
        return K
    end
    """
    if ascii_identifier(name) != name or name in JULIA_WORDS:
        raise InputError("name of the function", got=name, expected="an identifier of Julia")
    compute = program(derivation)
    identifiers = Identifiers({*JULIA_WORDS, name})
    names = named_symbols(compute, identifiers)
    printer = _JuliaPrinter(names)
    arguments = [names[symbol] for symbol in compute.arguments]
    kind, holds = identifiers.take("T"), identifiers.take("holds")
    results = [identifiers.take(result) for result in ("K", "dK")[: len(compute.results)]]
    lines = [
        *_documentation(derivation, compute, name, arguments),
        *wrapped_formula(", ".join(arguments) + ")", _WIDTH, f"function {name}("),
        *_numbers(arguments, kind),
    ]
    for assignment in compute.assignments:
        lines += assigned(names[assignment.symbol], printer.write(assignment.expression), _WIDTH)
    for result, matrix in zip(results, compute.results, strict=True):
        lines.append(f"    {result} = zeros({kind}, {matrix.rows}, {matrix.rows})")
        entries = filled(matrix, lambda i, j, K=result: f"{K}[{i + 1}, {j + 1}]", printer.write)
        for target, expression in entries:
            lines += assigned(target, expression, _WIDTH)
    given = f"({', '.join(arguments)}{',' * (len(arguments) == 1)})"
    of = [given] if arguments else []
    finite = " && ".join(f"all(isfinite, {x})" for x in (*of, *results))
    for test in tests_after(holds, finite, compute, printer.write):
        lines += assigned(holds, test, _WIDTH)
    thrown = f'{given}, "{NO_ANSWER}"))'
    lines += wrapped_formula(thrown, _WIDTH, f"    {holds} || throw(DomainError(", " " * 8)
    return "\n".join([*lines, f"    return {', '.join(results)}", "end"]) + "\n"


def _numbers(arguments: list[str], kind: str) -> list[str]:
    """Integers become floats, as their powers could overflow."""
    if not arguments:
        return [f"    {kind} = Float64"]
    return [
        *(f"    {argument} = float({argument})" for argument in arguments),
        *wrapped_formula(f"{' + '.join(arguments)})", _WIDTH, f"    {kind} = typeof(", " " * 8),
    ]


def _documentation(
    derivation: Derivation | FormulaDerivative,
    compute: FormulaProgram,
    name: str,
    arguments: list[str],
) -> list[str]:
    n = compute.entries.rows
    signature = wrapped_formula(", ".join(arguments) + ")", _WIDTH, f"    {name}(", " " * 8)
    lines = [*signature, ""]
    what = plain_text(title_of_function(derivation))
    title = f"Stiffness matrix {what} about the reference point, {n} x {n}."
    lines += [*wrapped_words(title, _WIDTH), "", *wrapped_words(f"It {convention(n)}", _WIDTH), ""]
    known = arguments_in_words(compute, arguments, "- `", "`")
    words = f"A `DomainError` is thrown {plain_text(where_it_holds(compute))}."
    return ['"""', *lines, *known, *[""][: len(known)], *wrapped_words(words, _WIDTH), '"""']


class _JuliaPrinter(CaretPrinter):
    """Julia's own functions throw where the result is not real."""

    def call(self, function: str, arguments: list[str]) -> str:
        return f"{'atan' if function == 'atan2' else function}({', '.join(arguments)})"
