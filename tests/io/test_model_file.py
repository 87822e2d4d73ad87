"""Model files: elements, tables of Denavit and Hartenberg, parallel blocks."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.io.snapshot import snapshot_from_document, snapshot_schema, snapshot_to_data
from robostiff.model import ALL_COORDINATES, Elbow, Link, ParallelBlock, PlacedBlock, Snapshot
from robostiff.spatial import Space
from tests.cases.metric import distance
from tests.files import FILES, text_of, written

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


# --- what is elastic ---


def test_free_direction_of_a_spring_is_a_passive_joint():
    spring = "{type: spring, stiffness: [1e7, 1e7, 1e7, 1e4, 1e4, 0]}"
    joint = "{type: revolute, axis: z, role: passive}"
    stiff = "{type: spring, stiffness: [1e7, 1e7, 1e7, 1e4, 1e4, 1e4]}"
    free, both = (
        rs.stiffness(read(ARM.format(chain=f"      - {first}\n      - {second}\n      - {TIP}"))).K
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


def test_elbow():
    text = (Path(PAGE).parents[1] / "src/robostiff/robots/3-puu.yaml").read_text()
    assert read(text).legs[0].elbow is Elbow.PLUS
    assert read(text.replace("elbow: plus", "elbow: minus")).legs[0].elbow is Elbow.MINUS


def test_planar_robot():
    text = ARM.format(chain=f"      - {{type: revolute, axis: z, role: passive}}\n      - {TIP}")
    robot = read(text.replace("legs:", "planar: true\nhome: {at: [L, 0, 0]}\nlegs:"))
    assert robot.space is Space.PLANAR
    assert [coordinate.value for coordinate in robot.coordinates] == ["y"]


@pytest.mark.filterwarnings("ignore:.*nothing in the file uses 'phi'")
def test_other_values_for_parameters(tmp_path):
    file = written(tmp_path / "arm.yaml", ARM.format(chain=f"      - {TIP}"))
    with pytest.warns(
        rs.PlausibilityWarning, match=r"arm.yaml:4:28: .*nothing in the file uses .k"
    ):
        rs.load(file)
    file.write_text(file.read_text().replace("k: 1e5 N m/rad, ", ""))
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
    assert str(rs.stiffness(robot, [0.45, 0.1, -0.2]).status) == "ok"
    with pytest.raises(ValueError, match=r"expected a translational stiffness") as caught:
        model_from_document(
            parse_document(example.replace("stiffness: k", "stiffness: 50 mm"), "tripod.yaml")
        )
    assert str(caught.value) in " ".join(PAGE.read_text().split())


EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5-dh.yaml"

TABLE = text_of("table-of-dh.yaml")


def read_table(text: str, **more):
    return model_from_document(parse_document(text, "arm.yaml"), **more)


def test_example_is_the_one_of_the_page():
    page = EXAMPLE.parents[1] / "docs" / "model-files.md"
    assert f"```yaml\n{EXAMPLE.read_text(encoding='utf-8')}```" in page.read_text(encoding="utf-8")


def test_file_is_the_arm_that_python_makes():
    rows = [
        rs.DHRow(d=0.4),
        rs.DHRow(alpha=-np.pi / 2, theta=-np.pi / 2, name="shoulder"),
        rs.DHRow(a=0.5),
        rs.DHRow(alpha=np.pi / 2, d=0.1, slides=True),
    ]
    own = rs.serial_arm(
        rows,
        convention=rs.DHConvention.MODIFIED,
        joint_stiffness=[2e4, 2e4, 2e4, 1e7],
        limits=[(-np.radians(170), np.radians(170)), None, None, None],
        home=[0, np.radians(20), np.radians(45), 0.05],
        base=rs.Frame(np.eye(3), np.array([0, 0, 1])),
        tool=RigidTransform.from_components(
            [0, 0, 0.08], Rotation.from_rotvec([0, np.radians(30), 0])
        ),
    )
    found = read_table(TABLE)
    (leg,), (other,) = found.legs, own.legs
    assert leg.chain.coordinate_names == ("joint1", "shoulder", "joint3", "joint4")
    assert leg.chain.roles == other.chain.roles
    assert leg.chain.home.tolist() == other.chain.home.tolist()
    assert found.reference_point.tolist() == [0, 0, 0.01]
    at = rs.stiffness(found).reference_point
    np.testing.assert_allclose(
        rs.compliance(found), rs.compliance(own, at=at), rtol=1e-12, atol=1e-18
    )


def test_other_values_of_parameters_and_symbols():
    longer = read_table(TABLE, parameters={"l": "700 mm"})
    end, start = rs.stiffness(longer).pose, rs.stiffness(read_table(TABLE)).pose
    assert np.linalg.norm(end - start) == pytest.approx(0.2)
    robot = read_table(TABLE, symbols=("l", "k"))
    assert [str(symbol) for symbol in robot.symbols] == ["k", "l"]
    assert robot.nominal == {"l": 0.5, "k": 2e4}
    np.testing.assert_allclose(
        rs.compliance(robot.numeric), rs.compliance(read_table(TABLE)), rtol=1e-12, atol=1e-18
    )


SIDE = text_of("ur5-of-example.stiffness.yaml")


def test_published_arm_in_ten_lines_is_that_of_its_urdf(tmp_path):
    """In ROS the base of a UR5 is turned by half a turn about z."""
    side = written(tmp_path / "ur5.stiffness.yaml", SIDE)
    table, described = rs.load(EXAMPLE), rs.load(EXAMPLE.with_name("ur5.urdf"), side=side)
    half = np.diag([-1.0, -1, 1])
    both = np.kron(np.eye(2), half)
    for q in np.random.default_rng(3).uniform(-2, 2, (4, 6)):
        at = rs.JointCoordinates(q)
        own, other = rs.stiffness(table, at), rs.stiffness(described, at)
        np.testing.assert_allclose(half @ own.pose[:3], other.pose[:3], atol=1e-12)
        C, expected = rs.compliance(table, at), rs.compliance(described, at)
        np.testing.assert_allclose(both @ C @ both, expected, rtol=1e-9, atol=1e-15)


SCARA = """\
robostiff: 1
name: scara
source: a test
home: {{at: [0.3, 0.3, 0]}}
{chosen}
legs:
  - name: arm
    chain:
      - {{type: revolute, axis: z, role: actuated, stiffness: 1e5 N m/rad}}
      - {{type: beam, to: [0.3, 0, 0], material: steel, section: {{circle: {{diameter: 20 mm}}}}}}
      - {{type: revolute, axis: z, role: actuated, stiffness: 1e5 N m/rad}}
      - {{type: beam, to: [0, 0.3, 0], material: steel, section: {{circle: {{diameter: 20 mm}}}}}}
      - {{type: prismatic, axis: z, role: actuated, stiffness: 1e7 N/m}}
