"""Functions of C, Python, Julia and MATLAB, one template each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.code import NO_ANSWER, Code, unquoted
from robostiff.analytic.export.entries import symbols_of
from robostiff.analytic.export.program import FormulaProgram
from robostiff.analytic.export.vocabulary import (
    C_WORDS,
    JULIA_WORDS,
    MATLAB_WORDS,
    PYTHON_WORDS,
)
from robostiff.errors import InputError


def c_function(derivation: Any, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function in C99.

    Parameters
    ----------
    derivation : Formula
        No derivative.
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
    >>> import sympy as sp
    >>> from robostiff.analytic import Derivation
    >>> k, d = sp.symbols("k d")
    >>> K = sp.ImmutableMatrix([[k, 0, 0], [0, 0, 0], [0, 0, k * d**2 / 3]])
    >>> lines = c_function(Derivation("K_C", K, (), K)).splitlines()
    >>> print("\n".join(lines[16:23]))
    int stiffness(double *restrict K_out, const double *restrict p)
    {
        const double d = p[0];
        const double k = p[1];
        double K[9] = {0.0};
        K[0] = k;
        K[8] = (1.0/3.0)*(d*d)*k;
    """
    refuse_derivative(derivation)
    return _C(derivation, name).source()


def refuse_derivative(derivation: Any) -> None:
    """For languages in which derivatives are not written.

    Raises
    ------
    InputError
        When it is a derivative.
    """
    if isinstance(derivation, FormulaDerivative):
        raise InputError(
            "derivation",
            got=f"the derivative {derivation.name}",
            expected="a derivation",
            hint="python_function and the printed forms write derivatives",
        )


def python_function(derivation: Any, name: str = "stiffness") -> str:
    r"""A derivation as the source of a Python module with one function, which needs only NumPy.

    Parameters
    ----------
    derivation : Formula
        The function returns its matrix, or the pair K, dK of a derivative.
    name : str
        Name of the function. Its arguments are the given symbols, in alphabetical order; they may
        be numbers or arrays that broadcast, and the result has shape (..., n, n). It raises a
        ValueError where the formula does not hold.

    Returns
    -------
    str
        Named intermediates keep their names, what occurs more than once is computed once.

    Raises
    ------
    InputError
        When the name is no identifier, or an expression is not of the vocabulary.

    Examples
    --------
    >>> import sympy as sp
    >>> from robostiff.analytic import Derivation
    >>> k, d = sp.symbols("k lambda")
    >>> K = sp.ImmutableMatrix([[k, 0, k * d], [0, 0, 0], [k * d, 0, k * d**2 / 3]])
    >>> lines = python_function(Derivation("K_C", K, (), K)).splitlines()
    >>> lines[6], lines[-14], lines[-11]
    ('def stiffness(k, lambda_):', '    t1 = k*lambda_', '    K[..., 0, 0] = k')
    """
    return _Python(derivation, name).source()


