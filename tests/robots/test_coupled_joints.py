"""Gears and differentials: against networks, least energy, 50 digits and closed forms."""

import json
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

import robostiff as rs
from robostiff.io.snapshot import network_to_data, snapshot_to_data
from robostiff.model import Coordinate, CoupledFreedom
from robostiff.network import condense, energy_stiffness, network_of_snapshot
from robostiff.spatial import Frame, move_stiffness
from robostiff_view.machines import RobotMachine, machine_of
from tests.campaign.reference import reference
from tests.cases.metric import apart
from tests.files import text_of, written

SECTION, STEEL = rs.circle(0.03), rs.material("steel")
GEAR = rs.coupling("b", follows="a", ratio=-1.5, offset=0.1)
BELT = rs.coupling("b", follows="a", ratio=-1.5, stiffness=5e4)
MOTORS = (
    rs.Coupling((("a", 1.0), ("b", 1.0)), rs.Actuated(1e4), name="left motor"),
    rs.Coupling((("a", 1.0), ("b", -1.0)), rs.Actuated(2e4), name="right motor"),
)
FREE, SOFT, STIFF = rs.Passive(), rs.Actuated(2e4), rs.Actuated(3e4)
CASES = {
    "gear": ((GEAR,), SOFT, STIFF),
    "belt": ((BELT,), SOFT, STIFF),
    "belt on a rigid drive": ((BELT,), rs.Actuated(), FREE),
    "gear without drive": ((GEAR,), FREE, STIFF),
    "two motors": (MOTORS, FREE, STIFF),
    "motor and gear": ((MOTORS[0], rs.Coupling((("a", 1.0), ("b", 2.0), ("c", -3.0)))), FREE, FREE),
    "train": ((GEAR, rs.coupling("c", follows="b", ratio=0.4, stiffness=7e3)), SOFT, FREE),
    "driven follower": ((rs.coupling("b", follows="a", ratio=-1.5),), FREE, STIFF),
}


def beam(name: str, *to: float):
    return rs.beam_link(to, STEEL, SECTION, name=name)


def arm(couplings, first=None, last=None, **options) -> rs.Robot:
    """Three joints askew, with beams between them."""
    elements = (
        rs.revolute([0, 0, 1], first or rs.Actuated(2e4), name="a", home=(0.2,)),
        beam("l1", 0.5, 0.1, 0),
        rs.revolute([0, 1, 0], rs.Passive(), name="b"),
        beam("l2", 0.3, 0, 0.1),
        rs.revolute([1, 0.2, 0], last or rs.Actuated(3e4), name="c"),
        beam("l3", 0.1, 0.2, 0.1),
    )
    chain = rs.Chain(elements, tuple(couplings))
    identity = Frame.identity()
    return rs.Robot("arm", (rs.Leg("arm", identity, chain, identity),), coordinates=(), **options)


