"""Laws of networks: beams, loops, braces, mechanisms, units."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis import stiffness
from robostiff.elasticity import Elasticity, beam_stiffness, elasticity_from_stiffness
from robostiff.elastostatics import matrix_distance
from robostiff.kinematics import with_masses
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.network import (
    CouplingElement,
    JointElement,
    Network,
    Node,
    SpringElement,
    beam_between,
    compliance_between,
    condense,
    energy_stiffness,
    mobility,
    network_of_snapshot,
)
from robostiff.spatial import Space, rotate_stiffness
from tests.cases.reference_case import case
from tests.network.frames import (
    BAR,
    GRAPH_NAMES,
    STEEL,
    ball,
    chain_of_beams,
    graph,
    lattice,
    nodes,
    slender_frame,
    sliding,
    turning,
)

ENDS = np.array([[0.1, -0.2, 0.3], [0.9, 0.5, 0.7]])


def framed(*, platform_ball: bool) -> Network:
    """A portal of three beams with a tie rod between two balls; the platform on its top."""
    a, b, c, d, top = nodes(a=[0, 0, 0], b=[1, 0, 0], c=[0, 0, 1], d=[1, 0.1, 1], top=[0.5, 0, 1.3])
    ends = [(a, c), (b, d), (c, d), (c, top)]
    beams = tuple(beam_between(*e, STEEL, BAR, name=e[0].name + e[1].name) for e in ends)
    start, end = nodes(start=[1, 0, 0], end=[0.5, 0, 1.3])
    tie = beam_between(start, end, STEEL, BAR, name="tie")
    joints = [JointElement("foot", "b", "start", ball(start.point))]
    if platform_ball:
        joints.append(JointElement("head", "end", "top", ball(end.point)))
    else:
        joints.append(JointElement("head", "end", "top"))
    every = (a, b, c, d, top, start, end)
    return Network("portal", every, ("a", "b"), "top", top.point, (*beams, tie), (), tuple(joints))


@pytest.mark.parametrize("pieces", [1, 2, 7, 100])
def test_a_beam_cut_into_pieces_is_the_same_beam(pieces):
    network = chain_of_beams(ENDS, pieces)
    length = float(np.linalg.norm(ENDS[1] - ENDS[0]))
    K = rotate_stiffness(beam_stiffness(length, STEEL, BAR), network.beams[0].rotation)
    assert matrix_distance(condense(network).K, K, 1.0) < 1e-13


def test_patch_a_lattice_under_even_tension_stretches_evenly():
    """Every column carries the same force, so the top face goes up by that of one column."""
    cells, pull = 2, 1000.0
    network = lattice(cells)
    # Poisson's effect is none in a lattice of bars: only the columns work.
    top = [node for node in network.nodes if abs(node.point[2] - 0.3 * cells) < 1e-12]
    C = compliance_between(network, [(node.name, node.point) for node in top])
    load = np.tile([0, 0, pull, 0, 0, 0], len(top))
    moved = (C @ load).reshape(-1, 6)
    expected = np.array([0, 0, pull * 0.3 * cells / (STEEL.E * BAR.A), 0, 0, 0])
    np.testing.assert_allclose(moved, np.tile(expected, (len(top), 1)), atol=1e-12 * expected[2])


@pytest.mark.parametrize("name", GRAPH_NAMES)
def test_graph_case_against_sixty_digits(name):
    network, oracle = graph(name)
    result = stiffness(network)
    assert matrix_distance(result.K, np.array(oracle["K"]), 0.5) < oracle["suggested_rtol"]
    assert int(result.rank) == oracle["rank"]
    assert len(result.free_motions) == 6 - oracle["rank"]
    if "compliance" in oracle:
        C = compliance_between(network, [(network.platform, network.reference_point)])
        assert matrix_distance(C, np.array(oracle["compliance"]), 2.0) < oracle["suggested_rtol"]


def test_motions_that_leave_the_platform_at_rest_displace_it_by_nothing():
    # four rods turn about their own axes, of which rounding moves the platform by 1e-17
    machine = rs.load(Path(__file__).parents[1] / "campaign" / "machines" / "4-rpur.yaml")
    network = network_of_snapshot(with_masses(rs.find_posture(machine)).one(0))
    for robot in (network, machine):
        bent = rs.deflection(robot, wrench=[1, 2, 3, 0.4, 0.5, 0.6])
        assert bent.twist == pytest.approx(rs.compliance(machine) @ bent.wrench, rel=1e-9)
    sunk = rs.deflection(network, gravity=[1, 2, 3])
    assert sunk.twist == pytest.approx(
        rs.deflection(machine, gravity=[1, 2, 3]).twist, rel=1e-9, abs=1e-15
    )
    assert sunk.energy == pytest.approx(sum(part.energy for part in sunk.parts), rel=1e-9)


def test_a_pendulum_on_the_platform_changes_nothing():
    network = chain_of_beams(ENDS, 1)
    bob = Node("bob", np.array([0.9, 0.5, 0.0]))
    hinge = JointElement("hinge", "n1", "bob", (turning(ENDS[1], [1, 2, 0]),))
    hanging = Network(
        "pendulum", (*network.nodes, bob), ("n0",), "n1", ENDS[1], network.beams, (), (hinge,)
    )
    result = condense(hanging)
    assert matrix_distance(result.K, condense(network).K, 1.0) < 1e-13
    assert result.status == rs.Status.REDUNDANT_JOINTS
    with pytest.raises(rs.NoAnswerError, match="node 'bob'"):
        compliance_between(hanging, [("bob", bob.point)])
    # A load along the hinge's axis does no work on the swing of the bob.
    axis = np.array([1.0, 2.0, 0.0, 0, 0, 0])[:, None] / np.sqrt(5)
    work = compliance_between(hanging, [("bob", bob.point)], loads=axis)
    at_hinge = np.concatenate([axis[:3, 0], np.cross(bob.point - ENDS[1], axis[:3, 0])])
    at_hinge[3:] -= at_hinge[3:] @ axis[:3, 0] * axis[:3, 0]
    C = compliance_between(network, [("n1", ENDS[1])])
    assert work.item() == pytest.approx(at_hinge @ C @ at_hinge, rel=1e-9)
    with pytest.raises(rs.NoAnswerError, match="of load 0"):
        compliance_between(hanging, [("bob", bob.point)], loads=np.eye(6)[:, [3]])


def door(hinges: int, k: float | None) -> Network:
    wall, leaf = nodes(wall=[0, 0, 0], leaf=[0.4, 0, 1])
    places = np.linspace(0.2, 1.8, hinges)
    joints = tuple(
        JointElement(f"h{i}", "wall", "leaf", (turning([0, 0, z], [0, 0, 1], k),))
        for i, z in enumerate(places)
    )
    spring = SpringElement(
        "seal", "leaf", "room", leaf.point, np.eye(3), Elasticity(1e-5 * np.eye(6))
    )
    room = Node("room", np.array([0.8, 0, 1]))
    return Network("door", (wall, leaf, room), ("wall",), "room", room.point, (), (spring,), joints)


@pytest.mark.parametrize("hinges", [2, 3, 9])
def test_more_hinges_on_one_axis_brace_one_another_without_load(hinges):
    one = condense(door(1, None))
    many = condense(door(hinges, None))
    assert matrix_distance(many.K, one.K, 1.0) < 1e-13
    assert many.status == one.status == rs.Status.FREE_MOTIONS
    assert int(many.rank) == 5


def test_two_ways_of_welds_are_one():
    a, b, c, d = nodes(a=[0, 0, 0], b=[0.1, 0, 0], c=[0.2, 0.1, 0], d=[0.5, 0.2, 0.3])
    beam = beam_between(c, d, STEEL, BAR)
    welds = [
        JointElement(f"w{p.name}{q.name}", p.name, q.name) for p, q in ((a, b), (b, c), (a, c))
    ]
    loop = Network("loop", (a, b, c, d), ("a",), "d", d.point, (beam,), (), tuple(welds))
    tree = Network("tree", (a, b, c, d), ("a",), "d", d.point, (beam,), (), tuple(welds[:2]))
    assert matrix_distance(condense(loop).K, condense(tree).K, 1.0) < 1e-13


def test_a_platform_held_by_rigid_parts_alone_has_rigid_directions():
    wall, table = nodes(wall=[0, 0, 0], table=[0, 0, 0.2])
    joint = JointElement("guide", "wall", "table", (sliding([0, 0, 0], [1, 0, 0], 1e6),))
    result = stiffness(
        Network("table", (wall, table), ("wall",), "table", table.point, joints=(joint,))
    )
    assert result.status == rs.Status.RIGID_DIRECTION
    assert len(result.rigid_directions) == 5
    with pytest.raises(rs.NoAnswerError):
        _ = result.K
    with pytest.raises(rs.NoAnswerError):
        energy_stiffness(
            Network("t", (wall, table), ("wall",), "table", table.point, joints=(joint,))
        )
    # Compliance exists: nothing but the slide moves.
    C = compliance_between(
        Network("t", (wall, table), ("wall",), "table", table.point, joints=(joint,)),
        [("table", table.point)],
    )
    np.testing.assert_allclose(C, np.diag([1e-6, 0, 0, 0, 0, 0]), atol=1e-20)


def test_a_platform_that_hangs_on_nothing_is_free():
    wall, tip, moon = nodes(wall=[0, 0, 0], tip=[1, 0, 0], moon=[0, 0, 9])
    beam = beam_between(wall, tip, STEEL, BAR)
    result = stiffness(Network("moon", (wall, tip, moon), ("wall",), "moon", moon.point, (beam,)))
    assert int(result.rank) == 0
    assert not result.K.any()


def test_slender_bars_keep_their_digits_in_the_plane():
    """Some 4000 times as long as thick and across the axes of the world: as in space."""
    frame = slender_frame()
    rows = list(Space.PLANAR.rows)
    expected = condense(replace(frame, space=Space.SPATIAL)).K[np.ix_(rows, rows)]
    assert np.allclose(condense(frame).K, expected, rtol=1e-13, atol=0)


def hinged_lattice(cells: int) -> Network:
    """A cube of rods, each of which starts at a ball and is welded on at its end."""
    welded = lattice(cells)
    feet, beams, joints = [], [], []
    for beam in welded.beams:
        feet.append(Node(f"foot of {beam.name}", beam.start))
        joints.append(JointElement(beam.name, beam.a, feet[-1].name, ball(beam.start)))
        beams.append(replace(beam, a=feet[-1].name))
    every = (*welded.nodes, *feet)
    return replace(welded, nodes=every, beams=tuple(beams), joints=tuple(joints))


@pytest.mark.parametrize(
    "network",
    [
        framed(platform_ball=True),
        door(3, None),
        graph("h_parallelogram_square")[0],
        network_of_snapshot(case("b_stewartA_home").snapshot),
        network_of_snapshot(case("a15_SS_redundant").snapshot),
        hinged_lattice(1),
        hinged_lattice(2),
    ],
    ids=lambda network: network.name,
)
def test_large_networks_are_decided_like_small_ones(monkeypatch, network):
    small = stiffness(network)
    monkeypatch.setattr(mobility, "_DENSE", 0)
    large = stiffness(network)
    assert large.status == small.status
    assert large.rank == small.rank
    assert large.redundant_joints == small.redundant_joints
    assert len(large.free_motions) == len(small.free_motions)
    # Other coordinates are pinned, and noise is about the condition of the rest.
    assert matrix_distance(large.K, small.K, 1.0) < 1e-10


@pytest.mark.parametrize(
    ("soft", "stiff", "digits"), [(1.0, 1e8, 1e-9), (1e-2, 1e7, 1e-8), (3e-5, 6.8e6, 1e-5)]
)
@pytest.mark.parametrize("seed", range(3))
def test_a_dense_spring_keeps_its_digits(soft: float, stiff: float, digits: float, seed: int):
    """Soft and stiff directions across all axes: K as it is given, and its deflections.

    Its inverse in floats has the stiff directions to 1e-16 times their ratio.
    """
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    K = Q @ np.diag(np.geomspace(soft, stiff, 6)) @ Q.T
    K = 0.5 * (K + K.T)
    wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([0.3, 0.1, 0.2]))
    spring = SpringElement("s", "wall", "tip", tip.point, np.eye(3), elasticity_from_stiffness(K))
    network = Network("dense", (wall, tip), ("wall",), "tip", tip.point, springs=(spring,))
    found, t = rs.stiffness(network), rng.normal(scale=1e-5, size=6)
    assert np.abs(found.K - K).max() < 1e-9 * stiff
    assert found.rank == 6
    bent = rs.deflection(network, wrench=K @ t)
    assert np.allclose(bent.twist, t, rtol=0, atol=10 * digits * np.abs(t).max())


def test_a_spring_with_free_and_rigid_directions():
    C = np.diag([1e-6, 0, 2e-6, 0, 3e-4, 0])
    free = np.eye(6)[:, [3]]
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]])
    far = np.array([0.3, 0.2, 0.9])
    soft = PlacedSpring("soft", far / 2, np.eye(3), Elasticity(1e-7 * np.eye(6)))
    odd = PlacedSpring("odd", far, turn, Elasticity(C, free))
    snapshot = Snapshot("mount", (PlacedLeg("leg", (soft, odd), far),), far)
    network = network_of_snapshot(snapshot)
    expected, result = stiffness(snapshot), stiffness(network)
    assert int(result.rank) == int(expected.rank) == 5
    assert matrix_distance(result.K, expected.K, 0.5) < 1e-12
    assert matrix_distance(energy_stiffness(network), expected.K, 0.5) < 1e-10


@pytest.mark.parametrize("pitch", [0.0, 0.05])
@pytest.mark.parametrize("axis", [[0.3, -0.7, 0.5], [0.2, 0.4, 0.5]])
def test_a_driven_slide_and_a_passive_turn_are_one_joint_or_two(pitch: float, axis: list[float]):
    """The slide's spring turns by rounding alone, from which no length follows."""
    foot, near, middle, far, tip, wall = nodes(
        foot=[0, 0, 0],
        near=[0.5, 0, 0],
        middle=[0.5, 0, 0],
        far=[0.5, 0, 0],
        tip=[1, 0, 0.3],
        wall=[0, 1, 0],
    )
    bars = [(foot, near), (far, tip), (wall, tip)]
    beams = tuple(beam_between(*own, STEEL, BAR, name=own[1].name) for own in bars)
    along = np.array(axis) / np.linalg.norm(axis)
    slide = PlacedFreedom(along, near.point, None, "slide", rs.Actuated(1e5))
    across = np.array([0.7, 0.3, 0]) / np.hypot(0.7, 0.3)
    turn = PlacedFreedom(across, near.point, pitch, "turn", rs.Passive())

    def network(*joints: JointElement) -> Network:
        names = {joint.b for joint in joints} | {joint.a for joint in joints}
        every = [
            node
            for node in (foot, near, middle, far, tip, wall)
            if node is not middle or "middle" in names
        ]
        return Network("two", tuple(every), ("foot", "wall"), "tip", tip.point, beams, (), joints)

    whole = stiffness(network(JointElement("both", "near", "far", (slide, turn))))
    apart = (
        JointElement("one", "near", "middle", (slide,)),
        JointElement("two", "middle", "far", (turn,)),
    )
    series = stiffness(network(*apart))
    assert whole.status == series.status == rs.Status.OK
    assert matrix_distance(whole.K, series.K, 1.0) < 1e-12


