"""Files and numbers that are too many, too large or too small are refused, at their place."""

import json

import pytest

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.expression import ParameterError, parameter_values
from robostiff.io.model_file import model_from_document
from robostiff.io.urdf import read_urdf

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
