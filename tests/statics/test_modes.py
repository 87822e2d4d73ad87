"""Natural frequencies: on paper, of beams, of networks, and laws."""

import itertools
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import eigh, expm
from scipy.optimize import root_scalar

import robostiff as rs
from robostiff.elasticity import BeamTheory, EulerBernoulli, Material, Timoshenko, circle, material
from robostiff.kinematics import with_masses
from robostiff.kinematics.turn import turn_by_vector
from robostiff.linkage import Connection, Linkage
from robostiff.linkage.essential import turned_round
from robostiff.model import Mass, PlacedFreedom, PlacedLeg, PlacedMass, Snapshot, beam_link
from robostiff.network import (
    JointElement,
    Network,
    Node,
    SpringElement,
    beam_between,
    network_of_snapshot,
)
from robostiff.spatial import Frame, Space
from tests.peers.opensees import frequencies_by_opensees
from tests.statics.robots_under_load import beam, column, joint, loaded
from tests.statics.test_networks_under_load import A, four_bar

TURN = 2 * np.pi
ONE = rs.Bowing(elements=1)


def slide(stiffnesses: list[float]) -> Snapshot:
    """Slides with springs, one after the other along x."""
    elements = tuple(
        joint(f"s{i + 1}", [0.1 * i, 0, 0], [1, 0, 0], "P", k) for i, k in enumerate(stiffnesses)
    )
    tip = np.array([0.3, 0, 0])
    return Snapshot("slides", (PlacedLeg("leg", elements, tip),), tip, Space.PLANAR)


def test_two_masses_on_two_springs():
    k1, k2, m1, m2 = 300.0, 700.0, 2.0, 0.5
    K, M = np.array([[k1 + k2, -k2], [-k2, k2]]), np.diag([m1, m2])
    exact = np.sqrt(eigh(K, M, eigvals_only=True)) / TURN
    found = rs.modes(slide([k1, k2]), masses={"leg/s1": m1, "platform": m2})
    assert np.allclose(found.frequencies, exact, rtol=1e-12)
    assert str(found[0]).endswith("Hz: the platform moves: translation along x")
    assert found.status == 0
    alone = rs.modes(slide([k1, k2]), masses={"leg/s1": m1})  # what has no mass follows
    assert np.allclose(alone.frequencies, np.sqrt(k1 / m1) / TURN, rtol=1e-12)
    between = rs.modes(slide([k1, k2]), masses={"platform": m2})
    series = k1 * k2 / (k1 + k2)
    assert np.allclose(between.frequencies, np.sqrt(series / m2) / TURN, rtol=1e-12)
    assert np.isclose(between[0].shares[0].share, series / k1, rtol=1e-9)


def test_soft_drives_keep_their_frequencies_beside_a_spring_that_is_almost_rigid():
    link, here = np.array([0.7, 0, 0.7]), Frame(np.eye(3), np.zeros(3))
    drives = [rs.revolute([0, 1, 0], rs.Actuated(k)) for k in (500.0, 200.0)]
    arms = [rs.Link(link, rs.Elasticity(c * np.eye(6)), np.eye(3)) for c in (0.0, 1e-12)]
    chain = rs.Chain((drives[0], arms[0], drives[1], arms[1]))
    arm = rs.Robot("arm", (rs.Leg("arm", here, chain, here),))
    found = rs.modes(arm, masses={"platform": rs.Mass(8.0, inertia=[0.1, 0.1, 0.1])})
    J = np.array([[1.4, 0.7], [-1.4, -0.7], [1, 1]])
    C = J @ np.diag([1 / 500, 1 / 200]) @ J.T
    exact = 1 / np.sqrt(eigh(C, np.diag(1 / np.array([8, 8, 0.1])), eigvals_only=True)[:0:-1])
    assert np.allclose(found.frequencies[:2], exact / TURN, rtol=1e-7)


