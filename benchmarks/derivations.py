"""How long a closed form of K_C takes, and what one gets: a full stiffness matrix of 21 symbols.

The first n of the five joints of eq. (21), derived by

* SymPy matrices: eq. (9) with several inverses, and the recursion (15), each entry then brought to
  one fraction by ``together`` or ``cancel``;
* SymPy's DomainMatrix: over the fraction field, and fraction-free over polynomials (solve_den);
* the algorithm of robostiff itself, carried over to SymPy's polynomial rings;
* symengine's DenseMatrix;
* robostiff.analytic.

Two times a route. "own" ends with the entries of K in the arithmetic of the route: FLINT fractions,
elements of a fraction field, expression trees. "SymPy" ends with all entries as SymPy expressions.
Canonical means that every entry is one cancelled fraction of expanded polynomials; a tree is what
the algebra left, with its number of operations. The last column says how many times longer than
robostiff a route takes up to SymPy expressions.

Every route runs in a process of its own, one thread, and is stopped after a limit. It first
derives one joint to load what it needs; SymPy's cache is then cleared; short runs are repeated and
the best one counts. Every answer is checked at random rational numbers.

    python benchmarks/derivations.py            all, about ten minutes
    python benchmarks/derivations.py --quick    one and two joints, 5 s a route
    python benchmarks/derivations.py --robots   time and size of K of all shipped robots, at home
                                                and at a symbolic pose, see derivations_of_robots
    python benchmarks/derivations.py --robots --table docs/derivations.md    the table there, or
                                                the rows of the robots that are named
"""

import argparse
import multiprocessing
import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sympy as sp
from derivations_of_robots import POSES, robots
from sympy.core.cache import clear_cache
from sympy.external.gmpy import GROUND_TYPES
from sympy.polys.matrices import DomainMatrix

import robostiff as rs
from robostiff.analytic import derive_chain
from robostiff.analytic.exact.definition import count_of

try:
    import symengine
except ImportError:
    symengine: Any = None

# Without assumptions, which symengine does not carry through.
L = sp.Symbol("L")
K0 = sp.Matrix(6, 6, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))
SYMBOLS = sorted({*K0.free_symbols, L}, key=str)
UPPER = [(i, j) for i in range(6) for j in range(i, 6)]
JOINTS = {
    "Rx": [0, 0, 0, 1, 0, 0],
    "Ry": [0, 0, 0, 0, 1, 0],
    "Rz": [0, 0, 0, 0, 0, 1],
    "Ry+": [0, 0, -L, 0, 1, 0],
    "Rz+": [0, L, 0, 0, 0, 1],
}
ENOUGH = 1.0  # seconds of repetitions
ENOUGH_IF_QUICK = 0.05


@dataclass(frozen=True)
class Route:
    """A way to derive K: `derive` gives it in its own form, `write` the 21 entries in SymPy."""

    name: str
    derive: Callable[[list[Any]], Any]
    write: Callable[[Any], list[sp.Expr]]
    is_canonical: bool


def jacobian(columns: list[Any]) -> sp.Matrix:
    return sp.Matrix([list(column) for column in columns]).T


def upper(K: Any) -> list[sp.Expr]:
    return [sp.sympify(K[i, j]) for i, j in UPPER]


def block(method: str, finish: Callable[[Any], Any]) -> Callable[[list[Any]], Any]:
    def derive(columns: list[Any]) -> sp.Matrix:
        J = jacobian(columns)
        KJ = K0 * J
        return (K0 - KJ * (J.T * KJ).inv(method=method) * KJ.T).applyfunc(finish)

    return derive


def recursion(finish: Callable[[Any], Any]) -> Callable[[list[Any]], Any]:
    def derive(columns: list[Any]) -> sp.Matrix:
        K = K0
        for column in columns:
            J = sp.Matrix(column)
            u = K * J
            K = (K - u * u.T / (J.T * u)[0]).applyfunc(finish)
        return K

    return derive


def fraction_field_recursion(columns: list[Any]) -> DomainMatrix:
    field = sp.QQ.frac_field(*SYMBOLS)
    K = DomainMatrix.from_Matrix(K0).convert_to(field)
    for column in columns:
        J = DomainMatrix.from_Matrix(sp.Matrix(column)).convert_to(field)
        u = K * J
        K = K - u * (J.transpose() * u).inv() * u.transpose()
    return K


