"""Files with mistakes, and with values that are hardly meant: refused or warned of in words."""

import copy
import functools
import json
import re
import warnings
from pathlib import Path

import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.cli.main import app
from robostiff.io.document import parse_document
from robostiff.io.expression import ParameterError, parameter_values
from robostiff.io.model_file import model_from_document
from robostiff.io.snapshot import network_from_document, snapshot_from_document
from robostiff.io.urdf import read_urdf
from tests.cases.reference_case import NAMES
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


@pytest.mark.filterwarnings("ignore::robostiff.PlausibilityWarning")
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
            except rs.InputError as error:
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


PLAUSIBLE = text_of("plausible-arm.yaml")
CHAIN = [
    {"type": "spring", "kind": "R", "point": [0, 0, 0], "axis": [0, 0, 1], "k": 1e4},
    {
        "type": "beam",
        "start": [0, 0, 0],
        "end": [0.3, 0, 0],
        "y_axis": [0, 1, 0],
        "E": 2.1e11,
        "G": 8e10,
        "A": 1e-4,
        "Iy": 1e-9,
        "Iz": 1e-9,
        "J": 2e-9,
    },
]
LEGS = [{"name": "arm", "end": [0.3, 0, 0], "chain": CHAIN}]
SNAPSHOT = {"name": "arm", "reference_point": [0.3, 0, 0], "legs": LEGS}


