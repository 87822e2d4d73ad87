"""Functions of Julia run as Python: a reader of the few constructs that exports use.

It is no interpreter of the language: syntax is checked only as far as it knows it. Functions of
MATLAB are run by Octave.
"""

import math
import re
import warnings

import numpy as np

_NAMES_OF_OTHERS = ("class", "lambda")
_CONDITIONS = ((r"&&", " and "), (r"\|\|", " or "), (r"\^", "**"))


def _real(function, domain=lambda x: True):
    def value(*arguments):
        if math.isnan(arguments[0]):
            return np.float64(math.nan)
        if not domain(arguments[0]):
            raise ValueError("a function left the real numbers")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return np.float64(function(*arguments))

    return value


def _throw(error):
    raise error


def _atan(*arguments):
    return np.float64(math.atan2(*arguments) if len(arguments) == 2 else math.atan(*arguments))


_NAMES = {
    **{name: _real(getattr(np, name)) for name in ("sin", "cos", "tan", "exp")},
    **{name: _real(getattr(np, name)) for name in ("sinh", "cosh", "tanh")},
    "sqrt": _real(np.sqrt, lambda x: x >= 0),
    "log": _real(np.log, lambda x: x >= 0),
    "asin": _real(np.arcsin, lambda x: abs(x) <= 1),
    "acos": _real(np.arccos, lambda x: abs(x) <= 1),
    "abs": np.abs,
    "pi": np.pi,
    "zeros": np.zeros,
    "all": np.all,
    "isfinite": np.isfinite,
    "atan": _atan,
    "float": np.float64,
    "throw": _throw,
    "DomainError": lambda _, words: ValueError(words),
}


def julia(source):
    """The function of a Julia file, as a Python function."""
    parts = source.split('"""\n')
    assert len(parts) == 3
    assert parts[0] == ""
    lines = parts[2].splitlines()
    assert lines[-1] == "end"
    text = "\n".join(lines[:-1])
    head = re.match(r"function (\w+)\(([^)]*)\)\n", text)
    assert head is not None, "no function"
    body = text[head.end() :]
    body = re.sub(r"^    \w+ = typeof\([^)]*\)\n", "", body, flags=re.MULTILINE)
    body = re.sub(r"^    \w+ = Float64\n", "", body, flags=re.MULTILINE)
    body = re.sub(r"zeros\(\w+, (\d+), \d+\)", r"zeros((\1, \1))", body)
    body = re.sub(r"all\(isfinite,\s+(\w+|\([^)]*\))\)", r"all(isfinite(\1))", body)
    body = re.sub(r"^    (\w+) \|\| throw\(", r"    \1 or throw(", body, flags=re.MULTILINE)
    returned = re.search(r"^    return (.*)$", body, flags=re.MULTILINE)
    assert returned is not None, "nothing is returned"
    for pattern, new in _CONDITIONS:
        body = re.sub(pattern, new, body)
    for name in returned[1].split(", "):  # entries, counted from 0
        body = re.sub(
            rf"\b{name}\[(\d+), (\d+)\]",
            lambda m, n=name: f"{n}[{int(m[1]) - 1}, {int(m[2]) - 1}]",
            body,
        )
    # Words of Python alone are good names in Julia.
    whole = f"def {head[1]}({head[2]}):\n{body}"
    module = dict(_NAMES)
    exec(re.sub(rf"\b({'|'.join(_NAMES_OF_OTHERS)})\b", r"\1_", whole), module)  # noqa: S102

    def called(*values):
        with np.errstate(all="ignore"):
            return module[head[1]](*map(np.float64, values))

    return called
