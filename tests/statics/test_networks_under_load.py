"""Networks and linkages under load: as robots of legs are, and a four-bar linkage on paper."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import Elasticity, circle
from robostiff.elasticity.cantilever import cantilever_compliance
from robostiff.kinematics import with_masses
from robostiff.linkage import Connection, Linkage
from robostiff.model import Actuated, Passive, PlacedFreedom, revolute
from robostiff.network import JointElement, Network, Node, SpringElement, beam_between
from robostiff.network.network import network_of_snapshot
from robostiff.spatial import Frame
from robostiff.statics import Bowing
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


def column(parts: list[JointElement | SpringElement]) -> Network:
    """In series from the ground to a platform that slides along, x across and y turning."""
    names = ["ground", *(f"n{i}" for i in range(1, len(parts))), "top"]
    pairs = zip(parts, names[:-1], names[1:], strict=True)
    placed = [replace(part, a=a, b=b) for part, a, b in pairs]
    guide = PlacedFreedom(np.array([1.0, 0, 0]), np.zeros(3), None, "guide", Actuated(1e-3))
    return Network(
        "column",
        tuple(Node(name, np.zeros(3)) for name in names),
        ("ground",),
        "top",
        np.array([1.0, 0, 0]),
        springs=tuple(part for part in placed if isinstance(part, SpringElement)),
        joints=(
            *(part for part in placed if isinstance(part, JointElement)),
            JointElement("guide", "ground", "top", (guide,)),
        ),
    )


def test_a_network_has_its_own_pose():
    network = network_of_snapshot(rs.find_posture(rs.load("3-puu")).snapshot.one(0))
    expected = r"pose of network '3-puu': got .*: a network is frozen at its own pose"
    for question in (rs.equilibrium, rs.stiffness, rs.plot.robot):
        with pytest.raises(rs.InputError, match=expected):
            question(network, np.zeros(6))


def test_elements_of_a_beam_in_a_graph_by_how_it_is_held():
    """The load at which it buckles has the error of two cubics only between hinges."""
    EI, L = 7.0, 1.0
    C = cantilever_compliance(L, 1.0, 1.0, 1e7, EI, 2 * EI, EI)
    strut = SpringElement("beam", "", "", np.array([L, 0, 0]), np.eye(3), Elasticity(C))

    def pin(name: str, x: float, axis: tuple[float, ...]) -> JointElement:
        point = np.array([x, 0, 0])
        return JointElement(
            name, "", "", (PlacedFreedom(np.array(axis), point, 0.0, name, Passive()),)
        )

    rigid = SpringElement("rigid", "", "", np.zeros(3), np.eye(3), Elasticity(np.zeros((6, 6))))
    slide = PlacedFreedom(np.array([1.0, 0, 0]), np.zeros(3), None, "drive", Actuated(1e7))
    drive, across, along = JointElement("drive", "", "", (slide,)), (0, 1.0, 0), (1.0, 0, 0)
    pinned = [pin("foot", 0, across), rigid, drive, strut, pin("head", L, across)]
    spins = [pin("foot", 0, across), strut, pin("head", L, along)]
    unit = [-1.0, 0, 0, 0, 0, 0]
    found = rs.critical_load(column(pinned), wrench=unit).factor / (EI / L**2)
    assert 1e-5 < found / np.pi**2 - 1 < 8e-3
    # clamped at one end: tan u = u
    found = rs.critical_load(column(spins), wrench=unit).factor / (EI / L**2)
    assert 1e-5 < found / 20.190729 - 1 < 5e-4  # with inner modes


@pytest.mark.parametrize("post", ["upwards", "downwards"])
def test_the_energy_of_a_network_is_the_same_whichever_body_is_the_platform(post: str):
    """Beams that begin at the platform, or end at the base, are measured as all others are."""
    portal = rs.load(EXAMPLES / "portal.json")
    if post == "downwards":
        turned = [
            replace(
                e,
                **{"a": e.b, "b": e.a, "start": e.end, "end": e.start},
                rotation=e.rotation * np.array([-1.0, 1, -1]),
            )
            if e.name == "right post"
            else e
            for e in portal.beams
        ]
        portal = replace(portal, beams=tuple(turned))
    loads = {"corner": [2400.0, 1200, -1.6e4], "top": [1600.0, -720, -8e3]}
    answers = []
    for name in ("corner", "top"):
        point = next(node.point for node in portal.nodes if node.name == name)
        subject = replace(portal, platform=name, reference_point=np.asarray(point, dtype=float))
        answers.append(loaded(subject, loads=loads))
    one, other = answers
    assert np.abs(one.displacement).max() > 0.01
    assert np.isclose(one.energy, other.energy, rtol=1e-11)
    energies = [{part.part: part.energy for part in own.parts} for own in answers]
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)
    corner = np.asarray(portal.nodes[-1].point, dtype=float)
    places = [own.places.nodes["corner"].of(corner) for own in answers]
    assert np.allclose(*places, rtol=0, atol=1e-11)
    assert np.allclose(places[0] - corner, one.displacement[:3], rtol=0, atol=1e-12)


def test_a_shipped_network_has_its_linear_stiffness_at_rest():
    network = rs.load("double-pantograph")
    K = rs.stiffness(network).K
    assert np.allclose(loaded(network).K, K, rtol=0, atol=1e-10 * np.abs(K).max())
    force = rs.DeadForce([0, 0, -20.0])
    on_body = loaded(network, loads={"platform": force})
    same = loaded(network, wrench=[0, 0, -20, 0, 0, 0], at=network.reference_point)
    assert np.allclose(on_body.displacement, same.displacement, rtol=1e-9, atol=1e-14)


A, B, D = 0.3, 0.5, 0.4
O, PIN = np.zeros(3), np.array([0.0, A, 0])
KNEE = np.array([D, B * 0.8, 0])
ROCKER = np.array([D, 0, 0])


def four_bar(k: float, turned: bool = False) -> Network:
    """Rigid bars in a plane, a spring at the crank; the coupler is the platform."""

    def pin(name: str, a: str, b: str, at: np.ndarray, own: float | None = None) -> JointElement:
        role = Passive() if own is None else Actuated(own)
        a, b = (b, a) if turned else (a, b)
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


def coupler(q: float) -> tuple[np.ndarray, float]:
    """Where the pin is when the crank has turned by q, and how far the coupler has turned."""
    pin = A * np.array([-np.sin(q), np.cos(q)])
    c, r = np.linalg.norm(KNEE[:2] - PIN[:2]), np.linalg.norm(KNEE - ROCKER)
    to = ROCKER[:2] - pin
    d = np.linalg.norm(to)
    along = (c * c - r * r + d * d) / (2 * d)
    up = np.sqrt(c * c - along * along)
    u = to / d
    knee = pin + along * u + up * np.array([-u[1], u[0]])
    rest = np.arctan2(*(KNEE - PIN)[[1, 0]])
    return pin, float(np.arctan2(*(knee - pin)[::-1]) - rest)


@pytest.mark.parametrize("turned", [False, True])
def test_a_four_bar_linkage_of_rigid_bars(turned: bool):
    """One freedom, three closures more than there are freedoms: ``k q^2 / 2 - F x - M phi``."""
    k, F = 20.0, np.array([15.0, 5.0, 2.0])

    def potential(q: float) -> float:
        pin, phi = coupler(q)
        return 0.5 * k * q * q - F[:2] @ (pin - PIN[:2]) - F[2] * phi

    h = 1e-5
    q = root(lambda q: potential(q + h) - potential(q - h), -0.9, 0.4)
    assert min(potential(q - 0.01), potential(q + 0.01)) > potential(q)
    pin, phi = coupler(q)
    answer = loaded(four_bar(k, turned), wrench=[*F[:2], 0, 0, 0, F[2]])
    assert str(answer.status) == "rigid-direction"
    assert answer.stable
    assert abs(q) > 0.2
    moved = [*(pin - PIN[:2]), 0, 0, 0, phi]
    assert np.allclose(answer.displacement, moved, rtol=0, atol=1e-8)
    curvature = (potential(q + 1e-4) - 2 * potential(q) + potential(q - 1e-4)) / 1e-8
    rate = [
        (b - a) / (2 * h)
        for a, b in zip(*(np.append(*coupler(q + s)) for s in (-h, h)), strict=True)
    ]
    C = np.outer(rate, rate) / curvature
    own = answer.compliance[np.ix_([0, 1, 5], [0, 1, 5])]
    assert np.allclose(own, C, rtol=0, atol=1e-5 * np.abs(C).max())


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
    with pytest.raises(rs.InputError, match="a body that moves"):
        rs.equilibrium(robot, loads={"ground": [1.0, 0, 0]})
    with pytest.raises(rs.InputError, match="one coordinate"):
        rs.equilibrium(robot, preload={"hinge": 3.0})
    assert rs.plot.equilibrium(at_knee).get_title() == f"{at_knee.name} under load"
    with pytest.raises(rs.InputError, match="without masses"):
        rs.equilibrium(robot, gravity="-z")


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
    assert np.allclose(answer.displacement, loaded(alone, wrench=wrench).displacement, rtol=1e-12)
    other = replace(alone, nodes=(nodes[0], nodes[2]), platform="twig", beams=(twig,))
    sunk = loaded(replace(other, reference_point=nodes[2].point), loads={"platform": load["twig"]})
    moved = answer.places.nodes["twig"].of(nodes[2].point) - nodes[2].point
    assert np.allclose(moved, sunk.displacement[:3], rtol=1e-9)
