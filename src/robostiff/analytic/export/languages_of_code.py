"""Functions of C, Python, Julia and MATLAB, one template each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from robostiff.analytic.export.code import (
    C_WORDS,
    JULIA_WORDS,
    MATLAB_WORDS,
    NO_ANSWER,
    PYTHON_WORDS,
    Code,
    plain_text,
)
from robostiff.analytic.export.entries import symbols_of
from robostiff.analytic.export.language import wrapped_words
from robostiff.analytic.export.program import FormulaProgram


def c_function(derivation: Any, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function in C99.

    Parameters
    ----------
    derivation : Formula
    name : str
        Name of the function ``int name(double *restrict K_out, const double *restrict p)``:
        it writes the n * n entries of K, row after row, for the values p of the given symbols
        in alphabetical order, as the comment in front of it says, and returns 0. Where the
        formula does not hold it returns 1, and writes nothing. Of a derivative, dK_out follows.

    Returns
    -------
    str
        Source that needs only the mathematical library (``-lm``). Named intermediates keep their
        names, what occurs more than once is computed once.

    Raises
    ------
    InputError
        When the name is no identifier, or an expression is not of the vocabulary.
    """
    return _C(derivation, name).source()


def python_function(derivation: Any, name: str = "stiffness") -> str:
    """A derivation as the source of a Python module with one function, which needs only NumPy.

    As `c_function`. The arguments of the function are the given symbols, in alphabetical order;
    they may be numbers or arrays that broadcast. It returns the matrix (..., n, n), or the pair K,
    dK of a derivative, and raises a ValueError where the formula does not hold.
    """
    return _Python(derivation, name).source()


def julia_function(derivation: Any, name: str = "stiffness") -> str:
    """A derivation as the source of a function of Julia, which needs no package.

    As `python_function`; its arguments are one number each, of any real type. Where the formula
    does not hold, it throws a DomainError.
    """
    return _Julia(derivation, name).source()


def matlab_function(derivation: Any, name: str = "stiffness") -> str:
    """A derivation as the source of a function of MATLAB, which Octave takes as well.

    As `python_function`; the name of ``K = name(...)``, or ``[K, dK] = name(...)`` of a
    derivative, is also that of its file, ``name.m``, and its arguments are one number each. Where
    the formula does not hold, it raises the error ``robostiff:formula``.
    """
    return _Matlab(derivation, name).source()


def source_of_values(compute: FormulaProgram, order: Sequence[int]) -> str:
    """Source of ``formula`` in Python, which refuses nothing.

    It returns K (and dK), where their entries and its arguments are finite, and a tuple of what is
    positive where the formula holds, or not negative, in the order of guards and conditions. Its
    arguments, arrays, are those of the program in the given `order`.
    """
    code = _Python(compute, "formula")
    code.template, code.arguments = _VALUES, [code.arguments[place] for place in order]
    return code.source()


_C_TEXT = """\
/*
 * $comment
 */
#include <math.h>

$head;

$head
{
    $given
    $steps
    $matrices
    int $holds = 1;
    $finite
    $tests
    if (!$holds) return 1;
    $copied
    return 0;
}
"""


