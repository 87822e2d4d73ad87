"""Slips in model files: each complaint says where, what came, what was expected, what to write."""

import copy
import functools
import json

import pytest

from robostiff.errors import FileError, InputError
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


def complaint(*changes, parameters=None):
    text = ROBOT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    with pytest.raises(FileError) as caught:
        model_from_document(parse_document(text, file="robot.yaml"), parameters)
    return str(caught.value)


def complaint_of(element):
    """The complaint about an element in the place of the drive, without file and line."""
    message = complaint((DRIVE, element))
    assert message.startswith("robot.yaml:14:")
    return message.split(": ", 1)[1]


def test_the_robot_itself_is_right():
    assert len(model_from_document(parse_document(ROBOT)).legs) == 3


# --- the top ---


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("robostiff: 1\n", ""),
         "robot.yaml:1:1: model file: expected robostiff: 1 at the top, the version of the format"),
        (("robostiff: 1", "robostiff: 2"),
         "robot.yaml:1:12: robostiff: version of the model file format: got 2, expected 1; this "
         "file needs a newer robostiff"),
        (("source: a test\n", ""),
         "robot.yaml:1:1: source: missing key; source is where the numbers come from, in a "
         "sentence"),
        (("source: a test", "source: '  '"),
         "robot.yaml:3:9: source: wrong value: got '  ', expected a text of at least 1 character"),
        (("home: {at: [0, 0, 800 mm]}\n", ""),
         "robot.yaml:1:1: home: missing key; home is the pose of the platform, for a robot with "
         "several legs; write home: {at: [0, 0, 800 mm]} or the like"),
        (("legs:", "coordinates: [x, x]\nlegs:"),
         "robot.yaml:6:14: coordinates: coordinates: got ['x', 'x'], expected each one once"),
        (("legs:", "reference_point: [0, 0]\nlegs:"),
         "robot.yaml:6:18: reference_point: wrong length: got 2 values, expected 3 values"),
    ],
)  # fmt: skip
def test_top_level(change, message):
    assert complaint(change) == message


def test_misspelt_keys_name_the_nearest():
    assert complaint(("legs:", "lgs:")).startswith("robot.yaml:6:1: lgs: unknown key: expected one")
    for change, place in (
        (("legs:", "lgs:"), "did you mean legs?"),
        (("role: actuated", "rle: actuated"), "did you mean role?"),
        (("stiffness:", "stifness:"), "did you mean stiffness?"),
        (("base:", "bse:"), "did you mean base?"),
        (("turn:", "trun:"), "did you mean turn?"),
    ):
        assert complaint(change).endswith(place)


@pytest.mark.parametrize(
    "change",
    [
        ("[0, 0, 800 mm]", "[max(R, 1 m), 0, 0]"),
        ("{R: 500 mm, k: 1e6 N/m}", "{R: max(1 m, 2 m), k: 1e6 N/m}"),
        ("[{z: phi}]", "[{z: atan2(1, phi)}]"),
    ],
)
def test_expressions_that_yaml_cuts_at_commas(change):
    assert complaint(change).endswith('in quotes, such as "atan2(h, b)"')


# --- values ---


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("8 deg", "length: got '8 deg', expected a length, such as 300 mm"),
        ("k", "length: got 'k', which is 1e+06 N/m (a translational stiffness), expected a length, "
              "such as 300 mm"),
        (".nan", "length: got nan, expected a finite number that stands for a length, such as "
                 "300 mm"),
        ("true", "wrong value: got true, expected a number, or a text such as 300 mm or 2*R"),
        ("1/2 mm", "length: got '1/2 mm', which is 500 1/m, expected a length, such as 300 mm"),
        ("[1]", "wrong value: got a list of 1 value, expected a number, or a text such as 300 mm "
                "or 2*R"),
    ],
)  # fmt: skip
def test_values(written, message):
    assert complaint(("800 mm", written)) == f"robot.yaml:5:19: home.at[2]: {message}"