def network_stiffness(robot: rs.Robot, pose=None, index: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """K of the saddle-point system of all bodies, and of their least energy."""
    snapshot = rs.find_posture(robot, pose).snapshot.one(index)
    network = network_of_snapshot(snapshot)
    found = condense(network)
    v = snapshot.reference_point - found.origin
    return move_stiffness(found.K, v), energy_stiffness(network)


def in_fifty_digits(robot: rs.Robot) -> np.ndarray:
    """All joints and couplings as unknowns."""
    snapshot = rs.find_posture(robot).snapshot.one(0)
    (leg,) = snapshot.legs
    alone = (e.alone if isinstance(e, CoupledFreedom) else e for e in leg.elements)
    sums = [(dict(own.terms), own.role.stiffness) for own in robot.legs[0].chain.couplings]
    found = reference(replace(snapshot, legs=(replace(leg, elements=tuple(alone)),)), sums)
    assert found is not None
    assert found.K is not None
    return found.K


@pytest.mark.parametrize("case", CASES)
def test_networks_and_fifty_digits_agree(case: str):
    robot = arm(*CASES[case])
    result = rs.stiffness(robot)
    by_rows, by_energy = network_stiffness(robot)
    assert apart(result.K, by_rows) < 1e-12
    assert apart(result.K, by_energy) < 1e-11
    assert apart(result.K, in_fifty_digits(robot)) < 1e-12
    for form in (rs.Block(), rs.Recursive(), rs.SaddlePoint()):
        assert apart(rs.stiffness(robot, method=form).K, result.K) < 1e-11


def posed(chain: rs.Chain) -> rs.Robot:
    identity = Frame.identity()
    return rs.Robot("arm", (rs.Leg("arm", identity, chain, identity),), coordinates=())


LENGTH = 0.3  # of a crank


def tripod(stiffness, *, geared: bool) -> rs.Robot:
    """Three legs on hinges: two rigid cranks geared 1 : -2, or the slide that they make."""
    legs = []
    for i, k in enumerate(stiffness):
        turn = 2 * np.pi * i / 3
        c, s = np.cos(turn), np.sin(turn)
        around = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        up = np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]])  # x of the leg
        hinge = rs.revolute([0, 1, 0], rs.Passive(), name="hinge", home=(-0.1,))
        if geared:
            rod = rs.Rigid(Frame(np.eye(3), np.array([LENGTH, 0, 0])), "rod")
            middle = (
                rs.revolute([0, 1, 0], rs.Actuated(k), name="crank", home=(-0.8,)),
                rod,
                rs.revolute([0, 1, 0], rs.Passive(), name="elbow"),
                rod,
            )
        else:
            middle = (rs.prismatic([1, 0, 0], rs.Actuated(k), name="slide", home=(0.42,)),)
        gears = (rs.coupling("elbow", follows="crank", ratio=-2.0),) if geared else ()
        ball = rs.spherical(rs.Passive(), name="ball")
        chain = rs.Chain((beam("foot", 0.1, 0, 0), hinge, *middle, ball), gears)
        base, seat = around @ np.array([0.4, 0, 0]), around @ np.array([0.35, 0, 0])
        legs.append(rs.Leg(f"leg{i}", Frame(around @ up, base), chain, Frame(np.eye(3), seat)))
    home = Frame(np.eye(3), np.array([0, 0, 0.5]))
    free = (Coordinate.Z, Coordinate.RX, Coordinate.RY)
    return rs.Robot("tripod", tuple(legs), home=home, coordinates=free)


POSES = np.array([[0.5, 0.0, 0.0], [0.46, 0.1, -0.05], [0.55, -0.1, 0.1]])


def test_geared_cranks_are_a_slide():
    """The tip is at 2 L cos a along a line, and the drive resists there with k / (2 L sin a)^2."""
    robot, k = tripod((1e4, 2e4, 3e4), geared=True), np.array([1e4, 2e4, 3e4])
    K = rs.stiffness(robot, POSES).K
    slides = rs.find_posture(tripod(k, geared=False), POSES).coordinates
    geared = rs.find_posture(robot, POSES).coordinates
    for i in range(len(POSES)):
        length = np.array([q[i, 1] for q in slides])
        a = np.arccos(length / (2 * LENGTH))
        assert [q[i, 1] for q in geared] == pytest.approx(-a, abs=1e-9)
        twin = tripod(k / (2 * LENGTH * np.sin(a)) ** 2, geared=False)
        assert apart(K[i], rs.stiffness(twin, POSES[i]).K) < 1e-9
    elbows = robot.legs[0].chain.joint_coordinates(geared[0])[:, 2]
    assert elbows == pytest.approx(-2 * geared[0][:, 1], abs=1e-12)


def test_kernels_take_couplings():
    """Recorded legs and recorded Newton steps against the network, pose by pose."""
    robot = arm(*CASES["motor and gear"])
    free = robot.legs[0].chain.free
    q = np.tile(robot.legs[0].chain.home, (4, 1))
    q[:, free] += 0.3 * np.random.default_rng(1).normal(size=(4, int(free.sum())))
    poses = rs.JointCoordinates(q)
    K = rs.compile(robot).evaluate(poses).values["K"]
    for i in range(4):
        assert apart(K[i], network_stiffness(robot, poses, i)[0]) < 1e-11