"""


def scara(chosen: str = "") -> Any:
    return read_table(SCARA.format(chosen=chosen))


@pytest.mark.parametrize("chosen", ["", "coordinates: [x, y, z]"])
def test_they_are_as_many_as_its_freedoms(chosen):
    robot = scara(chosen)
    names = [coordinate.value for coordinate in robot.coordinates]
    assert names == (["x", "y", "z"] if chosen else ["y", "z", "rz"])
    values = np.array([[0.3, 0.29, 0.01, 0, 0, 0.1]])[:, robot.coordinate_places]
    K = rs.stiffness(robot, values).K
    by_kernel = rs.compile(robot).evaluate(values).values["K"]
    np.testing.assert_allclose(by_kernel, K, rtol=1e-9, atol=1e-9 * np.max(K))


def test_all_of_them_pose_an_arm_whose_home_is_singular():
    assert rs.load(FILES / "wrist.yaml").coordinates == ALL_COORDINATES


PARALLEL = text_of("pair-of-bars.yaml")
PARALLELOGRAM = text_of("parallelogram.yaml")
REPEATED = text_of("repeated-bars.yaml")
HEAD = PARALLELOGRAM.partition("      - type")[0]


def read_file(text: str) -> rs.Robot:
    return model_from_document(parse_document(text, file="robot.yaml"))


@pytest.mark.parametrize("text", [PARALLELOGRAM, REPEATED])
def test_ways_to_write_a_parallelogram(text):
    robot, expected = read_file(text), read_file(PARALLEL)
    (block,), (wanted,) = (r.legs[0].chain.elements for r in (robot, expected))
    assert isinstance(block, ParallelBlock)
    assert isinstance(wanted, ParallelBlock)
    assert [b.name for b in block.branches] == [b.name for b in wanted.branches]
    for pose in ([0.0], [0.11]):
        first, second = rs.stiffness(robot, pose), rs.stiffness(expected, pose)
        assert distance(first.K, second.K) < 1e-13
        assert int(first.rank) == 5


def test_blocks_nested_without_end():
    element = "{type: spring, stiffness: [1e6 N/m, 1e6 N/m, 1e6 N/m, 1, 1, 1]}"
    for _ in range(12):
        element = f"{{type: parallelogram, across: [0, 1 mm, 0], chain: [{element}]}}"
    message = "elements inside a parallel block: got 1024, expected at most 1000"
    with pytest.raises(rs.FileError, match=message):
        read_file(f"{HEAD}      - {element}\n")


# --- snapshots ---

PIN = {"type": "passive", "kind": "R", "point": [0, 0, 0], "axis": [0, 0, 1]}


def beam(y: float) -> dict:
    element = {"type": "beam", "start": [0, y, 0], "end": [0.3, y, 0], "y_axis": [0, 1, 0]}
    return element | {"E": 2.1e11, "G": 8e10, "A": 8e-4, "Iy": 3e-8, "Iz": 1e-7, "J": 7e-8}


def branch(name: str, y: float) -> dict:
    pins = [PIN | {"point": [x, y, 0]} for x in (0, 0.3)]
    return {"name": name, "end": [0.3, y, 0], "chain": [pins[0], beam(y), pins[1]]}


def file_with(*branches: dict, **changes) -> dict:
    block = {"type": "parallel", "name": "pair", "branches": list(branches)}
    leg = {"name": "leg", "end": [0.3, 0, 0], "chain": [block]}
    return {"name": "pair", "reference_point": [0.3, 0, 0], "legs": [leg]} | changes


def snapshot(data: dict) -> Snapshot:
    return snapshot_from_document(parse_document(json.dumps(data), file="pair.json"))


PAIR = file_with(branch("low", -0.04), branch("high", 0.04))


def test_a_block_of_a_snapshot():
    Draft202012Validator(snapshot_schema()).validate(PAIR)
    given = snapshot(PAIR)
    (block,) = given.legs[0].elements
    assert isinstance(block, PlacedBlock)
    assert [b.name for b in block.branches] == ["pair/low", "pair/high"]
    names = [e.name for e in block.branches[1].elements]
    assert names == ["pair/high/passive1", "pair/high/beam1", "pair/high/passive2"]
    result = rs.stiffness(given)
    assert int(result.rank) == 5
    EA_by_L = 2.1e11 * 8e-4 / 0.3
    assert result.K[0, 0] == pytest.approx(2 * EA_by_L)
    assert result.K[5, 5] == pytest.approx(2 * EA_by_L * 0.04**2)


def test_nested_blocks_and_rigid_branches_are_written_too():
    inner = {"type": "parallel", "branches": [branch("a", 0.03), branch("b", 0.05)]}
    rod = {"name": "rod", "end": [0.3, 0, 0], "chain": []}
    outer = {"name": "outer", "end": [0.3, 0.04, 0], "chain": [inner, PIN | {"kind": "P"}]}
    data = file_with(outer, rod)
    data["legs"][0]["chain"].append(beam(0.0))
    given = snapshot(data)
    again = snapshot(snapshot_to_data(given))
    assert distance(rs.stiffness(again).K, rs.stiffness(given).K) < 1e-12
    names = [part.name for part in given.legs[0].parts]
    assert names[0] == "pair/outer/parallel1/a/passive1"