def test_lists_of_wrong_length():
    message = "robot.yaml:5:12: home.at: wrong length: got 2 values, expected 3 values"
    assert complaint(("[0, 0, 800 mm]", "[0, 800 mm]")) == message
    message = "robot.yaml:13:31: legs.chain[0].axes: wrong length: got 1 value, expected 2 values"
    assert complaint(("axes: [y, x]", "axes: [y]")) == message


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ("{R: 500 mm, k: 2*S}",
         "4:25: parameters.k: parameter k: got 'S', expected one of the parameters R, k"),
    ],
)  # fmt: skip
def test_parameters(parameters, message):
    found = complaint(("{R: 500 mm, k: 1e6 N/m}", parameters))
    # a name is blamed at its value
    assert found.split(": ", 1)[1] == message.split(": ", 1)[1]
    assert found.startswith("robot.yaml:4:")


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"r": "1 m"}, "parameter r: got a value for a parameter that is not defined, expected one "
                       "of the parameters R, k; did you mean R?"),
    ],
)  # fmt: skip
def test_overrides(overrides, message):
    with pytest.raises(InputError) as caught:
        model_from_document(parse_document(ROBOT), overrides)
    assert str(caught.value) == message


# --- frames ---


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("matrix: [[1, 0, 0], [0, 1, 0], [0, 0.1, 1]]",
         "11:51: legs.base.matrix: rotation (in leg1): got [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], "
         "[0.0, 0.1, 1.0]], expected orthonormal columns (R^T R differs from the identity by 0.1); "
         "the columns are the turned axes, of unit length and perpendicular; "
         "write six decimals or more"),
        ("axes: {x: x, z: [1, 0, 1]}",
         "11:49: legs.base.axes: axes of the frame (in leg1): got 45 deg between them, expected "
         "two perpendicular directions"),
        ("axes: {x: x}",
         "11:49: legs.base.axes: axes of the frame (in leg1): got x of the three, expected two of "
         "x, y, z; the third follows"),
        ("turn: [{z: phi}], rotation_vector: [0, 0, 0]",
         "11:61: legs.base.rotation_vector: second rotation (in leg1): got rotation_vector beside "
         "turn, expected one of turn, rotation_vector, matrix, axes"),
        ("turn: [{z: phi, y: 0}]",
         "11:50: legs.base.turn[0]: turn (in leg1): got y and z, expected one axis, such as "
         "{z: 30 deg}; write each turn as an entry of its own"),
        ("turn: [{z: R}]",
         "11:54: legs.base.turn[0].z: angle (in leg1): got 'R', which is 0.5 m (a length), "
         "expected an angle, such as 10 deg"),
        ("turn: {z: phi}", "11:49: legs.base.turn: wrong value: got a mapping, expected a list"),
    ],
)  # fmt: skip
def test_frames(written, message):
    assert complaint(("turn: [{z: phi}]", written)) == f"robot.yaml:{message}"


# --- joints ---