def test_a_tapered_beam_sinks_under_its_weight_as_by_integrals(tmp_path):
    """Its weight was shared by its ends as that of a uniform beam, 1.4 % too low."""
    path = tmp_path / "bar.yaml"
    path.write_text(
        "robostiff: 1\nname: bar\nsource: own\nlegs:\n  - name: bar\n    chain:\n"
        "      - {type: beam, to: [0.3, 0, 0], y_axis: z, material: aluminium, taper: ["
        "{share: 0.4, section: {circle: {diameter: 50 mm}}}, "
        "{share: 0.6, section: {circle: {diameter: 35 mm}}, material: steel}]}\n"
    )
    bar = network_of_snapshot(with_masses(rs.find_posture(rs.load(path))).one(0))
    x, step = np.linspace(0.0, 0.3, 30_000, endpoint=False) + 5e-6, 1e-5
    kinds = [rs.material(name) for name in ("aluminium", "steel")]
    d = np.where(x < 0.12, 0.05, 0.035)
    E, density = (np.where(x < 0.12, *(getattr(k, own) for k in kinds)) for own in ("E", "density"))
    weight, area = 9.0 * density, np.pi * d**2 / 4
    beyond = [np.cumsum((weight * area * own)[::-1])[::-1] * step for own in (1, x)]
    bend = (beyond[1] - x * beyond[0]) / (E * np.pi * d**4 / 64)
    sunk = rs.deflection(bar, gravity=[2.0, 0, -9.0]).twist
    assert np.allclose(
        sunk[[2, 4]], [-np.sum(bend * (0.3 - x)) * step, np.sum(bend) * step], 1e-6, 0
    )
    # Of the slice itself, half lies beyond its middle.
    stretch = np.sum((beyond[0] - weight * area * step / 2) / (E * area)) * step * 2 / 9
    assert np.isclose(sunk[0], stretch, rtol=1e-6, atol=0)


