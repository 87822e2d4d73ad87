"""Functions of MATLAB and Julia run as Python: readers of the few constructs that exports use.

They are no interpreters of these languages: syntax is checked only as far as they know it.
"""

import math
import re
import warnings

import numpy as np

_NAMES_OF_OTHERS = ("class", "lambda")
_CONDITIONS = ((r"&&", " and "), (r"\|\|", " or "), (r"~(?=\w)", "not "), (r"\^", "**"))


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


def _names():
    plain = {name: _real(getattr(np, name)) for name in ("sin", "cos", "tan", "exp")}
    plain |= {name: _real(getattr(np, name)) for name in ("sinh", "cosh", "tanh")}
    return plain | {
        "sqrt": _real(np.sqrt, lambda x: x >= 0),
        "log": _real(np.log, lambda x: x >= 0),
        "asin": _real(np.arcsin, lambda x: abs(x) <= 1),
        "acos": _real(np.arccos, lambda x: abs(x) <= 1),
        "atan": _real(np.arctan),
        "atan2": _real(np.arctan2),
        "abs": np.abs,
        "pi": np.pi,
        "NaN": np.float64(math.nan),
    }


def _python(text):
    for pattern, new in _CONDITIONS:
        text = re.sub(pattern, new, text)
    return text


def _indexed(text, names, opening, closing):
    """``K(1, 2)`` or ``K[1, 2]`` as entries counted from 0."""
    o, c = re.escape(opening), re.escape(closing)
    for name in names:
        pattern = rf"\b{name}{o}(\d+), (\d+){c}"
        text = re.sub(pattern, lambda m, n=name: f"{n}[{int(m[1]) - 1}, {int(m[2]) - 1}]", text)
    return text


def matlab(source):
    """The first function of a MATLAB file, as a Python function."""
    lines = [line for line in source.splitlines() if not line.startswith("%")]
    text = re.sub(r" \.\.\.\n *", " ", "\n".join(lines))
    out, depth, results = [], 0, []
    first = None
    for line in (line.strip() for line in text.splitlines() if line.strip()):
        head = re.fullmatch(r"function (\[?)([\w, ]+)\]? = (\w+)\((.*)\)", line)
        if head:
            assert depth == 0, "a function begins inside another"
            results = [result.strip() for result in head[2].split(",")]
            first = first or (head[3], list(results))
            out.append(f"def {head[3]}({head[4]}):")
            depth = 1
        elif line == "end":
            depth -= 1
            if depth == 0:
                out.append(f"    return {', '.join(results)}")
        elif line.startswith("if "):
            out.append("    " * depth + f"if {_python(line[3:])}:")
            depth += 1
        else:
            assert line.endswith(";"), f"a line without its end: {line}"
            assert first is not None, f"a line before the function: {line}"
            body = _indexed(_python(line[:-1]), first[1], "(", ")").replace("(:)", "")
            body = re.sub(r"zeros\((\d+), \d+\)", r"zeros((\1, \1))", body)
            body = re.sub(r"^error\((.*)\)$", r"raise ValueError(\1)", body)
            out.append("    " * depth + body)
    assert depth == 0, "an end is missing"
    assert first is not None, "no function"
    names = {**_names(), "zeros": np.zeros, "all": np.all, "isfinite": np.isfinite}
    names["isreal"] = np.isreal
    return _run(out, names, first[0])


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
    body = _indexed(_python(body), returned[1].split(", "), "[", "]")

    def throw(error):
        raise error

    def atan(*arguments):
        return np.float64(math.atan2(*arguments) if len(arguments) == 2 else math.atan(*arguments))

    names = {
        **_names(),
        "zeros": np.zeros,
        "all": np.all,
        "isfinite": np.isfinite,
        "atan": atan,
        "float": np.float64,
        "throw": throw,
        "DomainError": lambda _, words: ValueError(words),
    }
    del names["atan2"], names["NaN"]
    return _run([f"def {head[1]}({head[2]}):", *body.splitlines()], names, head[1])


def _run(lines, names, name):
    module = dict(names)
    # Words of Python alone are good names in the other languages.
    source = re.sub(rf"\b({'|'.join(_NAMES_OF_OTHERS)})\b", r"\1_", "\n".join(lines))
    exec(source, module)  # noqa: S102

    def called(*values):
        with np.errstate(all="ignore"):
            return module[name](*map(np.float64, values))

    return called
