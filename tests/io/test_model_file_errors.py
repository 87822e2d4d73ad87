"""Any slip in a model file is refused in words with its place; the words are in `slips.txt`."""

import copy
import functools
import json

import pytest

from robostiff.errors import InputError
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from tests.files import text_of

ROBOT = text_of("three-legs.yaml")
DRIVE = "{type: prismatic, axis: z, role: actuated, stiffness: k}"


def test_the_robots_themselves_are_right():
    assert len(model_from_document(parse_document(ROBOT)).legs) == 3
    for part in ("to: [1, 0, 0]", "turn: [{x: 90 deg}]"):  # over and back
        robot = model_from_document(parse_document(PLANAR.replace("to: [1, 0, 0]", part)))
        assert robot.name == "crank"


PLANAR = text_of("crank.yaml")


ODD = (None, [], {}, "", -1, 0, 1e308, "1e300 m", True, "x", [1, 2, 3], {"a": 1}, "90 deg", [[1]])


def entries(data, path=()):
    """The paths of all entries of a document."""
    for step, value in data.items() if isinstance(data, dict) else enumerate(data):
        yield (*path, step)
        if isinstance(value, (dict, list)):
            yield from entries(value, (*path, step))


@pytest.mark.parametrize("text", [ROBOT, PLANAR])
def test_any_entry_replaced_or_missing_is_refused_in_words(text):
    data = parse_document(text).data
    refusals = []
    for path in entries(data):
        for odd in (*ODD, "left out"):
            mutant = copy.deepcopy(data)
            *parents, last = path
            holder = functools.reduce(lambda part, step: part[step], parents, mutant)
            if odd == "left out":
                del holder[last]
            else:
                holder[last] = odd
            try:
                model_from_document(parse_document(json.dumps(mutant), file="robot.json"))
            except InputError as error:
                refusals.append(str(error))
    assert len(refusals) > 300
    assert all(words.startswith("robot.json:1:") for words in refusals)
