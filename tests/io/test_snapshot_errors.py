"""What a snapshot file may not say, and the message with its place."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.errors import FileError
from robostiff.io.document import parse_document
from robostiff.io.snapshot import snapshot_from_document

# One element a line, so that lines can be counted.
TEXT = """{
 "name": "arm", "reference_point": [0.5, 0, 0], "planar": false,
 "legs": [{"name": "left", "end": [0.5, 0, 0],
  "chain": [
   {"type": "passive", "kind": "R", "point": [0, 0, 0], "axis": [0, 0, 1]},
   {"type": "beam", "start": [0, 0, 0], "end": [0.5, 0, 0], "y_axis": [0, 1, 0],
    "E": 2.1e11, "G": 8e10, "A": 8e-4, "Iy": 3e-8, "Iz": 1e-7, "J": 7e-8},
   {"type": "spring", "kind": "P", "point": [0.5, 0, 0], "axis": [1, 0, 0], "k": 2e6},
   {"type": "spring6", "point": [0.5, 0, 0], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "compliance": [[1e-6, 0, 0, 0, 0, 0], [0, 1e-6, 0, 0, 0, 0], [0, 0, 1e-6, 0, 0, 0],
     [0, 0, 0, 1e-3, 0, 0], [0, 0, 0, 0, 1e-3, 0], [0, 0, 0, 0, 0, 1e-3]]}
  ]}]
}
"""
BEAM = TEXT[TEXT.index('{"type": "beam"') : TEXT.index(',\n   {"type": "spring",')]
SPRING6 = TEXT[TEXT.index('{"type": "spring6"') : TEXT.index("\n  ]}]")]
MATRIX = SPRING6[SPRING6.index("[[1e-6") : -1]

# What is replaced, by what, and the message after "arm.json:".
WRONG = [
    ('"axis": [0', '"axes": [0',
     "5:57: legs[0].chain[0].axes: unknown key: expected one of kind, point, axis, type, pitch, "
     "name, note; did you mean axis?"),
    ('"reference_point"', '"refrence_point"',
     "2:17: refrence_point: unknown key: expected one of name, reference_point, legs, description, "
     "planar, gravity, $schema, units, frame, order, params, oracle, peers, note, notes, masses; "
     "did you mean reference_point?"),
    ('"k": 2e6', '"k": 2e6, "E": 2e11',
     "8:87: legs[0].chain[2].E: unknown key: expected one of kind, point, axis, type, k, pitch, "
     "name, note, inertia"),
    (', "J": 7e-8', "",
     "6:4: legs[0].chain[1].J: missing key; J is the Saint-Venant torsion constant [m^4]"),
    ('"reference_point": [0.5, 0, 0], ', "",
     "1:1: reference_point: missing key; reference_point is the point of the platform about which "
     "stiffness is given [m]"),
    ('"type": "passive", ', "",
     "5:4: legs[0].chain[0].type: missing key: expected one of passive, spring, beam, spring6, "
     "parallel"),
    ('"passive"', '"passiv"',
     "5:13: legs[0].chain[0].type: unknown word: got 'passiv', expected one of passive, spring, "
     "beam, spring6, parallel; did you mean passive?"),
    ('"kind": "P"', '"kind": "p"',
     "8:31: legs[0].chain[2].kind: unknown word: got 'p', expected 'R' or 'P' or 'H'; did you mean "
     "P?"),
    ('"axis": [0, 0, 1]', '"axis": [0, 0, NaN]',
     "5:72: legs[0].chain[0].axis[2]: wrong value: got nan, expected a finite number"),
    ("2e6", '"2e6"',
     "8:82: legs[0].chain[2].k: wrong value: got '2e6', expected a number; write it without "
     "quotes"),
    ("2e6", '"2 N/um"', "8:82: legs[0].chain[2].k: wrong value: got '2 N/um', expected a number"),
    ("2e6", "0", "8:82: legs[0].chain[2].k: wrong value: got 0, expected a positive number"),
    ('"end": [0.5, 0, 0],\n', '"end": [0.5, 0, 0, 1],\n',
     "3:35: legs[0].end: wrong length: got 4 values, expected 3 values"),
    ('"end": [0.5, 0, 0],\n', '"end": 0.5,\n',
     "3:35: legs[0].end: wrong value: got 0.5, expected a list"),
    (", [0, 0, 0, 0, 0, 1e-3]", "",
     "10:19: legs[0].chain[3].compliance: wrong length: got 5 values, expected 6 values"),
    (TEXT[TEXT.index('"chain": [') : TEXT.rindex("]}]")], '"chain": [',
     "4:12: legs[0].chain: wrong length: got 0 values, expected at least 1 value"),
    (BEAM, '"beam"', "6:4: legs[0].chain[1]: wrong value: got 'beam', expected a mapping"),
    ('"name": "left"', '"name": ""',
     "3:20: legs[0].name: wrong value: got '', expected a text of at least 1 character"),
    ('"planar": false', '"planar": "no"',
     "2:59: planar: wrong value: got 'no', expected true or false"),
    ('"kind": "R", "point": [0, 0, 0]', '"kind": "S", "point": 0',
     "5:32: legs[0].chain[0].kind: unknown word: got 'S', expected 'R' or 'P' or 'H'\n"
     "arm.json:5:46: legs[0].chain[0].point: wrong value: got 0, expected a list"),
    ('"axis": [1, 0, 0]', '"axis": [0, 0, 0]',
     "8:66: legs[0].chain[2].axis: axis: got [0, 0, 0], expected a direction; a zero vector points "
     "nowhere"),
    ('"start": [0, 0, 0]', '"start": [0.5, 0, 0]',
     "6:50: legs[0].chain[1].end: beam of no length: got [0.5, 0, 0], expected a point other than "
     "its start"),
    ('"y_axis": [0, 1, 0]', '"y_axis": [-2, 0, 0]',
     "6:71: legs[0].chain[1].y_axis: y axis of the section: got [-2, 0, 0], expected a direction "
     "across the beam"),
    ('"J": 7e-8', '"J": 7e-8, "shear_factor_z": 0.85',
     "6:4: legs[0].chain[1]: shear factors: got shear_factor_z alone, expected shear_factor_y and "
     "shear_factor_z, or neither"),
    ("[[1, 0, 0], [0, 1, 0]", "[[1, 0.5, 0], [0, 1, 0]",
     "9:58: legs[0].chain[3].rotation: rotation: got [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]], expected "
     "orthonormal columns (R^T R differs from the identity by 0.5); the columns are the turned "
     "axes, of unit length and perpendicular; write six decimals or more"),
    ("[[1, 0, 0], [0, 1, 0]", "[[-1, 0, 0], [0, 1, 0]",
     "9:58: legs[0].chain[3].rotation: rotation: got [[-1, 0, 0], [0, 1, 0], [0, 0, 1]], expected "
     "a right-handed frame (determinant +1, not -1); a mirror image is no rotation: flip the sign "
     "of one column"),
    ("[[1e-6, 0, 0, 0, 0, 0]", "[[1e-6, 0, 0, 0, 0, 1e-5]",
     "10:19: legs[0].chain[3].compliance: compliance matrix, entries [dx, Mz] = 1e-05 and [rz, Fx] "
     "= 0: expected a symmetric matrix; rows are (dx, dy, dz, rx, ry, rz), columns (Fx, Fy, Fz, "
     "Mx, My, Mz); the scatter of a measurement is averaged by (M + M.T) / 2"),
    ("[[1e-6, 0, 0, 0, 0, 0]", "[[-1e-6, 0, 0, 0, 0, 0]",
     "10:19: legs[0].chain[3].compliance: compliance matrix, eigenvalue -1e-06 m/N along Fx "
     "(rotations scaled by 0.0183 m): expected no negative eigenvalue: a spring does not push in "
     "the direction it is pulled; look for a wrong sign, a wrong unit in the rotation rows, or "
     "missing digits"),
    ('"compliance": ', f'"K": {MATRIX}, "compliance": ',
     "9:4: legs[0].chain[3]: matrix of the spring: got both, expected one of K and compliance"),
    (f',\n    "compliance": {MATRIX}', "",
     "9:4: legs[0].chain[3]: matrix of the spring: got neither, expected one of K and compliance"),
    (TEXT[TEXT.index(',\n   {"type": "beam"') : TEXT.index("\n  ]}]")], "",
     "4:12: legs[0].chain: leg left without compliance: expected at least one beam, spring or "
     "spring6; a leg of rigid parts and passive joints alone has no stiffness matrix"),
    ('"legs"', '"graph"', "3:2: graph: a graph, and not legs; read it with load"),
    ('"legs"', '"graph": {}, "legs"',
     "3:2: graph: unknown key: expected one of name, reference_point, legs, description, planar, "
     "gravity, $schema, units, frame, order, params, oracle, peers, note, notes, masses"),
    ('"k": 2e6', '"k": 2e6, "k": 3e6',
     "8:87: legs[0].chain[2].k: duplicate key: got 'k', expected each key once; line 8 has it "
     "already"),
]  # fmt: skip


def complaint(text: str) -> str:
    with pytest.raises(FileError) as caught:
        snapshot_from_document(parse_document(text, file="arm.json"))
    return str(caught.value)


def test_the_text_itself_reads():
    snapshot = snapshot_from_document(parse_document(TEXT, file="arm.json"))
    assert len(snapshot.legs[0].elements) == 4


@pytest.mark.parametrize(("old", "new", "message"), WRONG)
def test_message_and_place(old, new, message):
    assert old in TEXT
    assert complaint(TEXT.replace(old, new, 1)) == f"arm.json:{message}"


def test_names_are_unique_in_a_leg():
    text = TEXT.replace('"type": "beam"', '"name": "boom", "type": "beam"')
    text = text.replace('"k": 2e6', '"k": 2e6, "name": "boom"')
    assert complaint(text) == (
        "arm.json:8:95: legs[0].chain[2].name: name of the element: got 'boom', "
        "expected a name that no other has"
    )


def test_names_of_legs_are_unique():
    leg = TEXT[TEXT.index('{"name": "left"') : TEXT.rindex("]\n")]
    text = TEXT.replace(leg, f"{leg},\n{leg}")
    assert complaint(text) == (
        "arm.json:13:10: legs[1].name: name of the leg: got 'left', "
        "expected a name that no other has"
    )


PLANAR = """{"name": "arm", "planar": true, "reference_point": [0, 0, 0],
"legs": [{"name": "leg", "end": [0, 0, 0], "chain": [
{"type": "spring", "kind": "R", "point": [0, 0, 9], "axis": [0, 0, 1], "k": 9},
"""
LEANS = "of a joint of a planar robot: got [0, 3, 4], expected"
IN_PLANE = "planar robots move in the x-y plane; leave planar: out for any other"
BENDS = (
    "legs[0].chain[1]: part of a planar robot that a load in the plane bends out of it: expected "
    "parts at the height of the reference point, a principal axis along z"
)
SPATIAL = "without planar: true the robot is spatial"


@pytest.mark.parametrize(
    ("element", "message"),
    [
        (
            '{"axis": [0, 3, 4], "type": "passive", "kind": "R", "point": [0, 0, 0]}',
            f"4:10: legs[0].chain[1].axis: axis {LEANS} an axis along z of the world; {IN_PLANE}",
        ),
        (
            '{"axis": [0, 3, 4], "type": "spring", "kind": "P", "point": [0, 0, 0], "k": 1}',
            f"4:10: legs[0].chain[1].axis: direction {LEANS} a direction in the x-y plane of the "
            f"world; {IN_PLANE}",
        ),
        (BEAM.replace("[0, 1, 0]", "[0, 1, 1]"), f"4:1: {BENDS}; {SPATIAL}"),
        (BEAM.replace("[0.5, 0, 0]", "[0.5, 0, 0.1]"), f"4:1: {BENDS}; {SPATIAL}"),
    ],
)
def test_planar_robots_stay_in_the_plane(element, message):
    assert complaint(f"{PLANAR}{element}]}}]}}") == f"arm.json:{message}"


def test_numbers_beyond_all_measure():
    assert complaint(TEXT.replace("2.1e11", "1e-320")) == (
        "arm.json:6:4: legs[0].chain[1]: compliance of the beam: expected finite numbers; "
        "check the units of the beam"
    )
    far = complaint(TEXT.replace('"end": [0.5, 0, 0], "y', '"end": [1e300, 0, 0], "y'))
    assert "legs[0].chain[1].end[0]: wrong value: got 1e+300, expected a number of at most" in far


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["type", "kind", "point", "axis", "k", "K"]), inner)
    ),
    max_leaves=8,
)
PATHS = [
    (),
    ("name",),
    ("legs",),
    ("legs", 0),
    ("legs", 0, "end"),
    ("legs", 0, "chain"),
    *(("legs", 0, "chain", i) for i in range(4)),
    ("legs", 0, "chain", 0, "type"),
    ("legs", 0, "chain", 0, "axis"),
    ("legs", 0, "chain", 1, "y_axis"),
    ("legs", 0, "chain", 1, "E"),
    ("legs", 0, "chain", 1, "start", 0),
    ("legs", 0, "chain", 3, "rotation", 1),
    ("legs", 0, "chain", 3, "compliance", 4, 4),
    ("legs", 0, "chain", 3, "compliance", 1, 4),
]


@pytest.mark.filterwarnings("ignore::robostiff.errors.PlausibilityWarning")
@given(st.sampled_from(PATHS), values)
def test_anything_anywhere_is_read_or_refused_with_its_place(path, value):
    data = {"top": json.loads(TEXT)}
    *parents, last = ("top", *path)
    inside = data
    for step in parents:
        inside = inside[step]
    inside[last] = value
    document = parse_document(json.dumps(data["top"]), file="arm.json")
    error = None
    try:
        snapshot_from_document(document)
    except FileError as caught:
        error = caught
    if error is not None:
        assert error.location.file == "arm.json"
        assert error.location.line == 1
        for line in str(error).splitlines():
            assert line.strip().startswith("arm.json:1:")
