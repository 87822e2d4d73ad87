"""Structures without mobility, and robots without extent, are read and answered at home."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.errors import InputError
from robostiff.kinematics import PostureFinder
from robostiff.model import Joint, PlacedFreedom
from robostiff.network import JointElement, Node, network_of_snapshot
from robostiff.spatial import Frame
from tests.files import written
from tests.generators.elements import random_transform


def frame_of_three(coordinates: str = "") -> str:
    legs = []
    for i in range(3):
        turn = f"turn: [{{z: {120 * i + 10} deg}}]"
        cosine, sine = np.cos(np.radians(120 * i + 10)), np.sin(np.radians(120 * i + 10))
        legs.append(
            f"""
  - name: leg{i}
    base: {{at: [{0.5 * cosine}, {0.5 * sine}, 0], {turn}}}
    chain:
      - {{type: revolute, axis: y, role: passive}}
      - {{type: rigid, to: [-0.2, 0, 0.6]}}
      - {{type: spring, stiffness: [1e6, 2e6, 3e6, 1e4, 2e4, 3e4]}}
    platform: {{at: [{0.3 * cosine}, {0.3 * sine}, 0], {turn}}}"""
        )
    head = "robostiff: 1\nname: frame\nsource: chosen here\nhome: {at: [0, 0, 0.6]}\n"
    return f"{head}{coordinates}legs:{''.join(legs)}\n"


def test_a_structure_without_mobility_stands_at_home(tmp_path):
    robot = rs.load(written(tmp_path / "frame.yaml", frame_of_three()))
    assert robot.coordinates == ()
    assert "without mobility" in repr(robot)
    result = rs.stiffness(robot)
    assert result.status is rs.Status.OK
    assert result.rank == 6
    # each leg: a spring at its end, condensed about its passive axis
    K = np.zeros((6, 6))
    for i in range(3):
        c, s = np.cos(np.radians(120 * i + 10)), np.sin(np.radians(120 * i + 10))
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        end, foot = R @ [0.3, 0, 0], R @ [0.5, 0, -0.6]
        k = np.zeros((6, 6))
        k[:3, :3] = R @ np.diag([1e6, 2e6, 3e6]) @ R.T
        k[3:, 3:] = R @ np.diag([1e4, 2e4, 3e4]) @ R.T
        cross = np.cross(np.eye(3), end)  # rows e_i x end: t_end = t - end x r
        J = np.block([[np.eye(3), cross.T], [np.zeros((3, 3)), np.eye(3)]])
        k = J.T @ k @ J
        axis = R[:, 1]
        u = k @ np.concatenate([np.cross(foot, axis), axis])
        K += k - np.outer(u, u) / (u @ np.concatenate([np.cross(foot, axis), axis]))
    assert np.allclose(result.K, K, rtol=0, atol=1e-9 * np.abs(K).max())
    assert np.allclose(rs.stiffness(robot, []).K, K, rtol=0, atol=1e-9 * np.abs(K).max())
    assert np.allclose(rs.compliance(robot) @ K, np.eye(6), atol=1e-8)
    assert rs.verify(robot).agree
    away = rs.stiffness(robot, [0.01, 0, 0.6, 0, 0, 0])
    assert away.status is rs.Status.UNREACHABLE


def test_coordinates_that_a_structure_does_not_have_are_refused(tmp_path):
    path = written(tmp_path / "frame.yaml", frame_of_three("coordinates: [x]\n"))
    with pytest.raises(InputError, match="as many as the 0 freedoms"):
        rs.load(path)


FLEXURES = ("p1", "p2", "p3", "r1", "r2", "r3")


def tree_of_two_legs() -> tuple[str, str]:
    """A part held by two passive hinges across one another, each on six flexures."""
    links, joints = ['<link name="base"/>'], []

    def joint(name: str, kind: str, parent: str, child: str, axis: str, xyz: str = "0 0 0") -> None:
        links.append(f'<link name="{child}"/>')
        joints.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{xyz}"/><axis xyz="{axis}"/></joint>'
        )

    for leg, foot in (("a", "0 0 0"), ("b", "1 0 0")):
        parent = "base"
        for i, name in enumerate(FLEXURES):
            kind = "prismatic" if name[0] == "p" else "continuous"
            axis = ("1 0 0", "0 1 0", "0 0 1")[i % 3]
            joint(f"{leg}{name}", kind, parent, f"{leg}{i}", axis, foot if i == 0 else "0 0 0")
            parent = f"{leg}{i}"
    joint("hinge", "continuous", "a5", "part", "0 0 1")
    side = """