def exact_frequencies(
    L: float, EI: float, per_length: float, turning: float, shear: float, count: int
) -> list[float]:
    """Of a cantilever [Hz], sections that turn and shear among it, from its transfer matrix.

    Along the beam w, psi, V and M follow ``w' = psi + shear V``, ``psi' = M / EI``,
    ``V' = -m w^2 w`` and ``M' = -V - j w^2 psi``; at the free end V and M vanish.
    """

    def free_end(square: float) -> float:
        along = np.zeros((4, 4))
        along[0, 1], along[0, 2], along[1, 3] = 1, shear, 1 / EI
        along[2, 0], along[3, 2], along[3, 1] = -per_length * square, -1, -turning * square
        return float(np.linalg.det(expm(along * L)[2:, 2:]))

    grid = (np.linspace(0.5, 12, 400) / L) ** 4 * EI / per_length
    signs = [np.sign(free_end(square)) for square in grid]
    changes = [i for i in range(len(grid) - 1) if signs[i] != signs[i + 1]]
    roots = [root_scalar(free_end, bracket=(grid[i], grid[i + 1])).root for i in changes[:count]]
    return [float(np.sqrt(square)) / TURN for square in roots]


def test_frequency_vanishes_at_the_critical_load():
    """The square of a column's frequency falls with its load, and is 0 where it buckles."""
    k, L = 40.0, 0.3
    robot = column(k, 1e9, L, 1e9)
    critical = 2 * k / L
    masses = {"links/link1": rs.Mass(2.0, point=[0, L, 0])}
    squares = [
        rs.modes(robot, masses=masses, wrench=[0, -part * critical, 0]).frequencies[0] ** 2
        for part in (0.0, 0.5, 0.9)
    ]
    assert np.allclose(np.array(squares) / squares[0], [1, 0.5, 0.1], atol=1e-6)
    assert "stays" in rs.modes(robot, masses=masses)[0].words


def test_inertia_of_the_model_vibrates_as_a_given_one():
    """On the platform, and on a rigid part: in its frame there, in the world where it is given."""
    inertia = np.array([[0.4, 0.05, 0], [0.05, 0.7, 0.1], [0, 0.1, 0.5]])
    bare = rs.load("gough-stewart-b")
    own = replace(bare, platform_masses=(rs.Mass(9.0, inertia=inertia),))
    R = turn_by_vector(rs.find_posture(bare).pose[0, 3:])
    home = rs.find_posture(bare).pose[0, :3]
    turned = rs.Mass(9.0, point=home, inertia=R @ inertia @ R.T)
    given = rs.modes(bare, masses={"platform": turned}).frequencies
    assert np.allclose(rs.modes(own).frequencies, given, rtol=1e-9)
    point = replace(bare, platform_masses=(rs.Mass(9.0),))
    assert not np.allclose(rs.modes(point).frequencies[:3], given[:3], rtol=1e-3)
    drive = rs.revolute([0, 1, 0], rs.Actuated(30.0), home=[0.3], name="drive")
    stiff = rs.Link(np.zeros(3), rs.Elasticity(1e-7 * np.eye(6)), np.eye(3), "bearings")
    rotor = rs.Rigid(Frame(np.eye(3), np.array([0.6, 0, 0])), "bar", (rs.Mass(2, inertia=inertia),))
    c, s = np.cos(0.3), np.sin(0.3)
    R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    alone = rs.modes(model_arm(drive, stiff, rotor)).frequencies
    bar = rs.Rigid(Frame(np.eye(3), np.array([0.6, 0, 0])), "bar")
    moved = rs.Mass(2, point=R @ [0.3, 0, 0], inertia=R @ inertia @ R.T)
    beside = rs.modes(model_arm(drive, stiff, bar), masses={"arm/bearings": moved}).frequencies
    assert np.allclose(alone, beside, rtol=1e-9)
    heavy = rs.Mass(2, [0.3, 0, 0], inertia=inertia)  # on a beam that hardly bends: the same
    hard = rs.Material("hard", 2e13, 8e12)
    beam = rs.beam_link([0.6, 0, 0], hard, circle(0.02), mass=heavy, name="bar")
    assert np.isclose(rs.modes(model_arm(drive, stiff, beam)).frequencies[0], alone[0], rtol=1e-4)


