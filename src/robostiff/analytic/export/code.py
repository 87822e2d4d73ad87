"""A derivation as a function of C, Python, Julia and MATLAB: SymPy's printer, one template each."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np
import sympy as sp
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.precedence import PRECEDENCE

from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.entries import symbols_of
from robostiff.analytic.export.program import LARGE, FormulaProgram, program
from robostiff.analytic.export.vocabulary import (
    C_WORDS,
    JULIA_WORDS,
    MATLAB_WORDS,
    PYTHON_WORDS,
    Identifiers,
    ascii_identifier,
    function_name,
)
from robostiff.errors import InputError
from robostiff.spatial import Space


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


_WORD = re.compile(r"@(\w+)@")
_NO_ANSWER = "the formula does not hold at these values"
_LARGEST = sp.Integer(10) ** 300
_EXACT = 2**53  # integers that are doubles
_FAILS = (
    "where the formula does not hold: where a denominator vanishes up to rounding, "
    "a radicand is negative, or a given value or K is not finite"
)


def plain_text(name: str) -> str:
    """A name inside a comment or a string: printable, without quotes and signs of comments."""
    kept = "".join(c for c in name if c.isascii() and c.isprintable() and c not in '"*\\?%$`#')
    return " ".join(kept.split()) or "without a plain name"


def _unquoted(name: str) -> str:
    """A name inside a string or a comment of Python."""
    kept = "".join(c for c in name if c.isprintable() and c not in '"\\')
    return " ".join(kept.split())


class Code(CodePrinter):
    """A program in a language: its expressions, and the template of a function.

    In a template ``@word@`` stands for a word, and a line that ends with ``<<block>>`` for the
    lines of that block. The template of an entry has the matrix, row i and column j from 0, I and J
    from 1, and the place n.
    """

    name_of_language: ClassVar[str]
    reserved: ClassVar[frozenset[str]]  # identifiers that must not be defined
    own: ClassVar[tuple[str, ...]] = ()  # further identifiers of the template
    longest: ClassVar[int | None] = None  # letters of an identifier
    template: ClassVar[str]
    width: ClassVar[int] = 96  # of lines
    indent: ClassVar[int] = 4  # of the comment
    subject: str = "It"  # what relates
    fails: ClassVar[str] = ""  # where there is no answer
    size: ClassVar[str] = "abs"
    zero: ClassVar[str] = "0"
    pi: ClassVar[str] = "pi"
    e: ClassVar[str] = "exp(1)"
    entry: ClassVar[str] = ""
    zeros: ClassVar[str] = ""
    head: ClassVar[str] = ""  # what stands before the arguments where they are defined
    colon: ClassVar[str] = ""  # and behind them
    declared: ClassVar[str] = "{}"  # the target of an intermediate
    both: ClassVar[str] = "{} && {}"  # what holds before, and a test
    each: ClassVar[str] = "all(isfinite({}))"  # whether arguments are finite
    every: ClassVar[str] = " && "  # whether a matrix is
    functions: ClassVar[dict[str, str]] = {}  # by their names in the vocabulary
    # a name fit for a comment of the language
    plain: ClassVar[staticmethod[[str], str]] = staticmethod(plain_text)

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__({"order": None})
        is_identifier = ascii_identifier(name) == name and len(name) <= (self.longest or len(name))
        if not is_identifier or name in self.reserved:
            expected = f"an identifier of {self.name_of_language}"
            raise InputError("name of the function", got=name, expected=expected)
        self.title: str = getattr(derivation, "name", "")
        if isinstance(derivation, FormulaDerivative):
            whole, symbol = derivation.derivation.name, derivation.symbol.name
            self.title = f"{whole} with its derivative by {symbol}"
        self.is_stiffness: bool = getattr(derivation, "is_stiffness", True)
        is_program = isinstance(derivation, FormulaProgram)
        compute = derivation if is_program else program(derivation)
        self.compute: FormulaProgram = compute
        self.identifiers: Identifiers = Identifiers({*self.reserved, name}, self.longest)
        take = self.identifiers.take
        symbols = (*compute.arguments, *(a.symbol for a in compute.assignments))
        self._names = {symbol: take(symbol.name) for symbol in symbols}
        self.arguments: list[str] = [self._names[symbol] for symbol in compute.arguments]
        self.results: list[str] = [take(x) for x in ("K", "dK")[: len(compute.results)]]
        self.n: int = compute.entries.rows
        #: Words of the template.
        self.words: dict[str, str] = {x: take(x) for x in ("holds", *self.own)}
        self.words |= {"name": name, "NAME": name.upper(), "K": self.results[0], "n": str(self.n)}
        self.words |= {"nn": str(self.n**2), "results": ", ".join(self.results)}
        is_alone = len(self.results) == 1
        self.words["left"] = self.results[0] if is_alone else f"[{self.words['results']}]"
        self.words["answer"] = _NO_ANSWER

    def source(self) -> str:
        """The template, filled in."""
        return "\n".join([*self.filled(self.template), ""])

    def filled(self, template: str) -> Iterator[str]:
        """Its lines."""
        for line in template.splitlines():
            before, mark, block = line.partition("<<")
            if mark:
                own = getattr(self, block.removesuffix(">>"))()
                yield from (f"{before}{x}".rstrip() for x in own)
            else:
                yield _WORD.sub(lambda m: self.words[m[1]], line)

    def call(self, function: str, arguments: list[str]) -> str:
        """A function of the vocabulary, or sqrt."""
        return f"{self.functions.get(function, function)}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        """A power with a positive exponent."""
        return sign.join(self.parenthesize(x, PRECEDENCE["Pow"]) for x in (base, exponent))

    def write(self, expression: Any) -> str:
        """An expression as a statement's right-hand side."""
        return self._print(expression)

    def _print_Symbol(self, expr: Any) -> str:
        return self._names[expr]

    def _print_Integer(self, expr: Any) -> str:
        return str(expr) if abs(expr) <= _EXACT else self._print_Float(expr)

    def _print_Rational(self, expr: Any) -> str:
        if abs(expr.p) > LARGE or expr.q > LARGE:
            return self._print_Float(expr)
        return "/".join(self._print_Integer(sp.Integer(x)) for x in (expr.p, expr.q))

    def _print_Float(self, expr: Any) -> str:
        """The double that is nearest to a number."""
        if abs(expr) > _LARGEST or 0 < abs(expr) < 1 / _LARGEST:
            raise InputError("number", got=str(expr), expected="one that is a double")
        return repr(float(expr))

    def _print_Pi(self, expr: Any) -> str:
        return self.pi

    def _print_Exp1(self, expr: Any) -> str:
        return self.e

    def _print_Function(self, expr: Any) -> str:
        return self.call(function_name(expr) or "", [self._print(x) for x in expr.args])

    _print_ExpBase = _print_Abs = _print_Function

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:
        if expr.exp.is_negative:
            return self._print_Mul(expr)
        if expr.exp == sp.S.Half:
            return self.call("sqrt", [self._print(expr.base)])
        return self.power(expr.base, expr.exp)

    def about(self, written: str, symbol: Any) -> str:
        """What a comment says of an argument: its name in the formula, its meaning."""
        own = [] if written == symbol.name else [f"{self.plain(symbol.name)} of the formula"]
        meaning = self.compute.meanings.get(symbol.name)
        return ", ".join([*own, self.plain(meaning)] if meaning else own)

    def of_arguments(self) -> list[str]:
        """Lines of the comment on the arguments of which something is known."""
        each = zip(self.arguments, self.compute.arguments, strict=True)
        about = [(x, self.about(x, symbol)) for x, symbol in each]
        return [f"{x}: {words}" for x, words in about if words]

    def comment(self, shape: str = "") -> list[str]:
        """Lines on the matrix, what it relates, its arguments, and where there is no answer."""
        n, width = self.n, self.width - self.indent
        space, of = Space.of_size(n), self.of_arguments()
        both = (
            f"the twist ({', '.join(space.twist_order)}) of the reference point",
            f"the wrench ({', '.join(space.wrench_order)}) about the reference point",
        )
        given, found = both if self.is_stiffness else both[::-1]
        matrix, law = (
            ("Stiffness matrix", "F = K t") if self.is_stiffness else ("Cartesian", "t = K F")
        )
        title = f"{matrix} {self.plain(self.title)} about the reference point, "
        convention = (
            f"relates {given} to {found}, {law}: translation before rotation, force before moment, "
            "SI units."
        )
        beside = dict.fromkeys(_unquoted(own) for own, *_ in self.compute.conditions)
        where = self.plain(_FAILS + "".join(f"; unless {own}" for own in beside))
        return [
            *(*wrapped_words(f"{title}{shape or f'{n} x {n}'}.", width), ""),
            *(*wrapped_words(f"{self.subject} {convention}", width), ""),
            *(*of, *[""][: len(of)]),
            *wrapped_words(f"{self.fails} {where}.", width),
        ]

    def tests(self) -> list[str]:
        """Lines that say where the formula holds."""
        holds = self.words["holds"]
        tests = [f"{size} > {least}" for size, least in self._guarded()]
        tests += [f"{self.write(x)} {sign} {self.zero}" for _, x, sign in self.compute.conditions]
        each = (self.assigned(holds, self.both.format(holds, test)) for test in tests)
        return [line for own in each for line in own]

    def finite(self) -> list[str]:
        """Lines that find whether arguments and matrices are finite."""
        each = self.every.join(self.each.format(x) for x in self.checked())
        return self.assigned(self.words["holds"], each)

    def checked(self) -> list[str]:
        """What is to be finite."""
        return self.results

    def given(self) -> list[str]:
        """Lines that make arguments numbers."""
        return []

    def signature(self, arguments: Sequence[str] | None = None) -> list[str]:
        """The line of the definition."""
        listed = ", ".join(self.arguments if arguments is None else arguments)
        (start,) = self.filled(self.head)
        return self.broken(f"{listed}){self.colon}", start)

    def broken(self, text: str, start: str) -> list[str]:
        """What may take more lines than one."""
        return wrapped_formula(text, self.width, start)

    def margins(self) -> list[str]:
        """What is positive where the formula holds, or not negative, in the order of its tests."""
        margins = [f"{size} - {least}" for size, least in self._guarded()]
        return [*margins, *(self.write(x) for _, x, _ in self.compute.conditions)]

    def _guarded(self) -> Iterator[tuple[str, str]]:
        """Sizes of sums that must not cancel, and the least that they may be."""
        for guard in self.compute.guards:
            whole, *terms = (f"{self.size}({self.write(x)})" for x in (guard.value, *guard.terms))
            yield whole, f"{guard.part}*({' + '.join(terms)})"

    def steps(self) -> list[str]:
        """Lines that compute intermediates and matrices."""
        lines: list[str] = []
        for a in self.compute.assignments:
            lines += self.assigned(
                self.declared.format(self._names[a.symbol]), self.write(a.expression)
            )
        for K, matrix in zip(self.results, self.compute.results, strict=True):
            rows = matrix.tolist()
            lines += self.filled(self.zeros.replace("@M@", K))
            for i, j in np.ndindex(self.n, self.n):
                if rows[i][j] != 0:
                    is_copy = j < i and rows[i][j] == rows[j][i]
                    written = self.place(K, j, i) if is_copy else self.write(rows[i][j])
                    lines += self.assigned(self.place(K, i, j), written)
        return lines

    def place(self, K: str, i: int, j: int) -> str:
        """The entry of a matrix in row i and column j, from 0."""
        return self.entry.format(K, i=i, j=j, I=i + 1, J=j + 1, n=self.n * i + j)

    def assigned(self, target: str, expression: str) -> list[str]:
        """An assignment, in brackets where it takes more than a line: of Python and of Julia."""
        line = f"    {target} = {expression}"
        if len(line) <= self.width:
            return [line]
        inside = wrapped_formula(expression, self.width, " " * 8, " " * 8)
        return [f"    {target} = (", *inside, "    )"]


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
    entry, both, plain = "{}[..., {i}, {j}]", "{} & ({})", staticmethod(_unquoted)
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
        thrown = f'{_tuple(self.arguments)}, "{_NO_ANSWER}"))'
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
