"""Networks and linkages under load: as robots of legs are, and a four-bar linkage on paper."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robostiff as rs
from robostiff.elasticity import Elasticity, circle
from robostiff.kinematics import with_masses
from robostiff.linkage import Connection, Linkage
from robostiff.model import Actuated, Passive, PlacedFreedom, revolute
from robostiff.network import (
    CouplingElement,
    JointElement,
    Network,
    Node,
    SpringElement,
    beam_between,
    network_of_snapshot,
)
from robostiff.spatial import Frame, Space
from robostiff.statics import Bowing
from tests.network.frames import slender_frame
from tests.statics.robots_under_load import loaded, root

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    "name", ["six-joint-arm", "3-puu", "gough-stewart-b-beams", "tricept.yaml", "exechon.yaml"]
)
def test_a_robot_and_its_network_are_the_same_far_from_rest(name: str):
    """Legs, parts in series, and every part between bodies of its own; hinged beams alike."""
    robot = rs.load(EXAMPLES / name if name.endswith("yaml") else name)
    snapshot = with_masses(rs.find_posture(robot)).one(0)
    F = np.array([80, -40, -160, 5, 10, 5.0])
    whole = network_of_snapshot(snapshot)
    both = [snapshot, whole]
    ways = [{"wrench": F}]
    if name.endswith("yaml"):
        ways += [{"gravity": [0, 0, -9.81]}, {"wrench": 30 * F, "gravity": [3.0, 0, -9.81]}]
    for given in ways:
        legs, network = (loaded(own, **given) for own in both)
        assert np.abs(legs.displacement).max() > 1e-7
        assert np.allclose(network.displacement, legs.displacement, rtol=1e-9, atol=1e-13)
        assert np.allclose(network.K, legs.K, rtol=0, atol=1e-10 * np.abs(legs.K).max())
        assert np.isclose(network.energy, legs.energy, rtol=1e-9, atol=0)
        assert np.isclose(network.margin, legs.margin, rtol=1e-6)
    one = Bowing(elements=1)
    legs, alone = (loaded(own, wrench=F, beams=one) for own in (snapshot, branching(whole)))
    assert np.allclose(alone.displacement, legs.displacement, rtol=1e-9, atol=1e-13)
    assert np.allclose(alone.K, legs.K, rtol=0, atol=1e-10 * np.abs(legs.K).max())


def branching(network: Network) -> Network:
    """The same with a part that hangs on every body, so that no two parts are in series."""
    nodes = [node for node in network.nodes if node.name not in network.fixed]
    ends = [Node(f"{node.name}, hanging", node.point) for node in nodes]
    soft = Elasticity(np.diag([1e-6] * 3 + [1e-3] * 3))
    hanging = [
        SpringElement(f"on {node.name}", node.name, end.name, node.point, np.eye(3), soft)
        for node, end in zip(nodes, ends, strict=True)
    ]
    return replace(network, nodes=(*network.nodes, *ends), springs=(*network.springs, *hanging))


def turned_round(network: Network) -> Network:
    """The same with every joint from its second node to its first."""

    def back(joint: JointElement) -> JointElement:
        own = tuple(replace(f, axis=-f.axis) for f in reversed(joint.freedoms))
        return replace(joint, a=joint.b, b=joint.a, freedoms=own)

    return replace(network, joints=tuple(map(back, network.joints)))


@pytest.mark.parametrize("name", ["hexapod", "delta", "3-prs"])
def test_parts_in_series_are_one_chain_whichever_way_their_joints_lead(name: str):
    snapshot = rs.find_posture(rs.load(name)).snapshot.one(0)
    network = network_of_snapshot(snapshot)
    F = np.array([80, -40, -160, 5, 10, 5.0])
    there, back = (loaded(own, wrench=F) for own in (network, turned_round(network)))
    assert np.allclose(back.displacement, there.displacement, rtol=1e-9, atol=1e-13)
    assert np.allclose(back.K, there.K, rtol=0, atol=1e-12 * np.abs(there.K).max())


@pytest.mark.parametrize("ends", [("near", "far"), ("far", "near")])
def test_a_joint_carries_what_its_second_body_exerts_on_its_first(ends: tuple[str, str]):
    """As under small loads, whichever way chains pass it; about its axis that is its load."""
    middle, tip = np.array([0.5, 0, 0]), np.array([1.0, 0, 0.3])
    nodes = Node("wall", O), Node("near", middle), Node("far", middle), Node("tip", tip)
    bars = ((nodes[0], nodes[1]), (nodes[2], nodes[3]))
    steel, bar = rs.material("steel"), circle(0.03)
    hinge = PlacedFreedom(np.array([0, 1.0, 0]), middle, 0.0, "hinge", Actuated(1e4))
    network = Network(
        "two bars",
        nodes,
        ("wall",),
        "tip",
        tip,
        beams=tuple(beam_between(*own, steel, bar, name=own[0].name) for own in bars),
        joints=(JointElement("hinge", *ends, (hinge,)),),
    )
    F = np.array([10.0, 20, 30, 1, 2, 3])
    (small,) = rs.deflection(network, None, F).reactions
    limit = next(p for p in loaded(network, wrench=1e-4 * F).parts if p.part == "hinge")
    assert np.allclose(limit.wrench / 1e-4, small.wrench, rtol=0, atol=1e-3)
    assert np.isclose(limit.wrench[4], limit.load)


def test_a_shipped_network_has_its_linear_stiffness_at_rest():
    network = rs.load("double-pantograph")
    K = rs.stiffness(network).K
    assert np.allclose(loaded(network).K, K, rtol=0, atol=1e-10 * np.abs(K).max())
    force = rs.DeadForce([0, 0, -20.0])
    on_body = loaded(network, loads={"platform": force})
    same = loaded(network, wrench=[0, 0, -20, 0, 0, 0], at=network.reference_point)
    assert np.allclose(on_body.displacement, same.displacement, rtol=1e-9, atol=1e-14)


def test_slender_bars_keep_their_digits_in_the_plane():
    """Some 4000 times as long as thick and across the axes of the world: as in space."""
    frame, rows = slender_frame(), list(Space.PLANAR.rows)
    F = np.array([2e-7, -3e-7, 1e-7])
    plane = loaded(frame, wrench=F)
    space = loaded(replace(frame, space=Space.SPATIAL), wrench=[*F[:2], 0, 0, 0, F[2]])
    assert np.abs(plane.displacement[1]) > 1e-3
    assert np.allclose(plane.displacement, space.displacement[rows], rtol=1e-10, atol=0)
    assert np.allclose(plane.K, space.K[np.ix_(rows, rows)], rtol=1e-10, atol=0)


def rod(diameter: float) -> Network:
    """A rod of 1 m, clamped at its wall."""
    wall, tip = Node("wall", O), Node("tip", np.array([1.0, 0, 0]))
    bar = beam_between(wall, tip, rs.material("steel"), circle(diameter), name="rod")
    return Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(bar,))


@pytest.mark.parametrize("diameter", [5e-3, 20e-3, 50e-3])
@pytest.mark.parametrize("bend", [0.01, 0.1, 0.3, 0.5])
def test_a_rod_held_where_a_wrench_takes_it_carries_that_wrench(diameter: float, bend: float):
    """Its ends are given, and its axial force alone is found, far below what buckles it."""
    EI = rs.material("steel").E * circle(diameter).Iy
    F = bend * EI * np.array([-0.5, 1, 0.3, 0.1, 0.2, 0.3])
    for beams in (Bowing(1, inner_modes=True), *([Bowing()] if bend < 0.5 else [])):
        free = loaded(rod(diameter), wrench=F, beams=beams)
        held = loaded(rod(diameter), displacement=free.displacement, beams=beams)
        assert held.stable
        assert np.allclose(held.wrench, F, rtol=0, atol=1e-7 * np.abs(F).max())
        assert np.isclose(held.energy, free.energy, rtol=1e-9)


@pytest.mark.parametrize(("elements", "most"), [(2, 0.015), (4, 0.002), (8, 2.5e-4)])
def test_a_rod_bent_by_half_a_radian_is_the_elastica(elements: int, most: float):
    """``EI t'' = -P cos t``, ``t = 0`` at the wall and ``t' = 0`` at the tip, with P = EI/L^2."""

    def shot(curvature: float) -> np.ndarray:
        def rates(_: float, y: np.ndarray) -> list[float]:
            t, slope = y[:2]
            return [slope, -np.cos(t), np.cos(t), np.sin(t)]

        path = solve_ivp(rates, (0, 1), [0, curvature, 0, 0], rtol=1e-10, atol=1e-12)
        return path.y[:, -1]

    turn, _, along, across = shot(root(lambda c: float(shot(c)[1]), 0.5, 1.0))
    P = rs.material("steel").E * circle(2e-3).Iy
    bent = loaded(rod(2e-3), wrench=[0, 0, P, 0, 0, 0], beams=Bowing(elements))
    off = bent.displacement[[0, 2]] - [along - 1, across]
    assert np.abs(off).max() < most * across
    assert np.isclose(-bent.displacement[4], turn, rtol=most)
    chosen = loaded(rod(2e-3), wrench=[0, 0, P, 0, 0, 0])
    assert np.abs(chosen.displacement[[0, 2]] - [along - 1, across]).max() < 0.003 * across
    assert chosen.divisions == {"rod/rod": 8}
    assert not chosen.advice
    one = loaded(rod(2e-3), wrench=[0, 0, P, 0, 0, 0], beams=Bowing(1))
    assert "bends" in one.advice[0]