@pytest.mark.parametrize(
    ("element", "message"),
    [
        (DRIVE.replace("prismatic", "prismatc"),
         "legs.chain[1].type: unknown word: got 'prismatc', expected one of revolute, prismatic, "
         "helical, universal, spherical, cylindrical, planar, rigid, beam, spring, link, "
         "telescope, parallelogram, parallel; did you mean prismatic?"),
        (DRIVE.replace("actuated", "actuatd"),
         "legs.chain[1].role: unknown word: got 'actuatd', expected 'passive' or 'actuated' or "
         "'locked'; did you mean actuated?"),
        ("{type: prismatic, axis: z, stiffness: k}",
         "legs.chain[1].role: missing key; role is passive, actuated or locked"),
        (DRIVE.replace(": k", ": 300 mm"),
         "legs.chain[1].stiffness: translational stiffness (in leg1): got '300 mm', expected a "
         "translational stiffness, such as 1e8 N/m"),
        (DRIVE.replace(": k", ": -k"),
         "legs.chain[1].stiffness: translational stiffness (in leg1): got '-k', which is -1e+06 "
         "N/m (a translational stiffness), expected a positive one; a joint without resistance has "
         "role: passive, a rigid drive or lock no stiffness"),
        (DRIVE.replace("z", "[0, 0, 0]"),
         "legs.chain[1].axis: direction (in leg1): got [0.0, 0.0, 0.0], expected a direction; a "
         "zero vector points nowhere"),
        (DRIVE.replace("z", "w"),
         "legs.chain[1].axis: unknown word: got 'w', expected one of x, y, z, -x, -y, -z"),
        ("{type: universal, axes: [x, -x], role: passive}",
         "legs.chain[1]: axes of the universal joint (in leg1): got [[1.0, 0.0, 0.0], [-1.0, 0.0, "
         "0.0]], expected two directions that are not parallel"),
        ("{type: revolute, axis: z, role: passive, stiffness: 1}",
         "legs.chain[1].stiffness: stiffness of a passive joint (in leg1): expected no stiffness; "
         "write role: actuated or role: locked for a joint with a stiffness"),
        ("{type: revolute, axis: z, role: locked, limits: [0, 1]}",
         "legs.chain[1].limits: limits of a locked joint (in leg1): expected limits of actuated "
         "joints only"),
        (DRIVE.replace("k}", "k, limits: [1, 0]}"),
         "legs.chain[1].limits: limits of the drive (in leg1): got (1.0, 0.0), expected lowest < "
         "highest"),
        ("{type: cylindrical, axis: z, role: passive, home: [10 deg, 0]}",
         "legs.chain[1].home[0]: length (in leg1): got '10 deg', expected a length, such as 300 "
         "mm"),
        ("{type: rigid}",
         "legs.chain[1]: rigid part (in leg1): expected to: [x, y, z], a rotation, or both"),
    ],
)  # fmt: skip
def test_joints(element, message):
    assert complaint_of(element) == message


def test_names_in_a_chain_are_unique():
    part = "\n    - {type: rigid, name: prismatic1, to: [0, 0, 0]}"
    assert complaint((DRIVE, f"{DRIVE}{part}{part}")) == (
        "robot.yaml:16:27: legs.chain[3].name: name of an element (in leg1): got "
        "'prismatic1', expected each name once in a chain"
    )


# --- what is elastic ---


def beam(material="steel", section="{circle: {diameter: 20 mm}}", to="[0, 0, R]", more=""):
    return f"{{type: beam, to: {to}, material: {material}, section: {section}{more}}}"


