"""Answers are those written; `python -m tests.answers --write` where they are meant to differ."""

import json

from tests.answers.answers import FILE, all_answers, differences, written

KNOWN = json.loads(FILE.read_text(encoding="utf-8"))


def test_answers_are_those_that_were_written():
    now = json.loads(written(all_answers()))
    assert list(now) == list(KNOWN)
    found = [one for name in KNOWN for one in differences(name, now[name], KNOWN[name])]
    assert not found, "\n".join([*found, "meant so? python -m tests.answers --write"])


def test_a_difference_is_seen():
    """Of a part in 10^8, of a word, and of an answer more."""
    name = "hexapod"
    for question, value in (("K", None), ("status", "unstable"), ("rank", 5), ("more", [1.0])):
        other = dict(KNOWN[name])
        other[question] = [x * (1 + 1e-8) for x in other["K"]] if value is None else value
        assert differences(name, other, KNOWN[name]), question
    assert not differences(name, KNOWN[name], KNOWN[name])


def test_file_is_small():
    assert FILE.stat().st_size < 1_000_000
