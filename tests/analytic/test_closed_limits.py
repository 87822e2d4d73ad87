"""Closed forms that grow, and a budget of time: refused in time, stopped, given on request."""

import itertools
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from types import SimpleNamespace

import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Closed, FormulaTooLargeError, Steps, derive_chain
from robostiff.analytic.budget import OutOfTimeError, spend, within
from robostiff.analytic.exact.closed import closed_sum
from robostiff.analytic.export import derivation_text
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


@pytest.fixture
def an_hour_a_look(monkeypatch):
    """A clock that goes on by an hour whenever it is read: no machine is too fast for a budget."""
    hours = itertools.count()
    clock = SimpleNamespace(thread_time=lambda: 3600.0 * next(hours))
    monkeypatch.setattr("robostiff.analytic.budget.time", clock)


def endless():
    while True:
        with suppress(Exception):  # as in libraries that catch all they can
            spend()


def test_what_does_not_end_is_stopped():
    with pytest.raises(OutOfTimeError, match=r"none within 0.2 s of computing"):
        within(0.2, endless)


def test_errors_of_the_computation_come_through():
    with pytest.raises(ZeroDivisionError):
        within(1.0, lambda: 1 // 0)


def test_another_thread_is_as_good_and_alone_is_stopped():
    found = []

    def work():
        try:
            within(0.2, endless)
        except OutOfTimeError as error:
            found.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join(30)
    assert len(found) == 1


def test_the_smaller_of_two_budgets_counts():
    with pytest.raises(OutOfTimeError, match="outer"):
        within(0.05, lambda: within(60.0, endless, "inner"), "outer")
    with pytest.raises(OutOfTimeError, match="inner"):
        within(60.0, lambda: within(0.05, endless, "inner"), "outer")
    spend()  # outside of all budgets


def test_a_record_that_does_not_end_says_what_makes_it_shorter():
    with pytest.raises(OutOfTimeError, match=r"record of a formula.*let its dimensions be symbols"):
        within(0.2, endless, "record of a formula")


@pytest.mark.usefixtures("an_hour_a_look")
def test_numbers_with_roots_that_once_grew_without_end_are_recorded_in_time():
    assert rs.derive("h4", budget=0.02).definitions


@pytest.mark.usefixtures("an_hour_a_look")
def test_steps_are_the_answer_when_time_ends():
    derivation = rs.derive("hexapod-pus", budget=0.03)
    assert derivation.definitions
    assert derivation.remark == "A closed form did not end within 0.03 s of computing."
    assert derivation.remark in derivation_text(derivation).replace("\n", " ")


@pytest.mark.usefixtures("an_hour_a_look")
def test_a_closed_form_that_was_wanted_is_an_error():
    with pytest.raises(FormulaTooLargeError, match=r"form=Steps\(\), or a larger budget"):
        rs.derive("hexapod-pus", form=Closed(10**6), budget=0.03)


def test_steps_need_no_budget():
    assert rs.derive("planar-link", form=Steps(), budget=1e-6).remark == ""
