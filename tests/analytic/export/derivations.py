"""Derivations written by hand, independent of the elimination that usually makes them."""

import random
from collections.abc import Callable, Iterator, Mapping
from functools import cache

import numpy as np
import sympy as sp

from robostiff.analytic.derivation import Derivation, RobotDerivation, Stage
from robostiff.analytic.exact.definition import Condition, Definition


def symmetric(n, letter="K"):
    """A general symmetric matrix with entries K_11, K_12, ..."""
    return sp.ImmutableMatrix(
        n, n, lambda i, j: sp.Symbol(f"{letter}_{min(i, j) + 1}{max(i, j) + 1}")
    )


def one_stage(K0, J, *, joint="tip", name="K_C"):
    """Eq. (15) once, in SymPy."""
    K0, J = sp.ImmutableMatrix(K0), sp.ImmutableMatrix(J)
    u = K0 * J
    mu = sp.expand((J.T * u)[0, 0])
    K = sp.ImmutableMatrix((K0 - u * u.T / mu).applyfunc(sp.together))
    stage = Stage(joint, J, "recursion (15)", sp.ImmutableMatrix(u), mu, K)
    return Derivation(name, K0, (stage,), K)


def equation_4():
    """The motivating example, eq. (4): a planar link with a passive joint at its tip."""
    return one_stage(symmetric(3), [0, 0, 1])


def oblique():
    """An oblique joint: square roots, sines and cosines, a third."""
    k_x, k_y, k_phi, d_a = sp.symbols("k_x k_y k_phi d_a", positive=True)
    phi, a = sp.symbols("phi a", real=True)
    c, s = sp.cos(phi), sp.sin(phi)
    K0 = [
        [k_x * c**2 + k_y * s**2, (k_x - k_y) * s * c, d_a * k_y * s],
        [(k_x - k_y) * s * c, k_x * s**2 + k_y * c**2, d_a * k_y * c],
        [d_a * k_y * s, d_a * k_y * c, k_phi + 4 * d_a**2 * k_y / 3],
    ]
    return one_stage(K0, [sp.sqrt(a**2 + 1), -a, 1], joint="el_bow & 50 %")


def in_steps():
    """Named intermediates, one of them of given symbols alone and one that nothing needs."""
    K0 = symmetric(6)
    L = sp.Symbol("L", positive=True)
    u = [Definition(sp.Symbol(f"u_1_{i + 1}"), L * K0[i, 1] + K0[i, 5]) for i in range(6)]
    mu = Definition(sp.Symbol("mu_1"), L * u[1].symbol + u[5].symbol)
    unused = Definition(sp.Symbol("unused"), L**2 + 1)
    entries = {
        (i, j): Definition(
            sp.Symbol(f"K_1_{i + 1}{j + 1}"), K0[i, j] - u[i].symbol * u[j].symbol / mu.symbol
        )
        for i in range(6)
        for j in range(i, 6)
    }
    K = sp.ImmutableMatrix(6, 6, lambda i, j: entries[min(i, j), max(i, j)].symbol)
    definitions = (*u, mu, unused, *entries.values())
    J = sp.ImmutableMatrix([0, L, 0, 0, 0, 1])
    column = sp.ImmutableMatrix([d.symbol for d in u])
    stage = Stage("rear", J, "quasi-trivial joint (18)", column, mu.symbol, K, definitions)
    return Derivation("K_C", K0, (stage,), K, definitions)


def gough_stewart_b():
    """Eq. (28), with (R/2 - r) r h for rhd_b."""
    K_11, L, R, r, h = sp.symbols("K_11 L R r h", positive=True)
    side, lever, turn = (R - r) ** 2 + R * r, r * h * (R / 2 - r), r**2 * h**2
    entries = {
        (0, 0): side,
        (1, 1): side,
        (2, 2): 2 * h**2,
        (3, 3): turn,
        (4, 4): turn,
        (5, 5): sp.Rational(3, 2) * r**2 * R**2,
        (0, 4): lever,
        (1, 3): -lever,
    }
    K = sp.ImmutableMatrix(
        6, 6, lambda i, j: 3 * K_11 / L**2 * entries.get((min(i, j), max(i, j)), 0)
    )
    return Derivation("K_C", K, (), K)


def redundant():
    """The same joint twice: the second takes nothing away."""
    first = equation_4()
    again = Stage(
        "again",
        first.stages[0].J,
        "redundant, mu = 0, nothing changes",
        sp.ImmutableMatrix(sp.zeros(3, 1)),
        sp.Integer(0),
        first.K,
    )
    return Derivation("planar link", first.K0, (*first.stages, again), first.K)


