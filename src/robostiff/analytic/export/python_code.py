"""A derivation as a Python function that needs only NumPy."""

from __future__ import annotations

import keyword
from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.code_printer import (
    CodePrinter,
    Identifiers,
    about_argument,
    ascii_identifier,
    assigned,
    checks_of,
    convention,
    filled,
    named_symbols,
    title_of_function,
    unquoted,
    where_it_holds,
)
from robostiff.analytic.export.program import FormulaProgram, program
from robostiff.errors import InputError

_WIDTH = 96

# Names that the generated function needs itself.
_USED = {"np", "float"}

_NUMPY_NAMES = {
    "abs": "abs",
    "acos": "arccos",
    "asin": "arcsin",
    "atan": "arctan",
    "atan2": "arctan2",
}


def python_function(derivation: Derivation | FormulaDerivative, name: str = "stiffness") -> str:
    r"""A derivation as the source of a Python module with one function.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative
        The function returns K, or the pair K, dK of a derivative.
    name : str
        Name of the function. Its arguments are the given symbols, in alphabetical order; they may
        be numbers or arrays that broadcast, and the result has shape (..., n, n).

    Returns
    -------
    str
        Source that needs only NumPy. Named intermediates keep their names, what occurs more than
        once is computed once.

    Raises
    ------
    InputError
        When the name is no identifier, or an expression is not of the vocabulary.

    Examples
    --------
    >>> k, d = sp.symbols("k lambda")
    >>> K = sp.ImmutableMatrix([[k, 0, k * d], [0, 0, 0], [k * d, 0, k * d**2 / 3]])
    >>> lines = python_function(Derivation("K_C", K, (), K)).splitlines()
    >>> lines[6]
    'def stiffness(k, lambda_):'
    >>> print("\n".join(lines[-16:]))
        k = np.asarray(k, dtype=float)
        lambda_ = np.asarray(lambda_, dtype=float)
        t1 = k*lambda_
        shape = np.broadcast_shapes(k.shape, lambda_.shape)
        K = np.zeros((*shape, 3, 3))
        K[..., 0, 0] = k
        K[..., 0, 2] = t1
        K[..., 2, 0] = K[..., 0, 2]
        K[..., 2, 2] = (1/3)*k*lambda_**2
        holds = np.isfinite(K).all(axis=(-2, -1))
        for given in (k, lambda_):
            holds = holds & np.isfinite(given)
        if not np.all(holds):
            bad = np.size(holds) - np.count_nonzero(holds)
            raise ValueError(f"the formula does not hold at {bad} of {np.size(holds)} points")
        return K
    """
    if ascii_identifier(name) != name or keyword.iskeyword(name) or name in _USED:
        raise InputError("name of the function", got=name, expected="an identifier")
    compute, title = program(derivation), title_of_function(derivation)
    identifiers, names = _identifiers(compute, name)
    arguments = [names[symbol] for symbol in compute.arguments]
    body, targets, holds = _body(compute, names, identifiers)
    lines = [
        f'"""Stiffness matrix {title} as a function."""',
        *("", "import numpy as np", "", ""),
        *_head(name, arguments),
        *_docstring(title, compute, names),
        *(f"    {argument} = np.asarray({argument}, dtype=float)" for argument in arguments),
        *body,
        *_finite(arguments, holds, identifiers.take("given")),
        *_refusal(holds, identifiers.take("bad")),
        f"    return {', '.join(targets)}",
    ]
    return "\n".join(lines) + "\n"


def source_of_values(compute: FormulaProgram, order: Sequence[int]) -> str:
    """Source of ``formula``, which returns K (and dK), and where it holds, and refuses nothing.

    Its arguments, arrays, are those of the program in the given `order`.
    """
    identifiers, names = _identifiers(compute, "formula")
    arguments = [names[compute.arguments[place]] for place in order]
    body, targets, holds = _body(compute, names, identifiers)
    lines = ["import numpy as np", "", *_head("formula", arguments), *body]
    return "\n".join([*lines, f"    return {', '.join((*targets, holds))}"]) + "\n"


def _identifiers(compute: FormulaProgram, name: str) -> tuple[Identifiers, dict[sp.Symbol, str]]:
    identifiers = Identifiers({*keyword.kwlist, *keyword.softkwlist, *_USED, name})
    return identifiers, named_symbols(compute, identifiers)


def _head(name: str, arguments: list[str]) -> list[str]:
    signature = wrapped_formula(", ".join(arguments) + "):", _WIDTH, f"def {name}(")
    return ['@np.errstate(all="ignore")', *signature]


