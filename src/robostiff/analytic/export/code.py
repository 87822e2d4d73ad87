"""A derivation as a function of C, Python, Julia and MATLAB: one class a language."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.code_printer import NO_ANSWER, Code, unquoted
from robostiff.analytic.export.entries import symbols_of
from robostiff.analytic.export.outline import refuse_derivative
from robostiff.analytic.export.program import FormulaProgram
from robostiff.analytic.export.vocabulary import C_WORDS, JULIA_WORDS, MATLAB_WORDS, PYTHON_WORDS


def c_function(derivation: Any, name: str = "stiffness") -> str:
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
    >>> from robostiff.analytic import Derivation
    >>> import sympy as sp
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


def python_function(derivation: Any, name: str = "stiffness") -> str:
    r"""A derivation as the source of a Python module with one function, which needs only NumPy.

    Parameters
    ----------
    derivation : Derivation, FormulaDerivative or ComplianceSteps
        The function returns K, or the pair K, dK of a derivative.
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
    >>> from robostiff.analytic import Derivation
    >>> import sympy as sp
    >>> k, d = sp.symbols("k lambda")
    >>> K = sp.ImmutableMatrix([[k, 0, k * d], [0, 0, 0], [k * d, 0, k * d**2 / 3]])
    >>> lines = python_function(Derivation("K_C", K, (), K)).splitlines()
    >>> lines[6], lines[-14], lines[-11]
    ('def stiffness(k, lambda_):', '    t1 = k*lambda_', '    K[..., 0, 0] = k')
    """
    return _Python(derivation, name).source()


def julia_function(derivation: Any, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function of Julia, which needs no package.

    Parameters
    ----------
    derivation : Derivation, FormulaDerivative or ComplianceSteps
    name : str
        Name of the function; it returns K, or the pair K, dK of a derivative. Its arguments are
        the given symbols, in alphabetical order, each one number of any real type. Where the
        formula does not hold, it throws a DomainError.

    Raises
    ------
    InputError
        When the name is no identifier, or an expression is not of the vocabulary.

    Examples
    --------
    >>> from robostiff.analytic import Derivation
    >>> import sympy as sp
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

    Parameters
    ----------
    derivation : Derivation, FormulaDerivative or ComplianceSteps
    name : str
        Name of the function ``K = name(...)``, or ``[K, dK] = name(...)`` of a derivative; also
        that of its file, ``name.m``. Its arguments are the given symbols, in alphabetical order,
        each one number. Where the formula does not hold, it raises the error
        ``robostiff:formula``.

    Raises
    ------
    InputError
        When the name is no identifier, or an expression is not of the vocabulary.

    Examples
    --------
    >>> from robostiff.analytic import Derivation
    >>> import sympy as sp
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
    arguments = ", ".join(code.arguments[place] for place in order)
    margins = ", ".join(code.margins())
    lines = [*code.steps(), *code.finite(), f"    margins = ({margins}{',' * bool(margins)})"]
    returned = ", ".join((*code.results, code.holds, "margins"))
    head = ["import numpy as np", "", *code.head("formula", arguments)]
    return "\n".join([*head, *lines, f"    return {returned}", ""])


class _C(Code):
    """All numbers are doubles; small powers of a symbol are products."""

    language = "C"
    words = C_WORDS
    size, zero = "fabs", "0.0"

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__(derivation, name)
        self.p, self.out, self.i = map(self.identifiers.take, ("p", "K_out", "i"))

    def integer(self, value: int) -> str:
        return f"{value}.0"

    def call(self, function: str, arguments: list[str]) -> str:
        return f"{'fabs' if function == 'abs' else function}({', '.join(arguments)})"

    def constant(self, name: str) -> str:
        return {"pi": "3.14159265358979323846", "e": "2.71828182845904523536"}[name]

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        if base.is_Symbol and exponent.is_Integer and exponent <= 4:
            return f"({'*'.join([self.factor(base)] * int(exponent))})"
        return self.call("pow", [self.write(base), self.write(exponent)])

    def assigned(self, target: str, expression: str) -> list[str]:
        return wrapped_formula(f"{expression};", self.width, f"    {target} = ", " " * 8)

    def declared(self, name: str) -> str:
        return f"const double {name}"

    def place(self, K: str, i: int, j: int, n: int) -> str:
        return f"{K}[{n * i + j}]"

    def zeros(self, K: str, n: int) -> list[str]:
        return [f"    double {K}[{n * n}] = {{0.0}};"]

    def of_arguments(self) -> list[str]:
        given = self.compute.arguments
        if not given:
            return [f"{self.p} is not used and may be null."]
        order = [f"{self.p}[{i}] {self.plain(x.name)}" for i, x in enumerate(given)]
        about = [self.about(x.name, x) for x in given]
        if not any(about):
            return wrapped_words(f"Values: {', '.join(order)}.", self.width - 3)
        each = zip(order, about, strict=True)
        return ["Values:", *(f"  {own}: {words}".removesuffix(": ") for own, words in each)]

    def beginning(self) -> list[str]:
        n, p, given = self.compute.entries.rows, self.p, self.compute.arguments
        subject = f"{self.out}, {n} x {n}, row after row,"
        comment = self.comment(subject, "Returns 0; 1, and writes nothing,", 3)
        signature = f"int {self.name}(double *restrict {self.out}, const double *restrict {p})"
        beside = [x for _, x, _ in self.compute.conditions]
        steps = [a.expression for a in self.compute.assignments]
        used = symbols_of([self.compute.entries, *steps, *beside])
        numbers = enumerate(zip(self.arguments, given, strict=True))
        return [
            *("/*", *(f" * {line}".rstrip() for line in comment), " */"),
            *("#include <math.h>", "", f"{signature};", "", signature, "{"),
            *(f"    const double {x} = {p}[{i}];" for i, (x, symbol) in numbers if symbol in used),
            *([] if given else [f"    (void){p};"]),
        ]

    def finite(self) -> list[str]:
        i, holds, given = self.i, self.holds, len(self.arguments)
        each = [(self.p, given)] * bool(given) + [(self.results[0], self.compute.entries.rows**2)]
        loops = (
            f"    for (int {i} = 0; {i} < {n}; ++{i}) {holds} = {holds} && isfinite({x}[{i}]);"
            for x, n in each
        )
        return [f"    int {holds} = 1;", *loops]

    def end(self) -> list[str]:
        i, n = self.i, self.compute.entries.rows
        copied = f"{self.out}[{i}] = {self.results[0]}[{i}];"
        return [
            f"    if ({self.holds})",
            f"        for (int {i} = 0; {i} < {n * n}; ++{i}) {copied}",
            f"    return !{self.holds};",
            "}",
        ]


class _Python(Code):
    """NumPy, imported as np."""

    language = "Python"
    words = PYTHON_WORDS
    size = "np.abs"

    def call(self, function: str, arguments: list[str]) -> str:
        names = {"acos": "arccos", "asin": "arcsin", "atan": "arctan", "atan2": "arctan2"}
        return f"np.{names.get(function, function)}({', '.join(arguments)})"

    def constant(self, name: str) -> str:
        return f"np.{name}"

    def power(self, base: Any, exponent: Any, sign: str = "**") -> str:
        return super().power(base, exponent, sign)

    def integer(self, value: int) -> str:
        return str(value)

    @staticmethod
    def plain(name: str) -> str:
        return unquoted(name)

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__(derivation, name)
        self.shape, self.given, self.bad = map(self.identifiers.take, ("shape", "given", "bad"))

    def both(self, test: str) -> str:
        return f"{self.holds} & ({test})"

    def place(self, K: str, i: int, j: int, n: int) -> str:
        return f"{K}[..., {i}, {j}]"

    def zeros(self, K: str, n: int) -> list[str]:
        shapes = ", ".join(f"{x}.shape" for x in self.arguments)
        shape = self.assigned(self.shape, f"np.broadcast_shapes({shapes})")
        first = self.results[0] == K
        return [*shape * first, f"    {K} = np.zeros((*{self.shape}, {n}, {n}))"]

    def head(self, name: str, arguments: str) -> list[str]:
        """The line of the definition."""
        signature = wrapped_formula(f"{arguments}):", self.width, f"def {name}(")
        return ['@np.errstate(all="ignore")', *signature]

    def of_arguments(self) -> list[str]:
        lines = ["Parameters", "----------"] if self.arguments else []
        for x, symbol in zip(self.arguments, self.compute.arguments, strict=True):
            about = self.about(x, symbol)
            lines.append(f"{x} : float or array")
            lines += [f"    {about[0].upper()}{about[1:]}."] if about else []
        return lines

    def beginning(self) -> list[str]:
        n, each = self.compute.entries.rows, " each" if len(self.results) > 1 else ""
        start, *lines = self.comment("It", "ValueError", 8, f"(..., {n}, {n}){each}")
        place = max(i for i, line in enumerate(lines) if line.startswith("ValueError"))
        words = " ".join(lines[place:]).removeprefix("ValueError ")
        fails = wrapped_words(f"{words[0].upper()}{words[1:]}", self.width - 8)
        docstring = [
            *(f'"""{start}', *lines[:place], "Raises", "------", "ValueError"),
            *(*(f"    {line}" for line in fails), '"""'),
        ]
        return [
            *('"""A stiffness matrix as a function of its symbols."""', ""),
            *("import numpy as np", "", ""),
            *self.head(self.name, ", ".join(self.arguments)),
            *(f"    {line}" if line else "" for line in docstring),
            *(f"    {x} = np.asarray({x}, dtype=float)" for x in self.arguments),
        ]

    def finite(self) -> list[str]:
        holds, given = self.holds, self.given
        each = [f"np.isfinite({K}).all(axis=(-2, -1))" for K in self.results]
        lines = self.assigned(holds, " & ".join(each))
        if not self.arguments:
            return lines
        # K may be finite where an argument is not, as 1/k of an infinite k.
        values = ", ".join(self.arguments) + "," * (len(self.arguments) == 1)
        lines += wrapped_formula(f"{values}):", self.width, f"    for {given} in (", " " * 8)
        return [*lines, f"        {holds} = {holds} & np.isfinite({given})"]

    def end(self) -> list[str]:
        holds, bad = self.holds, self.bad
        return [
            f"    if not np.all({holds}):",
            f"        {bad} = np.size({holds}) - np.count_nonzero({holds})",
            f'        raise ValueError(f"the formula does not hold at {{{bad}}} of '
            f'{{np.size({holds})}} points")',
            f"    return {', '.join(self.results)}",
        ]