class _C(Code):
    """All numbers are doubles; small powers of a symbol are products."""

    language, reserved, extra, text = "C", C_WORDS, ("p", "K_out", "dK_out", "i"), _C_TEXT
    size, zero, pi, e = "fabs", "0.0", "3.14159265358979323846", "2.71828182845904523536"
    entry, steps, end, zeros = "{}[{n}]", "const double {}", ";", "double {}[{nn}] = {{0.0}};"
    fails, subject = "Returns 0; 1, and writes nothing,", "{K_out}, {n} x {n}, row after row,"

    def parts(self) -> Mapping[str, str | list[str]]:
        p, i, given = self.fields["p"], self.fields["i"], self.compute.arguments
        out = [self.fields[f"{x}_out"] for x, _ in zip(("K", "dK"), self.results, strict=False)]
        beside = [x for _, x, _ in self.compute.conditions]
        used = symbols_of(
            [*self.compute.results, *beside, *(a.expression for a in self.compute.assignments)]
        )
        names = enumerate(zip(self.arguments, given, strict=True))
        numbers = [f"const double {x} = {p}[{k}];" for k, (x, symbol) in names if symbol in used]
        loop = f"for (int {i} = 0; {i} < {{}}; ++{i})"
        finite = [(p, len(given))] * bool(given) + [(K, self.n**2) for K in self.results]
        h = self.fields["holds"]
        outputs = ", ".join(f"double *restrict {x}" for x in out)
        return {
            "head": f"int {self.name}({outputs}, const double *restrict {p})",
            "given": numbers if given else [f"(void){p};"],
            "finite": [f"{loop.format(n)} {h} = {h} && isfinite({x}[{i}]);" for x, n in finite],
            "copied": [
                f"{loop.format(self.n**2)} {x}[{i}] = {K}[{i}];"
                for x, K in zip(out, self.results, strict=True)
            ],
        }

    def values(self) -> list[str]:
        """The order of all of them."""
        p, meanings = self.fields["p"], self.compute.meanings
        given = {
            x.name: f"{p}[{k}] {plain_text(x.name)}" for k, x in enumerate(self.compute.arguments)
        }
        if not given:
            return [f"{p} is not used and may be null."]
        if not any(map(meanings.get, given)):
            return wrapped_words(f"Values: {', '.join(given.values())}.", self.width - 4)
        words = {x: f": {plain_text(meaning)}" for x in given if (meaning := meanings.get(x))}
        return ["Values:", *(f"  {value}{words.get(x, '')}" for x, value in given.items())]

    def call(self, function: str, arguments: list[str]) -> str:
        return super().call("fabs" if function == "abs" else function, arguments)

    def _print_Integer(self, expr: Any) -> str:
        written = super()._print_Integer(expr)
        return written if "e" in written else f"{expr}.0"

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        if base.is_Symbol and exponent.is_Integer and exponent <= 4:
            return f"({'*'.join([self._print(base)] * int(exponent))})"
        return self.call("pow", [self._print(base), self._print(exponent)])


_BODY = """\
    $steps
    $shaped
    $matrices
    $finite
"""

_PYTHON_TEXT = f'''\
"""A stiffness matrix as a function of its symbols."""

import numpy as np


@np.errstate(all="ignore")
$head
    """
    $comment
    """
    $floats
{_BODY}    $tests
    if not np.all($holds):
        $bad = np.size($holds) - np.count_nonzero($holds)
        raise ValueError(f"the formula does not hold at {{$bad}} of {{np.size($holds)}} points")
    return $results
'''

_VALUES = f"""\
import numpy as np


@np.errstate(all="ignore")
$head
{_BODY}    $margins
    return $results, $holds, margins
"""


class _Python(Code):
    """NumPy, imported as np."""

    language, reserved, extra = "Python", PYTHON_WORDS, ("shape", "bad")
    size, pi, e, text, in_brackets = "np.abs", "np.pi", "np.e", _PYTHON_TEXT, True
    entry, both = "{}[..., {i}, {j}]", "{} & ({})"
    zeros, shape = "{} = np.zeros((*{shape}, {n}, {n}))", "(..., {n}, {n})"

    def values(self) -> list[str]:
        """A section of all arguments."""
        lines = []
        for name, words in self.description():
            lines += [
                f"{name} : array_like",
                *wrapped_words(f"    {words}", self.width - 4, "    "),
            ]
        return ["Parameters", "----------", *lines] if lines else []

    def failing(self, where: str) -> list[str]:
        """A section of errors."""
        words = wrapped_words(f"    W{where[1:]}", self.width - 4, "    ")
        return ["Raises", "------", "ValueError", *words]

    def parts(self) -> Mapping[str, str | list[str]]:
        holds = self.fields["holds"]
        shapes = ", ".join(f"{x}.shape" for x in self.arguments)
        # K may be finite where an argument is not, as 1/k of an infinite k.
        of_all = " & ".join(f"np.isfinite({x}).all(axis=(-2, -1))" for x in self.results)
        finite = [f"{holds} = {of_all}"]
        finite += [f"{holds} = {holds} & np.isfinite({x})" for x in self.arguments]
        margins = [f"{size} - {least}" for size, least in self.guards()]
        margins += [self._print(x) for _, x, _ in self.compute.conditions]
        return {
            "head": self.on_lines(f"def {self.name}(", f"{', '.join(self.arguments)}):"),
            "floats": [f"{x} = np.asarray({x}, dtype=float)" for x in self.arguments],
            "shaped": self.assignment(self.fields["shape"], f"np.broadcast_shapes({shapes})"),
            "finite": finite,
            "margins": self.assignment(
                "margins", f"({''.join(f'{x}, ' for x in margins).strip()})"
            ),
        }

    def call(self, function: str, arguments: list[str]) -> str:
        is_arc = function.startswith("a") and function != "abs"
        return f"np.{f'arc{function[1:]}' if is_arc else function}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any, sign: str = "**") -> str:
        return super().power(base, exponent, sign)


