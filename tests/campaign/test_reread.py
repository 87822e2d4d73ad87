"""Files by a reader of its own, and mutated ones: answered as they should, or refused."""

import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from tests.campaign import readers
from tests.campaign.answers import Complaint
from tests.campaign.reread_answers import KINDS, SHIPPED, compared, drawn, is_right
from tests.project.shown_output import ROOT

FILES = (
    *SHIPPED.glob("*.yaml"),
    *(path for path in (ROOT / "examples").glob("*.yaml") if "stiffness" not in path.name),
    ROOT / "docs/star-platform.yaml",
    *Path(__file__).with_name("machines").glob("*.yaml"),
)


@pytest.mark.parametrize("path", sorted(FILES), ids=lambda path: path.stem)
def test_files_that_are_shipped(path: Path):
    answers = list(compared(path, np.random.default_rng(1), poses=2))
    assert [own for own in answers if not is_right(own)] == []
    assert "K" in answers[0]


@pytest.mark.parametrize("part", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_random_files(kind: str, part: int, tmp_path: Path):
    found = 0
    for number in range(4 * part, 4 * part + 4):
        path = drawn(kind, 20261123, number, tmp_path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rs.PlausibilityWarning)
            try:
                answers = list(compared(path, np.random.default_rng([20261123, number])))
            except (rs.FileError, rs.NoAnswerError):  # too short a telescope
                continue
        assert [own for own in answers if not is_right(own)] == [], number
        found += sum("K" in own for own in answers)
    assert found >= 6


def test_a_thousandth_of_a_millimetre_is_seen():
    path = SHIPPED / "3-rps.yaml"
    (right,) = compared(path, np.random.default_rng(1), poses=1)
    (wrong,) = compared(path, np.random.default_rng(1), poses=1, given={"r": "200.001 mm"})
    assert is_right(right)
    assert not is_right(wrong)


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
