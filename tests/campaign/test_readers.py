"""Some hundred mutated files, and that the campaign sees what it is there to see."""

import time

import pytest

import robostiff as rs
from tests.campaign import readers

SEED, COUNT = 2026, 200


@pytest.mark.parametrize("part", range(2))
def test_mutated_files_are_answered_or_refused(part):
    tally = readers.run_part(SEED, range(part, COUNT, 2))
    assert not tally.failures
    assert len(tally.outcomes) >= 2


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
def test_defects_are_found_shrunk_and_saved(load, key, tmp_path, monkeypatch):
    monkeypatch.setattr(rs, "load", load)
    monkeypatch.setattr(readers, "SECONDS", 0.2)
    monkeypatch.setattr(readers, "BY_THE_CLOCK", 30)
    kinds = ("data", "xml")
    numbers = [n for n in range(60) if readers.trial(SEED, n).source.kind in kinds][:3]
    tally = readers.run_part(SEED, numbers, tmp_path)
    assert sum(map(len, tally.failures.values())) == 3
    assert all(found.startswith(key) for found in tally.failures)
    (saved,) = tmp_path.glob("readers-*")
    assert key in (saved / "failure.txt").read_text()
    assert len(list(saved.iterdir())) >= 2
