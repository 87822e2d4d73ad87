"""Any slip in a model file is refused in words with its place; the words are in `slips.txt`."""

import copy
import functools
import json

import pytest

from robostiff.errors import InputError
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document

ROBOT = """\
robostiff: 1
name: demo
source: a test
parameters: {R: 500 mm, k: 1e6 N/m}
home: {at: [0, 0, 800 mm]}
legs:
  repeat:
    - {name: leg1, phi: 0 deg}
    - {name: leg2, phi: 120 deg}
    - {name: leg3, phi: 240 deg}
  base: {at: [R*cos(phi), R*sin(phi), 0], turn: [{z: phi}]}
  chain:
    - {type: universal, axes: [y, x], role: passive}
    - {type: prismatic, axis: z, role: actuated, stiffness: k}
    - {type: spherical, role: passive}
  platform: {at: [200 mm * cos(phi), 200 mm * sin(phi), 0]}
"""
DRIVE = "{type: prismatic, axis: z, role: actuated, stiffness: k}"


def test_the_robots_themselves_are_right():
    assert len(model_from_document(parse_document(ROBOT)).legs) == 3
    for part in ("to: [1, 0, 0]", "turn: [{x: 90 deg}]"):  # over and back
        robot = model_from_document(parse_document(PLANAR.replace("to: [1, 0, 0]", part)))
        assert robot.name == "crank"


PLANAR = """\
robostiff: 1
name: crank
source: a test
planar: true
legs:
  - name: arm
    chain:
      - {type: revolute, axis: z, role: actuated, stiffness: 1e4 N m/rad}
      - {type: rigid, to: [1, 0, 0]}
      - {type: prismatic, axis: x, role: actuated, stiffness: 1e6 N/m}
"""


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
