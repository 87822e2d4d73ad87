"""Closed forms that grow: refused in time, given on request, interrupted at once."""

import signal
import subprocess
import sys
import time

import pytest
import sympy as sp

from robostiff.analytic import Closed, FormulaTooLargeError, Steps, derive_chain
from robostiff.analytic.exact.closed import closed_sum
from tests.interrupts import interrupts_heard

FULL = sp.Matrix(6, 6, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))
INTERRUPTED = """
import sympy as sp
from robostiff.analytic import Closed, derive_chain
from tests.analytic.test_closed_limits import FULL, general
print("started", flush=True)
derive_chain(FULL, general(3), Closed(limit=10**9))
"""


def general(number):
    """Joints whose axis e and place r are symbols, J = (e x r, e), eq. (17)."""
    joints = {}
    for k in range(number):
        e = sp.Matrix(sp.symbols(f"e{k}x e{k}y e{k}z"))
        r = sp.Matrix(sp.symbols(f"r{k}x r{k}y r{k}z"))
        joints[f"j{k}"] = [*e.cross(r), *e]
    return joints


@pytest.mark.parametrize("number", [2, 5])
def test_more_general_joints_have_few_steps(number):
    assert len(derive_chain(FULL, general(number), Steps()).definitions) <= 28 * number


def test_two_general_joints_are_given_on_request():
    # Only the last stage is looked at, and not written: that takes seconds and 400 MB.
    sparse = sp.diag(*sp.symbols("k1:7"))
    derivation = derive_chain(sparse, general(2), Closed(limit=500_000))
    stepped = derive_chain(sparse, general(2), Steps())
    values = {symbol: sp.Integer(3 + 2 * i) for i, symbol in enumerate(derivation.symbols)}
    assert derivation.substituted(values) == stepped.substituted(values)


def test_entries_of_all_legs_that_nobody_reads_are_refused():
    # Six legs whose entries each were short enough had 300,000 operations together.
    a, b, k = sp.symbols("a b k", positive=True)
    legs = [([[1, x, x * a]], [[1 / k + x]]) for x in (a, b, a + b)]
    assert closed_sum(legs, 3, 100, 200).K.shape == (3, 3)
    with pytest.raises(FormulaTooLargeError, match=r"form=Steps\(\)"):
        closed_sum(legs, 3, 100, 40)


def test_interruption_is_heard():
    with interrupts_heard():
        process = subprocess.Popen(
            [sys.executable, "-c", INTERRUPTED],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert process.stdout is not None
    assert process.stdout.readline() == "started\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, complaint = process.communicate(timeout=30)
    assert "KeyboardInterrupt" in complaint
    assert process.returncode == -signal.SIGINT
