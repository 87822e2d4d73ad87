"""A derivation as a function of MATLAB and Octave."""

from __future__ import annotations

from typing import Any

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.code_printer import NO_ANSWER, CaretCode, convention, plain_text
from robostiff.analytic.export.vocabulary import MATLAB_WORDS


def matlab_function(derivation: Derivation | FormulaDerivative, name: str = "stiffness") -> str:
    r"""A derivation as the source of a function of MATLAB, which Octave takes as well.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative
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
    >>> import sympy as sp
    >>> k, d = sp.symbols("k d")
    >>> K = sp.ImmutableMatrix([[k, 0, 0], [0, 0, 0], [0, 0, k * d**2 / 3]])
    >>> lines = matlab_function(Derivation("K_C", K, (), K)).splitlines()
    >>> lines[0]
    'function K = stiffness(d, k)'
    >>> print("\n".join(lines[-8:]))
    K = zeros(3, 3);
    K(1, 1) = k;
    K(3, 3) = (1/3)*d^2*k;
    holds = all(isfinite([d, k])) && all(isfinite(K(:)));
    if ~holds
        error('robostiff:formula', 'the formula does not hold at these values');
    end
    end
    """
    return _Matlab(derivation, name).source()


# Functions that leave the real numbers: outside their domain they give NaN, which is refused.
_DOMAINS = {
    "sqrt": ("x >= 0", "sqrt(x)"),
    "log": ("x >= 0", "log(x)"),
    "asin": ("abs(x) <= 1", "asin(x)"),
    "acos": ("abs(x) <= 1", "acos(x)"),
    "power": ("x >= 0", "x^y"),
}


class _Matlab(CaretCode):
    """Numbers are doubles; functions that may become complex have a real one of their own."""

    language = "MATLAB"
    words = MATLAB_WORDS
    longest = 63

    def prepare(self) -> None:
        self._real: dict[str, str] = {}

    def call(self, function: str, arguments: list[str]) -> str:
        if function in _DOMAINS:
            if function not in self._real:
                self._real[function] = self.identifiers.take(f"real_{function}")
            function = self._real[function]
        return f"{function}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any) -> str:
        if not exponent.is_Integer:
            return self.call("power", [self.write(base), self.write(exponent)])
        return super().power(base, exponent)

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
        n, results = self.compute.entries.rows, ", ".join(self.results)
        left = results if len(self.results) == 1 else f"[{results}]"
        what = f"{self.name.upper()} Stiffness matrix {plain_text(self.title)}, {n} x {n}."
        known = self.known_arguments()
        first, *others = [
            *(*wrapped_words(what, self.width - 2, "  "), ""),
            *wrapped_words(f"It {convention(n)}", self.width - 4),
            *(["", *known] if known else []),
            "",
            *wrapped_words(
                f"It raises the error robostiff:formula {self.conditions}.", self.width - 4
            ),
        ]
        return [
            *self._continued(f"{', '.join(self.arguments)})", f"function {left} = {self.name}("),
            *(f"%{first}", *(f"%   {line}".rstrip() for line in others), ""),
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