def test_couplings_have_no_order(tmp_path):
    """The second sum is an angle; it keeps a joint that turns where the third takes the slide."""
    elements = (
        rs.prismatic([1, 0.3, 0], rs.Passive(), name="slide"),
        rs.revolute([0, 0, 1], rs.Passive(), name="a"),
        beam("l1", 0.4, 0.1, 0.2),
        rs.revolute([0, 1, 0.2], rs.Passive(), name="b"),
        beam("l2", 0.2, 0, 0.3),
        rs.revolute([1, 0, 0.1], rs.Actuated(2e4), name="drive"),
        beam("l3", 0.1, 0.2, 0.1),
    )
    sums = (
        rs.Coupling((("a", 1.0), ("drive", -1.2)), rs.Locked(8e4)),
        rs.Coupling((("a", 1.0), ("slide", 0.2))),
        rs.Coupling((("slide", 1.0), ("b", -0.4)), rs.Locked(6e5)),
    )
    K = [rs.stiffness(posed(rs.Chain(elements, order))).K for order in permutations(sums)]
    for other in K:
        assert apart(other, network_stiffness(posed(rs.Chain(elements, sums)))[0]) < 1e-12
    path = written(
        tmp_path / "arm.json",
        json.dumps(
            snapshot_to_data(rs.find_posture(posed(rs.Chain(elements, sums))).snapshot.one(0))
        ),
    )
    assert apart(rs.stiffness(rs.load(path)).K, K[0]) < 1e-12


def test_home_coordinates_fit_the_gear():
    joints = (
        rs.revolute([0, 0, 1], rs.Actuated(1e4), name="a", home=(0.2,)),
        rs.revolute([0, 1, 0], rs.Passive(), name="b", home=(0.5,)),
        beam("l", 0.3, 0.1, 0),
    )
    held = rs.Chain(joints, (rs.Coupling((("b", 1.0), ("a", 1.5)), rs.Locked()),))
    assert held.home == pytest.approx([0.2, 0.8])
    assert held.joint_coordinates(held.home) == pytest.approx([0.2, 0.5])


MODEL = text_of("geared-wrist.yaml")


def model(tmp_path, text: str = MODEL, **options):
    return rs.load(written(tmp_path / "wrist.yaml", text), **options)


def test_a_ratio_may_be_a_symbol(tmp_path):
    """K of the formula, and of a kernel with the ratio as its parameter, against the network."""
    robot = model(tmp_path, symbols=("r", "k"))
    kernel = rs.compile(robot, parameters=("r", "k"))
    (leg,) = robot.numeric.legs
    q = rs.JointCoordinates(leg.chain.home[None])
    for r in (-1.5, 0.7):
        K = kernel.evaluate(q, parameters={"r": r}).values["K"][0]
        text = MODEL.replace("r: -1.5", f"r: {r}")
        assert apart(K, network_stiffness(model(tmp_path, text))[0]) < 1e-10


@pytest.mark.parametrize("case", CASES)
def test_snapshot_files_keep_couplings(case: str, tmp_path):
    robot = arm(*CASES[case])
    snapshot = rs.find_posture(robot).snapshot.one(0)
    path = written(tmp_path / "arm.json", json.dumps(snapshot_to_data(snapshot)))
    read = rs.load(path)
    assert apart(rs.stiffness(read).K, rs.stiffness(robot).K) < 1e-11
    by_rows = condense(network_of_snapshot(read))
    assert int(by_rows.rank) == int(rs.stiffness(robot).rank)
    path.write_text(json.dumps(network_to_data(network_of_snapshot(snapshot))))
    graph = condense(rs.load(path))
    assert apart(graph.K, by_rows.K) < 1e-10


def test_errors_of_couplings_in_snapshot_files(tmp_path):
    data = snapshot_to_data(rs.find_posture(arm((BELT,))).snapshot.one(0))
    path = tmp_path / "arm.json"
    for change, words in (
        ({"sum": {"b": 1, "x": 2}}, "a joint of the same chain"),
        ({"k": -1}, "k"),
    ):
        own = {**data["legs"][0]["couplings"][0], **change}
        path.write_text(json.dumps({**data, "legs": [{**data["legs"][0], "couplings": [own]}]}))
        with pytest.raises(rs.InputError, match=rf"couplings\[0\].*{words}"):
            rs.load(path)


def test_a_view_has_no_slider_for_what_a_gear_holds():
    machine = machine_of(arm((GEAR,)))
    assert isinstance(machine, RobotMachine)
    assert [slider.name for slider in machine.sliders] == ["a", "c"]
    q = machine.pose({"a": 0.3, "c": 0.1})
    assert np.asarray(q.values) == pytest.approx([0.3, 0.1, 0.1])