@pytest.mark.parametrize("diameter", [5e-4, 5e-3, 20e-3])
def test_the_force_of_a_rod_whose_end_is_moved_aside_is_the_slope_of_its_energy(diameter: float):
    robot, h = rod(diameter), 1e-6
    low, here, high = (
        loaded(robot, displacement=[0, 0, 0.1 + shift, 0, 0, 0]) for shift in (-h, 0, h)
    )
    assert np.isclose((high.energy - low.energy) / (2 * h), here.wrench[2], rtol=1e-7)


def test_a_frame_held_where_a_wrench_takes_it_carries_that_wrench():
    frame, F = slender_frame(), np.array([2e-7, -3e-7, 1e-7])
    free = loaded(frame, wrench=F)
    held = loaded(frame, displacement=free.displacement)
    assert held.stable
    assert np.allclose(held.wrench, F, rtol=0, atol=1e-6 * np.abs(F).max())


A, B, D = 0.3, 0.5, 0.4
O, PIN = np.zeros(3), np.array([0.0, A, 0])
KNEE = np.array([D, B * 0.8, 0])
ROCKER = np.array([D, 0, 0])


def four_bar(k: float) -> Network:
    """Rigid bars in a plane, a spring at the crank; the coupler is the platform."""

    def pin(name: str, a: str, b: str, at: np.ndarray, own: float | None = None) -> JointElement:
        role = Passive() if own is None else Actuated(own)
        return JointElement(
            name, a, b, (PlacedFreedom(np.array([0, 0, 1.0]), at, 0.0, name, role),)
        )

    joints = (
        pin("drive", "ground", "crank", O, k),
        pin("pin", "crank", "coupler", PIN),
        pin("knee", "coupler", "rocker", KNEE),
        pin("foot", "rocker", "ground", ROCKER),
    )
    points = {"ground": O, "crank": PIN, "coupler": PIN, "rocker": KNEE}
    nodes = tuple(Node(name, point) for name, point in points.items())
    return Network("four-bar", nodes, ("ground",), "coupler", PIN, joints=joints)