def test_double_cross_of_nafems():
    """FV2: eight arms of 5 m pinned at their ends, four elements each; frequencies of its beams.

    Arms are pinned at both ends (11.336 Hz) or clamped at the hub (17.709 Hz).
    """
    steel = rs.Material("steel", 200e9, 80e9, density=8000.0)
    side, L, n = 0.125, 5.0, 4
    hub, nodes, beams, joints, pins = Node("hub", np.zeros(3)), [], [], [], []
    for k in range(8):
        along = np.array([np.cos(k * np.pi / 4), np.sin(k * np.pi / 4), 0])
        arm = [hub] + [Node(f"n{k}.{i}", along * L * (i + 1) / n) for i in range(n)]
        beams += [
            beam_between(a, b, steel, rs.rectangle(side, side), y_axis=[0, 0, 1], name=f"b{k}.{i}")
            for i, (a, b) in enumerate(itertools.pairwise(arm))
        ]
        pin = Node(f"pin{k}", along * L)
        hinge = PlacedFreedom(np.array([0.0, 0, 1]), pin.point, 0.0, f"h{k}", rs.Passive())
        joints.append(JointElement(f"h{k}", pin.name, arm[-1].name, (hinge,)))
        pins.append(pin)
        nodes += arm[1:]
    network = Network(
        *("cross", (hub, *nodes, *pins), tuple(pin.name for pin in pins), "hub", hub.point),
        space=Space.PLANAR,
        beams=tuple(beams),
        joints=tuple(joints),
    )
    found = rs.modes(network, beams=ONE).frequencies[:16]
    published = [11.336, *[17.709] * 7, 45.345, *[57.390] * 7]
    assert np.allclose(found, published, rtol=6e-3)


