"""Beams that bend far, alone and in linkages, against the corotational beams of OpenSees."""

from itertools import pairwise

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import Elasticity, cantilever_compliance
from robostiff.model import Actuated, Chain, Leg, Link, Passive, PlacedFreedom, beam_axes, revolute
from robostiff.network import BeamElement, JointElement, Network, Node, SpringElement
from robostiff.spatial import Frame
from tests.cases.metric import apart
from tests.statics.opensees_beam import BeamFrame, extrapolated
from tests.statics.robots_under_load import loaded

pytestmark = pytest.mark.needs("OpenSees")
L = 0.7
BEAM = (1e7, 35.0, 20.0)  # EA, EI, GJ
CANTILEVER = BeamFrame(
    {"wall": [0, 0, 0], "tip": [L, 0, 0]}, ["wall"], [("wall", "tip", BEAM)], in_plane=False
)
LOADS = [[-60.0, 90, 50, 0, 0, 0], [80.0, -120, 30, 0, 0, 0], [0.0, 40, -25, 0, 0, 0]]


def network(frame: BeamFrame) -> Network:
    """The frame, its last node the platform."""
    points = frame.points
    nodes = [Node(name, at) for name, at in points.items()]
    beams = []
    for a, b, (EA, EI, GJ) in frame.beams:
        along = points[b] - points[a]
        C = cantilever_compliance(float(np.linalg.norm(along)), 1.0, 1.0, EA, EI, EI, GJ)
        own = BeamElement(f"{a}-{b}", a, b, points[a], points[b], beam_axes(along, None), C)
        beams.append(own)
    joints, springs = [], []
    for a, b, k in frame.pins:
        joints.append(turning(f"{a}-{b}", a, b, points[a], [[0, 0, 1]], k))
    for a, b, EA in frame.rods:  # from a universal joint to a ball
        along = points[b] - points[a]
        R = beam_axes(along, None)
        near, far = f"{a}-{b} near", f"{a}-{b} far"
        nodes += [Node(near, points[a]), Node(far, points[b])]
        C = np.diag([float(np.linalg.norm(along)) / EA, 0, 0, 0, 0, 0])
        springs.append(SpringElement(near, near, far, points[b], R, Elasticity(C)))
        joints.append(turning(f"{near} u", a, near, points[a], R.T[1:]))
        joints.append(turning(f"{far} s", far, b, points[b], R.T))
    *_, platform = points
    return Network(
        "frame",
        tuple(nodes),
        tuple(frame.fixed),
        platform,
        points[platform],
        tuple(beams),
        tuple(springs),
        tuple(joints),
    )


def turning(name: str, a: str, b: str, at: np.ndarray, axes, k: float | None = None):
    role = Passive() if k is None else Actuated(k)
    own = tuple(
        PlacedFreedom(np.array(axis, dtype=float), at, 0.0, f"{name}{i}", role)
        for i, axis in enumerate(axes)
    )
    return JointElement(name, a, b, own)


@pytest.mark.parametrize("load", LOADS)
def test_beam_bent_far(load: list[float], by_opensees):
    exact = by_opensees(extrapolated, CANTILEVER, 30, load)[:, 0]
    assert np.linalg.norm(exact) > 0.1 * L
    size, missed = np.linalg.norm(exact), []
    for n in (8, 16):
        answer = loaded(network(CANTILEVER), wrench=load, beams=rs.Bowing(n))
        assert answer.stable
        missed.append(np.linalg.norm(answer.displacement[:3] - exact) / size)
    assert missed[0] < 1e-3
    assert missed[1] < 1.2e-4
    assert missed[0] / missed[1] > 6  # with the third power of the number, and not by luck


def bars(*names: str) -> list[tuple[str, str, tuple[float, float, float]]]:
    """Beams from node to node, along words such as ``a-b-c``."""
    return [(a, b, BEAM) for word in names for a, b in pairwise(word.split("-"))]


FOUR_BAR = BeamFrame(
    {
        "foot foot2": [0.7, 0, 0],
        "knee knee2": [0.1, 0.5, 0],
        "elbow elbow2": [0.8, 0.7, 0],
        "wall": [0, 0, 0],
        "tool": [0.5, 0.9, 0],
    },
    ["wall", "foot"],
    bars("wall-knee", "knee2-tool-elbow", "elbow2-foot2"),
    sprung={"foot2": 15.0},
)
PANTOGRAPH = BeamFrame(
    {
        "o o2": [0, 0, 0],
        "a a2": [-0.2, 0.3, 0],
        "b b2 b3": [0.15, 0.2, 0],
        "c c2": [-0.6, 0.9, 0],
        "d d2": [-0.25, 0.8, 0],
        "tool": [0.45, 0.6, 0],
    },
    ["o", "b"],
    bars("o2-a-c", "c2-d-tool", "a2-b2", "b3-d2"),
)