def julia_function(derivation: Any, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function of Julia, which needs no package.

    As `python_function`; its arguments are one number each, of any real type. Where the formula
    does not hold, it throws a DomainError.

    Examples
    --------
    >>> import sympy as sp
    >>> from robostiff.analytic import Derivation
    >>> k, d = sp.symbols("k d")
    >>> K = sp.ImmutableMatrix([[k, 0, 0], [0, 0, 0], [0, 0, k * d**2 / 3]])
    >>> lines = julia_function(Derivation("K_C", K, (), K)).splitlines()
    >>> print("\n".join(lines[-6:-2]))
        K[1, 1] = k
        K[3, 3] = (1/3)*d^2*k
        holds = all(isfinite, (d, k)) && all(isfinite, K)
        holds || throw(DomainError((d, k), "the formula does not hold at these values"))
    """
    return _Julia(derivation, name).source()


def matlab_function(derivation: Any, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function of MATLAB, which Octave takes as well.

    As `python_function`; the name of ``K = name(...)``, or ``[K, dK] = name(...)`` of a
    derivative, is also that of its file, ``name.m``, and its arguments are one number each. Where
    the formula does not hold, it raises the error ``robostiff:formula``.

    Examples
    --------
    >>> import sympy as sp
    >>> from robostiff.analytic import Derivation
    >>> k, d = sp.symbols("k d")
    >>> K = sp.ImmutableMatrix([[k, 0, 0], [0, 0, 0], [0, 0, k * d**2 / 3]])
    >>> lines = matlab_function(Derivation("K_C", K, (), K)).splitlines()
    >>> print("\n".join([lines[0], *lines[-7:-4]]))
    function K = stiffness(d, k)
    K(1, 1) = k;
    K(3, 3) = (1/3)*d^2*k;
    holds = all(isfinite([d, k])) && all(isfinite(K(:)));
    """
    return _Matlab(derivation, name).source()


def source_of_values(compute: FormulaProgram, order: Sequence[int]) -> str:
    """Source of ``formula`` in Python, which refuses nothing.

    It returns K (and dK), where their entries and its arguments are finite, and a tuple of the
    `margins` of the code. Its arguments, arrays, are those of the program in the given `order`.
    """
    code = _Python(compute, "formula")
    margins = "".join(f"{x}, " for x in code.margins())
    returned = ", ".join((*code.results, code.words["holds"], "margins"))
    lines = [
        *("import numpy as np", "", '@np.errstate(all="ignore")'),
        *code.signature([code.arguments[place] for place in order]),
        *(*code.steps(), *code.finite(), f"    margins = ({margins.rstrip()})"),
        f"    return {returned}",
    ]
    return "\n".join([*lines, ""])


class _C(Code):
    """All numbers are doubles; small powers of a symbol are products."""

    name_of_language, reserved, own = "C", C_WORDS, ("p", "K_out", "i")
    size, zero, pi, e = "fabs", "0.0", "3.14159265358979323846", "2.71828182845904523536"
    entry, declared, functions = "{}[{n}]", "const double {}", {"abs": "fabs"}
    zeros, fails, indent = "    double @M@[@nn@] = {0.0};", "Returns 0; 1, and writes nothing,", 3
    template = """\
/*
 * <<comment>>
 */
#include <math.h>

int @name@(double *restrict @K_out@, const double *restrict @p@);

int @name@(double *restrict @K_out@, const double *restrict @p@)
{
    <<given>>
<<steps>>
    int @holds@ = 1;
    <<finite>>
<<tests>>
    if (@holds@)
        for (int @i@ = 0; @i@ < @nn@; ++@i@) @K_out@[@i@] = @K@[@i@];
    return !@holds@;
}"""

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__(derivation, name)
        self.subject = f"{self.words['K_out']}, {self.n} x {self.n}, row after row,"

    def _print_Integer(self, expr: Any) -> str:
        return f"{expr}.0"

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        if base.is_Symbol and exponent.is_Integer and exponent <= 4:
            return f"({'*'.join([self._print(base)] * int(exponent))})"
        return self.call("pow", [self._print(base), self._print(exponent)])

    def assigned(self, target: str, expression: str) -> list[str]:
        return wrapped_formula(f"{expression};", self.width, f"    {target} = ", " " * 8)

    def of_arguments(self) -> list[str]:
        given, p = self.compute.arguments, self.words["p"]
        if not given:
            return [f"{p} is not used and may be null."]
        order = [f"{p}[{i}] {self.plain(x.name)}" for i, x in enumerate(given)]
        about = [self.about(x.name, x) for x in given]
        if not any(about):
            return wrapped_words(f"Values: {', '.join(order)}.", self.width - 3)
        each = zip(order, about, strict=True)
        return ["Values:", *(f"  {own}: {words}".removesuffix(": ") for own, words in each)]

    def given(self) -> list[str]:
        p, compute = self.words["p"], self.compute
        beside = [x for _, x, _ in compute.conditions]
        used = symbols_of([compute.entries, *(a.expression for a in compute.assignments), *beside])
        each = enumerate(compute.arguments)
        numbers = [f"const double {self._names[x]} = {p}[{i}];" for i, x in each if x in used]
        return numbers if self.arguments else [f"(void){p};"]

    def finite(self) -> list[str]:
        i, holds, given = self.words["i"], self.words["holds"], len(self.arguments)
        each = [(self.words["p"], given)] * bool(given) + [(self.results[0], self.n**2)]
        test = f"for (int {i} = 0; {i} < {{n}}; ++{i}) {holds} = {holds} && isfinite({{x}}[{i}]);"
        return [test.format(x=x, n=n) for x, n in each]


class _Python(Code):
    """NumPy, imported as np."""

    name_of_language, reserved, own = "Python", PYTHON_WORDS, ("shape", "given", "bad")
    size, pi, e, indent, fails = "np.abs", "np.pi", "np.e", 8, "ValueError"
    entry, both, plain = "{}[..., {i}, {j}]", "{} & ({})", staticmethod(unquoted)
    each, every = "np.isfinite({}).all(axis=(-2, -1))", " & "
    zeros = "    @M@ = np.zeros((*@shape@, @n@, @n@))"
    head, colon = "def @name@(", ":"
    template = """\
\"\"\"A stiffness matrix as a function of its symbols.\"\"\"

import numpy as np


@np.errstate(all="ignore")
<<signature>>
    <<docstring>>
    <<given>>
<<steps>>
<<finite>>
<<tests>>
    if not np.all(@holds@):
        @bad@ = np.size(@holds@) - np.count_nonzero(@holds@)
        raise ValueError(f"the formula does not hold at {@bad@} of {np.size(@holds@)} points")
    return @results@"""

    def call(self, function: str, arguments: list[str]) -> str:
        is_arc = function.startswith("a") and function != "abs"
        return f"np.{f'arc{function[1:]}' if is_arc else function}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any, sign: str = "**") -> str:
        return super().power(base, exponent, sign)

    def given(self) -> list[str]:
        return [f"{x} = np.asarray({x}, dtype=float)" for x in self.arguments]

    def steps(self) -> list[str]:
        # Intermediates first, then the matrices, of which the shape is that of the arguments.
        lines = super().steps()
        shapes = ", ".join(f"{x}.shape" for x in self.arguments)
        place = lines.index(next(self.filled(self.zeros.replace("@M@", self.results[0]))))
        shape = self.assigned(self.words["shape"], f"np.broadcast_shapes({shapes})")
        return [*lines[:place], *shape, *lines[place:]]

    def of_arguments(self) -> list[str]:
        lines = ["Parameters", "----------"] if self.arguments else []
        for x, symbol in zip(self.arguments, self.compute.arguments, strict=True):
            about = self.about(x, symbol)
            lines.append(f"{x} : float or array")
            lines += [f"    {about[0].upper()}{about[1:]}."] if about else []
        return lines

    def docstring(self) -> list[str]:
        """The comment, with where it raises as a section."""
        shape = f"(..., {self.n}, {self.n}){' each' if len(self.results) > 1 else ''}"
        start, *lines = self.comment(shape)
        place = max(i for i, line in enumerate(lines) if line.startswith(self.fails))
        words = " ".join(lines[place:]).removeprefix(f"{self.fails} ")
        fails = wrapped_words(f"{words[0].upper()}{words[1:]}", self.width - self.indent)
        raises = ("Raises", "------", self.fails, *(f"    {line}" for line in fails))
        return [f'"""{start}', *lines[:place], *raises, '"""']

    def finite(self) -> list[str]:
        holds, given, lines = self.words["holds"], self.words["given"], super().finite()
        if not self.arguments:
            return lines
        # K may be finite where an argument is not, as 1/k of an infinite k.
        values = f"{_tuple(self.arguments)[1:]}:"
        lines += wrapped_formula(values, self.width, f"    for {given} in (", " " * 8)
        return [*lines, f"        {holds} = {holds} & np.isfinite({given})"]


def _tuple(values: Sequence[str]) -> str:
    return f"({', '.join(values)}{',' * (len(values) == 1)})"


class _Julia(Code):
    """Julia's own functions throw where the result is not real."""

    name_of_language, reserved, own, width, indent = "Julia", JULIA_WORDS, ("T",), 92, 0
    entry, functions, each = "{}[{I}, {J}]", {"atan2": "atan"}, "all(isfinite, {})"
    zeros, fails = "    @M@ = zeros(@T@, @n@, @n@)", "A `DomainError` is thrown"
    head = "function @name@("
    template = """\
\"\"\"
<<usage>>

<<comment>>
\"\"\"
<<signature>>
<<given>>
<<steps>>
<<finite>>
<<tests>>
<<refusal>>
    return @results@
end"""

    def _listed(self, first: str, rest: str = "    ", sign: str = ", ") -> list[str]:
        return wrapped_formula(f"{sign.join(self.arguments)})", self.width, first, rest)

    def usage(self) -> list[str]:
        """How it is called."""
        return self._listed(f"    {self.words['name']}(", " " * 8)

    def of_arguments(self) -> list[str]:
        each = (line.partition(":") for line in super().of_arguments())
        return [f"- `{x}`:{words}" for x, _, words in each]

    def given(self) -> list[str]:
        kind = self.words["T"]
        if not self.arguments:
            return [f"    {kind} = Float64"]
        # Powers of integers could overflow.
        numbers = [f"    {x} = float({x})" for x in self.arguments]
        return numbers + self._listed(f"    {kind} = typeof(", " " * 8, " + ")

    def checked(self) -> list[str]:
        return [*([_tuple(self.arguments)] if self.arguments else []), *self.results]

    def refusal(self) -> list[str]:
        """Lines that throw."""
        thrown = f'{_tuple(self.arguments)}, "{NO_ANSWER}"))'
        start = f"    {self.words['holds']} || throw(DomainError("
        return wrapped_formula(thrown, self.width, start, " " * 8)


# Functions that leave the real numbers: outside their domain they give NaN, which is refused.
_DOMAINS = {
    "sqrt": ("x >= 0", "sqrt(x)"),
    "log": ("x >= 0", "log(x)"),
    "asin": ("abs(x) <= 1", "asin(x)"),
    "acos": ("abs(x) <= 1", "acos(x)"),
    "power": ("x >= 0", "x^y"),
}


class _Matlab(Code):
    """Numbers are doubles; functions that may become complex have a real one of their own."""

    name_of_language, reserved, longest = "MATLAB", MATLAB_WORDS, 63
    entry, zeros = "{}({I}, {J})", "@M@ = zeros(@n@, @n@);"
    fails, head = "It raises the error robostiff:formula", "function @left@ = @name@("
    template = """\
<<signature>>
%<<comment>>

<<steps>>
<<finite>>
<<tests>>
if ~@holds@
    error('robostiff:formula', '@answer@');
end
end
<<domains>>"""

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__(derivation, name)
        self.functions: dict[str, str] = {}  # pyright: ignore[reportIncompatibleVariableOverride]

    def call(self, function: str, arguments: list[str]) -> str:
        if function in _DOMAINS and function not in self.functions:
            self.functions[function] = self.identifiers.take(f"real_{function}")
        return super().call(function, arguments)

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        if not exponent.is_Integer:
            return self.call("power", [self._print(base), self._print(exponent)])
        return super().power(base, exponent, sign)

    def assigned(self, target: str, expression: str) -> list[str]:
        return self.broken(f"{expression};", f"{target} = ")

    def broken(self, text: str, start: str) -> list[str]:
        lines = wrapped_formula(text, self.width - 4, start, " " * 4)
        return [*(f"{line} ..." for line in lines[:-1]), lines[-1]]

    def comment(self, shape: str = "") -> list[str]:
        first, *others = super().comment(shape)
        return [f"{self.words['NAME']} {first}", *(f"   {line}" for line in others)]

    def checked(self) -> list[str]:
        of = [f"[{', '.join(self.arguments)}]"] if self.arguments else []
        return [*of, *(f"{K}(:)" for K in self.results)]

    def domains(self) -> list[str]:
        """Functions of real numbers."""
        lines = []
        for function, own in self.functions.items():
            inside, value = _DOMAINS[function]
            arguments = "x, y" if function == "power" else "x"
            lines += ["", f"function z = {own}({arguments})", "z = NaN;", f"if {inside}"]
            lines += [f"    z = {value};", "end", "end"]
        return lines