def test_a_linkage_from_joint_coordinates():
    """A parallelogram of cranks of 1 m: ``k q = F cos(q0 + q)``, from where it is given."""
    here, right = Frame.identity(), Frame(np.eye(3), np.array([2.0, 0, 0]))
    up = Frame(np.eye(3), np.array([0, 0, 1.0]))
    drive = revolute([0, 1, 0], Actuated(30.0), name="left")
    hinges = [revolute([0, 1, 0], Passive(), name=name) for name in ("knee", "right", "loop")]
    connections = (
        Connection("left", "ground", "crank", here, drive, here),
        Connection("knee", "crank", "coupler", up, hinges[0], here),
        Connection("right", "ground", "rocker", right, hinges[1], here),
        Connection("loop", "coupler", "rocker", right, hinges[2], up.inverse),
    )
    linkage = Linkage("four bar", connections, "ground", "coupler", np.zeros(3), frozenset())
    q = root(lambda q: 30.0 * q - 12.0 * np.cos(0.3 + q), 0, 1)
    answer = loaded(linkage, pose={"left": 0.3}, wrench=[12.0, 0, 0, 0, 0, 0])
    moved = np.array([np.sin(0.3 + q) - np.sin(0.3), 0, np.cos(0.3 + q) - np.cos(0.3)])
    assert np.allclose(answer.displacement, [*moved, 0, 0, 0], rtol=0, atol=1e-9)


