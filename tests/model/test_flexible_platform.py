"""Platforms that bend, from model files: a reference case, formulas, and messages."""

from pathlib import Path

import numpy as np

import robostiff as rs
from robostiff.network import network_of_snapshot
from tests.files import written

FILE = Path(__file__).parent / "star-platform.yaml"
LOAD = np.array([100.0, 50, -1000, 10, 20, 30])


def star(**parameters: str | float) -> rs.Robot:
    return rs.load(FILE, parameters)


def test_far_above_the_base_a_deflection_keeps_its_digits():
    """At 20 m the legs are almost parallel, and stiffnesses differ by 10^8 for the length."""
    robot, pose = star(), [0.05, -0.03, 20.0, 0.02, 0.04, -0.05]
    snapshot = rs.find_posture(robot, pose).snapshot.one(0)
    expected = np.asarray(rs.compliance(network_of_snapshot(snapshot))) @ LOAD
    for bent in (
        rs.deflection(robot, pose, LOAD).twist,
        rs.deflection(robot, [pose], LOAD).twist[0],
    ):
        np.testing.assert_allclose(bent, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_symbols_in_the_dimensions_of_a_platform():
    robot = rs.load(FILE, symbols=("r", "h"))
    assert [str(s) for s in robot.symbols] == ["h", "r"]
    other = robot.substituted({"r": 0.25, "h": 0.7})
    expected = rs.stiffness(star(r="250 mm", h="700 mm")).K
    assert np.allclose(rs.stiffness(other).K, expected, rtol=1e-12, atol=1e-12 * expected.max())


def test_maps_by_kernels_and_in_batches():
    robot = star()
    quantities = [
        rs.Quantity.STIFFNESS,
        rs.Quantity.DEFLECTION,
        rs.Quantity.WORST_DEFLECTION,
        rs.Quantity.ACTUATOR_FORCES,
    ]
    grid = rs.Grid(x=rs.Axis(-0.02, 0.02, 3), z=rs.Axis(0.78, 0.8, 2))
    for method in (None, rs.Batched(), rs.Compiled()):
        chosen = quantities[:-1] if method == rs.Compiled() else quantities
        made = rs.stiffness_map(robot, grid, chosen, wrench=LOAD, method=method)
        pose = np.array([0.02, 0, 0.78, 0, 0, 0])
        assert np.allclose(
            made["K"].values[-1, 0], rs.stiffness(robot, pose).K, rtol=1e-9, atol=1e-3
        )
        bent = rs.deflection(robot, pose, LOAD)
        moved = made["displacement"].values[-1, 0]
        assert np.allclose(moved, bent.twist[:3], rtol=1e-5, atol=1e-12)
        if rs.Quantity.ACTUATOR_FORCES not in chosen:
            continue
        forces = [actuator.load for actuator in bent.actuators]
        # In maps, forces have single precision.
        assert np.allclose(made["actuator_force"].values[-1, 0], forces, rtol=1e-6)


def test_who_bends():
    parts = rs.deflection(star(), wrench=LOAD).parts
    assert {part.leg for part in parts} == {"platform", *(f"leg{i}" for i in range(1, 7))}
    assert parts[0].leg == "platform"  # arms of 15 kg/m bend more than tubes shorten


def edited(tmp_path: Path, *changes: tuple[str, str]) -> Path:
    text = FILE.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return written(tmp_path / "robot.yaml", text)


def test_rigid_members_springs_and_theories_are_read(tmp_path):
    path = edited(
        tmp_path,
        (
            "    - {between: [end6, hub], material: metal, section: arm, y_axis: z}\n",
            "  rigid: [{between: [end6, end5]}]\n"
            "  springs:\n"
            "    - {name: mount, between: [end1, end2], stiffness: [1 kN/mm, 1 kN/mm, 1 kN/mm, "
            "50 N m/rad, 50 N m/rad, 50 N m/rad]}\n",
        ),
    )
    robot = rs.load(path)
    assert [part.name for part in robot.platform.parts][-2:] == ["mount", "rigid1"]
    assert np.allclose(robot.platform.parts[-2].point, robot.platform.point_of("end1"))
    assert int(rs.stiffness(robot).rank) == 6


def test_legs_find_the_node_at_their_end(tmp_path):
    text = FILE.read_text()
    head, rest = text.split("platform:\n", 1)
    legs = rest[rest.index("\nlegs:\n") :]
    arm = "material: metal, section: arm, y_axis: z"
    nodes = "".join(
        f"    end{i}: [r*cos({phi} deg), r*sin({phi} deg), 0]\n"
        for i, phi in enumerate((60, 180, 300))
    )
    beams = "".join(f"    - {{between: [hub, end{i}], {arm}}}\n" for i in range(3))
    path = tmp_path / "three.yaml"
    nodes = f"  nodes:\n    hub: [0, 0, 0]\n{nodes}"
    path.write_text(f"{head}platform:\n{nodes}  beams:\n{beams}  tool: hub\n{legs}")
    robot = rs.load(path)
    assert robot.holds == ("end0", "end0", "end1", "end1", "end2", "end2")
    symbolic = rs.load(path, symbols=("r",))
    assert symbolic.holds == robot.holds
    # Arms in pairs, one beside the other, share what one arm carries alone.
    assert rs.stiffness(robot).K[2, 2] < rs.stiffness(star()).K[2, 2]
