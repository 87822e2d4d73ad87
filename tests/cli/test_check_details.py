"""`robostiff check`: freedoms of the platform, parts at home, and a picture."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from tests.cli.running import Running

EXAMPLES = Path(__file__).parents[2] / "examples"


run = Running("check")
facts = run.answer


def columns_of(text: str, count: int) -> list[list[str]]:
    """The first cells of rows that have so many."""
    rows = [re.split(r" {2,}", line) for line in text.splitlines()]
    return [row[:count] for row in rows if len(row) >= count]


def test_joints_of_an_arm_at_home():
    (leg,) = facts(str(EXAMPLES / "ur5-dh.yaml"), "--parts")["parts"].values()
    assert [part["name"] for part in leg] == [f"joint{i}" for i in range(1, 7)]
    assert [part["coordinate"] for part in leg] == pytest.approx(
        [0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0]
    )
    assert leg[2]["point"] == pytest.approx([0, 0, 0.089159 + 0.425])
    assert leg[2]["axis"] == pytest.approx([0, -1, 0])
    assert (leg[2]["motion"], leg[2]["role"], leg[2]["unit"]) == ("turns", "actuated", "rad")
    assert leg[2]["stiffness"] == 2e4


def test_lengths_and_stiffnesses_of_a_beam(tmp_path):
    """A round cantilever, each load alone: EA/L, 3EI/L^3, GJ/L and EI/L."""
    file = tmp_path / "table.yaml"
    file.write_text(TABLE)
    column = facts(str(file), "--parts")["parts"]["column"]
    (beam,) = (part for part in column if part["kind"] == "elastic")
    E, G, L, d = rs.material("steel").E, rs.material("steel").G, 0.5, 0.06
    A, I = np.pi * d**2 / 4, np.pi * d**4 / 64
    assert beam["length"] == pytest.approx(L)
    assert beam["point"] == pytest.approx([0, 0, L])
    assert beam["translation"] == pytest.approx([E * A / L, 3 * E * I / L**3, 3 * E * I / L**3])
    assert beam["rotation"] == pytest.approx([2 * G * I / L, E * I / L, E * I / L])


def test_blocks_and_limits_are_listed():
    parts = facts("orthoglide", "--parts")["parts"]["leg-x"]
    bars = [part for part in parts if part["name"].endswith("/bar")]
    assert [bar["length"] for bar in bars] == pytest.approx([0.6, 0.6])
    arm = facts("six-joint-arm", "--parts")["parts"]["arm"]
    (first,) = (part for part in arm if part["name"] == "joint1")
    assert first["limits"] == pytest.approx(np.radians([-170, 170]).tolist())
    assert "-2.9671 to 2.9671 rad" in run("six-joint-arm", "--parts").stdout


TABLE = """
robostiff: 1
name: table
source: an example
home: {at: [0, 0, 500 mm]}
coordinates: [x, y, z, rx, ry, rz]
legs:
  - name: column
    chain:
      - {type: prismatic, axis: z, role: passive}
      - {type: beam, to: [0, 0, 500 mm], material: steel, section: {circle: {diameter: 60 mm}}}
      - {type: universal, axes: [x, y], role: passive}
  - repeat: {count: 3, variable: i}
    let: {phi: i*120 deg}
    base: {at: [0.3 m*cos(phi), 0.3 m*sin(phi), 0]}
    chain:
      - {type: universal, axes: [y, x], role: passive}
      - {type: prismatic, axis: z, role: actuated, stiffness: 5e7 N/m}
      - {type: spherical, role: passive}
    platform: {at: [0.2 m*cos(phi), 0.2 m*sin(phi), 0]}