@pytest.mark.parametrize(
    "name", [*rs.shipped_robots(), *rs.shipped_cable_robots(), *rs.shipped_linkages(), "cases"]
)
def test_what_is_right_does_not_warn(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error", rs.PlausibilityWarning)
        if name != "cases":
            rs.load(name)
            return
        for case in NAMES:
            for folder, read in (
                ("data", snapshot_from_document),
                ("graphs", network_from_document),
            ):
                file = f"tests/cases/{folder}/{case}.json"
                try:
                    text = Path(file).read_text(encoding="utf-8")
                except FileNotFoundError:
                    continue
                read(parse_document(text, file))


def test_a_warning_is_of_the_line_that_calls_and_shown_once(tmp_path):
    text = PLAUSIBLE.replace("210 GPa", "210")
    warning = "material.E: an elastic modulus of 210 Pa; in GPa? write 210 GPa"
    with pytest.warns(rs.PlausibilityWarning) as caught:
        model_from_document(parse_document(text, "arm.yaml"))
    assert any(str(w.message).endswith(warning) for w in caught), [str(w.message) for w in caught]
    assert {w.filename for w in caught} == {__file__}
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    shown = CliRunner().invoke(app, ["check", str(path)])
    assert shown.exit_code == 0
    assert "robostiff: warning: " in shown.stderr
    assert shown.stderr.count(warning) == 1
    facts = json.loads(CliRunner().invoke(app, ["check", str(path), "--json"]).stdout)
    assert facts["warnings"][0].endswith(warning)


MIXED = """robostiff: 1
name: arm
source: chosen here
parameters: {R: 300 mm, k: 2e7 N/m, k_nut: 30 N/um}
legs:
  - name: a
    chain:
      - {type: prismatic, axis: z, role: actuated, stiffness: k}
      - {type: prismatic, axis: x, role: actuated, stiffness: k_nut}
      - type: beam
        to: [0, 0, R]
        material: steel
        section: {tube: {outer_diameter: 20 mm, inner_diameter: 10 mm}}
"""


@pytest.mark.parametrize(
    ("was", "becomes", "said"),
    [
        ("k: 2e7 N/m", "k: 120", "stiffness: a stiffness of 120 N/m; in N/um? write 120 N/um"),
        ("k: 2e7 N/m", "k: 20000", "k without a unit beside 30 N/um; write 20000 N/um, or"),
        ("k: 2e7 N/m", "k: 2e7", ""),
        ("outer_diameter: 20 mm", "outer_diameter: 20", "20 without a unit beside 10 mm"),
        ("inner_diameter: 10 mm", "inner_diameter: 0.01", ""),
        ("[0, 0, R]", "[5 mm, 3, R]", "3 without a unit beside 5 mm; write 3 mm, or 3 m"),
        ("[0, 0, R]", "[5 m, 3, R]", ""),
        ("[0, 0, R]", "[900 mm, 2, R]", ""),
        ("[0, 0, R]", "[5 mmm, 3, R]", "'mmm'"),
    ],
)
def test_numbers_without_a_unit_beside_those_with_one(was, becomes, said):
    assert MIXED.count(was) == 1
    text = MIXED.replace(was, becomes)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            model_from_document(parse_document(text, "arm.yaml"))
            errors = []
        except rs.InputError as error:
            errors = [str(error)]
    errors += [str(w.message) for w in caught]
    assert [said in error for error in errors] == [True] * bool(said), errors


def test_values_of_parameters_without_the_unit_of_the_file():
    slip = "parameter k_joint = 250: 250 N/m .* in place of 4e[+]08 N/m"
    for symbols in ((), rs.ALL_PARAMETERS):
        with pytest.warns(rs.PlausibilityWarning, match=slip):
            rs.load("hexapod", {"k_joint": 250}, symbols=symbols)
    with pytest.warns(rs.PlausibilityWarning, match="parameter k = 30: 30 N/m"):
        rs.load("gough-stewart-a", {"k": "30"})
    rs.load("hexapod", {"k_joint": 2.5e8})
    rs.load("hexapod", {"k_joint": "250 N/m"})  # who writes the unit means it


def test_degrees_in_functions_and_densities_of_a_cubic_centimetre():
    for right, slip, warning in (
        ("[L, 0, 0]", '["L*cos(phi)", 0, 0]', "cos(70): an angle of 70 rad; in degrees?"),
        ("G: 81 GPa", "G: 81 GPa, density: 7.85", "7.85 kg/m^3; in g/cm^3? write 7.85 g/cm^3"),
    ):
        text = PLAUSIBLE.replace(right, slip).replace("L: 300 mm", "L: 300 mm, phi: 70")
        with pytest.warns(rs.PlausibilityWarning, match=re.escape(warning)):
            model_from_document(parse_document(text))
    # Turns by multiples of pi, and degrees with their unit, are meant.
    text = PLAUSIBLE.replace("[L, 0, 0]", '["L*cos(3*pi)", "L*sin(400 deg)", 0]')
    text = text.replace("G: 81 GPa", "G: 81 GPa, density: 7.85 g/cm^3")
    with warnings.catch_warnings():
        warnings.simplefilter("error", rs.PlausibilityWarning)
        model_from_document(parse_document(text))


def test_angles_with_their_unit_soft_materials_and_joints_near_their_beams_do_not_warn():
    text, place = json.dumps(SNAPSHOT), '"kind": "R", "point": [0, 0, 0]'
    assert place in text
    with warnings.catch_warnings():
        warnings.simplefilter("error", rs.PlausibilityWarning)
        for right, other in (("20 deg", "700 deg"), ("210 GPa", "0.07 MPa"), ("300 mm", "99 m")):
            model_from_document(parse_document(PLAUSIBLE.replace(right, other)))
        for other in ('"kind": "R", "point": [0, 0.1, 0.7]', '"kind": "P", "point": [0, 500, 0]'):
            snapshot_from_document(parse_document(text.replace(place, other)))


def test_poses_in_other_units():
    hexapod, arm = rs.load("hexapod"), rs.load("six-joint-arm")
    for pose, warning in (
        ([0, 0, 900, 0, 0, 0], "more than 100 m from home; in mm?"),
        ([0, 0, 0.9, 0, 0, 20], "rotation vector of more than a turn; in degrees?"),
    ):
        with pytest.warns(rs.PlausibilityWarning, match=re.escape(warning)):
            rs.stiffness(hexapod, pose)
    with pytest.warns(rs.PlausibilityWarning, match="did you mean JointCoordinates"):
        rs.stiffness(arm, [3, -3, 3, 0, 0, 0])
    with pytest.warns(rs.PlausibilityWarning, match="beyond two turns; in degrees"):
        rs.stiffness(arm, rs.JointCoordinates([0, -75, 90, 0, 0, 0]))
    with pytest.raises(rs.InputError, match="did you mean JointCoordinates"):
        rs.stiffness(rs.load("two-link-arm"), [0.1, 0.2])
    shown = CliRunner().invoke(app, ["stiffness", "hexapod", "--pose", "0 0 0.9 0 0 20"])
    assert "robostiff: warning: pose of 'hexapod': a rotation vector" in shown.stderr