def fraction_field_block(columns: list[Any]) -> DomainMatrix:
    field = sp.QQ.frac_field(*SYMBOLS)
    K = DomainMatrix.from_Matrix(K0).convert_to(field)
    J = DomainMatrix.from_Matrix(jacobian(columns)).convert_to(field)
    KJ = K * J
    return K - KJ * (J.transpose() * KJ).inv() * KJ.transpose()


def fraction_free_block(columns: list[Any]) -> list[Any]:
    ring = sp.ZZ[tuple(SYMBOLS)]
    K = DomainMatrix.from_Matrix(K0).convert_to(ring)
    J = DomainMatrix.from_Matrix(jacobian(columns)).convert_to(ring)
    KJ = K * J
    X, below = (J.transpose() * KJ).solve_den(KJ.transpose())
    above = K * below - KJ * X
    return [(ring, *above[i, j].element.cancel(below)) for i, j in UPPER]


def fraction_free_recursion(columns: list[Any]) -> list[Any]:
    ring = sp.ZZ[tuple(SYMBOLS)]
    N = [[ring.from_sympy(K0[i, j]) for j in range(6)] for i in range(6)]
    below = ring.one
    for column in columns:
        J = [ring.from_sympy(sp.sympify(entry)) for entry in column]
        u = [sum((row[k] * J[k] for k in range(6) if J[k]), ring.zero) for row in N]
        mu = sum((J[k] * u[k] for k in range(6) if J[k]), ring.zero)
        after = {(i, j): (N[i][j] * mu - u[i] * u[j]).exquo(below) for i, j in UPPER}
        N = [[after[min(i, j), max(i, j)] for j in range(6)] for i in range(6)]
        below = mu
    return [(ring, *N[i][j].cancel(below)) for i, j in UPPER]


def ring_fractions(K: list[Any]) -> list[sp.Expr]:
    return [ring.to_sympy(above) / ring.to_sympy(below) for ring, above, below in K]


def field_fractions(K: DomainMatrix) -> list[sp.Expr]:
    return upper(K.to_Matrix())


def symengine_recursion(columns: list[Any]) -> Any:
    K = symengine.DenseMatrix(6, 6, [symengine.sympify(entry) for entry in K0])
    for column in columns:
        J = symengine.DenseMatrix(6, 1, [symengine.sympify(entry) for entry in column])
        u = K * J
        mu = (J.T * u)[0, 0]
        K = K - (u * u.T) * (1 / mu)
    return K


def symengine_block(columns: list[Any]) -> Any:
    K = symengine.DenseMatrix(6, 6, [symengine.sympify(entry) for entry in K0])
    entries = [symengine.sympify(entry) for entry in jacobian(columns)]
    J = symengine.DenseMatrix(6, len(columns), entries)
    KJ = K * J
    return K - KJ * (J.T * KJ).inv() * KJ.T


def robostiff(columns: list[Any]) -> Any:
    # cancelled, and written in SymPy, when it is looked at
    return derive_chain(K0, {f"joint {i}": column for i, column in enumerate(columns)}).K


ROUTES = [
    Route("robostiff.analytic", robostiff, upper, True),
    Route("SymPy, (9), inv GE", block("GE", lambda e: e), upper, False),
    Route("SymPy, (9), inv GE, cancel", block("GE", sp.cancel), upper, True),
    Route("SymPy, (9), inv ADJ, cancel", block("ADJ", sp.cancel), upper, True),
    Route("SymPy, (9), inv LU, cancel", block("LU", sp.cancel), upper, True),
    Route("SymPy, (15), as it comes", recursion(lambda e: e), upper, False),
    Route("SymPy, (15), together", recursion(sp.together), upper, False),
    Route("SymPy, (15), cancel", recursion(sp.cancel), upper, True),
    Route("DomainMatrix, field, (9)", fraction_field_block, field_fractions, True),
    Route("DomainMatrix, field, (15)", fraction_field_recursion, field_fractions, True),
    Route("DomainMatrix, solve_den, (9)", fraction_free_block, ring_fractions, True),
    Route("same algorithm, SymPy rings", fraction_free_recursion, ring_fractions, True),
]
if symengine is not None:
    ROUTES += [
        Route("symengine, (9)", symengine_block, upper, False),
        Route("symengine, (15)", symengine_recursion, upper, False),
    ]


@dataclass(frozen=True)
class Outcome:
    """Seconds to a route's own form and to SymPy, operations of K, and whether K is right."""

    own: float
    written: float
    operations: int
    is_right: bool


