"""Slips in model files, and files and numbers that are too many or too large, are refused."""

import copy
import functools
import json

import pytest

import robostiff as rs
from robostiff.errors import InputError
from robostiff.io.document import parse_document
from robostiff.io.expression import ParameterError, parameter_values
from robostiff.io.model_file import model_from_document
from robostiff.io.urdf import read_urdf
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


BEAM = "{type: beam, to: [L, 0, 0], material: steel, section: {circle: {diameter: d}}}"
ARM = f"""robostiff: 1
name: arm
source: chosen here
parameters: {{L: 300 mm, d: 20 mm}}
legs:
  - name: arm
    chain:
      - {BEAM}
"""


def _refused(text, parameters=None, file="arm.yaml"):
    with pytest.raises(rs.InputError) as error:
        model_from_document(parse_document(text, file), parameters)
    return str(error.value)


def test_a_hundred_thousand_keys_are_refused_before_they_are_read():
    many = {f"k{i}": 1 for i in range(100_000)}
    text = ARM + "".join(f"{key}: 1\n" for key in many)
    assert "too many values in YAML: got 100014 lines and commas" in _refused(text)
    assert "too many keys: got more than 10000" in _refused(json.dumps(many), file="arm.json")


def test_very_many_mistakes_are_counted():
    data = {"robostiff": 1, "name": "arm", "source": "chosen here", "legs": [{"nam": 1}] * 2_000}
    message = _refused(json.dumps(data), file="arm.json")
    assert message.startswith("arm.json:1:")
    first, *shown, rest = message.splitlines()
    assert "legs[0].nam: unknown key" in first
    assert len(shown) == 20
    # Of every leg a misspelt name and a missing chain; some of the names that are missing, too.
    assert 3_979 <= int(rest.removeprefix("and ").removesuffix(" more errors")) <= 5_979


def test_parameters_legs_elements_and_links_are_bounded():
    with pytest.raises(ParameterError, match=r"k4000: got 5000 parameters, expected at most 4000"):
        parameter_values({f"k{i}": i for i in range(5000)})
    repeated = ARM.replace("- name: arm", "- repeat: {count: 1000, variable: i}")
    assert "legs (in leg201): got more than 200, expected at most 200" in _refused(repeated)
    long = ARM + f"      - {BEAM}\n" * 300
    assert "chain[200]: elements of a chain: got 301, expected at most 200" in _refused(long)


def test_links_of_a_description_are_bounded(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text("<robot name='r'>" + "".join(f"<link name='l{i}'/>" for i in range(2001)))
    path.write_text(path.read_text() + "</robot>")
    with pytest.raises(rs.FileError, match="links: got 2001, expected at most 2000"):
        read_urdf(path)
