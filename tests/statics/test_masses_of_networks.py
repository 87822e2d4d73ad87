"""Weights and vibrations of networks: beams and frames on paper, OpenSees, and robots of legs."""

from itertools import pairwise

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import Material, circle, material
from robostiff.kinematics import with_masses
from robostiff.linkage import Connection, Linkage
from robostiff.linkage.essential import turned_round
from robostiff.model import Mass, PlacedMass, beam_link
from robostiff.network import Network, Node, beam_between, network_of_snapshot
from robostiff.spatial import Frame
from tests.statics.opensees_frame import frequencies
from tests.statics.test_modes import exact_frequencies
from tests.statics.test_networks_under_load import A, four_bar

STEEL, BAR = material("steel"), circle(0.02)
LENGTH, G = 1.2, 9.80665
Q = STEEL.density * BAR.A  # kg/m
EI = STEEL.E * BAR.Iy
ONE = rs.Bowing(elements=1)


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
    assert np.isclose(bent.energy, sum(part.energy for part in bent.parts), rtol=1e-9)
    small = rs.equilibrium(cantilever(elements), gravity=[0, 0, -1e-3 * G], beams=rs.Linear())
    assert np.allclose(1e3 * small.displacement[[2, 4]], moved, rtol=1e-6)
    # The weight and a force that lifts the tip again.
    up = 3 * EI / LENGTH**3 * -moved[0]
    held = rs.deflection(cantilever(elements), wrench=[0, 0, up, 0, 0, 0], gravity="-z")
    assert abs(held.twist[2]) < 1e-9 * abs(moved[0])
    assert np.isclose(held.energy, sum(part.energy for part in held.parts), rtol=1e-9)


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
    assert np.isclose(sunk.energy, bent.energy, rtol=1e-10)
    assert np.isclose(sunk.parts[0].energy, bent.parts[0].energy, rtol=1e-8)
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
    section = (BAR.A, STEEL.E, STEEL.G, BAR.J, BAR.Iy, BAR.Iz)
    expected = by_opensees(frequencies, POINTS, FEET, BEAMS, MASSES, section, 9)
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
    assert np.allclose(rs.modes(frame).frequencies, expected, rtol=1e-7)