def delta() -> BeamFrame:
    """Arms, crossbars and platform of beams; parallelograms of rods between balls."""
    nodes, fixed, beams, rods = {}, [], [], []
    for i, angle in enumerate((0.2, 2.3, 4.4)):
        out, across = (
            np.array([np.cos(own), np.sin(own), 0]) for own in (angle, angle + np.pi / 2)
        )
        foot, elbow, corner = 0.3 * out, 0.55 * out + [0, 0, 0.1], 0.15 * out - [0, 0, 0.5]
        nodes |= {f"foot{i}": foot, f"elbow{i}": elbow, f"corner{i}": corner}
        fixed.append(f"foot{i}")
        beams += bars(f"foot{i}-elbow{i}", f"tool-corner{i}")
        for side, way in (("l", 0.1), ("r", -0.12)):
            nodes |= {f"elbow{i}{side}": elbow + way * across}
            nodes |= {f"corner{i}{side}": corner + way * across}
            beams += bars(f"elbow{i}-elbow{i}{side}", f"corner{i}-corner{i}{side}")
            rods.append((f"elbow{i}{side}", f"corner{i}{side}", 2e4))
    nodes["tool"] = np.array([0, 0, -0.5])
    return BeamFrame(nodes, fixed, beams, rods, in_plane=False)


HYBRID = BeamFrame(
    {
        "wall": [0, 0, 0],
        "column": [0, 0.5, 0],
        "left left2": [-0.3, 0.8, 0],
        "right right2": [0.3, 0.85, 0],
        "head head2 wrist": [0, 1.1, 0],
        "tool": [0.2, 1.4, 0],
    },
    ["wall"],
    bars("wall-column-left", "column-right", "left2-head", "right2-head2", "wrist-tool"),
    sprung={"wrist": 15.0},
)


def machine() -> rs.Robot:
    """The same as modules: a column that bends, two legs with pins, a wrist on a sprung hinge."""
    points = HYBRID.points

    def link(a: str, b: str) -> Link:
        to = points[b] - points[a]
        EA, EI, GJ = BEAM
        C = cantilever_compliance(float(np.linalg.norm(to)), 1.0, 1.0, EA, EI, EI, GJ)
        return Link(to, Elasticity(C), beam_axes(to, None), f"{a}-{b}")

    pin = [revolute([0, 0, 1], Passive(), name=f"pin{i}") for i in range(2)]
    here = Frame.identity()
    chains = (
        Chain((link("column", "left"), pin[0], link("left2", "head"))),
        Chain((link("column", "right"), pin[0], link("right2", "head2"), pin[1])),
    )
    legs = tuple(Leg(f"leg{i}", here, chain, here) for i, chain in enumerate(chains))
    home = Frame(np.eye(3), points["head"] - points["column"])
    wrist = revolute([0, 0, 1], Actuated(15.0), name="hinge")
    return rs.hybrid_machine(
        [
            rs.Module("column", Chain((link("wall", "column"),))),
            rs.Module("legs", rs.Robot("legs", legs, home=home, coordinates=())),
            rs.Module("wrist", Chain((wrist, link("wrist", "tool")))),
        ]
    )


@pytest.mark.parametrize(
    ("robot", "frame", "load", "parts"),
    [
        (network(FOUR_BAR), FOUR_BAR, [60.0, -40, 4], 4),
        (network(PANTOGRAPH), PANTOGRAPH, [30.0, -25, -3], 4),
        (network(delta()), delta(), [60.0, -40, -150, 2, 3, -4], 2),
        (machine(), HYBRID, [20.0, -30, 3], 4),
    ],
    ids=["four-bar", "pantograph", "delta", "hybrid"],
)
def test_closed_loops_of_beams_moved_far(robot, frame, load, parts, by_opensees):
    """Where the tool is, and its stiffness there; in space its shifts by forces and moments."""
    rows = np.array([0, 1, 5] if frame.in_plane else range(6))
    wrench, seen, missed = np.zeros(6), rows[:3], []
    wrench[rows] = load
    found = by_opensees(extrapolated, frame, 8, load)
    unloaded = rs.stiffness(robot).compliance[np.ix_(seen, rows)]
    assert apart(unloaded @ load, found[:, 0]) > 0.1
    assert apart(unloaded, found[:, 1:]) > 0.1
    for n in (parts, 2 * parts):
        answer = loaded(robot, wrench=wrench, beams=rs.Bowing(n))
        assert answer.stable
        C = answer.compliance[np.ix_(seen, rows)]
        missed.append([apart(answer.displacement[seen], found[:, 0]), apart(C, found[:, 1:])])
    coarse, fine = np.array(missed)
    assert np.all(coarse < 2.5e-3)
    # with the third power of the number of elements, and where beams carry a torque the second
    assert np.all(coarse > (6 if frame.in_plane else 3.3) * fine)


def test_a_beam_with_a_torque_converges_with_the_second_power(by_opensees):
    load, missed = [0.0, 0, 0, 10, 10, 0], []
    exact = by_opensees(extrapolated, CANTILEVER, 20, load)[:, 0]
    for n in (4, 8):
        answer = loaded(network(CANTILEVER), wrench=load, beams=rs.Bowing(n))
        missed.append(apart(answer.displacement[:3], exact))
    assert missed[0] < 1e-2
    assert 3.8 < missed[0] / missed[1] < 4.2