"""


def test_coordinates_that_the_legs_leave_no_room_for(tmp_path):
    file = tmp_path / "table.yaml"
    file.write_text(TABLE)
    assert facts(str(file))["mobility"] == {"freedoms": 3, "coordinates": ["z", "rx", "ry"]}
    assert "this platform has 3 freedoms at home: z rx ry" in run(str(file)).stdout
    file.write_text(TABLE.replace("[x, y, z, rx, ry, rz]", "[z, rx, ry]"))
    assert "freedoms at home" not in run(str(file)).stdout
    file.write_text(TABLE.replace("[x, y, z, rx, ry, rz]", "[x, y]"))
    outcome = run(str(file))
    assert outcome.exit_code == 2
    assert "the 3 freedoms that the legs leave it" in outcome.stderr
    assert "write coordinates: [z, rx, ry], or leave it out" in outcome.stderr


@pytest.mark.parametrize("ending", [".png", ".svg"])
def test_picture(tmp_path, ending):
    file = tmp_path / f"robot{ending}"
    assert facts("3-rrr", "--plot", str(file))["picture"] == str(file)
    assert file.stat().st_size > 5000
    again = run("3-rrr", "--plot", str(file))
    assert again.exit_code == 2
    assert "write --overwrite to replace it" in again.stderr
    assert run("3-rrr", "--plot", str(file), "--overwrite").exit_code == 0


def test_other_kinds_are_drawn(tmp_path):
    for name in ("cable-8", "double-pantograph"):
        file = tmp_path / f"{name}.png"
        assert facts(name, "--plot", str(file))["picture"] == str(file)


def test_parts_of_networks():
    """Beams of a portal, a load alone: EA/L and 3EI/L^3, L = 1 m; a linkage at home."""
    portal = str(EXAMPLES / "portal.json")
    beams = facts(portal, "--parts")["parts"]["network"]
    assert [beam["between"] for beam in beams] == [
        ["left foot", "top"],
        ["right foot", "corner"],
        ["top", "corner"],
    ]
    assert [beam["length"] for beam in beams] == pytest.approx([0.8, 0.8, 1])
    EA, EI = 2.1e11 * 3.49e-4, 2.1e11 * 6e-8
    assert beams[2]["translation"] == pytest.approx([EA, 3 * EI, 3 * EI])
    outcome = run(portal, "--parts")
    assert "4 bodies, 3 beams\n" in outcome.stdout
    assert ["beam", "top, corner", "(1, 0, 0.8)"] in columns_of(outcome.stdout, 3)
    names = [part["name"] for part in facts("double-pantograph", "--parts")["parts"]["network"]]
    assert "screw" in names
    shown = columns_of(run("double-pantograph", "--parts").stdout, 5)
    assert ["screw", "slides, actuated", "(1, 0, 0)"] in [[own[0], own[2], own[4]] for own in shown]


def test_cables_at_home():
    cables = facts("cable-8", "--parts")["parts"]["cables"]
    robot = rs.load("cable-8")
    assert [cable["name"] for cable in cables] == list(robot.cable_names)
    assert cables[0]["length"] == pytest.approx(np.sqrt(1.94**2 + 1.44**2 + 1))
    assert cables[0]["tension_limits"] == [50, 720]
    words = ["cable1", "(-2, 1.5, 2)", "(-0.06, 0.06, 1)", "2.6148 m", "1 m"]
    assert words in columns_of(run("cable-8", "--parts").stdout, 5)


def test_freedoms_of_one_leg(tmp_path):
    """A leg with three joints, alone: its pose has their three freedoms."""
    file = tmp_path / "ram.yaml"
    file.write_text(RAM)
    assert facts(str(file))["mobility"] == {"freedoms": 3, "coordinates": ["x", "y", "z"]}
    assert "free coordinates: x y z\n" in run(str(file)).stdout


def test_a_beam_longer_than_its_telescope_is_named_instead_of_parts_of_negative_length(tmp_path):
    file = tmp_path / "ram.yaml"
    beams = "beams: [{fixed: 1.5 m, share: 0, %s}, {share: 1, %s}]" % (2 * (STEEL,))
    file.write_text(RAM.replace("home: 1.2 m}", f"{beams}}}"))
    found = facts(str(file), "--parts")
    assert "leg 'ram': the length [m] of beam 2 of 'telescope1' would be -0.3" in str(found["home"])
    assert not {"parts", "masses"} & set(found)
    assert "at home: status unreachable" in run(str(file)).stdout


def test_what_rounding_leaves_beside_metres_and_radians_is_zero():
    words = run("gough-stewart-b", "--parts").stdout
    assert not re.search(r"\de-1\d", words)
    assert "(-0.5, 0, 0)" in words or "(-0.25, 0.43301, 0)" in words


STEEL = "material: steel, section: {circle: {diameter: 50 mm}}"
RAM = """
robostiff: 1
name: ram
source: an example
home: {at: [0, 0, -1.2 m]}
legs:
  - name: ram
    chain:
      - {type: universal, axes: [x, y], role: passive}
      - {type: telescope, direction: -z, role: actuated, stiffness: 1e8 N/m, home: 1.2 m}