def _docstring(title: str, compute: FormulaProgram, names: Mapping[sp.Symbol, str]) -> list[str]:
    n = compute.entries.rows
    words = f"It {convention(n)}"
    each = " each" if len(compute.results) > 1 else ""
    first = f"Stiffness matrix {title} about the reference point, (..., {n}, {n}){each}."
    start, *others = wrapped_words(first, _WIDTH - 8)
    lines = [*others, "", *wrapped_words(words, _WIDTH - 4)]
    if compute.arguments:
        lines += ["", "Parameters", "----------"]
        for symbol in compute.arguments:
            lines.append(f"{names[symbol]} : float or array")
            about = about_argument(names[symbol], symbol, compute.meanings, unquoted)
            lines += [f"    {about[0].upper()}{about[1:]}."] if about else []
    lines += ["", "Raises", "------", "ValueError"]
    where = where_it_holds(compute)
    fails = wrapped_words(f"{where[0].upper()}{where[1:]}.", _WIDTH - 8)
    lines += [f"    {line}" for line in fails]
    written = [f'"""{start}', *lines, '"""']
    return [f"    {line}" if line else "" for line in written]


def _body(
    compute: FormulaProgram, names: Mapping[sp.Symbol, str], identifiers: Identifiers
) -> tuple[list[str], list[str], str]:
    """Lines that compute the results, their names, and the name for where they hold."""
    printer = _PythonPrinter(names)
    lines: list[str] = []
    for assignment in compute.assignments:
        lines += assigned(names[assignment.symbol], printer.write(assignment.expression), _WIDTH)
    targets = [identifiers.take(name) for name in ("K", "dK")[: len(compute.results)]]
    shape = identifiers.take("shape")
    shapes = ", ".join(f"{names[symbol]}.shape" for symbol in compute.arguments)
    lines += assigned(shape, f"np.broadcast_shapes({shapes})", _WIDTH)
    for target, matrix in zip(targets, compute.results, strict=True):
        lines += _filled(target, shape, matrix, printer)
    holds = identifiers.take("holds")
    return lines + _guard(compute, targets, printer, holds), targets, holds


def _guard(
    compute: FormulaProgram, targets: list[str], printer: _PythonPrinter, holds: str
) -> list[str]:
    """Lines that find where the result is finite, and its denominators and conditions are good."""
    lines = []
    for i, target in enumerate(targets):
        kept = f"{holds} & " if i else ""
        lines.append(f"    {holds} = {kept}np.isfinite({target}).all(axis=(-2, -1))")
    for test in checks_of(compute, printer.write, "np.abs"):
        lines += assigned(holds, f"{holds} & ({test})", _WIDTH)
    return lines


def _finite(arguments: list[str], holds: str, given: str) -> list[str]:
    """Lines that refuse arguments that are not finite where K is, as 1/k of an infinite k."""
    if not arguments:
        return []
    given_values = ", ".join(arguments) + "," * (len(arguments) == 1)
    every = wrapped_formula(f"{given_values}):", _WIDTH, f"    for {given} in (", " " * 8)
    return [*every, f"        {holds} = {holds} & np.isfinite({given})"]


def _refusal(holds: str, bad: str) -> list[str]:
    return [
        f"    if not np.all({holds}):",
        f"        {bad} = np.size({holds}) - np.count_nonzero({holds})",
        f'        raise ValueError(f"the formula does not hold at {{{bad}}} of '
        f'{{np.size({holds})}} points")',
    ]


def _filled(K: str, shape: str, matrix: sp.ImmutableMatrix, printer: _PythonPrinter) -> list[str]:
    """A matrix made of zeros, its other entries assigned one by one."""
    lines = [f"    {K} = np.zeros((*{shape}, {matrix.rows}, {matrix.rows}))"]
    for place, expression in filled(matrix, lambda i, j: f"{K}[..., {i}, {j}]", printer.write):
        lines += assigned(place, expression, _WIDTH)
    return lines


class _PythonPrinter(CodePrinter):
    """Printer of NumPy code, with NumPy imported as np."""

    def integer(self, value: int) -> str:
        return str(value)

    def call(self, function: str, arguments: list[str]) -> str:
        return f"np.{_NUMPY_NAMES.get(function, function)}({', '.join(arguments)})"

    def constant(self, name: str) -> str:
        return f"np.{name}"

    def power(self, base: Any, exponent: Any) -> str:
        written = self.factor(base)
        return f"{f'({written})' if base.is_Pow else written}**{self.factor(exponent)}"
