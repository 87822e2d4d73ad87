"""Seconds for the canonical closed form of a leg with a full stiffness matrix of 21 symbols.

The first n of the five joints of eq. (21), by the recursion (15): with SymPy matrices and `cancel`,
with SymPy's fraction field (the arithmetic of its DomainMatrix), and with robostiff.analytic. One
thread; a route that takes longer than the limit is stopped.
"""

import multiprocessing
import time
from collections.abc import Callable
from queue import Empty
from typing import Any

import sympy as sp

from robostiff.analytic import derive_chain

LIMIT = 60.0
L = sp.Symbol("L", positive=True)
K0 = sp.Matrix(6, 6, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))
JOINTS = {
    "Rx": [0, 0, 0, 1, 0, 0],
    "Ry": [0, 0, 0, 0, 1, 0],
    "Rz": [0, 0, 0, 0, 0, 1],
    "Ry+": [0, 0, -L, 0, 1, 0],
    "Rz+": [0, L, 0, 0, 0, 1],
}


def with_sympy_matrices(joints: dict[str, Any]) -> None:
    K = K0
    for column in joints.values():
        J = sp.Matrix(column)
        u = K * J
        mu = (J.T * u)[0]
        K = (K - u * u.T / mu).applyfunc(sp.cancel)


def with_fraction_field(joints: dict[str, Any]) -> None:
    symbols = sorted({*K0.free_symbols, L}, key=str)
    field = sp.QQ.frac_field(*symbols)
    K = [[field.from_sympy(K0[i, j]) for j in range(6)] for i in range(6)]
    for column in joints.values():
        J = [field.from_sympy(sp.sympify(entry)) for entry in column]
        u = [sum((K[i][k] * J[k] for k in range(6)), field.zero) for i in range(6)]
        mu = sum((J[k] * u[k] for k in range(6)), field.zero)
        K = [[K[i][j] - u[i] * u[j] / mu for j in range(6)] for i in range(6)]


def with_robostiff(joints: dict[str, Any]) -> None:
    derive_chain(K0, joints)


ROUTES: dict[str, Callable[[dict[str, Any]], None]] = {
    "SymPy matrices": with_sympy_matrices,
    "SymPy fraction field": with_fraction_field,
    "robostiff.analytic": with_robostiff,
}


def _timed(route: str, joints: dict[str, Any], answer: Any) -> None:
    start = time.perf_counter()
    ROUTES[route](joints)
    answer.put(time.perf_counter() - start)


def seconds(route: str, joints: dict[str, Any]) -> float | None:
    """Time of a route in a process of its own; None beyond the limit."""
    answer: Any = multiprocessing.Queue()
    process = multiprocessing.Process(target=_timed, args=(route, joints, answer))
    process.start()
    try:
        return answer.get(timeout=LIMIT)
    except Empty:
        return None
    finally:
        process.terminate()
        process.join()


def main() -> None:
    print("seconds for a closed form, full K0 of 21 symbols, joints of eq. (21)")
    print(f"{'joints':>6}" + "".join(f"{route:>24}" for route in ROUTES))
    for n in range(1, 6):
        joints = dict(list(JOINTS.items())[:n])
        times = [seconds(route, joints) for route in ROUTES]
        cells = [f"> {LIMIT:.0f}" if t is None else f"{t:.4f}" for t in times]
        print(f"{n:>6}" + "".join(f"{cell:>24}" for cell in cells))


if __name__ == "__main__":
    main()
