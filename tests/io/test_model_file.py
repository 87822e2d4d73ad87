"""Model files: what may be written, and what becomes of it."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.analysis import stiffness
from robostiff.elasticity import (
    BeamSegment,
    beam_compliance,
    box,
    elasticity_from_stiffness,
    i_section,
    moved,
    tapered_compliance,
    tube,
)
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.model import Elbow, Link
from robostiff.spatial import Space
from tests.files import FILES, text_of

PAGE = Path(__file__).parents[2] / "docs" / "model-files.md"

ARM = """\
robostiff: 1
name: arm
source: a test
parameters: {{L: 300 mm, k: 1e5 N m/rad, phi: 30 deg}}
legs:
  - name: arm
    chain:
{chain}
"""
HINGE = "{type: revolute, axis: y, role: actuated, stiffness: 1e5 N m/rad}"
TIP = "{type: beam, to: [L, 0, 0], material: steel, section: {circle: {diameter: 20 mm}}}"


def read(text: str, parameters: dict | None = None) -> Any:
    return model_from_document(parse_document(text, file="robot.yaml"), parameters)


def chain_of(*elements: str) -> Any:
    """The elements of an arm whose chain is written like this, with a beam at the end."""
    lines = "\n".join(f"      - {element}" for element in (*elements, TIP))
    return read(ARM.format(chain=lines)).legs[0].chain.elements


def first_of(*elements: str) -> Any:
    return chain_of(*elements)[0]


# --- what is elastic ---

SHAPES = {
    "circle: {diameter: 20 mm}": rs.circle(0.02),
    "tube: {outer_diameter: 20 mm, inner_diameter: 10 mm}": tube(0.02, 0.01),
    "rectangle: {width_y: 20 mm, height_z: 10 mm}": rs.rectangle(0.02, 0.01),
    "box: {width_y: 20 mm, height_z: 10 mm, wall: 1 mm}": box(0.02, 0.01, 0.001),
    "i: {flange_width: 20 mm, height: 40 mm, web_thickness: 2 mm, flange_thickness: 3 mm}":
        i_section(0.02, 0.04, 0.002, 0.003),
}  # fmt: skip


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
@pytest.mark.parametrize("written", SHAPES)
def test_beam_sections(written, theory):
    beam = first_of(
        f"{{type: beam, to: [0, L, 0], y_axis: z, material: steel, section: {{{written}}}, "
        f"theory: {theory}}}"
    )
    theories = {"timoshenko": (rs.Timoshenko(),)}.get(theory, ())
    expected = beam_compliance(0.3, rs.material("steel"), SHAPES[written], *theories)
    assert isinstance(beam, Link)
    np.testing.assert_allclose(beam.elasticity.compliance, expected, rtol=1e-14)
    np.testing.assert_array_equal(beam.axes, np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]).T)


def test_shear_factors_depend_on_the_material():
    written = (
        "{type: beam, to: [0, L, 0], material: aluminium-6061, theory: timoshenko, "
        "section: {circle: {diameter: 20 mm}}}"
    )
    alloy, section = rs.material("aluminium-6061"), rs.circle(0.02, poisson_ratio=0.33)
    expected = beam_compliance(0.3, alloy, section, rs.Timoshenko())
    np.testing.assert_allclose(first_of(written).elasticity.compliance, expected, rtol=1e-12)


def test_properties_of_a_section():
    beam = first_of(
        "{type: beam, to: [L, 0, 0], material: {E: 100 GPa, G: 40 GPa}, section: {properties: "
        "{A: 10 cm^2, Iy: 1e4 mm^4, Iz: 1e4 mm^4, J: L^4/1e6}}}"
    )
    C = np.diag(beam.elasticity.compliance)
    np.testing.assert_allclose(C[0], 0.3 / (100e9 * 1e-3))
    np.testing.assert_allclose(C[3], 0.3 / (40e9 * 0.3**4 / 1e6))
    np.testing.assert_allclose(C[4], 0.3 / (100e9 * 1e-8))


def test_named_materials_and_sections():
    text = ARM.format(
        chain="      - {type: beam, to: [L, 0, 0], material: my steel, section: rod}"
    ).replace(
        "legs:",
        "materials: {my steel: {E: 200 GPa, poisson_ratio: 0.25, source: a plate}}\n"
        "sections: {rod: {circle: {diameter: L/10}}}\nlegs:",
    )
    (beam,) = read(text).legs[0].chain.elements
    np.testing.assert_allclose(beam.elasticity.compliance[0, 0], 0.3 / (200e9 * np.pi * 2.25e-4))


def test_taper():
    beam = first_of(
        "{type: beam, to: [0, 0, L], material: steel, taper: [{share: 1/3, section: {circle: "
        "{diameter: 40 mm}}}, {share: 2/3, material: aluminium, section: {circle: {diameter: "
        "30 mm}}}]}"
    )
    segments = [
        BeamSegment(0.1, rs.material("steel"), rs.circle(0.04)),
        BeamSegment(0.2, rs.material("aluminium"), rs.circle(0.03)),
    ]
    np.testing.assert_allclose(
        beam.elasticity.compliance, tapered_compliance(segments), rtol=1e-12, atol=1e-25
    )


def test_spring_measured_elsewhere():
    K = np.diag([1e7, 2e7, 3e7, 2e4, 3e4, 4e4])
    spring = first_of(
        f"{{type: spring, stiffness: {K.tolist()}, at: [L, 0, 50 mm], turn: [{{z: phi}}]}}"
    )
    R = Rotation.from_rotvec([0, 0, np.pi / 6]).as_matrix()
    expected = moved(elasticity_from_stiffness(K), R, [-0.3, 0, -0.05])
    np.testing.assert_allclose(spring.elasticity.compliance, expected.compliance, rtol=1e-12)
    np.testing.assert_array_equal(spring.axes, np.eye(3))


def test_free_direction_of_a_spring_is_a_passive_joint():
    spring = "{type: spring, stiffness: [1e7, 1e7, 1e7, 1e4, 1e4, 0]}"
    joint = "{type: revolute, axis: z, role: passive}"
    stiff = "{type: spring, stiffness: [1e7, 1e7, 1e7, 1e4, 1e4, 1e4]}"
    free, both = (
        stiffness(read(ARM.format(chain=f"      - {first}\n      - {second}\n      - {TIP}"))).K
        for first, second in ((HINGE, spring), (HINGE, f"{joint}\n      - {stiff}"))
    )
    np.testing.assert_allclose(free, both, rtol=1e-9, atol=1e-3)


# --- legs and robots ---

TRIPOD = text_of("tripod-that-repeats.yaml")
COPIES = (
    "repeat: [{name: a, phi: 120 deg}, {name: b, phi: 240 deg}, {name: c, phi: 360 deg}]",
    "repeat: {count: 3, variable: i}\n  let: {phi: i*120 deg}",
    "repeat: {count: 3, variable: i}\n  let: {phi: i*step, step: 240 deg/2}",
    "repeat: [{name: a, i: 1}, {name: b, i: 2}, {name: c, i: 3}]\n  let: {phi: i*120 deg}",
)


@pytest.mark.parametrize("repeat", COPIES)
def test_ways_to_repeat_a_leg(repeat):
    robot = read(TRIPOD.replace("REPEAT", repeat))
    named = "count" in repeat
    assert [leg.name for leg in robot.legs] == (["leg1", "leg2", "leg3"] if named else list("abc"))
    expected = [[-0.15, 0.15 * np.sqrt(3), 0], [-0.15, -0.15 * np.sqrt(3), 0], [0.3, 0, 0]]
    found = [leg.base.p for leg in robot.legs]
    np.testing.assert_allclose(found, expected, atol=1e-15)
    assert (robot.title, robot.source) == ("A tripod", "a test")
    np.testing.assert_array_equal(robot.reference_point, [0, 0, 0.02])
    assert len(robot.coordinates) == 6


def test_repeated_legs_beside_single_ones():
    text = TRIPOD.replace("REPEAT", COPIES[1].replace("variable: i", "variable: i, name: strut"))
    head, body = text.split("legs:\n  ")
    body = "\n  ".join(body.split("\n"))
    column = (
        "  - {name: column, chain: [{type: prismatic, axis: z, role: passive, home: 500 mm}, "
        "{type: spring, stiffness: [1e8, 1e8, 1e8, 1e5, 1e5, 1e5]}]}\n"
    )
    robot = read(f"{head}legs:\n{column}  - {body}".rstrip() + "\n")
    assert [leg.name for leg in robot.legs] == ["column", "strut1", "strut2", "strut3"]


def test_elbow():
    text = (Path(PAGE).parents[1] / "src/robostiff/robots/3-puu.yaml").read_text()
    assert read(text).legs[0].elbow is Elbow.PLUS
    assert read(text.replace("elbow: plus", "elbow: minus")).legs[0].elbow is Elbow.MINUS


def test_serial_arm_needs_no_home():
    robot = read(ARM.format(chain=f"      - {HINGE}\n      - {TIP}"))
    assert robot.home is None
    assert robot.coordinates == ()
    beam = beam_compliance(0.3, rs.material("steel"), rs.circle(0.02))
    C = np.linalg.inv(stiffness(robot).K)
    np.testing.assert_allclose(C[1, 1], beam[1, 1], rtol=1e-9)
    np.testing.assert_allclose(C[2, 2], beam[2, 2] + 0.3**2 / 1e5, rtol=1e-9)


def test_planar_robot():
    text = ARM.format(chain=f"      - {{type: revolute, axis: z, role: passive}}\n      - {TIP}")
    robot = read(text.replace("legs:", "planar: true\nhome: {at: [L, 0, 0]}\nlegs:"))
    assert robot.space is Space.PLANAR
    assert [coordinate.value for coordinate in robot.coordinates] == ["y"]


def test_other_values_for_parameters(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(ARM.format(chain=f"      - {TIP}"))
    (beam,) = rs.load(file).legs[0].chain.elements
    assert isinstance(beam, Link)
    assert beam.to[0] == 0.3
    for value in ("400 mm", 0.4, "200 mm + 20 cm", "2*(phi/phi)*20 cm"):
        (beam,) = rs.load(str(file), {"L": value}).legs[0].chain.elements
        assert isinstance(beam, Link)
        assert beam.to[0] == pytest.approx(0.4, abs=1e-15)


# --- the documentation ---


def test_drives_of_a_robot_with_symbols_have_limits_of_numbers_and_all_else_in_symbols():
    drive = (
        "{type: revolute, axis: y, role: actuated, stiffness: k, limits: [-2*phi, 0.1 + phi], "
        "inertia: 2 kg m^2 * L / 1 m}"
    )
    text = ARM.format(chain=f"      - {drive}\n      - {TIP}")
    role: Any = read(text).legs[0].chain.roles[0]
    document = parse_document(text)
    robot = model_from_document(document, {"L": "0.5 m"}, symbols=("L", "k", "phi"))
    symbolic: Any = robot.legs[0].chain.roles[0]
    assert symbolic.limits == pytest.approx(role.limits, rel=1e-15)
    assert all(type(limit) is float for limit in symbolic.limits)
    assert {str(x) for x in symbolic.inertia.free_symbols} == {"L"}
    numeric: Any = robot.numeric.legs[0].chain.roles[0]
    assert numeric.inertia == pytest.approx(1.0)
    assert role.inertia == pytest.approx(0.6)


def test_many_symbols_are_read_without_simplification_of_each_entry():
    code = f"""if True:
        import sys
        import robostiff as rs
        robot = rs.load({str(FILES / "on-bearings.yaml")!r}, symbols=rs.ALL_PARAMETERS)
        assert len(robot.symbols) == 6
        assert "sympy.physics" not in sys.modules, "sympy.simplify imports it"
    """
    subprocess.run([sys.executable, "-c", code], check=True)


def test_example_of_the_documentation():
    blocks = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (example,) = [block for block in blocks if "name: tripod" in block]
    robot = read(example)
    assert [leg.name for leg in robot.legs] == ["column", "strut1", "strut2", "strut3"]
    assert str(stiffness(robot, [0.45, 0.1, -0.2]).status) == "ok"
    with pytest.raises(ValueError, match=r"expected a translational stiffness") as caught:
        model_from_document(
            parse_document(example.replace("stiffness: k", "stiffness: 50 mm"), "tripod.yaml")
        )
    assert str(caught.value) in " ".join(PAGE.read_text().split())
