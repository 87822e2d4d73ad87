"""A budget of time: what does not end in time is stopped, and the answer says so."""

import itertools
import threading
from contextlib import suppress
from types import SimpleNamespace

import pytest

import robostiff as rs
from robostiff.analytic import Closed, FormulaTooLargeError, Steps
from robostiff.analytic.budget import OutOfTimeError, spend, within
from robostiff.analytic.export import derivation_text


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
