"""A budget of time: what does not end in time is stopped, and the answer says so."""

import gc
import subprocess
import sys
import threading
import time
from contextlib import suppress

import pytest

import robostiff as rs
from robostiff.analytic import Closed, FormulaTooLargeError, Steps
from robostiff.analytic.budget import OutOfTimeError, within
from robostiff.analytic.export import derivation_text


def endless():
    while True:
        with suppress(Exception):  # as in libraries that catch all they can
            sum(range(1000))


def test_what_does_not_end_is_stopped():
    with pytest.raises(OutOfTimeError, match=r"none within 0.2 s of computing"):
        within(0.2, endless)


def test_what_ends_in_time_is_returned_and_nothing_comes_after():
    assert within(0.15, lambda: 42) == 42
    end = time.thread_time() + 0.6
    while time.thread_time() < end:
        sum(range(1000))


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


class Slow:
    """What takes its time when it is collected."""

    def __del__(self):
        wait_in_python(0.03)


def wait_in_python(seconds):
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        sum(range(100))


def test_a_stop_is_not_lost_in_a_callback_of_the_garbage_collector():
    # pytest makes an error of an exception that the interpreter could only print
    def callback(phase, info):
        wait_in_python(0.03)

    def collect():
        while True:
            gc.collect(0)
            wait_in_python(0.03)

    gc.callbacks.append(callback)
    try:
        with pytest.raises(OutOfTimeError):
            within(0.2, collect)
    finally:
        gc.callbacks.remove(callback)


def test_a_stop_is_not_lost_in_a_finalizer():
    def finalize():
        while True:
            Slow()
            wait_in_python(0.03)

    with pytest.raises(OutOfTimeError):
        within(0.2, finalize)


def test_numbers_that_grow_on_the_way_to_a_formula_are_stopped(monkeypatch):
    monkeypatch.setattr("robostiff.analytic.robot_formula.BUDGET", 0.02)
    with pytest.raises(OutOfTimeError, match=r"record of a formula.*let its dimensions be symbols"):
        rs.derive("h4", budget=0.02)


PROFILED = """
import contextlib, sys, time
from robostiff.analytic.budget import OutOfTimeError, within

def endless():
    while True:
        sum(range(1000))

within(5.0, lambda: sum(range(1000)))
with contextlib.suppress(OutOfTimeError):
    within(0.1, endless)
events = []
sys.setprofile(lambda *event: events.append(event[1]))
sum(map(abs, range(10)))
(lambda: None)()
sys.setprofile(None)
print(events.count("call"))
"""


def test_programs_can_be_profiled_after_it():
    command = [sys.executable, "-c", PROFILED]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout == "1\n"


@pytest.mark.parametrize("budget", [0, -1, "20", True, float("nan")])
def test_a_budget_is_a_positive_number(budget):
    with pytest.raises(rs.InputError, match="budget of time"):
        rs.derive("planar-link", budget=budget)


def test_steps_are_the_answer_when_time_ends():
    derivation = rs.derive("hexapod-pus", budget=0.03)
    assert derivation.definitions
    assert derivation.remark == "A closed form did not end within 0.03 s of computing."
    assert derivation.remark in derivation_text(derivation).replace("\n", " ")
    assert rs.derive("planar-link").remark == ""


def test_a_closed_form_that_was_wanted_is_an_error():
    with pytest.raises(FormulaTooLargeError, match=r"form=Steps\(\), or a larger budget"):
        rs.derive("hexapod-pus", form=Closed(10**6), budget=0.03)


def test_steps_need_no_budget():
    assert rs.derive("planar-link", form=Steps(), budget=1e-6).remark == ""