@pytest.mark.parametrize(
    ("element", "message"),
    [
        (beam("stel"), "material: unknown material (in leg1): got 'stel', expected one of steel, "),
        (beam("xyz"),
         "define it under materials: or write {E: 70 GPa, poisson_ratio: 0.33}"),
        (beam("{E: 1 GPa}"), "material: material (in leg1): got E alone, expected E with either G "
                             "or poisson_ratio"),
        (beam("{E: -1 GPa, G: 1 GPa}"),
         "material.E: elastic modulus (in leg1): got '-1 GPa', expected a positive one"),
        (beam("{E: 1 GPa, poisson_ratio: 0.7}"),
         "material.poisson_ratio: Poisson ratio (in leg1): got 0.7, expected a number between -1 "
         "and 0.5, both excluded (isotropic material); write E and G for a material that is not "
         "isotropic"),
        (beam(section="{circle: {diameter: -20 mm}}"),
         "section.circle.diameter: length (in leg1): got '-20 mm', expected a positive one"),
        (beam(section="{circle: {radius: 20 mm}}"),
         "section.circle.radius: unknown key: expected diameter"),
        (beam(section="{tube: {outer_diameter: 1, inner_diameter: 2}}"),
         "section.tube: inner diameter of the tube (in leg1): got 2.0, expected less than the "
         "outer diameter 1.0; both are diameters, not radii"),
        (beam(section="{circle: {diameter: 1}, rectangle: {width_y: 1, height_z: 1}}"),
         "section: section (in leg1): got circle and rectangle, expected one of circle, tube, "
         "rectangle, box, i, properties"),
        (beam(section="rod"),
         "section: unknown section (in leg1): got 'rod', expected a shape, as no section is "
         "defined; define it under sections: or write {circle: {diameter: 20 mm}}"),
        (beam(section="{properties: {A: 1 mm, Iy: 1, Iz: 1, J: 1}}"),
         "section.properties.A: area (in leg1): got '1 mm', expected an area, such as 120 mm^2"),
        (beam(section="{properties: {A: 1, Iy: 1, Iz: 1, J: 1}}", more=", theory: timoshenko"),
         "section: shear correction factors of the cross-section (in leg1): got (None, None), "
         "expected two numbers, as the Timoshenko theory needs them; write them beside A, or leave "
         "theory: timoshenko out"),
        (beam(more=", y_axis: z"),
         "y_axis: y axis of the section (in leg1): got [0.0, 0.0, 1.0], expected a direction "
         "across the beam"),
        (beam(to="[0, 0, 0]"),
         "to: end of the beam (in leg1): got [0, 0, 0], expected a point away from the beam's "
         "start"),
        ("{type: beam, to: [0, 0, R], material: steel}",
         "beam (in leg1): got neither section nor taper, expected either a section or a taper"),
        ("{type: beam, to: [0, 0, R], material: steel, taper: [{share: 0.4, section: {circle: "
         "{diameter: 1 mm}}}]}",
         "taper: shares of the segments (in leg1): got 0.4 in all, expected 1 in all"),
        ("{type: spring}", "elastic element (in leg1): got neither, expected either stiffness: or "
                           "compliance:, 6 x 6"),
        ("{type: spring, stiffness: [1, 2, 3, 4, 5, 6 N/m]}",
         "stiffness[5]: rotational stiffness (in leg1): got '6 N/m', expected a rotational "
         "stiffness, such as 1e5 N m/rad"),
        ("{type: spring, stiffness: [1, 2, 3, 4, 5, [6]]}",
         "stiffness[5]: row of the matrix (in leg1): got 1 value, expected 6 values"),
        ("{type: spring, stiffness: [1, 2, 3, 4, 5, [0, 0, 0, 0, 0, 1]]}",
         "stiffness: matrix (in leg1): got lists beside single values, expected six lists of six "
         "values, or the six values of the diagonal"),
        ("{type: spring, stiffness: [1, 2, 3, 4, 5, true]}",
         "stiffness[5]: entry of the matrix (in leg1): got true, expected a number or an "
         "expression"),
        ("{type: spring, stiffness: [1, 2, 3, 4, 5, -6]}", "expected no negative eigenvalue"),
        ("{type: spring, compliance: [[1, 2, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], "
         "[0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]]}",
         "expected a symmetric matrix"),
        ("{type: telescope, direction: z, role: actuated, beams: [{share: 0.4, material: steel, "
         "section: {circle: {diameter: 1 mm}}}]}",
         "beams: shares of the telescope's beams (in leg1): got [0.4], expected shares that add up "
         "to 1"),
        ("{type: telescope, direction: z, role: actuated, beams: [{material: steel, section: "
         "{circle: {diameter: 1 mm}}}, {share: 1, material: steel, section: {circle: {diameter: "
         "1 mm}}}]}",
         "beams[0]: beam of a telescope (in leg1): got no share, expected the share of the "
         "extension that lengthens this beam, such as share: 0.5, or its fixed length"),
        ("{type: telescope, direction: z, role: actuated, beams: [{share: 1, fixed: -1 mm, "
         "material: steel, section: {circle: {diameter: 1 mm}}}]}",
         "fixed length (in leg1): got -0.001, expected zero or more metres"),
    ],
)  # fmt: skip
def test_elasticity(element, message):
    assert message in complaint_of(element)


