"""Functions of C, Python, Julia and MATLAB, one template each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robostiff.analytic.calculus import FormulaDerivative
from robostiff.analytic.export.code import NO_ANSWER, Code, unquoted
from robostiff.analytic.export.entries import symbols_of
from robostiff.analytic.export.language import wrapped_formula, wrapped_words
from robostiff.analytic.export.program import FormulaProgram
from robostiff.analytic.export.vocabulary import C_WORDS, JULIA_WORDS, MATLAB_WORDS, PYTHON_WORDS
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
    returned = ", ".join((*code.results, code.holds, "margins"))
    listed = ", ".join(code.arguments[place] for place in order)
    lines = [
        *("import numpy as np", "", '@np.errstate(all="ignore")'),
        *code.broken(f"{listed}):", "def formula("),
        *code.body(),
        *(f"    margins = ({margins.rstrip()})", f"    return {returned}"),
    ]
    return "\n".join([*lines, ""])


class _C(Code):
    """All numbers are doubles; small powers of a symbol are products."""

    name_of_language, reserved, own, indent = "C", C_WORDS, ("p", "K_out", "i"), 3
    size, zero, pi, e = "fabs", "0.0", "3.14159265358979323846", "2.71828182845904523536"
    entry, declared, functions = "{}[{n}]", "const double {}", {"abs": "fabs"}

    def lines(self) -> list[str]:
        (p, K_out, i), (K,), holds, nn = self.others, self.results, self.holds, self.n**2
        given, names = self.compute.arguments, list(enumerate(self.arguments))
        beside = [x for _, x, _ in self.compute.conditions]
        steps = (a.expression for a in self.compute.assignments)
        used = symbols_of([self.compute.entries, *steps, *beside])
        numbers = [f"    const double {x} = {p}[{k}];" for k, x in names if given[k] in used]
        of = [f"{p} is not used and may be null."]
        if given:
            order = [f"{p}[{k}] {self.plain(x.name)}" for k, x in enumerate(given)]
            meanings = self.compute.meanings
            words = [self.plain(own) if (own := meanings.get(x.name)) else "" for x in given]
            pairs = zip(order, words, strict=True)
            of = ["Values:", *(f"  {x}: {own}".removesuffix(": ") for x, own in pairs)]
            if not any(words):
                of = wrapped_words(f"Values: {', '.join(order)}.", self.width - 3)
        fails, subject = (
            "Returns 0; 1, and writes nothing,",
            f"{K_out}, {self.n} x {self.n}, row after row,",
        )
        head = f"int {self.name}(double *restrict {K_out}, const double *restrict {p})"
        finite = [(p, len(given))] * bool(given) + [(K, nn)]
        loop = f"for (int {i} = 0; {i} < {{}}; ++{i})"
        return [
            *("/*", *(f" * {x}" for x in self.comment(fails, of, subject)), " */"),
            *("#include <math.h>", "", f"{head};", "", head, "{"),
            *(numbers if given else [f"    (void){p};"]),
            *self.intermediates(),
            *self.matrices(f"    double {{}}[{nn}] = {{{{0.0}}}};"),
            f"    int {holds} = 1;",
            *(f"    {loop.format(n)} {holds} = {holds} && isfinite({x}[{i}]);" for x, n in finite),
            *self.tests(),
            *(f"    if ({holds})", f"        {loop.format(nn)} {K_out}[{i}] = {K}[{i}];"),
            *(f"    return !{holds};", "}"),
        ]

    def _print_Integer(self, expr: Any) -> str:
        return f"{expr}.0"

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        if base.is_Symbol and exponent.is_Integer and exponent <= 4:
            return f"({'*'.join([self._print(base)] * int(exponent))})"
        return self.call("pow", [self._print(base), self._print(exponent)])

    def assigned(self, target: str, expression: str) -> list[str]:
        return self.broken(f"{expression};", f"    {target} = ", " " * 8)


class _Python(Code):
    """NumPy, imported as np."""

    name_of_language, reserved, own = "Python", PYTHON_WORDS, ("shape", "given", "bad")
    size, pi, e, indent = "np.abs", "np.pi", "np.e", 8
    entry, both, plain = "{}[..., {i}, {j}]", "{} & ({})", staticmethod(unquoted)

    def lines(self) -> list[str]:
        holds, bad = self.holds, self.others[2]
        points = f"{{{bad}}} of {{np.size({holds})}} points"
        return [
            '"""A stiffness matrix as a function of its symbols."""',
            *("", "import numpy as np", "", "", '@np.errstate(all="ignore")'),
            *self.broken(f"{', '.join(self.arguments)}):", f"def {self.name}("),
            *(f"    {x}" for x in self.docstring()),
            *(f"    {x} = np.asarray({x}, dtype=float)" for x in self.arguments),
            *self.body(),
            *self.tests(),
            f"    if not np.all({holds}):",
            f"        {bad} = np.size({holds}) - np.count_nonzero({holds})",
            f'        raise ValueError(f"the formula does not hold at {points}")',
            f"    return {', '.join(self.results)}",
        ]

    def body(self) -> list[str]:
        """Intermediates, matrices, of which the shape is that of the arguments, and `holds`."""
        (shape, given, _), holds, n = self.others, self.holds, self.n
        shapes = ", ".join(f"{x}.shape" for x in self.arguments)
        each = " & ".join(f"np.isfinite({x}).all(axis=(-2, -1))" for x in self.results)
        lines = [
            *self.intermediates(),
            *self.assigned(shape, f"np.broadcast_shapes({shapes})"),
            *self.matrices(f"    {{}} = np.zeros((*{shape}, {n}, {n}))"),
            *self.assigned(holds, each),
        ]
        if self.arguments:
            # K may be finite where an argument is not, as 1/k of an infinite k.
            values = f"{_tuple(self.arguments)[1:]}:"
            lines += self.broken(values, f"    for {given} in (", " " * 8)
            lines.append(f"        {holds} = {holds} & np.isfinite({given})")
        return lines

    def docstring(self) -> list[str]:
        """The comment, arguments and where it raises as sections."""
        of = ["Parameters", "----------"] if self.arguments else []
        for x, words in self.about():
            of += [f"{x} : float or array"]
            of += [f"    {words[0].upper()}{words[1:]}."] if words else []
        shape = f"(..., {self.n}, {self.n}){' each' if len(self.results) > 1 else ''}"
        start, *lines = self.comment("@", of, shape=shape)
        place = max(k for k, line in enumerate(lines) if line.startswith("@"))
        words = f"{self.failure()}."
        fails = wrapped_words(f"{words[0].upper()}{words[1:]}", self.width - self.indent)
        raises = ("Raises", "------", "ValueError", *(f"    {line}" for line in fails))
        return [f'"""{start}', *lines[:place], *raises, '"""']

    def call(self, function: str, arguments: list[str]) -> str:
        is_arc = function.startswith("a") and function != "abs"
        return f"np.{f'arc{function[1:]}' if is_arc else function}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any, sign: str = "**") -> str:
        return super().power(base, exponent, sign)


def _tuple(values: Sequence[str]) -> str:
    return f"({', '.join(values)}{',' * (len(values) == 1)})"


class _Julia(Code):
    """Julia's own functions throw where the result is not real."""

    name_of_language, reserved, own, width, indent = "Julia", JULIA_WORDS, ("T",), 92, 0
    entry, functions = "{}[{I}, {J}]", {"atan2": "atan"}

    def lines(self) -> list[str]:
        (T,), holds, n = self.others, self.holds, self.n
        listed = f"{', '.join(self.arguments)})"
        of = [f"- `{x}`: {words}" for x, words in self.about() if words]
        given = [f"    {T} = Float64"]
        if self.arguments:  # powers of integers could overflow
            given = [f"    {x} = float({x})" for x in self.arguments]
            total = f"{' + '.join(self.arguments)})"
            given += self.broken(total, f"    {T} = typeof(", " " * 8)
        checked = [*([_tuple(self.arguments)] if self.arguments else []), *self.results]
        thrown = f'{_tuple(self.arguments)}, "{NO_ANSWER}"))'
        return [
            *('"""', *self.broken(listed, f"    {self.name}(", " " * 8), ""),
            *(*self.comment("A `DomainError` is thrown", of), '"""'),
            *self.broken(listed, f"function {self.name}("),
            *given,
            *self.intermediates(),
            *self.matrices(f"    {{}} = zeros({T}, {n}, {n})"),
            *self.assigned(holds, " && ".join(f"all(isfinite, {x})" for x in checked)),
            *self.tests(),
            *self.broken(thrown, f"    {holds} || throw(DomainError(", " " * 8),
            *(f"    return {', '.join(self.results)}", "end"),
        ]


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

    name_of_language, reserved, longest, entry = "MATLAB", MATLAB_WORDS, 63, "{}({I}, {J})"

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__(derivation, name)
        self.functions: dict[str, str] = {}  # pyright: ignore[reportIncompatibleVariableOverride]

    def lines(self) -> list[str]:
        first, *others = self.comment("It raises the error robostiff:formula")
        left = self.results[0] if len(self.results) == 1 else f"[{', '.join(self.results)}]"
        head = self.broken(f"{', '.join(self.arguments)})", f"function {left} = {self.name}(")
        checked = [f"[{', '.join(self.arguments)}]"] if self.arguments else []
        checked += [f"{K}(:)" for K in self.results]
        lines = [
            *(*head, f"%{self.name.upper()} {first}", *(f"%   {line}" for line in others), ""),
            *self.intermediates(),
            *self.matrices(f"{{}} = zeros({self.n}, {self.n});"),
            *self.assigned(self.holds, " && ".join(f"all(isfinite({x}))" for x in checked)),
            *self.tests(),
            *(f"if ~{self.holds}", f"    error('robostiff:formula', '{NO_ANSWER}');", "end", "end"),
        ]
        for function, own in self.functions.items():
            inside, value = _DOMAINS[function]
            arguments = "x, y" if function == "power" else "x"
            lines += ["", f"function z = {own}({arguments})", "z = NaN;", f"if {inside}"]
            lines += [f"    z = {value};", "end", "end"]
        return lines

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

    def broken(self, text: str, start: str, rest: str = "    ") -> list[str]:
        lines = wrapped_formula(text, self.width - 4, start, rest)
        return [*(f"{line} ..." for line in lines[:-1]), lines[-1]]