def numbers_only():
    """No symbol at all, an exact and an inexact number."""
    K = sp.ImmutableMatrix([[sp.Rational(1, 3), 0, 0], [0, sp.Float("0.1", 30), 0], [0, 0, 0]])
    return Derivation("K_C", K, (), K)


def nothing():
    """The zero matrix."""
    K = sp.ImmutableMatrix(sp.zeros(3, 3))
    return Derivation("", K, (), K)


def one_term():
    """A single entry of a single symbol."""
    K = sp.ImmutableMatrix(3, 3, lambda i, j: sp.Symbol("k_tau") if i == j == 1 else 0)
    return Derivation("K_C", K, (), K)


def all_functions():
    """Every function and constant of the vocabulary, odd powers, a float."""
    x, y = sp.symbols("x y", positive=True)
    K = [
        [sp.sin(x) ** 2 / sp.cos(y), sp.tan(x) + sp.pi, sp.sqrt(x) ** -1],
        [sp.asin(x / 9), sp.acos(y / 9) ** 3, sp.atan(x * y)],
        [sp.sinh(x) - sp.cosh(y) / sp.tanh(x), sp.exp(-x) * sp.log(y) * sp.E, 1.25 * x**5 / 7],
    ]
    more = [
        [sp.atan2(x - 1, y), sp.Abs(x - y), (x + y) ** sp.Rational(-3, 2)],
        [sp.cbrt(x), -2 * (x + y) / (3 * (x + 2 * y)), sp.Mul(2, x + y, evaluate=False)],
        [x**-4 - y, (x - 5 * y) ** 2, -x / 3],
    ]
    zero = sp.zeros(3, 3)
    matrix = sp.ImmutableMatrix(
        sp.Matrix(sp.BlockMatrix([[sp.Matrix(K), zero], [sp.Matrix(more), zero]]))
    )
    return Derivation("K_C", matrix, (), matrix)


def badly_named():
    """Symbols whose names are no identifiers, are keywords, or become the same."""
    names = ["lambda", "K_C,1", "K_C_1", "φ", "phi", "2a", "class", "double", "sin", "K", "p"]
    names += ["np", "shape", "t1", "y0", "a b", "*/", '"', "float", "stiffness", "λ", "x\\y", "$"]
    symbols = [sp.Symbol(name) for name in names]
    squares = sum(((i + 2) * s + sp.sin(s)) ** 2 for i, s in enumerate(symbols))
    K = sp.ImmutableMatrix([[squares, 0, 0], [0, squares + 1, 0], [0, 0, symbols[0]]])
    return Derivation('name "with" */ quotes\n', K, (), K)


class _Made(Mapping[str, Derivation]):
    """Derivations by name, each made when it is asked for first."""

    def __init__(self, *functions: Callable[[], Derivation]) -> None:
        self.functions = {f.__name__: cache(f) for f in functions}

    def __getitem__(self, name: str) -> Derivation:
        return self.functions[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self.functions)

    def __len__(self) -> int:
        return len(self.functions)


ALL = _Made(
    *(equation_4, oblique, in_steps, gough_stewart_b, redundant),
    *(numbers_only, nothing, one_term, all_functions, badly_named),
)


def random_values(derivation, seed):
    """A value between 0.3 and 2.3 for each symbol, in the order of the arguments."""
    generator = random.Random(seed)  # noqa: S311
    return {symbol: generator.uniform(0.3, 2.3) for symbol in derivation.symbols}


@cache
def named_values(name, seed):
    """Values of the derivation of this name, and K at them with 40 digits."""
    values = random_values(ALL[name], seed)
    return values, exact(ALL[name], values)


def exact(derivation, values):
    """K at given values, computed with 40 digits."""
    precise = {symbol: sp.Rational(value) for symbol, value in values.items()}
    K = derivation.substituted(precise)
    return np.array([[float(sp.N(K[i, j], 40)) for j in range(K.cols)] for i in range(K.rows)])


def of_signed_symbols():
    """Roots written without a root as L is positive and x negative; A is of no part in K."""
    L, A = sp.symbols("L A", positive=True)
    x = sp.Symbol("x", negative=True)
    K = sp.ImmutableMatrix(sp.diag(sp.sqrt(L**2), sp.sqrt(x**2) + 1 / (1 + L), 1))
    beside = Condition("the beam has a positive length", A + L)
    return RobotDerivation("signed", K, (), K, conditions=(beside,))


#: Values of (A, L, x) with a sign that the formula of them excludes.
WRONG_SIGNS = [(1.0, -0.5, -1.0), (1.0, 0.5, 1.0), (-1e-9, 0.5, -1.0)]

#: Of them where one is no finite number, and K is one.
INFINITE = [(np.inf, 0.5, -1.0), (np.nan, 0.5, -1.0)]