robostiff: 1
source: chosen here
platform: part
joints:
  "?p*": {role: locked, stiffness: 1e6 N/m}
  "?r*": {role: locked, stiffness: 1e4 N m/rad}
  hinge: {role: passive}
loops:
  - name: other
    between: [b5, {link: part, at: [1, 0, 0]}]
    joint: {type: revolute, axis: x, role: passive}
"""
    return f'<robot name="held">{"".join(links)}{"".join(joints)}</robot>', side


def test_a_tree_without_mobility(tmp_path):
    urdf, side = tree_of_two_legs()
    path, beside = tmp_path / "held.urdf", tmp_path / "held.stiffness.yaml"
    path.write_text(urdf, encoding="utf-8")
    beside.write_text(side, encoding="utf-8")
    robot = rs.load(path)
    assert robot.coordinates == ()
    result = rs.stiffness(robot)
    assert result.status is rs.Status.OK
    network = rs.network_at(rs.load_linkage(path))
    assert np.allclose(rs.stiffness(network).K, result.K, rtol=0, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_a_robot_all_in_one_point_closes_wherever_it_is(seed: int):
    random = np.random.default_rng(seed)
    base, attachment = random_transform(random), random_transform(random, 0.0)
    axis = random.normal(size=3)
    spring = rs.Elasticity(np.diag([1e-6, 2e-6, 3e-6, 1e-4, 2e-4, 3e-4]))
    link = rs.Link(np.zeros(3), spring, np.eye(3))
    chain = rs.Chain((rs.revolute(axis, rs.Passive(), home=[0.4]), link))
    alone = rs.Robot("point", (rs.Leg("leg", base, chain, attachment),), coordinates=())
    pose = PostureFinder(alone).home_pose
    home = Frame(Rotation.from_rotvec(pose[3:]).as_matrix(), pose[:3])
    robot = rs.Robot("point", alone.legs, home=home)
    result = rs.stiffness(robot)
    assert result.rank == 5
    assert np.allclose(result.K, rs.stiffness(alone).K, rtol=1e-9, atol=1e-3)


def away_and_back(random: np.random.Generator) -> tuple[rs.Rigid, rs.Rigid]:
    """Two links that lead back to the point, but for rounding."""
    there = random_transform(random)
    turn = Rotation.from_rotvec(random.normal(size=3)).as_matrix()
    return rs.Rigid(there), rs.Rigid(Frame(turn, -(there.R.T @ there.p)))


@pytest.mark.parametrize("seed", range(3))
def test_axes_that_meet_in_the_origin_but_for_rounding(seed: int):
    """Forces are carried, and moments across all passive axes of the leg."""
    random = np.random.default_rng(seed)
    spring = rs.Elasticity(np.diag([1e-8, 1e-8, 1e-8, 1e-5, 1e-5, 1e-5]))
    legs = []
    for leg in range(3):
        parts: list[rs.Rigid | rs.Link | Joint] = [rs.Link(np.zeros(3), spring, np.eye(3))]
        turned = np.eye(3)
        for joint in range(3):
            role = rs.Passive() if joint else rs.Actuated(1e4)
            parts.append(rs.revolute(random.normal(size=3), role, name=f"{joint}"))
            links = away_and_back(random)
            parts += links
            turned = turned @ links[0].transform.R @ links[1].transform.R
        legs.append(
            rs.Leg(f"{leg}", Frame.identity(), rs.Chain(tuple(parts)), Frame(turned, np.zeros(3)))
        )
    robot = rs.Robot("wrist", tuple(legs), Frame.identity())
    assert rs.stiffness(robot).rank == 6  # a moment of each leg
    pair = rs.Robot("wrist", tuple(legs[:2]), Frame.identity())
    assert rs.stiffness(pair).rank == 5
    at_rest = rs.find_posture(robot).snapshot.one(0)
    assert rs.stiffness(network_of_snapshot(at_rest)).rank == 6


@pytest.mark.parametrize("seed", range(2))
def test_a_spherical_four_bar_about_the_origin_but_for_rounding(seed: int):
    random = np.random.default_rng(seed)
    bodies = [Node(f"{k}", random.normal(size=3)) for k in range(4)]
    joints = []
    for k in range(4):
        axis = random.normal(size=3)
        own = PlacedFreedom(
            axis / np.linalg.norm(axis), 1e-16 * random.normal(size=3), 0.0, "turn", rs.Passive()
        )
        joints.append(JointElement(f"joint {k}", f"{k}", f"{(k + 1) % 4}", (own,)))
    loop = rs.Network("loop", tuple(bodies), ("0",), "2", bodies[2].point, joints=tuple(joints))
    assert rs.stiffness(loop).rank == 5