@pytest.mark.parametrize("space", Space)
def test_a_joint_that_leaves_all_motions_free_holds_nothing(space: Space):
    wall, tip, loose = nodes(wall=[0, 0, 0], tip=[1, 0, 0], loose=[1, 1, 0])
    rod = beam_between(wall, tip, STEEL, BAR, y_axis=[0, 0, 1], name="rod")
    free = [motion(tip.point, axis) for axis in np.eye(3) for motion in (sliding, turning)]
    planar = [f for f in free if (abs(f.axis[2]) > 0) == (f.pitch is not None)]
    joint = JointElement("any", "tip", "loose", tuple(free if space is Space.SPATIAL else planar))
    alone = Network("alone", (wall, tip), ("wall",), "tip", tip.point, (rod,), space=space)
    both = replace(alone, nodes=(wall, tip, loose), joints=(joint,))
    np.testing.assert_allclose(stiffness(both).K, stiffness(alone).K, rtol=1e-12)
    hanging = stiffness(replace(both, platform="loose"))
    assert hanging.rank == 0
    assert hanging.status == rs.Status.FREE_MOTIONS


@pytest.mark.parametrize("along", [[1, 0, 0], [0.6, 0.8, 0]])
def test_a_drive_along_a_passive_slide_gives_no_direction_its_compliance(along: list[float]):
    wall, tip = nodes(wall=[0, 0, 0], tip=[1, 0, 0])
    slides = sliding(tip.point, along, 1e4), sliding(tip.point, along)
    turn = turning(tip.point, [0, 0, 1])
    joint = JointElement("joint", "wall", "tip", (*slides, turn))
    result = stiffness(
        Network("two", (wall, tip), ("wall",), "tip", tip.point, (), (), (joint,), Space.PLANAR)
    )
    # nothing yields across the slides, and nothing resists along them
    assert result.status == rs.Status.FREE_MOTIONS | rs.Status.RIGID_DIRECTION


def test_a_coupled_freedom_that_another_one_repeats_is_refused():
    wall, tip = nodes(wall=[0, 0, 0], tip=[1, 0, 0])
    rod = beam_between(wall, tip, STEEL, BAR, name="rod")
    turn, drive = (turning(tip.point, [0, 0, 1], k) for k in (None, 1e4))
    two = JointElement("two", "wall", "tip", (turn, drive, sliding(tip.point, [1, 0, 0])))
    geared = CouplingElement("gear", ((two, 0, 2.0), (two, 2, 1.0)))
    shaft = Network("shaft", (wall, tip), ("wall",), "tip", tip.point, (rod,), (), (two,))
    assert stiffness(shaft).rank == 6
    with pytest.raises(rs.InputError, match="freedom 1 of joint 'two', which others repeat"):
        stiffness(replace(shaft, couplings=(geared,)))