def model_arm(*elements: object, **options: object) -> rs.Robot:
    frame = Frame(np.eye(3), np.zeros(3))
    leg = rs.Leg("arm", frame, rs.Chain(tuple(elements)), frame)  # type: ignore[arg-type]
    return rs.Robot("arm", (leg,), coordinates=(), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("theory", [EulerBernoulli(), Timoshenko()])
@pytest.mark.parametrize("D", [0.02, 0.2])
def test_masses_of_the_model_move(theory: BeamTheory, D: float):
    """A beam of steel by its density alone: its sections move, turn and shear."""
    steel, section, n, L = rs.material("steel"), circle(D), 12, 0.8
    rods = [
        rs.beam_link([L / n, 0, 0], steel, section, name=f"b{i + 1}", theory=theory)
        for i in range(n)
    ]
    found = rs.modes(model_arm(*rods), beams=rs.Linear())
    across = [own.frequency for own in found if abs(own.twist[1]) + abs(own.twist[2]) > 1e-9]
    shear = 0.0
    if theory == Timoshenko():
        shear = 1 / (section.shear_factor_y * steel.G * section.A)
    own = steel.density * section.A, steel.density * section.Iy
    exact = exact_frequencies(L, steel.E * section.Iy, *own, shear, 3)
    above = np.array(across[:6:2]) / exact - 1  # with static shapes, most where sections shear
    assert np.all((above > 0) & (above < [1e-4, 2e-3, 6e-3]))
    assert np.allclose(across[:6:2], across[1:6:2], rtol=1e-9)


@pytest.mark.parametrize(
    ("heavier", "frequency", "rtol"), [(1.0, 15.603, 2e-5), (25.48, 13.84, 2e-3)]
)
def test_a_flexure_stage_has_thirteen_thirtyfifths_of_its_leaves(
    heavier: float, frequency: float, rtol: float
):
    """Four leaves between the ground and a table that shifts: ``12 E I / L^3`` and 13/35 each.

    With half of heavy leaves at the table it had 13.34 Hz. Heavy leaves bend a little differently.
    """
    E, rho, L, b, t, table = 205e9, heavier * 7850.0, 0.06, 0.02, 0.4e-3, 0.5
    steel = rs.Material("spring steel", E, E / 2.6, density=rho)
    leaf = rs.beam_link([0, 0, L], steel, rs.rectangle(t, b), y_axis=[1, 0, 0], name="leaf")
    legs = []
    for i, (x, y) in enumerate(itertools.product((-0.05, 0.05), (-0.02, 0.02))):
        place = Frame(np.eye(3), np.array([x, y, 0.0]))
        legs.append(rs.Leg(f"leg{i}", place, rs.Chain((leaf,)), place))
    home = Frame(np.eye(3), np.array([0, 0, L]))
    stage = rs.Robot("stage", tuple(legs), home=home, platform_masses=(rs.Mass(table),))
    K, m = 4 * 12 * E * b * t**3 / 12 / L**3, rho * L * b * t
    exact = np.sqrt(K / (table + 4 * (13 / 35 + 1.2 * t**2 / 12 / L**2) * m)) / TURN
    for beams in (rs.Bowing(), rs.Linear()):
        found = rs.modes(stage, beams=beams).frequencies[0]
        assert np.isclose(found, exact, rtol=rtol), found / exact - 1
    assert np.isclose(exact, frequency, atol=1e-3)


@pytest.mark.parametrize("mass", [1e-3, 0.1, 1.0, 10.0])
def test_a_free_motion_without_mass_leaves_the_others_as_they_are(mass: float):
    """A mass on the axis of a free hinge, at the end of a beam with its consistent mass matrix."""
    robot = rs.load("planar-link")
    steel, L, A, I = rs.material("steel"), 0.5, 0.02 * 0.04, 0.04 * 0.02**3 / 12
    own, EA, EI = steel.density * A * L, steel.E * A, steel.E * I
    bending = EI / L**3 * np.array([[12, -6 * L], [-6 * L, 4 * L**2]])
    across = own * np.array([[13 / 35, -11 * L / 210], [-11 * L / 210, L**2 / 105]])
    turning = own * I / A / L**2 * np.array([[6 / 5, -L / 10], [-L / 10, 2 * L**2 / 15]])
    masses = np.diag([mass, 0.0]) + across + turning
    squares = np.append(eigh(bending, masses, eigvals_only=True), EA / L / (mass + own / 3))
    found = rs.modes(robot, masses={"platform": mass}, beams=ONE)
    assert found.status == 0
    expected = np.sqrt(np.sort(squares)) / (2 * np.pi)
    assert np.allclose(found.frequencies, expected, rtol=1e-9)


@pytest.mark.parametrize("k", [1e8, 1e13])
def test_slow_vibrations_beside_fast_ones_and_a_free_motion_are_no_free_motions(k: float):
    across = joint("across", [0.3, 0, 0], [0, 1, 0], "P", None)
    turn = joint("turn", [0.3, 0, 0], [0, 0, 1], "R", 1e5)
    (leg,) = slide([40.0, 1e4, k]).legs
    slides = replace(leg, elements=(*leg.elements, across, turn))
    heavy = {f"leg/s{i}": 1.0 for i in (1, 2, 3)} | {"platform": rs.Mass(1.0, inertia=[1, 1, 1])}
    found = rs.modes(Snapshot("slides", (slides,), leg.end, Space.PLANAR), masses=heavy)
    # the last two masses are one for the slow vibrations
    slow = eigh([[1.004e4, -1e4], [-1e4, 1e4]], np.diag([1.0, 3.0]), eigvals_only=True)
    exact = np.sqrt([0.0, *slow, 1e5, 1.5 * k]) / TURN
    assert np.allclose(found.frequencies, exact, rtol=2e-4, atol=0)
    assert abs(found[0].twist[1]) > 0.5
    shapes = found.shapes()  # of one kinetic energy each, and of none together
    moved = np.column_stack([np.cumsum(shapes[:, :3], axis=1), shapes[:, -3:]])
    assert np.allclose(moved @ moved.T, np.eye(5), atol=1e-9)


def test_a_body_vibrates_on_a_platform_that_rigid_parts_hold():
    points = {"ground": [0, 0, 0], "platform": [1, 0, 0], "motor": [1.0, 0, 0]}
    nodes = tuple(Node(name, np.array(point, dtype=float)) for name, point in points.items())
    hinges = tuple(
        JointElement(
            f"hinge{i}", "ground", "platform", (PlacedFreedom(axis, at, 0.0, "turn", rs.Passive()),)
        )
        for i, (axis, at) in enumerate(
            [(np.eye(3)[2], nodes[0].point), (np.eye(3)[1], nodes[1].point)]
        )
    )
    rubber = rs.Elasticity(np.diag([1e-4, 2e-4, 5e-4, 0, 0, 0]))
    mount = SpringElement("mount", "platform", "motor", nodes[2].point, np.eye(3), rubber)
    held = Network("held", nodes, ("ground",), "platform", nodes[1].point, (), (mount,), hinges)
    found = rs.modes(held, masses={"motor": 2.0})
    exact = np.sqrt(np.array([2e3, 5e3, 1e4]) / 2.0) / TURN
    assert np.allclose(found.frequencies, exact, rtol=1e-12, atol=0)
    assert "the platform stays" in found[0].words


def test_modes_of_many_poses_are_those_of_each():
    robot = rs.load("gough-stewart-b")
    poses = [[0, 0, 0.8, 0, 0, 0], [0, 0, 0.7, 0.1, 0, 0], [0.1, 0, 0.9, 0, 0, 0.1]]
    mass, F = {"platform": rs.Mass(20, inertia=[1, 1, 2])}, np.diag([-50.0, 80, -90, 1, 2, 3])[:3]
    found = rs.modes(robot, poses, mass, wrench=F)
    assert found.frequencies.shape == (3, len(found[0]))
    assert found.answered.all()
    for i, pose in enumerate(poses):
        alone = rs.modes(robot, pose, mass, wrench=F[i])
        np.testing.assert_allclose(found.frequencies[i], alone.frequencies, rtol=1e-9)
        assert (found.status_codes[i], str(found[i][0])) == (int(alone.status), str(alone[0]))
    under = rs.modes(robot, poses[1], mass, wrench=F)
    np.testing.assert_array_equal(under.frequencies[1], found.frequencies[1])


@pytest.mark.parametrize("inertia", [None, [1, 2, 3]])
@pytest.mark.parametrize(
    "name",
    # of the platform alone, by K; the rest have masses on their legs
    [
        *("gough-stewart-b", "us-ups", "gantry-tau", "3-rpr"),
        *("hexapod", "delta", "six-joint-arm", "3-rrr", "3-rpr-beams"),
    ],
)
def test_without_load_modes_at_many_poses_are_those_at_each(name: str, inertia: list[int] | None):
    robot = rs.load(name)
    home = np.asarray(rs.stiffness(robot).pose)
    free = [("x", "y", "z", "rx", "ry", "rz").index(c.value) for c in robot.coordinates]
    poses = np.tile(home, (5, 1))
    poses[:, free] += np.random.default_rng(3).uniform(-0.1, 0.1, (5, len(free)))
    poses[2, 0] += 90 * (name in ("3-rpr", "delta"))  # out of reach
    poses[2, 3] += 0.1 * (name == "gantry-tau")
    mass = {"platform": rs.Mass(20, centre=[0.1, 0.2, 0.0], inertia=inertia)}
    found = rs.modes(robot, poses, mass)
    for i, (pose, own) in enumerate(zip(poses, found.frequencies, strict=True)):
        alone = rs.modes(robot, pose, mass)
        assert (found.status_codes[i], found.answered[i]) == (int(alone.status), len(alone) > 0)
        expected = alone.frequencies if len(alone) else []
        np.testing.assert_allclose(own.compressed(), expected, rtol=1e-9)
        assert str(found[i]) == str(alone)
    assert found[1:3] == found.poses[1:3]


def test_a_mass_on_one_leg_is_the_same_on_each_leg_alike():
    robot = rs.load("gough-stewart-b")
    each = [rs.modes(robot, None, {f"leg{i}/platform joint": 2.0}).frequencies for i in (1, 3, 5)]
    np.testing.assert_allclose(each, np.tile(each[0], (3, 1)), rtol=1e-9)


@pytest.mark.parametrize("name", ["hexapod", "3-rrr", "cable-8", "portal", "star"])
def test_where_results_are_asked_for_changes_no_load_and_no_frequency(name: str):
    files = {"portal": "examples/portal.json", "star": "docs/star-platform.yaml"}
    robot = rs.load(files.get(name, name))
    at = rs.stiffness(robot).reference_point + np.array([0.1, 0.2, 0])
    masses = {"platform": rs.Mass(20, inertia=[1, 1, 2])}
    one, other = (rs.modes(robot, masses=masses, at=point).frequencies for point in (None, at))
    np.testing.assert_allclose(one, other, rtol=1e-6)
    for load in (rs.Mass(3), [5.0, -8, 0], rs.DeadForce([5.0, -8, 0])):
        loads = {"platform": load}
        ways = [rs.equilibrium] if name == "cable-8" else [rs.equilibrium, rs.deflection]
        for way in ways:
            one, other = (way(robot, loads=loads, at=point).energy for point in (None, at))
            np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_mass_at_a_point_of_the_world_is_elsewhere_on_the_platform_at_each_pose():
    robot, masses = rs.load("gough-stewart-b"), {"platform": rs.Mass(5, point=[0.1, 0.05, 0.9])}
    poses = np.array([[0, 0, 0.8, 0, 0, 0], [0.1, 0, 0.75, 0, 0.2, 0.1]])
    each = [rs.modes(robot, pose, masses).squares for pose in poses]
    np.testing.assert_allclose(rs.modes(robot, poses, masses).squares, each, rtol=1e-9)


STEEL, BAR = material("steel"), circle(0.02)
LENGTH, G = 1.2, 9.80665
Q = STEEL.density * BAR.A  # kg/m
EI = STEEL.E * BAR.Iy


def cantilever(elements: int) -> Network:
    nodes = [Node(f"n{i}", np.array([LENGTH * i / elements, 0, 0])) for i in range(elements + 1)]
    beams = [
        beam_between(a, b, STEEL, BAR, y_axis=[0, 1, 0], name=f"b{i}")
        for i, (a, b) in enumerate(pairwise(nodes))
    ]
    return Network(
        "rod", tuple(nodes), ("n0",), nodes[-1].name, nodes[-1].point, beams=tuple(beams)
    )


def test_a_beam_vibrates_as_euler_bernoulli_and_rayleigh_have_it():
    """Its sections turn, too; errors fall with the fourth power of the number of elements."""
    exact = exact_frequencies(LENGTH, EI, Q, Q * BAR.Iy / BAR.A, 0.0, 3)
    # Across in both planes alike; frequencies along and about the axis are far above.
    coarse, fine = (rs.modes(cantilever(n)).frequencies[:6:2] for n in (8, 16))
    assert np.allclose((16 * fine - coarse) / 15, exact, rtol=1e-5)
    assert np.all(fine > exact)


@pytest.mark.parametrize("elements", [1, 3])
def test_a_beam_sinks_under_its_own_weight(elements: int):
    """q L^4 / 8 E I and q L^3 / 6 E I at the tip, as the limit of the equilibrium has it."""
    q = Q * G
    bent = rs.deflection(cantilever(elements), gravity="-z")
    moved = [-q * LENGTH**4 / (8 * EI), q * LENGTH**3 / (6 * EI)]
    assert np.allclose(bent.twist[[2, 4]], moved, rtol=1e-9)
    assert np.isclose(bent.energy, sum(part.energy for part in bent.parts), rtol=1e-9, atol=0)
    small = rs.equilibrium(cantilever(elements), gravity=[0, 0, -1e-3 * G], beams=rs.Linear())
    assert np.allclose(1e3 * small.displacement[[2, 4]], moved, rtol=1e-6)
    # The weight and a force that lifts the tip again.
    up = 3 * EI / LENGTH**3 * -moved[0]
    held = rs.deflection(cantilever(elements), wrench=[0, 0, up, 0, 0, 0], gravity="-z")
    assert abs(held.twist[2]) < 1e-9 * abs(moved[0])
    assert np.isclose(held.energy, sum(part.energy for part in held.parts), rtol=1e-9, atol=0)


def test_a_four_bar_linkage_with_a_mass_at_its_pin():
    """The crank alone is elastic, and moves the mass at its end: ``sqrt(k / m) / a``."""
    found = rs.modes(four_bar(20.0), masses={"platform": 2.0})
    assert np.allclose(found.frequencies, [np.sqrt(20.0 / 2.0) / A / (2 * np.pi)], rtol=1e-9)
    assert "mode 1" in rs.plot.mode(found, 1).get_title()


@pytest.mark.parametrize("name", ["six-joint-arm", "3-puu"])
def test_a_robot_and_its_network_are_as_heavy(name: str):
    robot = rs.load(name)
    network = network_of_snapshot(with_masses(rs.find_posture(robot)).one(0))
    nothing = np.zeros(3)
    legs = rs.modes(robot, gravity=nothing, beams=ONE)
    whole = rs.modes(network, gravity=nothing, beams=ONE)
    assert len(whole) == len(legs)
    assert np.allclose(whole.frequencies[:12], legs.frequencies[:12], rtol=1e-8)
    bent, sunk = (rs.deflection(one, gravity="-z") for one in (robot, network))
    assert np.allclose(sunk.twist, bent.twist, rtol=0, atol=1e-10 * np.abs(bent.twist).max())
    assert np.isclose(sunk.energy, bent.energy, rtol=1e-10, atol=0)
    assert np.isclose(sunk.parts[0].energy, bent.parts[0].energy, rtol=1e-8, atol=0)
    F = [30, -20, -50, 2, 1, 3.0]
    one, other = (rs.equilibrium(r, wrench=F, gravity="-z", beams=ONE) for r in (robot, network))
    assert np.allclose(other.displacement, one.displacement, rtol=1e-7, atol=1e-12)


def test_a_linkage_and_a_link_turned_round_keep_their_masses():
    bar = beam_link([LENGTH, 0, 0], STEEL, BAR, name="bar")
    spot = beam_link([LENGTH, 0, 0], STEEL, BAR, name="bar", mass=Mass(2.0, [0.3, 0, 0]))
    for own in (bar, spot):
        there = Connection("bar", "wall", "tip", Frame.identity(), own, Frame.identity())
        sunk = [
            rs.deflection(
                Linkage("rod", (connection,), "wall", "tip", np.zeros(3)), gravity="-z"
            ).twist
            for connection in (there, turned_round(there))
        ]
        assert np.abs(sunk[0]).max() > 1e-6
        assert np.allclose(sunk[1], sunk[0], rtol=1e-9, atol=1e-15)


def test_a_force_that_drives_a_free_motion_is_said_to():
    swinging = four_bar(20.0)
    free = tuple(j for j in swinging.joints if j.name != "knee")
    loose = Network(
        "loose", swinging.nodes, ("ground",), "crank", swinging.nodes[1].point, joints=free
    )
    assert str(rs.deflection(loose, loads={"rocker": [1.0, 0, 0]}).status).endswith("unbalanced")


POINTS = {
    "a": (0, 0, 0),
    "b": (1.0, 0.2, 0),
    "c": (0, 0.9, 0),
    "d": (0.1, 0, 1.1),
    "e": (1.0, 0.2, 1.0),
    "f": (0, 0.8, 0.9),
}
FEET = ("a", "b", "c")
BEAMS = (("a", "d"), ("b", "e"), ("c", "f"), ("d", "e"), ("e", "f"), ("f", "d"))
MASSES = {"d": 4.0, "e": 6.5, "f": 3.0}


@pytest.mark.needs("OpenSees")
def test_a_frame_vibrates_as_opensees_has_it(by_opensees):
    nodes = {
        name: Node(
            name,
            np.array(point, dtype=float),
            (PlacedMass(name, np.asarray(MASSES[name]), np.array(point, dtype=float)),)
            if name in MASSES
            else (),
        )
        for name, point in POINTS.items()
    }
    light = Material("steel", STEEL.E, STEEL.G)
    beams = tuple(beam_between(nodes[a], nodes[b], light, BAR, name=f"{a}{b}") for a, b in BEAMS)
    frame = Network("frame", tuple(nodes.values()), FEET, "e", nodes["e"].point, beams=beams)
    expected = by_opensees(frequencies_by_opensees, frame, MASSES)
    assert np.allclose(rs.modes(frame).frequencies, expected, rtol=1e-7)


BENT = [-0.0564, 0.3017, 0.4612]  # the elastica under F = E I / L^2, and at its tip


@pytest.mark.parametrize("graph", [False, True], ids=["legs", "network"])
@pytest.mark.parametrize("size", [1e-5, 1e-4, 1.0, 1e3])
def test_a_hinge_at_the_tip_of_a_beam_of_any_size(size: float, graph: bool):
    """Its parts are in one point, so that only the beam says how large the robot is."""
    tip, EA, EI = [size, 0, 0], 1e4, 3.0 * size**2
    parts = beam("rod", [0, 0, 0], tip, EA, EI, EI), joint("hinge", tip, [0, 0, 1])
    leg = PlacedLeg("leg", parts, np.array(tip))
    robot = Snapshot("hinged", (leg,), np.array(tip), Space.PLANAR)
    disc = rs.Mass(2.0, inertia=[0.1 * size**2] * 3)
    subject = network_of_snapshot(robot) if graph else robot
    found = rs.modes(subject, masses={"platform": disc}, beams=ONE)
    exact = np.array([0, 3 * EI / size**3, EA / size]) / 2.0
    assert np.allclose(found.squares, exact, rtol=1e-9, atol=1e-9 * exact[1])
    alone = replace(robot, legs=(replace(leg, elements=parts[:1]),))
    subject = network_of_snapshot(alone) if graph else alone
    bent = loaded(subject, wrench=[0, EI / size**2, 0], beams=rs.Bowing(8))
    assert np.allclose(bent.displacement / [size, size, 1], BENT, rtol=0, atol=1e-3)
