"""Some hundred mutated files, and defects of a reader that are complained of."""

import time

import pytest

import robostiff as rs
from tests.campaign import readers
from tests.campaign.answers import Complaint

SEED, COUNT = 2026, 200


@pytest.mark.parametrize("part", range(2))
def test_mutated_files_are_answered_or_refused(part):
    found = [readers.outcome(readers.trial(SEED, number)) for number in range(part, COUNT, 2)]
    assert not [own for own in found if isinstance(own, Complaint)]
    assert len(set(found)) >= 2


def test_trials_repeat():
    assert readers.trial(SEED, 5).files == readers.trial(SEED, 5).files


def _spin(*_, **__):
    until = time.process_time() + 20
    while time.process_time() < until:
        pass


def _fill(*_, **__):
    return [bytes(500_000_000) for _ in range(8)]


def _fail(*_, **__):
    raise KeyError("legs")


@pytest.mark.parametrize(
    ("load", "key"), [(_spin, "over 0.2 s"), (_fill, "MemoryError"), (_fail, "KeyError")]
)
def test_defects_are_found(load, key, monkeypatch):
    monkeypatch.setattr(rs, "load", load)
    monkeypatch.setattr(readers, "SECONDS", 0.2)
    monkeypatch.setattr(readers, "BY_THE_CLOCK", 30)
    kinds = ("data", "xml")
    numbers = [n for n in range(60) if readers.trial(SEED, n).source.kind in kinds][:3]
    assert [own.what for n in numbers for own in readers.judged_file(SEED, n)] == 3 * [key]
