"""Trees whose loops a side file closes: two arms on one part, platforms on legs, linkages."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.linkage import close
from tests.files import FILES, text_of
from tests.io.urdf.examples import (
    matrix_distance,
    needs_examples,
    network_of,
    robot_of,
    two_ur5,
    with_side,
)

GRASPED = """
robostiff: 1
source: chosen here
tool: {{link: part, at: [0, 0, 50 mm]}}
joints:
  "*_wrist_*": {{stiffness: 5e3 N m/rad}}
  "*": {{stiffness: 3e4 N m/rad}}
loops:
  - name: second grasp
    between: [right_tool0, {{link: part, at: [0, 0, 20 mm], turn: [{{x: 180 deg}}]}}]
    joint: {joint}
home: {{left_shoulder_lift_joint: -70 deg, left_elbow_joint: 100 deg, left_wrist_1_joint: -30 deg,
       left_shoulder_pan_joint: 10 deg, left_wrist_2_joint: 20 deg, left_wrist_3_joint: 0}}
start: {{right_shoulder_lift_joint: -70 deg, right_elbow_joint: 100 deg,
        right_wrist_1_joint: -30 deg}}
"""


@needs_examples
def test_two_arms_that_hold_one_part_are_a_parallel_robot(tmp_path):
    cell = two_ur5(tmp_path)
    side = with_side(tmp_path, GRASPED.format(joint="fixed"))
    robot = robot_of(cell, side)
    assert [leg.chain.size for leg in robot.legs] == [6, 6]
    assert len(robot.coordinates) == 6
    result = rs.stiffness(robot)
    assert result.status is rs.Status.OK
    assert result.rank == 6
    network = rs.network_at(rs.load_linkage(cell, side=side))
    assert matrix_distance(rs.stiffness(network).K, result.K) < 1e-9
    assert rs.verify(robot).agree
    total = np.zeros((6, 6))  # eq. (12): legs in parallel add up, about one point
    for leg in robot.legs:
        arm = rs.Robot("arm", (leg,), home=robot.home, reference_point=robot.reference_point)
        total += rs.stiffness(arm).K
    assert matrix_distance(result.K, total) < 1e-12


@needs_examples
def test_an_elastic_second_grasp_is_softer_than_a_rigid_one(tmp_path):
    cell = two_ur5(tmp_path)
    rigid = robot_of(cell, with_side(tmp_path, GRASPED.format(joint="fixed")))
    spring = "{type: spring, stiffness: [1e5, 1e5, 1e5, 1e3, 1e3, 1e3]}"
    side = with_side(tmp_path, GRASPED.format(joint=spring))
    elastic = robot_of(cell, side)
    K = rs.stiffness(elastic).K
    assert np.linalg.eigvalsh(rs.stiffness(rigid).K - K).min() > -1e-6
    K_of_side = rs.stiffness(rs.network_at(rs.load_linkage(cell, side=side))).K
    assert matrix_distance(K_of_side, K) < 1e-9


def _hexapod_tree():
    """A Stewart platform of radii 0.5 and 0.3, drawn with its legs upright and open loops."""
    links, joints, loops = ['<link name="base"/>', '<link name="platform"/>'], [], []

    def joint(name, kind, parent, child, xyz="0 0 0", axis="0 0 1"):
        links.append(f'<link name="{child}"/>')
        joints.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{xyz}"/><axis xyz="{axis}"/></joint>'
        )

    def at(radius, angle):
        return f"{radius * np.cos(angle):.17g} {radius * np.sin(angle):.17g} 0"

    for i in range(6):
        joint(f"u{i}", "continuous", "base", f"a{i}", at(0.5, np.pi / 3 * i), "1 0 0")
        joint(f"v{i}", "continuous", f"a{i}", f"b{i}", axis="0 1 0")
        joint(f"slide{i}", "prismatic", f"b{i}", f"c{i}")
        other = np.pi / 3 * (i + (0.5 if i % 2 else -0.5))
        x, y, _ = at(0.3, other).split()
        loops.append(
            f"  - {{between: [c{i}, {{link: platform, at: [{x}, {y}, 0]}}], joint: spherical}}"
        )
    joints.append(
        '<joint name="free" type="floating"><parent link="base"/><child link="platform"/>'
        '<origin xyz="0 0 0.8"/></joint>'
    )
    side = "\n".join(
        [
            "robostiff: 1",
            "source: chosen here",
            "platform: platform",
            "joints:",
            '  "slide?": {stiffness: 1e8 N/m}',
            '  "[uv]?": {role: passive}',
            "start:",
            *(f"  slide{i}: 0.9" for i in range(6)),
            "loops:",
            *loops,
        ]
    )
    return f'<robot name="hexapod">{"".join(links)}{"".join(joints)}</robot>', side


def test_a_stewart_platform_as_tree_is_that_of_a_model_file(tmp_path):
    urdf, side = _hexapod_tree()
    path = tmp_path / "hexapod.urdf"
    path.write_text(urdf, encoding="utf-8")
    tree = robot_of(path, with_side(tmp_path, side))
    assert len(tree.legs) == 6
    written = rs.load(FILES / "hexapod-of-a-tree.yaml")
    for pose in ([0, 0, 0.8, 0, 0, 0], [0.05, -0.02, 0.85, 0.1, 0.05, -0.1]):
        K, wanted = rs.stiffness(tree, pose).K, rs.stiffness(written, pose).K
        assert matrix_distance(K, wanted) < 1e-9


FIVE_BAR = text_of("five-bar.urdf")
FIVE_BAR_SIDE = text_of("five-bar.stiffness.yaml")


def _five_bar(folder, side):
    path = folder / "five-bar.urdf"
    path.write_text(FIVE_BAR, encoding="utf-8")
    return path, with_side(folder, side)


def test_a_beam_to_the_loop_leaves_a_robot_of_two_legs(tmp_path):
    path, side = _five_bar(tmp_path, FIVE_BAR_SIDE.replace("to: tool, ", "to: loop1, "))
    robot = robot_of(path, side)
    assert [leg.name for leg in robot.legs] == ["left crank", "right crank"]
    result = rs.stiffness(robot)
    network = rs.network_at(rs.load_linkage(path, side=side))
    assert matrix_distance(rs.stiffness(network).K, result.K) < 1e-9


def test_a_screw_closes_a_loop(tmp_path):
    side = FIVE_BAR_SIDE.replace("to: tool, ", "to: loop1, ")
    path, turning = _five_bar(tmp_path, side)
    K = rs.stiffness(robot_of(path, turning)).K
    found = []
    for pitch in ("1e-9 mm", "40 mm"):
        screw = side.replace("type: revolute, axis: z,", f"type: helical, axis: z, pitch: {pitch},")
        path, advancing = _five_bar(tmp_path, screw)
        found.append(rs.stiffness(robot_of(path, advancing)).K)
        network = rs.network_at(rs.load_linkage(path, side=advancing))
        assert matrix_distance(rs.stiffness(network).K, found[-1]) < 1e-9
    assert matrix_distance(found[0], K) < 1e-9
    assert abs(found[1][0, 2]) > 1e-2 * K[0, 0] > abs(K[0, 2])  # it pushes out of the plane


def test_a_beam_to_the_tool_leaves_the_loop_on_its_near_end(tmp_path):
    path, side = _five_bar(tmp_path, FIVE_BAR_SIDE)
    network = network_of(path, side)
    assert network.platform == "left rod, far end"


def test_a_beam_to_one_of_several_places_must_say_which(tmp_path):
    path, side = _five_bar(tmp_path, FIVE_BAR_SIDE.replace("to: tool, ", ""))
    with pytest.raises(rs.FileError, match="2 places to which it leads: loop1, tool"):
        rs.load(path, side=side)


def test_a_bridge_between_legs_makes_a_network(tmp_path):
    bridged = FIVE_BAR_SIDE.replace("to: tool, ", "to: loop1, ") + (
        "  - {between: [{link: bridge, at: [200 mm, 0, 0]}, {link: right, at: [0, 150 mm, 0]}],"
        " joint: {type: revolute, axis: z, role: passive}}\n"
    )
    path, side = _five_bar(tmp_path, bridged)
    network = network_of(path, side)
    without = robot_of(path, with_side(tmp_path, bridged.rsplit("  - {between", 1)[0]))
    stiffer = rs.stiffness(network).K - rs.stiffness(without).K
    assert np.linalg.eigvalsh(stiffer).min() > -1e-6 * np.abs(stiffer).max()
    assert np.abs(stiffer).max() > 1.0


def test_loops_follow_from_driven_joints(tmp_path):
    side = FIVE_BAR_SIDE.replace("to: tool, ", "to: loop1, ")
    path, file = _five_bar(tmp_path, side)
    linkage = rs.load_linkage(path, side=file)
    found = close(linkage, {"left crank": 0.3, "right crank": -0.2})
    assert found.is_closed
    assert found.coordinates["left crank"] == 0.3
    tip = found.frames["left rod"].p + found.frames["left rod"].R @ [0.15, 0.25, 0]
    for crank, angle in ((0.0, 0.3), (0.2, -0.2)):
        elbow = np.array([crank - 0.3 * np.sin(angle), 0.3 * np.cos(angle), 0])
        length = np.hypot(0.15, 0.25) if crank == 0 else np.hypot(0.05, 0.25)
        assert np.linalg.norm(tip - elbow) == pytest.approx(length, abs=1e-12)


def test_coordinates_of_a_platform_can_be_chosen(tmp_path):
    urdf, side = _hexapod_tree()
    path = tmp_path / "hexapod.urdf"
    path.write_text(urdf, encoding="utf-8")
    every = "coordinates: [z, x, y, rx, ry, rz]\n"
    robot = robot_of(path, with_side(tmp_path, every + side))
    assert [c.value for c in robot.coordinates] == ["z", "x", "y", "rx", "ry", "rz"]
    for few, match in (("[x, x, y, z, rx, ry]", "each one once"), ("[x, y]", "as many as the 6")):
        with pytest.raises(rs.FileError, match=match):
            rs.load(path, side=with_side(tmp_path, f"coordinates: {few}\n{side}"))


def test_a_loop_that_lacks_digits_is_reported(tmp_path):
    """Axes that are parallel to five digits only close no loop of hinges in space."""
    side = FIVE_BAR_SIDE.replace("to: tool, ", "to: loop1, ")
    path, file = _five_bar(tmp_path, side)
    short = FIVE_BAR.replace('<origin xyz="0.2 0 0"/>', '<origin xyz="0.2 0 0" rpy="2e-5 0 0"/>')
    path.write_text(short, encoding="utf-8")
    with pytest.raises(rs.FileError, match="more digits, for the loops nearly close"):
        rs.load(path, side=file)


def test_loops_that_cannot_close_are_reported(tmp_path):
    side = FIVE_BAR_SIDE.replace("to: tool, ", "to: loop1, ")
    path, file = _five_bar(tmp_path, side)
    linkage = rs.load_linkage(path, side=file)
    with pytest.raises(rs.NoAnswerError, match=r"a gap of .* mm"):
        rs.network_at(linkage, {"left crank": 1.5, "right crank": -1.5})
    far = side + "home: {left crank: 86 deg, right crank: -86 deg}\n"
    with pytest.raises(rs.FileError, match="loops that close in the home configuration"):
        rs.load(path, side=with_side(tmp_path, far))


def test_a_drive_slightly_beyond_a_fold_does_not_lack_digits(tmp_path):
    """The elbows are as far apart as both rods are long, and 0.05 mm more."""
    path, file = _five_bar(tmp_path, FIVE_BAR_SIDE)
    linkage = rs.load_linkage(path, side=file)
    fold = np.arcsin((np.hypot(0.15, 0.25) + np.hypot(0.05, 0.25) - 0.2) / 0.6)

    def gap(angle):
        found = close(linkage, {"left crank": angle, "right crank": -angle})
        return found, max(shift for shift, _ in found.gaps.values())

    assert gap(fold - 1e-4)[0].is_closed
    found, missing = gap(fold + 1e-4)
    assert 0 < missing < 1e-4
    assert not found.is_closed
    assert found.advice.startswith("give joint values nearer to home")