class _Julia(Code):
    """Julia's own functions throw where the result is not real."""

    language = "Julia"
    words = JULIA_WORDS
    width = 92

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__(derivation, name)
        self.kind = self.identifiers.take("T")
        values = ", ".join(self.arguments) + "," * (len(self.arguments) == 1)
        self.values = f"({values})"

    def call(self, function: str, arguments: list[str]) -> str:
        return f"{'atan' if function == 'atan2' else function}({', '.join(arguments)})"

    def place(self, K: str, i: int, j: int, n: int) -> str:
        return f"{K}[{i + 1}, {j + 1}]"

    def zeros(self, K: str, n: int) -> list[str]:
        return [f"    {K} = zeros({self.kind}, {n}, {n})"]

    def of_arguments(self) -> list[str]:
        each = (line.partition(":") for line in super().of_arguments())
        return [f"- `{x}`:{words}" for x, _, words in each]

    def beginning(self) -> list[str]:
        given = f"{', '.join(self.arguments)})"
        lines = [
            *('"""', *wrapped_formula(given, self.width, f"    {self.name}(", " " * 8), ""),
            *(*self.comment("It", "A `DomainError` is thrown"), '"""'),
            *wrapped_formula(given, self.width, f"function {self.name}("),
        ]
        if not self.arguments:
            return [*lines, f"    {self.kind} = Float64"]
        # Powers of integers could overflow.
        lines += [f"    {x} = float({x})" for x in self.arguments]
        total = f"{' + '.join(self.arguments)})"
        return lines + wrapped_formula(total, self.width, f"    {self.kind} = typeof(", " " * 8)

    def finite(self) -> list[str]:
        each = ([self.values] if self.arguments else []) + self.results
        return self.assigned(self.holds, " && ".join(f"all(isfinite, {x})" for x in each))

    def end(self) -> list[str]:
        thrown = f'{self.values}, "{NO_ANSWER}"))'
        start = f"    {self.holds} || throw(DomainError("
        refusal = wrapped_formula(thrown, self.width, start, " " * 8)
        return [*refusal, f"    return {', '.join(self.results)}", "end"]


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

    language = "MATLAB"
    words = MATLAB_WORDS
    longest = 63

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__(derivation, name)
        self._real: dict[str, str] = {}

    def call(self, function: str, arguments: list[str]) -> str:
        if function in _DOMAINS:
            if function not in self._real:
                self._real[function] = self.identifiers.take(f"real_{function}")
            function = self._real[function]
        return f"{function}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        if not exponent.is_Integer:
            return self.call("power", [self.write(base), self.write(exponent)])
        return super().power(base, exponent, sign)

    def assigned(self, target: str, expression: str) -> list[str]:
        return self._continued(f"{expression};", f"{target} = ")

    def _continued(self, text: str, first: str) -> list[str]:
        lines = wrapped_formula(text, self.width - 4, first, " " * 4)
        return [*(f"{line} ..." for line in lines[:-1]), lines[-1]]

    def place(self, K: str, i: int, j: int, n: int) -> str:
        return f"{K}({i + 1}, {j + 1})"

    def zeros(self, K: str, n: int) -> list[str]:
        return [f"{K} = zeros({n}, {n});"]

    def beginning(self) -> list[str]:
        results = ", ".join(self.results)
        left = results if len(self.results) == 1 else f"[{results}]"
        start = f"function {left} = {self.name}("
        first, *others = self.comment("It", "It raises the error robostiff:formula", 4)
        return [
            *self._continued(f"{', '.join(self.arguments)})", start),
            f"%{self.name.upper()} {first}",
            *(f"%   {line}".rstrip() for line in others),
            "",
        ]

    def finite(self) -> list[str]:
        of = [f"[{', '.join(self.arguments)}]"] if self.arguments else []
        each = (f"all(isfinite({x}))" for x in (*of, *(f"{K}(:)" for K in self.results)))
        return self.assigned(self.holds, " && ".join(each))

    def end(self) -> list[str]:
        refusal = f"    error('robostiff:formula', '{NO_ANSWER}');"
        lines = [f"if ~{self.holds}", refusal, "end", "end"]
        for function, own in self._real.items():
            inside, value = _DOMAINS[function]
            arguments = "x, y" if function == "power" else "x"
            lines += ["", f"function z = {own}({arguments})", "z = NaN;", f"if {inside}"]
            lines += [f"    z = {value};", "end", "end"]
        return lines