def measured(route: Route, columns: list[Any], enough: float) -> Outcome:
    route.write(route.derive(columns[:1]))
    best, spent = (float("inf"), float("inf")), 0.0
    while True:
        clear_cache()
        start = time.perf_counter()
        K = route.derive(columns)
        derived = time.perf_counter()
        entries = route.write(K)
        end = time.perf_counter()
        best = min(best[0], derived - start), min(best[1], end - start)
        spent += end - start
        if spent > enough:
            break
    operations = sum(count_of(entry) for entry in entries)
    return Outcome(*best, operations, is_right(entries, columns))


def is_right(entries: list[sp.Expr], columns: list[Any]) -> bool:
    """Whether K has the value of eq. (9) at random rational numbers."""
    dice = random.Random(1)  # noqa: S311
    values = {symbol: sp.Rational(dice.randint(1, 99), dice.randint(1, 9)) for symbol in SYMBOLS}
    K, J = K0.xreplace(values), jacobian(columns).xreplace(values)
    expected = K - K * J * (J.T * K * J).inv() * J.T * K
    return [entry.xreplace(values) for entry in entries] == upper(expected)


def _answer(route: Route, columns: list[Any], enough: float, pipe: Any) -> None:
    pipe.send(measured(route, columns, enough))


def outcome(route: Route, columns: list[Any], enough: float, limit: float) -> Outcome | None:
    """What a route gives in a process of its own; None beyond the limit."""
    context = multiprocessing.get_context("fork")
    mine, its = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(route, columns, enough, its))
    process.start()
    its.close()
    try:
        return mine.recv() if mine.poll(limit) else None
    except EOFError:
        raise RuntimeError(f"{route.name} failed") from None
    finally:
        process.kill()
        process.join()


def row(route: Route, found: Outcome | None, limit: float, ours: Outcome) -> str:
    form = "canonical" if route.is_canonical else "tree"
    if found is None:
        factor = f"> {limit / ours.written:.0f}"
        none = f"no answer in {limit:.0f} s"
        return f"{route.name:<29}{form:>10}{none:>22}{'':>12}{factor:>9}"
    if not found.is_right:
        return f"{route.name:<29} WRONG"
    times = f"{1e3 * found.own:>11.2f}{1e3 * found.written:>11.2f}"
    factor = f"{found.written / ours.written:.1f}"
    return f"{route.name:<29}{form:>10}{times}{found.operations:>12}{factor:>9}"


def main() -> None:
    parser = argparse.ArgumentParser(description="Seconds for a closed form, by many routes.")
    parser.add_argument("--quick", action="store_true", help="one and two joints only")
    parser.add_argument("--joints", type=int, nargs="+", choices=range(1, 6))
    parser.add_argument("--limit", type=float, help="seconds a route may take")
    parser.add_argument(
        "--robots", nargs="*", metavar="ROBOT", help="shipped robots or model files instead"
    )
    parser.add_argument("--sets", type=int, default=100, help="random parameters of each robot")
    parser.add_argument("--pose", nargs="+", choices=POSES, default=list(POSES), dest="poses")
    parser.add_argument(
        "--table", type=Path, help="page in which the rows of these robots are replaced"
    )
    options = parser.parse_args()
    if options.robots is not None:
        names = options.robots or list(rs.shipped_robots())
        if robots(names, options.sets, options.poses, options.table):
            raise SystemExit(1)
        return
    numbers = options.joints or ([1, 2] if options.quick else [1, 2, 3, 4, 5])
    limit = options.limit or (5.0 if options.quick else 60.0)
    enough = ENOUGH_IF_QUICK if options.quick else ENOUGH
    print(f"SymPy {sp.__version__} on {GROUND_TYPES} numbers; times in ms")
    if symengine is None:
        print("symengine is not installed: pip install 'robostiff[bench]'")
    for n in numbers:
        columns = list(JOINTS.values())[:n]
        print(f"\n{n} of the joints of (21), K0 of 21 symbols")
        print(f"{'':<29}{'form':>10}{'own':>11}{'SymPy':>11}{'operations':>12}{'factor':>9}")
        ours = outcome(ROUTES[0], columns, enough, limit)
        if ours is None:
            raise RuntimeError("robostiff.analytic gave no answer")
        print(row(ROUTES[0], ours, limit, ours), flush=True)
        for route in ROUTES[1:]:
            found = outcome(route, columns, enough, limit)
            print(row(route, found, limit, ours), flush=True)


if __name__ == "__main__":
    main()