_JULIA_TEXT = '''\
"""
    $call

$comment
"""
$head
    $given
    $steps
    $matrices
    $finite
    $tests
    $thrown
    return $results
end
'''


class _Julia(Code):
    """Julia's own functions throw where the result is not real."""

    language, reserved, extra, width = "Julia", JULIA_WORDS, ("T",), 88
    entry, zeros, text, in_brackets = "{}[{I}, {J}]", "{} = zeros({T}, {n}, {n})", _JULIA_TEXT, True
    fails = "A `DomainError` is thrown"

    def parts(self) -> Mapping[str, str | list[str]]:
        T, holds, listed = self.fields["T"], self.fields["holds"], ", ".join(self.arguments)
        given = [f"{T} = Float64"]
        if listed:  # powers of integers could overflow
            given = [f"{x} = float({x})" for x in self.arguments]
            given += self.on_lines(f"{T} = typeof(", f"{' + '.join(self.arguments)})")
        values = f"({listed}{',' * (len(self.arguments) == 1)})"
        checked = [values] * bool(listed) + self.results
        return {
            "call": self.on_lines(f"{self.name}(", f"{listed})"),
            "head": self.on_lines(f"function {self.name}(", f"{listed})"),
            "given": given,
            "finite": self.assignment(holds, " && ".join(f"all(isfinite, {x})" for x in checked)),
            "thrown": self.on_lines(f"{holds} || throw(DomainError(", f'{values}, "{NO_ANSWER}"))'),
        }

    def call(self, function: str, arguments: list[str]) -> str:
        return super().call("atan" if function == "atan2" else function, arguments)


_MATLAB_TEXT = """\
$head
% $comment
$steps
$matrices
$finite
$tests
if ~$holds
    error('robostiff:formula', '$no_answer');
end
end

function z = $real_one(z)
if ~isreal(z)
    z = NaN;
end
end
"""


class _Matlab(Code):
    """Numbers are doubles; what would be complex is not a number, and refused."""

    language, reserved, longest, extra = "MATLAB", MATLAB_WORDS, 63, ("real_one",)
    text = _MATLAB_TEXT
    entry, zeros, end, goes_on = "{}({I}, {J})", "{} = zeros({n}, {n});", ";", " ..."
    fails = "It raises the error robostiff:formula"

    def parts(self) -> Mapping[str, str | list[str]]:
        out = self.results[0] if len(self.results) == 1 else f"[{', '.join(self.results)}]"
        checked = [f"[{', '.join(self.arguments)}]"] * bool(self.arguments)
        checked += [f"{K}(:)" for K in self.results]
        finite = " && ".join(f"all(isfinite({x}))" for x in checked)
        return {
            "head": self.on_lines(
                f"function {out} = {self.name}(", f"{', '.join(self.arguments)})"
            ),
            "finite": self.assignment(self.fields["holds"], finite),
        }

    def call(self, function: str, arguments: list[str]) -> str:
        called = super().call(function, arguments)
        leaves = function in ("sqrt", "log", "asin", "acos")
        return f"{self.fields['real_one']}({called})" if leaves else called

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        found = super().power(base, exponent, sign)
        return found if exponent.is_Integer else f"{self.fields['real_one']}({found})"
