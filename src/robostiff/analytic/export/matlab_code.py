"""A derivation as a function of MATLAB and Octave."""

from __future__ import annotations

from typing import Any

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.code_printer import (
    NO_ANSWER,
    CaretPrinter,
    Identifiers,
    arguments_in_words,
    ascii_identifier,
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

_WIDTH = 96
_LONGEST_NAME = 63

_KEYWORDS = """
    break case catch classdef continue do else elseif end endfunction endif endwhile endfor
    end_try_catch end_unwind_protect for function global if otherwise parfor persistent return spmd
    switch try until unwind_protect unwind_protect_cleanup while
"""
_USED = "sqrt pi zeros all isfinite error NaN eps"

#: Identifiers that generated MATLAB must not define.
MATLAB_WORDS: frozenset[str] = frozenset([*_KEYWORDS.split(), *FUNCTIONS, *_USED.split()])

# Functions that leave the real numbers: outside their domain they give NaN, which is refused.
_DOMAINS = {
    "sqrt": ("x >= 0", "sqrt(x)"),
    "log": ("x >= 0", "log(x)"),
    "asin": ("abs(x) <= 1", "asin(x)"),
    "acos": ("abs(x) <= 1", "acos(x)"),
    "power": ("x >= 0", "x^y"),
}


def matlab_function(derivation: Derivation | FormulaDerivative, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function of MATLAB, which Octave takes as well.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative
    name : str
        Name of the function ``K = name(...)``, or ``[K, dK] = name(...)`` of a derivative; also
        that of its file, ``name.m``. Its arguments are the given symbols, in alphabetical order,
        each one number.

    Returns
    -------
    str
        Source that needs no toolbox. Where the formula does not hold, the function raises the
        error ``robostiff:formula``.

    Raises
    ------
    InputError
        When the name is no identifier, or an expression is not of the vocabulary.

    Examples
    --------
    >>> import sympy as sp
    >>> k, d = sp.symbols("k d")
    >>> K = sp.ImmutableMatrix([[k, 0, 0], [0, 0, 0], [0, 0, k * d**2 / 3]])
    >>> lines = matlab_function(Derivation("K_C", K, (), K)).splitlines()
    >>> lines[0]
    'function K = stiffness(d, k)'
    >>> print("\n".join(lines[-9:]))
    K = zeros(3, 3);
    K(1, 1) = k;
    K(3, 3) = (1/3)*d^2*k;
    <BLANKLINE>
    holds = all(isfinite([d, k])) && all(isfinite(K(:)));
    if ~holds
        error('robostiff:formula', 'the formula does not hold at these values');
    end
    end
    """
    if ascii_identifier(name) != name or name in MATLAB_WORDS or len(name) > _LONGEST_NAME:
        raise InputError("name of the function", got=name, expected="an identifier of MATLAB")
    compute = program(derivation)
    identifiers = Identifiers({*MATLAB_WORDS, name}, longest=_LONGEST_NAME)
    names = named_symbols(compute, identifiers)
    printer = _MatlabPrinter(names, identifiers)
    results = [identifiers.take(result) for result in ("K", "dK")[: len(compute.results)]]
    holds = identifiers.take("holds")
    left = results[0] if len(results) == 1 else f"[{', '.join(results)}]"
    arguments = ", ".join(names[symbol] for symbol in compute.arguments)
    lines = [
        *_continued(f"{arguments})", f"function {left} = {name}("),
        *_comment(derivation, compute, name, [names[s] for s in compute.arguments]),
        "",
    ]
    for assignment in compute.assignments:
        lines += _assigned(names[assignment.symbol], printer.write(assignment.expression))
    for result, matrix in zip(results, compute.results, strict=True):
        n = matrix.rows
        lines += ["", f"{result} = zeros({n}, {n});"]
        entries = filled(matrix, lambda i, j, K=result: f"{K}({i + 1}, {j + 1})", printer.write)
        for target, expression in entries:
            lines += _assigned(target, expression)
    lines.append("")
    of = [f"[{arguments}]"] if arguments else []
    finite = " && ".join(f"all(isfinite({x}))" for x in (*of, *(f"{K}(:)" for K in results)))
    for test in tests_after(holds, finite, compute, printer.write):
        lines += _assigned(holds, test)
    lines += [f"if ~{holds}", f"    error('robostiff:formula', '{NO_ANSWER}');", "end", "end"]
    return "\n".join([*lines, *printer.local_functions()]) + "\n"


def _comment(
    derivation: Derivation | FormulaDerivative,
    compute: FormulaProgram,
    name: str,
    arguments: list[str],
) -> list[str]:
    n = compute.entries.rows
    title = (
        f"{name.upper()} Stiffness matrix {plain_text(title_of_function(derivation))}, {n} x {n}."
    )
    lines = [*wrapped_words(title, _WIDTH - 2, "  "), ""]
    lines += wrapped_words(f"It {convention(n)}", _WIDTH - 4)
    known = arguments_in_words(compute, arguments)
    lines += ["", *known] if known else []
    words = f"It raises the error robostiff:formula {plain_text(where_it_holds(compute))}."
    lines += ["", *wrapped_words(words, _WIDTH - 4)]
    first, *others = lines
    return [f"%{first}", *(f"%   {line}".rstrip() for line in others)]


def _assigned(target: str, expression: str) -> list[str]:
    return _continued(f"{expression};", f"{target} = ")


def _continued(text: str, first: str) -> list[str]:
    lines = wrapped_formula(text, _WIDTH - 4, first, " " * 4)
    return [*(f"{line} ..." for line in lines[:-1]), lines[-1]]


class _MatlabPrinter(CaretPrinter):
    """Numbers are doubles; functions that may become complex have a real one of their own."""

    def __init__(self, names: Any, identifiers: Identifiers) -> None:
        super().__init__(names)
        self._identifiers = identifiers
        self._own: dict[str, str] = {}

    def call(self, function: str, arguments: list[str]) -> str:
        if function in _DOMAINS:
            if function not in self._own:
                self._own[function] = self._identifiers.take(f"real_{function}")
            function = self._own[function]
        return f"{function}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any) -> str:
        if not exponent.is_Integer:
            return self.call("power", [self.write(base), self.write(exponent)])
        return super().power(base, exponent)

    def local_functions(self) -> list[str]:
        """The functions that were used, and are NaN outside their domain."""
        lines: list[str] = []
        for function, own in self._own.items():
            inside, value = _DOMAINS[function]
            arguments = "x, y" if function == "power" else "x"
            lines += ["", f"function z = {own}({arguments})", "z = NaN;", f"if {inside}"]
            lines += [f"    z = {value};", "end", "end"]
        return lines