def test_loads_on_bodies_and_preload():
    """A moment in the drive turns the crank; a force on the rocker's end is one on the knee."""
    robot = four_bar(20.0)
    pushed = loaded(robot, preload={"drive": 3.0})
    parts = {part.part: part for part in pushed.parts}
    assert np.isclose(float(parts["drive"].motion[0]), 3.0 / 20.0, rtol=1e-9)
    at_knee = loaded(robot, loads={"rocker": [8.0, 0, 0]})
    same = loaded(robot, loads={"coupler": rs.DeadForce([8.0, 0, 0], KNEE)})
    assert np.allclose(at_knee.displacement, same.displacement, rtol=0, atol=1e-10)
    assert rs.plot.equilibrium(at_knee).get_title() == f"{at_knee.name} under load"


def test_parts_that_only_the_base_holds_bend_beside_the_platform():
    """They are solved apart: the platform moves as without them, they as without the platform."""
    places = {"wall": [0.0, 0, 0], "arm": [1.0, 0, 0], "twig": [0.0, 0.8, 0.3]}
    nodes = [Node(name, np.array(at)) for name, at in places.items()]
    arm, twig = (
        beam_between(nodes[0], node, rs.material("steel"), circle(0.02), name=node.name)
        for node in nodes[1:]
    )
    tree = Network("tree", tuple(nodes), ("wall",), "arm", nodes[1].point, beams=(arm, twig))
    alone = replace(tree, beams=(arm,), nodes=tuple(nodes[:2]))
    load, wrench = {"twig": [0, 0, -300.0]}, [0, 400.0, 0, 0, 0, 0]
    answer = loaded(tree, wrench=wrench, loads=load)
    assert np.allclose(
        answer.displacement, loaded(alone, wrench=wrench).displacement, rtol=1e-12, atol=1e-15
    )
    other = replace(alone, nodes=(nodes[0], nodes[2]), platform="twig", beams=(twig,))
    sunk = loaded(replace(other, reference_point=nodes[2].point), loads={"platform": load["twig"]})
    moved = answer.places.nodes["twig"].of(nodes[2].point) - nodes[2].point
    assert np.allclose(moved, sunk.displacement[:3], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("axes", [[[0, 0, 1]], [[0.6, 0, 0.8], [0, 0.6, 0.8], [1, 0, 0]]])
@pytest.mark.parametrize("force", [0.0, 1e-3, 30.0])
def test_a_body_that_hangs_unloaded_on_a_hinge_is_no_instability(axes: list, force: float):
    points = {"a": [0, 0, 0.0], "b": [1, 0, 0.0], "c": [1, 1, 0.0]}
    wall, tip, link = (Node(name, np.array(point)) for name, point in points.items())
    rod = beam_between(wall, tip, rs.material("steel"), circle(0.02), name="rod")
    hinges = (
        PlacedFreedom(np.array(axis), np.array([1, 0.2 * i, 0]), 0.0, f"hinge{i}", Passive())
        for i, axis in enumerate(axes)
    )
    alone = Network("rod", (wall, tip), ("a",), "b", tip.point, beams=(rod,))
    joint = JointElement("joint", "b", "c", tuple(hinges))
    both = replace(alone, nodes=(wall, tip, link), joints=(joint,))
    wrench = force * np.array([1.0, 1, 1, 0, 0, 0])
    one, other = (rs.equilibrium(network, wrench=wrench) for network in (alone, both))
    assert other.status == one.status | rs.Status.REDUNDANT_JOINTS
    assert other.margin == pytest.approx(one.margin, rel=1e-9)
    assert np.allclose(other.displacement, one.displacement, rtol=1e-9, atol=1e-15)
    held = replace(both, platform="c")  # turns freely
    assert rs.Status.FREE_MOTIONS in rs.equilibrium(held).status


def test_a_coupled_joint_between_fixed_bodies_stays_where_it_is():
    feet = [Node(name, np.array([0, y, 0.0])) for name, y in (("a", 0), ("b", 1))]
    tip, along = Node("c", np.array([1, 0, 0.0])), np.array([1.0, 0, 0])
    free, held = (PlacedFreedom(along, n.point, None, "slide", Passive()) for n in (tip, feet[1]))
    joints = JointElement("one", "a", "c", (free,)), JointElement("two", "a", "b", (held,))
    belt = CouplingElement("belt", ((joints[0], 0, 2.0), (joints[1], 0, 1.0)), 1e4)
    network = Network(
        "belt", (*feet, tip), ("a", "b"), "c", tip.point, joints=joints, couplings=(belt,)
    )
    pulled = rs.equilibrium(network, wrench=[3.0, 0, 0, 0, 0, 0])
    assert pulled.displacement[0] == pytest.approx(3.0 / (2.0**2 * 1e4), rel=1e-12)
    assert rs.compliance(network)[0, 0] == pytest.approx(1 / (2.0**2 * 1e4), rel=1e-12)


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_a_spring_yields_along_its_freedoms_whatever_its_compliance_there(size: float):
    A = np.random.default_rng(3).normal(size=(6, 6))
    C = A @ A.T * 1e-6 / np.outer([1, 1, 1, *[size] * 3], [1, 1, 1, *[size] * 3])
    turns = np.eye(6)[:, 3:5] + np.eye(6)[:, :2] * 0.3 * size
    wall, tip = Node("a", np.zeros(3)), Node("b", np.array([size, 0, 0]))
    springs = tuple(
        SpringElement(f"s{i}", "a", "b", tip.point * at, np.eye(3), Elasticity(C, free))
        for i, (at, free) in enumerate([(0.2, turns), (0.9, turns[:, :1]), (0.5, np.zeros((6, 0)))])
    )
    network = Network("springs", (wall, tip), ("a",), "b", tip.point, springs=springs)
    K = rs.stiffness(network).K
    assert np.allclose(rs.equilibrium(network).K, K, rtol=1e-9, atol=1e-12 * np.abs(K).max())
    wrench = 1e-3 * size * np.array([1, 2, 3, *[size] * 3])
    bent, found = rs.deflection(network, wrench=wrench), rs.equilibrium(network, wrench=wrench)
    assert np.allclose(found.displacement, bent.twist, rtol=1e-5, atol=0)