"""


def test_branches_of_a_block_are_named():
    said = run(str(EXAMPLES / "tricept-with-head.yaml")).stdout
    assert (
        "tricept [ram: universal1 (passive), telescope1 (passive); strut1, strut2, strut3:" in said
    )


def test_masses_of_a_snapshot_are_those_of_its_robot(tmp_path):
    for name in ("six-joint-arm", "orthoglide", str(EXAMPLES / "tricept-with-head.yaml")):
        file = tmp_path / "placed.json"
        Running("convert")(name, "-o", str(file), "--overwrite")
        placed, model = facts(str(file))["masses"], facts(name)["masses"]
        assert placed["parts"] == pytest.approx(model["parts"])
        assert placed["centre"] == pytest.approx(model["centre"], abs=1e-12)
        Running("convert")(name, "--to", "graph", "-o", str(file), "--overwrite")
        bodies = facts(str(file))["masses"]
        assert bodies["total"] == pytest.approx(model["total"])
        assert bodies["centre"] == pytest.approx(model["centre"], abs=1e-12)
        assert "masses: " in run(str(file)).stdout


def test_drives_of_a_machine_are_named():
    machine = str(EXAMPLES / "tricept-with-head.yaml")
    said = Running("stiffness")(machine, "--joints", "head/a-axis=20 deg").stdout
    drives = next(line for line in said.splitlines() if line.startswith("drives at"))
    assert drives.count("=") == 5
    assert "head/c-axis=0, head/a-axis=0.34907 (m, rad)" in drives


def test_drives_whose_stiffness_depends_on_them_are_listed_and_written(tmp_path):
    """4 E A / L in the middle of a screw, in series with its bearings."""
    table = str(EXAMPLES / "ball-screws.yaml")
    first = facts(table, "--parts")["parts"]["table"][0]
    k = 1 / (1 / 2e8 + 1.2 / (4 * 206e9 * np.pi * 0.03**2 / 4))
    assert first["stiffness"] == pytest.approx(k)
    file = tmp_path / "placed.yaml"
    assert Running("convert")(table, "--joints", "x=0.4", "-o", str(file)).exit_code == 0
    moved = rs.stiffness(rs.load(table), rs.JointCoordinates([0.4, 0])).K
    np.testing.assert_allclose(rs.stiffness(rs.load(file)).K, moved, rtol=1e-12, atol=1)


def test_masses_of_a_network(tmp_path):
    """A beam weighs its density times its volume; masses that differ by leg have their legs."""
    portal = json.loads((EXAMPLES / "portal.json").read_text())
    portal["graph"]["beams"][0]["density"] = 7850
    portal["graph"]["masses"] = [{"on": "top", "name": "motor", "mass": 2.5}]
    file = tmp_path / "portal.json"
    file.write_text(json.dumps(portal))
    masses = facts(str(file))["masses"]
    post = 7850 * 3.49e-4 * 0.8
    assert masses["parts"] == pytest.approx({"top/motor": 2.5, "left post": post})
    assert masses["centre"][2] == pytest.approx((2.5 * 0.8 + post * 0.4) / (2.5 + post))
    shown = "masses: top/motor 2.5 kg, left post 2.1917 kg; 4.6917 kg in all"
    assert shown in run(str(file)).stdout
    words = run(str(EXAMPLES / "exechon.yaml")).stdout
    assert "masses: upr1/telescope1.beam 56.871 kg, upr2/telescope1.beam 56.871 kg, spr/" in words


def test_small_loads_in_words():
    """Of a network without weights, of drives that gravity does not load, of rigid directions."""
    load = ("--wrench", "100 N 0 -200 N 0 0 0")
    words = Running("deflection")("double-pantograph", *load).stdout
    assert re.findall(r"^(Fx +100 N|Fz +-200 N)  d", words, re.MULTILINE)[1:]
    assert re.search(r"^a lower +[0-9.]+ %$", words, re.MULTILINE)
    words = Running("deflection")("us-ups", "--gravity=-z").stdout
    assert re.search(r"^strut1/screw +0 N +0 µm$", words, re.MULTILINE)
    table = "{convention: standard, joints: [{a: 1 m, stiffness: 1e4 N m/rad}]}"
    arm = f"{{robostiff: 1, name: arm, source: none, dh: {table}}}"
    words = Running("stiffness")("-", stdin=arm).stdout
    assert "rigid direction: Fz 1 N\n" in words
    assert "rigid direction: Mx 1 N m\n" in words


def test_rigid_parts_have_no_unit():
    words = run("hexapod", "--parts").stdout
    assert re.search(r" 4e\+08, 4e\+08, 4e\+08 +rigid$", words, re.MULTILINE)
    assert "masses: 6 x strut.beam1 13.81 kg" in words
    assert "in all, centre of mass (0, 0, 0.41099) m" in words


def test_a_side_file_in_place_of_its_robot_description():
    done = run(str(EXAMPLES / "ur5.stiffness.yaml"))
    assert done.exit_code == 2
    assert "ur5.stiffness.yaml:4:1: joints" in done.stderr
    assert "got a side file, which adds stiffnesses to a robot description" in done.stderr