# --- legs ---


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((", stiffness: k", ""),
         "13:5: legs.chain: leg 'leg1': got 'no compliance at all', expected an elastic link, or a "
         "joint with a stiffness"),
        (("leg2, phi: 120 deg", "leg2"),
         "9:7: legs.repeat[1]: variables of the copy 'leg2': got none, expected phi; phi must have "
         "a value in every copy"),
        (("leg2, phi", "leg2, psi_2"),
         "9:7: legs.repeat[1]: variables of the copy 'leg2': got psi_2, expected phi; phi must"),
        (("name: leg2", "name: leg1"),
         "9:7: legs.repeat[1]: name of a leg: got 'leg1', expected each name once"),
        (("{name: leg2, ", "{"),
         "9:7: legs.repeat[1]: copy of the leg: got no name, expected a name, such as {name: leg1, "
         "phi: 0 deg}"),
        (("phi: 120 deg", "phi: 120 mm"),
         "11:15: legs.base.at[0]: expression 'R*cos(phi)', column 3 (in leg2): got cos of 0.12 m "
         "(a length), expected an angle, such as 10 deg"),
        (("phi: 120 deg", "phi: 2*phi"),
         "9:25: legs.repeat[1].phi: variable phi: got phi -> phi, expected parameters that do not "
         "depend on themselves"),
        (("  base:", "  let: {R: 1 m}\n  base:"),
         "11:9: legs.let.R: variable: got 'R', expected a name of its own; a parameter has it"),
        (("  platform:", "  elbow: plus\n  platform:"),
         "7:3: legs: elbow of leg 'leg1': got 'plus', expected none: only a slide or crank"),
    ],
)  # fmt: skip
def test_legs(change, message):
    assert complaint(change).startswith(f"robot.yaml:{message}")


def test_home_that_does_not_close():
    # a universal joint at the platform cannot take up the turn about the leg
    change = ("{type: spherical, role: passive}", "{type: universal, axes: [x, y], role: passive}")
    assert complaint(change, ("{at: [0, 0, 800 mm]}", "{at: [0, 0, 800 mm], turn: [{z: 0.3}]}"))
    rods = (
        ("[{z: phi}]}\n  chain", "[{z: phi}]}\n  elbow: plus\n  chain"),
        (
            "{type: universal, axes: [y, x], role: passive}\n    - " + DRIVE,
            DRIVE
            + "\n    - {type: universal, axes: [y, x], role: passive}"
            + "\n    - {type: rigid, to: [0, 0, -200 mm]}",
        ),
    )
    message = complaint(*rods)
    assert message.startswith(
        "robot.yaml:7:3: legs: home configuration of leg 'leg1': got 'a gap of 0.1 m and"
    )
    assert "expected a leg that closes at the home pose; check its dimensions" in message


# --- planar robots ---

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


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("axis: z", "axis: [0, 0.1, 1]",
         "8:9: legs[0].chain[0]: axis of revolute1 in a planar robot: got [0.0, 0.099504, "
         "0.995037], expected an axis along z of the world; planar robots move in the x-y plane; "
         "leave planar: out for any other"),
        ("axis: x", "axis: z",
         "10:9: legs[0].chain[2]: direction of prismatic1 in a planar robot: got [0.0, 0.0, 1.0], "
         "expected a direction in the x-y plane of the world; planar robots move in the x-y plane; "
         "leave planar: out for any other"),
        ("to: [1, 0, 0]", "turn: [{x: 90 deg}]", None),
        ("to: [1, 0, 0]", "turn: [{y: 90 deg}]", "10:9: legs[0].chain[2]: direction of"),
        ("planar: true", "planar: true\ncoordinates: [x, y, rx]",
         "5:21: coordinates[2]: coordinate of a planar robot: got 'rx', expected x, y or rz"),
    ],
)  # fmt: skip
def test_planar(old, new, message):
    document = parse_document(PLANAR.replace(old, new, 1), file="robot.yaml")
    if message is None:
        assert model_from_document(document).name == "crank"
        return
    with pytest.raises(FileError) as caught:
        model_from_document(document)
    assert str(caught.value).startswith(f"robot.yaml:{message}")


# --- whatever else ---

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


def test_numbers_beyond_any_robot():
    assert complaint(("800 mm", "1e31")) == (
        "robot.yaml:5:19: home.at[2]: length: got 1e+31, expected at most 1e+09 in SI units"
    )
